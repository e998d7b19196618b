/* Where a strip's middle lies: its light by column, fitted as a cylinder or a flat sticker of known
 * width, lit from anywhere, seen through a lens and a moving shutter.
 *
 * Light from one side makes the half-way points of a cylinder's sides wander by a tenth of its
 * width. Lambert's law says how its light runs over the surface: a + b u + c sqrt(1 - u^2), u from
 * -1 to 1 between the silhouettes. The middle and the blur are found with a, b and c free. */
#include "eye.h"

#include <math.h>
#include <string.h>

#define CELLS 8
#define FINE_CELLS 24
#define ROUNDS 6
#define LEVELS 3
#define PARAMETERS 6 /* levels, middle, blur, half width */
#define WIDTH_PRIOR 0.04 /* of the half width */
#define BLUR_PRIOR 1.0
#define CUT_SIGMA 0.05 /* of the half width: where a side is cut off its light is not known */

/* One column of the model: basis of the levels and derivatives; returns the prediction. */
static double model_column(double x, double size, const double *guess, int flat, double *row)
{
    double middle = guess[3], sharp = 1 / guess[4], half = guess[5];
    double weight = 2 * half / (CELLS * size);
    memset(row, 0, sizeof(double) * PARAMETERS);
    double by_middle = 0, by_blur = 0, by_half = 0, sum = 0;
    for (int i = 0; i < CELLS; i++) {
        double u = (2 * i + 1.0) / CELLS - 1;
        double place = middle + half * u;
        double z0 = (x - size / 2 - place) * sharp, z1 = (x + size / 2 - place) * sharp;
        if (z1 < -5 || z0 > 5)
            continue;
        double b0 = eye_bell(z0), b1 = eye_bell(z1);
        double kernel = (eye_cumulative(z1) - eye_cumulative(z0)) * weight;
        double rise = sqrt(1 - u * u);
        double level = guess[0] + guess[1] * u + (flat ? 0 : guess[2] * rise);
        double by_place = (b0 - b1) * weight * sharp;
        row[0] += kernel;
        row[1] += kernel * u;
        if (!flat)
            row[2] += kernel * rise;
        sum += level * kernel;
        by_middle += level * by_place;
        by_half += level * (by_place * u + kernel / half);
        by_blur += level * (b0 * z0 - b1 * z1) * weight * sharp;
    }
    row[3] = by_middle;
    row[4] = by_blur;
    row[5] = by_half;
    return sum;
}

/* The mean height of the surface over the columns that the profile averaged, of the radius. */
static double front_of(const eye_upright *u, const double *guess)
{
    double total = 0, sum = 0;
    for (int i = 0; i < FINE_CELLS; i++) {
        double at = (2 * i + 1.0) / FINE_CELLS - 1;
        double offset = guess[3] + guess[5] * at - u->column;
        double rise = sqrt(1 - at * at);
        double light = guess[0] + guess[1] * at + guess[2] * rise;
        /* A blurred window: columns beside it lend it some of their light. */
        double inside = eye_cumulative((u->half_window - offset) / guess[4]) -
                        eye_cumulative((-u->half_window - offset) / guess[4]);
        double weight = inside * (light > 0 ? light : 0);
        total += weight;
        sum += weight * rise;
    }
    return total > 0 ? sum / total : 0.9;
}

