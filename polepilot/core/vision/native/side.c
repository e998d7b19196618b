/* Where a strip's middle lies: its light by column, fitted as a cylinder or a flat sticker of known
 * width, lit from anywhere, seen through a lens and a moving shutter.
 *
 * Light from one side makes the half-way points of a cylinder's sides wander by a tenth of its
 * width. Lambert's law says how its light runs over the surface: a + b u + c sqrt(1 - u^2), u from
 * -1 to 1 between the silhouettes. The middle and the blur are found with a, b and c free. */
#include "internal.h"

#include <math.h>
#include <string.h>

#define FEWEST_CELLS 8 /* strips of the surface in the model, */
#define MOST_CELLS 32  /* each about a column wide: finer than the blur, */
#define FINE_CELLS 24 /* and for its mean height */
#define ROUNDS 6
#define SETTLED 0.04    /* columns by which the middle still moves when a fit may end */
#define MARGIN 3.0    /* columns that take part beside a strip a quarter wider than expected */
#define LEAST_COLUMNS 3
#define LEAST_PEAK 0.002 /* light */
#define USUAL_BULGE 0.4  /* of the peak: how light on a cylinder is shared out on average */
#define LIGHT_PRIOR 0.5  /* of the peak, by which it may differ from that */
#define WIDTH_PRIOR 0.04 /* of the half width */
#define BLUR_GUESS 0.7   /* columns */
#define BLUR_PRIOR 1.0
#define LEAST_BLUR 0.25
#define LEAST_HALF 0.4   /* of the half width that is expected */
#define USUAL_FRONT 0.9
#define CUT_SIGMA 0.015 /* of the half width: where a side is cut off its light is not known */

/* The parameters; the model is linear in those before LEVELS. */
enum {
    LEVEL,           /* light, bright minus dark: everywhere alike, */
    SLOPE,           /* more from left to right, */
    BULGE,           /* and where a cylinder faces the camera */
    LEVELS,
    MIDDLE = LEVELS, /* column */
    BLUR,            /* standard deviation, columns */
    HALF,            /* half width, columns */
    PARAMETERS
};

/* The sums of one round of the fit. */
typedef struct {
    double normal[PARAMETERS * PARAMETERS], right[PARAMETERS];
    double plain, variance; /* of what is left over: mean square at the better side, variance */
} equations;

/* The strips of the surface: where each lies, from -1 to 1, and how high, 0 to 1. */
typedef struct {
    int cells;
    double place[MOST_CELLS], rise[MOST_CELLS];
} surface;

static void divide(surface *out, int cells)
{
    out->cells = cells;
    for (int i = 0; i < cells; i++) {
        double u = (2 * i + 1.0) / cells - 1;
        out->place[i] = u;
        out->rise[i] = sqrt(1 - u * u);
    }
}

/* What the normal distribution about each strip of the surface is at one place: how far off that is,
 * of the blur, and its cumulative function and density there. */
typedef struct {
    double off[MOST_CELLS], below[MOST_CELLS], bell[MOST_CELLS];
} border;

static void look_at_border(double x, const double *guess, const surface *of, border *out)
{
    double sharp = 1 / guess[BLUR];
    for (int i = 0; i < of->cells; i++) {
        double z = (x - guess[MIDDLE] - guess[HALF] * of->place[i]) * sharp;
        out->off[i] = z;
        eye_normal(z, out->below + i, out->bell + i);
    }
}

/* One column of the model, between two borders: basis of the levels and derivatives; returns the
 * prediction. */
static double model_column(const border *left, const border *right, double size,
                           const double *guess, const surface *of, int flat, double *row)
{
    int cells = of->cells;
    double sharp = 1 / guess[BLUR], half = guess[HALF], bulge = flat ? 0 : guess[BULGE];
    double weight = 2 * half / (cells * size), over = 1 / half;
    double by_level = 0, by_slope = 0, by_bulge = 0, by_middle = 0, by_blur = 0, by_half = 0, sum = 0;
    for (int i = 0; i < cells; i++) {
        double u = of->place[i], rise = of->rise[i];
        double kernel = right->below[i] - left->below[i], change = left->bell[i] - right->bell[i];
        double light = guess[LEVEL] + guess[SLOPE] * u + bulge * rise;
        by_level += kernel;
        by_slope += kernel * u;
        by_bulge += kernel * rise;
        sum += light * kernel;
        by_middle += light * change;
        by_half += light * (change * sharp * u + kernel * over);
        by_blur += light * (left->bell[i] * left->off[i] - right->bell[i] * right->off[i]);
    }
    row[LEVEL] = by_level * weight;
    row[SLOPE] = by_slope * weight;
    row[BULGE] = flat ? 0 : by_bulge * weight;
    row[MIDDLE] = by_middle * weight * sharp;
    row[BLUR] = by_blur * weight * sharp;
    row[HALF] = by_half * weight;
    return sum * weight;
}