/* Fits the strip's middle. ``half``: half of its width as its range has it, columns. */
int eye_fit_side(const eye_picture *p, const eye_upright *u, double half, int flat, eye_side *out)
{
    double guess[PARAMETERS] = {0, 0, 0, u->column, 0.7, half};
    double normal[PARAMETERS * PARAMETERS], right[PARAMETERS], row[PARAMETERS];
    double variance = 0, peak = 0, plain = 0;
    int from = (int)ceil((u->column - half * 1.25 - 3 - u->across_first) / u->step);
    int to = (int)floor((u->column + half * 1.25 + 3 - u->across_first) / u->step) + 1;
    /* Beyond the picture there is nothing to compare with. */
    int first = (int)ceil((0.0 - u->across_first) / u->step);
    int last = (int)floor((p->columns - 1 - u->across_first) / u->step) + 1;
    from = from < first ? first : from;
    to = to > last ? last : to;
    from = from < 0 ? 0 : from;
    to = to > u->columns ? u->columns : to;
    if (to - from < 3)
        return EYE_CUT_OFF;
    for (int i = from; i < to; i++)
        if (u->across[i] > peak)
            peak = u->across[i];
    if (peak < 0.002)
        return EYE_NO_CONTRAST;
    /* Where the picture cuts one side off, the other one and the width tell the middle. */
    int cut = u->column - half < 0 ? -1 : u->column + half > p->columns - 1 ? 1 : 0;
    if (cut) {
        int at = cut < 0 ? to - 1 : from;
        while (at > from - (cut > 0) && at < to - (cut > 0) && u->across[at] < 0.5 * peak)
            at += cut;
        guess[3] = u->across_first + at * u->step + cut * half;
    }
    guess[0] = 0.6 * peak;
    guess[2] = flat ? 0 : 0.4 * peak;
    for (int round = 0; round < ROUNDS; round++) {
        memset(normal, 0, sizeof normal);
        memset(right, 0, sizeof right);
        double rests = 0;
        for (int i = from; i < to; i++) {
            double x = u->across_first + i * u->step;
            double rest = u->across[i] - model_column(x, u->step, guess, flat, row);
            rests += rest * rest;
            for (int a = 0; a < PARAMETERS; a++) {
                right[a] += row[a] * rest;
                for (int b = 0; b < PARAMETERS; b++)
                    normal[a * PARAMETERS + b] += row[a] * row[b];
            }
        }
        plain = rests;
        int free = to - from - 4;
        variance = rests / (free > 2 ? free : 2) + 1e-8 + 1e-4 * peak * peak;
        /* Priors: the width is known from the range; light does not run wild over the surface. */
        double pull = variance / pow(WIDTH_PRIOR * half + 0.05, 2);
        normal[5 * PARAMETERS + 5] += pull;
        right[5] += pull * (half - guess[5]);
        pull = variance / (BLUR_PRIOR * BLUR_PRIOR);
        normal[4 * PARAMETERS + 4] += pull;
        right[4] += pull * (0.7 - guess[4]);
        for (int a = 1; a < LEVELS; a++) {
            pull = variance / pow(0.5 * peak, 2);
            normal[a * PARAMETERS + a] += pull;
            right[a] += pull * ((a == 2 && !flat ? 0.4 * peak : 0) - guess[a]);
        }
        for (int a = 0; a < PARAMETERS; a++)
            normal[a * PARAMETERS + a] *= 1 + 1e-9;
        double solving[PARAMETERS * PARAMETERS];
        memcpy(solving, normal, sizeof normal);
        if (!eye_solve(solving, right, PARAMETERS, 1))
            return EYE_NO_CONTRAST;
        for (int a = 0; a < LEVELS; a++)
            guess[a] += right[a];
        double move = right[3] < -1 ? -1 : right[3] > 1 ? 1 : right[3];
        guess[3] += move;
        guess[4] += right[4] < -0.5 ? -0.5 : right[4] > 0.5 ? 0.5 : right[4];
        guess[4] = guess[4] < 0.25 ? 0.25 : guess[4] > half + 2 ? half + 2 : guess[4];
        guess[5] += right[5] < -0.2 * half ? -0.2 * half : right[5] > 0.2 * half ? 0.2 * half : right[5];
        if (!(fabs(guess[3] - u->column) <= half + 2 + (cut ? half : 0)) || !(guess[5] > 0.4 * half))
            return EYE_WRONG_WIDTH;
        if (fabs(move) < 0.015 && round > 0)
            break;
    }
    double inverse[PARAMETERS] = {0, 0, 0, 1, 0, 0};
    if (!eye_solve(normal, inverse, PARAMETERS, 1))
        return EYE_NO_CONTRAST;
    out->column = guess[3];
    out->half = guess[5];
    out->blur = guess[4];
    out->sigma = sqrt(variance * inverse[3]) + (cut ? CUT_SIGMA * half : 0);
    out->noise = sqrt(plain / (to - from)) / peak;
    out->front = flat ? 1.0 : front_of(u, guess);
    out->sides = 2;
    if (guess[3] - half < -0.5 || guess[3] + half > p->columns - 0.5)
        out->sides = 1;
    return EYE_READ;
}