/* The mean height of the surface over the columns that the profile averaged, and its mean place to the
 * right of the middle, of the radius. */
static void look_at_front(const eye_upright *u, const double *guess, int flat, eye_side *out)
{
    double total = 0, height = 0, place = 0;
    for (int i = 0; i < FINE_CELLS; i++) {
        double at = (2 * i + 1.0) / FINE_CELLS - 1;
        double offset = guess[MIDDLE] + guess[HALF] * at - u->column;
        double rise = sqrt(1 - at * at);
        double light = guess[LEVEL] + guess[SLOPE] * at + guess[BULGE] * rise;
        /* A blurred window: columns beside it lend it some of their light. */
        double inside = eye_cumulative((u->half_window - offset) / guess[BLUR]) -
                        eye_cumulative((-u->half_window - offset) / guess[BLUR]);
        double weight = inside * (light > 0 ? light : 0);
        total += weight;
        height += weight * rise;
        place += weight * at;
    }
    out->front = flat ? 1 : total > 0 ? height / total : USUAL_FRONT;
    out->aside = total > 0 ? place / total : 0;
}

/* The entries that take part: about the strip, within the picture; 0 where there are too few. */
static int choose_columns(const eye_picture *p, const eye_upright *u, double half, int *from,
                          int *to)
{
    double reach = half * 1.25 + MARGIN;
    double whole = (u->step - 1) / 2.0; /* columns on either side that an entry averages */
    int first = (int)ceil((whole - u->across_first) / u->step);
    int last = (int)floor((p->columns - 1 - whole - u->across_first) / u->step) + 1;
    *from = (int)ceil((u->column - reach - u->across_first) / u->step);
    *to = (int)floor((u->column + reach - u->across_first) / u->step) + 1;
    /* Beyond the picture there is nothing to compare with. */
    *from = *from < first ? first : *from;
    *to = *to > last ? last : *to;
    *from = *from < 0 ? 0 : *from;
    *to = *to > u->columns ? u->columns : *to;
    return *to - *from >= LEAST_COLUMNS;
}

/* Where the middle is if the picture cuts off the strip's left (-1) or right (1) side: the other
 * one and the width tell. */
static double middle_by_one_side(const eye_upright *u, double half, double peak, int cut, int from,
                                 int to)
{
    int at = cut < 0 ? to - 1 : from, end = cut < 0 ? from : to - 1;
    while (at != end && u->across[at] < 0.5 * peak)
        at += cut;
    return u->across_first + at * u->step + cut * half;
}

/* Pulls a parameter by ``off`` towards where a prior with this deviation has it. */
static void pull(equations *sums, int parameter, double off, double deviation)
{
    double strength = sums->variance / (deviation * deviation);
    sums->normal[parameter * PARAMETERS + parameter] += strength;
    sums->right[parameter] += strength * off;
}

/* Mean square of what is left over on the strip and at its better side: clutter stands at one side
 * of a pole, a wider post goes on at both. */
static double on_and_beside(const double *zone, const int *size)
{
    double left = size[0] ? zone[0] / size[0] : HUGE_VAL;
    double right = size[2] ? zone[2] / size[2] : HUGE_VAL;
    int better = left < right ? 0 : 2, n = size[1] + 2 * size[better];
    return n > 0 ? (zone[1] + 2 * zone[better]) / n : 0;
}

/* Compares the columns with the model: the normal equations. Priors: the width is known from the
 * range, and light does not run wild over the surface. */
static void compare(const eye_upright *u, const surface *of, const double *guess, double half,
                    double peak, int flat, int from, int to, equations *out)
{
    double row[PARAMETERS], zone[3] = {0};
    int size[3] = {0};
    border borders[2];
    look_at_border(u->across_first + (from - 0.5) * u->step, guess, of, borders + from % 2);
    memset(out->normal, 0, sizeof out->normal);
    memset(out->right, 0, sizeof out->right);
    for (int i = from; i < to; i++) {
        double x = u->across_first + i * u->step;
        const border *left = borders + i % 2;
        border *right = borders + (i + 1) % 2;
        look_at_border(x + 0.5 * u->step, guess, of, right);
        double rest = u->across[i] - model_column(left, right, u->step, guess, of, flat, row);
        int at = x < guess[MIDDLE] - guess[HALF] ? 0 : x > guess[MIDDLE] + guess[HALF] ? 2 : 1;
        zone[at] += rest * rest;
        size[at]++;
        for (int a = 0; a < PARAMETERS; a++) {
            out->right[a] += row[a] * rest;
            for (int b = 0; b < PARAMETERS; b++)
                out->normal[a * PARAMETERS + b] += row[a] * row[b];
        }
    }
    int free = to - from - 4;
    double all = zone[0] + zone[1] + zone[2];
    out->plain = on_and_beside(zone, size);
    out->variance = all / (free > 2 ? free : 2) + 1e-8 + 1e-4 * peak * peak;
    pull(out, HALF, half - guess[HALF], WIDTH_PRIOR * half + 0.05);
    pull(out, BLUR, BLUR_GUESS - guess[BLUR], BLUR_PRIOR);
    pull(out, SLOPE, 0 - guess[SLOPE], LIGHT_PRIOR * peak);
    pull(out, BULGE, (flat ? 0 : USUAL_BULGE * peak) - guess[BULGE], LIGHT_PRIOR * peak);
    for (int a = 0; a < PARAMETERS; a++)
        out->normal[a * PARAMETERS + a] *= 1 + 1e-9;
}

/* Moves the guess by one step, not too far; returns by how many columns the middle moves, or nan
 * where there is no step. */
static double move(const equations *sums, double half, double *guess)
{
    double solving[PARAMETERS * PARAMETERS], step[PARAMETERS];
    memcpy(solving, sums->normal, sizeof solving);
    memcpy(step, sums->right, sizeof step);
    if (!eye_solve(solving, step, PARAMETERS, 1))
        return NAN;
    for (int a = 0; a < LEVELS; a++)
        guess[a] += step[a];
    double moved = eye_limit(step[MIDDLE], -1, 1);
    guess[MIDDLE] += moved;
    guess[BLUR] += eye_limit(step[BLUR], -0.5, 0.5);
    guess[BLUR] = eye_limit(guess[BLUR], LEAST_BLUR, half + 2);
    guess[HALF] += eye_limit(step[HALF], -0.2 * half, 0.2 * half);
    return fabs(moved);
}

/* Fits the strip's middle; the reason where that cannot be. ``half``: half of its width as its range
 * has it, columns. */
int eye_fit_side(const eye_picture *p, const eye_upright *u, double half, int flat, eye_side *out)
{
    equations sums;
    surface cells;
    double peak = 0;
    int from, to;
    if (!choose_columns(p, u, half, &from, &to))
        return EYE_CUT_OFF;
    for (int i = from; i < to; i++)
        if (u->across[i] > peak)
            peak = u->across[i];
    if (peak < LEAST_PEAK)
        return EYE_NO_CONTRAST;
    int cut = u->column - half < 0 ? -1 : u->column + half > p->columns - 1 ? 1 : 0;
    double guess[PARAMETERS] = {
        [LEVEL] = (1 - USUAL_BULGE) * peak,
        [BULGE] = flat ? 0 : USUAL_BULGE * peak,
        [MIDDLE] = cut ? middle_by_one_side(u, half, peak, cut, from, to) : u->column,
        [BLUR] = BLUR_GUESS,
        [HALF] = half,
    };
    double astray = half + 2 + (cut ? half : 0);
    divide(&cells, eye_clamp((int)(1.5 * half), FEWEST_CELLS, MOST_CELLS));
    for (int round = 0; round < ROUNDS; round++) {
        compare(u, &cells, guess, half, peak, flat, from, to, &sums);
        double moved = move(&sums, half, guess);
        if (isnan(moved))
            return EYE_NO_CONTRAST;
        if (!(fabs(guess[MIDDLE] - u->column) <= astray) || !(guess[HALF] > LEAST_HALF * half))
            return EYE_WRONG_WIDTH;
        if (moved < SETTLED && round > 0)
            break;
    }
    double inverse[PARAMETERS] = {[MIDDLE] = 1};
    if (!eye_solve(sums.normal, inverse, PARAMETERS, 1))
        return EYE_NO_CONTRAST;
    out->column = guess[MIDDLE];
    out->half = guess[HALF];
    out->blur = guess[BLUR];
    out->sigma = sqrt(sums.variance * inverse[MIDDLE]) + (cut ? CUT_SIGMA * half : 0);
    out->noise = sqrt(sums.plain) / peak;
    look_at_front(u, guess, flat, out);
    int whole = guess[MIDDLE] - half >= -0.5 && guess[MIDDLE] + half <= p->columns - 0.5;
    out->sides = whole ? 2 : 1;
    return EYE_READ;
}
