/* All edges of a code at once, fitted to one scale.
 *
 * The straightened light is compared with what a code of that scale would give. Gauss-Newton; the
 * uncertainty comes out of the same fit. */
#include "wave.h"

#include <math.h>
#include <string.h>

#define ROUNDS 8
#define SETTLED 0.06      /* rows by which boundaries still move when a fit may end */
#define BLUR_GUESS 0.55   /* rows */
#define BLUR_PRIOR 0.4    /* rows by which blur may differ from that, about */
#define LEAST_BLUR 0.2    /* rows */
#define LEAK_PRIOR 0.3    /* share of what is beside the strip that blur mixes into it */
#define THIN 1.0          /* half of the columns looked at, of a strip that blur fills so far */
#define LEAK_RIDGE 1.0
#define GROWTH_PRIOR 0.15 /* rows by which bright segments may seem to grow: glare, tone curve */
#define PITCH_PRIOR 0.03  /* radians by which camera or pole may lean towards each other */
#define MOST_SAG 0.04     /* three times that of the nearest pole seen 10 degrees from level */
#define DARK_NOISE 0.01   /* light whose photons are as many as what darkness has of noise */
#define LEAST_CONTRAST 0.002 /* light */
#define MOST_LAG 3        /* rows over which what is left over may be alike */
#define MOST_INFLATION 6.0
#define EDGE_SIGMA 0.003  /* segments by which an edge is off besides: paint, lens, the pole's round end */
#define BLURRED 3.54      /* rows over which an edge is spread, times its blur: 2 sqrt(pi) */
#define ASTRAY 2.5        /* times the rest that the other channel leaves */
#define USUAL_NOISE 0.1   /* rest, of bright - dark, that says nothing about a channel */
#define RIDGE 1e-9
#define LEVEL_RIDGE 1e-4  /* rows of nothing: hold the levels that no row shows */

/* Light along the strip in one channel, and just beside it, there from its mean. */
typedef struct {
    double light[EYE_MOST_ROWS], beside[EYE_MOST_ROWS];
    double weight[EYE_MOST_ROWS], root[EYE_MOST_ROWS]; /* what a row counts, and its root */
} profile;

/* The sums of one round of the fit. */
typedef struct {
    double rests[EYE_MOST_ROWS]; /* what is left over, weighted as the rows are, */
    double variance;             /* of that */
    double plain;                /* sum of its squares, not weighted */
    double sag_pull;             /* the prior's share of the sag's diagonal entry */
    double normal[EYE_PARAMETERS * EYE_PARAMETERS], right[EYE_PARAMETERS];
} equations;

/* Two numbers at a time. */
typedef double pair __attribute__((vector_size(2 * sizeof(double))));

/* Adds one entry's products with ``n`` entries, an even number, to its line of the equations. */
static inline void add_line(double *line, const double *row, double scaled, int n)
{
    for (int b = 0; b < n; b += 2) {
        pair sum, entry;
        memcpy(&sum, line + b, sizeof sum);
        memcpy(&entry, row + b, sizeof entry);
        sum += scaled * entry;
        memcpy(line + b, &sum, sizeof sum);
    }
}

/* Adds a row to the normal equations; most of its entries are nought, all but the levels' where no
 * boundary shows. Beyond the diagonal it leaves what `mirror` overwrites. */
static void add_row(double *normal, double *right, const double *row, int shows, double rest,
                    double weight)
{
    for (int a = 0; a < EYE_LINEAR; a++) {
        if (row[a] == 0)
            continue;
        double scaled = row[a] * weight;
        right[a] += scaled * rest;
        add_line(normal + a * EYE_PARAMETERS, row, scaled, (a + 2) / 2 * 2);
    }
    for (int a = EYE_LINEAR; shows && a < EYE_PARAMETERS; a++) {
        double scaled = row[a] * weight;
        right[a] += scaled * rest;
        add_line(normal + a * EYE_PARAMETERS, row, scaled, (a + 2) / 2 * 2);
    }
}

/* Pulls a parameter by ``off`` towards where a prior with this deviation has it. */
static double pull(equations *sums, int parameter, double off, double deviation)
{
    double strength = sums->variance / (deviation * deviation);
    sums->normal[parameter * EYE_PARAMETERS + parameter] += strength;
    sums->right[parameter] += strength * off;
    return strength;
}

/* Fills in the other half of the matrix, and makes sure that it can be solved. */
static void mirror(double *normal)
{
    for (int i = 0; i < EYE_PARAMETERS; i++) {
        normal[i * EYE_PARAMETERS + i] += RIDGE * (1 + normal[i * EYE_PARAMETERS + i]);
        for (int j = 0; j < i; j++)
            normal[j * EYE_PARAMETERS + i] = normal[i * EYE_PARAMETERS + j];
    }
}

/* Takes the mean of some rows off all of them. */
static void center(double *values, int from, int to)
{
    double mean = 0;
    for (int i = from; i < to; i++)
        mean += values[i] / (to - from);
    for (int i = from; i < to; i++)
        values[i] -= mean;
}

/* What the rows count. Photon noise: the variance of light grows with the light. */
static void weigh(profile *seen, int from, int to)
{
    for (int i = from; i < to; i++) {
        seen->weight[i] = 1 / (fabs(seen->light[i]) + DARK_NOISE);
        seen->root[i] = sqrt(seen->weight[i]);
    }
}

/* First values for the levels: linear least squares with the edges where they are. */
static int fit_levels(const eye_upright *u, const profile *seen, const eye_wave *wave,
                      double *guess, int from, int to)
{
    double matrix[EYE_LINEAR * EYE_LINEAR] = {0}, right[EYE_LINEAR] = {0}, row[EYE_PARAMETERS];
    eye_layout at;
    eye_lay_out(wave, guess, &at);
    for (int i = from; i < to; i++) {
        double upper = u->first + i * u->bin;
        eye_wave_row(wave, &at, guess, upper, upper + u->bin, seen->beside[i], row);
        for (int a = 0; a < EYE_LINEAR; a++) {
            if (row[a] == 0)
                continue;
            right[a] += row[a] * seen->light[i];
            for (int b = 0; b < EYE_LINEAR; b++)
                matrix[a * EYE_LINEAR + b] += row[a] * row[b];
        }
    }
    for (int a = 0; a < EYE_LINEAR; a++)
        matrix[a * EYE_LINEAR + a] += a == EYE_LEAK ? LEAK_RIDGE : LEVEL_RIDGE;
    if (!eye_solve(matrix, right, EYE_LINEAR, 1))
        return 0;
    memcpy(guess, right, sizeof right);
    return 1;
}

/* The rows that take part: a bar's outer edge only where something else begins behind it. */
static void choose_rows(const eye_upright *u, const eye_wave *wave, const double *guess,
                        int open_top, int open_bottom, int *from, int *to)
{
    double margin = 1.5 * guess[EYE_BLUR] + 1.0 + 0.5 * u->bin, inside = 0.6 * guess[EYE_UNIT];
    double half = wave->segments / 2;
    double top = eye_row_of(guess, -half) + (open_top ? inside : -margin);
    double bottom = eye_row_of(guess, half) - (open_bottom ? inside : -margin);
    *from = (int)ceil((top - u->first) / u->bin);
    *to = (int)floor((bottom - u->first) / u->bin);
    *from = *from < 0 ? 0 : *from;
    *to = *to > u->rows ? u->rows : *to;
}

/* Compares the rows with the model: the normal equations, and weak priors for what a code cannot
 * tell. */
static void compare(const eye_upright *u, const profile *seen, const eye_wave *wave,
                    const double *guess, double constant, int from, int to, equations *out)
{
    double row[EYE_PARAMETERS], weighted = 0, plain = 0;
    eye_layout at;
    memset(out->normal, 0, sizeof out->normal);
    memset(out->right, 0, sizeof out->right);
    eye_lay_out(wave, guess, &at);
    for (int i = from; i < to; i++) {
        double upper = u->first + i * u->bin;
        double rest = seen->light[i] - eye_wave_row(wave, &at, guess, upper, upper + u->bin,
                                                    seen->beside[i], row);
        double weight = seen->weight[i];
        add_row(out->normal, out->right, row, at.shows, rest, weight);
        weighted += rest * rest * weight;
        plain += rest * rest;
        out->rests[i - from] = rest * seen->root[i];
    }
    int free = to - from - EYE_PARAMETERS;
    out->plain = plain;
    out->variance = weighted / (free > 4 ? free : 4) + 1e-7;
    /* Little is blurred into a wide strip; whatever covers it is beside it as well, and no leak. */
    double thin = THIN / fmax(u->half_window, THIN);
    pull(out, EYE_LEAK, -guess[EYE_LEAK], LEAK_PRIOR * thin * thin);
    pull(out, EYE_GROWTH, -guess[EYE_GROWTH], GROWTH_PRIOR);
    pull(out, EYE_BLUR, BLUR_GUESS - guess[EYE_BLUR], BLUR_PRIOR);
    out->sag_pull = pull(out, EYE_SAG, -guess[EYE_SAG], PITCH_PRIOR * guess[EYE_UNIT] / constant);
    mirror(out->normal);
}

/* Moves the guess by one step, not too far; returns by how many rows boundaries move at the most,
 * or -1 where there is no step. */
static double move(const equations *sums, double unit, int segments, double *guess)
{
    double solving[EYE_PARAMETERS * EYE_PARAMETERS], step[EYE_PARAMETERS];
    memcpy(solving, sums->normal, sizeof solving);
    memcpy(step, sums->right, sizeof step);
    if (!eye_solve(solving, step, EYE_PARAMETERS, 1))
        return -1;
    for (int i = 0; i < EYE_LINEAR; i++)
        guess[i] += step[i];
    double by_middle = eye_limit(step[EYE_MIDDLE], -0.6 * unit, 0.6 * unit);
    double by_unit = eye_limit(step[EYE_UNIT], -0.08 * unit, 0.08 * unit);
    guess[EYE_MIDDLE] += by_middle;
    guess[EYE_UNIT] += by_unit;
    guess[EYE_BLUR] += eye_limit(step[EYE_BLUR], -0.25, 0.25);
    guess[EYE_GROWTH] += eye_limit(step[EYE_GROWTH], -0.3, 0.3);
    guess[EYE_SAG] += eye_limit(step[EYE_SAG], -0.01, 0.01);
    guess[EYE_BLUR] = eye_limit(guess[EYE_BLUR], LEAST_BLUR, 0.25 * guess[EYE_UNIT] + 1.2);
    return fmax(fabs(by_middle), fabs(by_unit) * segments);
}

/* By how much the variance grows because what is left over is no white noise: demosaicing, JPEG
 * and whatever the model does not know make neighbouring rows err alike. */
static double inflation(const double *rests, int n)
{
    double sum = 0, power = 1e-12;
    for (int i = 0; i < n; i++)
        power += rests[i] * rests[i];
    for (int lag = 1; lag <= MOST_LAG && lag < n; lag++) {
        double product = 0;
        for (int i = lag; i < n; i++)
            product += rests[i] * rests[i - lag];
        sum += product / power;
    }
    return eye_limit(1 + 2 * sum, 1, MOST_INFLATION);
}

/* The variance of a row's light that makes an edge as uncertain as EDGE_SIGMA says, weighed as rows are. */
static double edge_variance(const double *guess, double contrast, int bin)
{
    double off = EDGE_SIGMA * guess[EYE_UNIT] * contrast, spread = BLURRED * guess[EYE_BLUR];
    double light = fabs(guess[EYE_DARK] + contrast / 2) + DARK_NOISE;
    return off * off / (fmax(spread, (double)bin * bin) * light);
}

/* What a fit has found, and how uncertain that is; the reason where it says nothing. */
static int conclude(equations *sums, const double *guess, int rows, int bin, eye_scale *out)
{
    double contrast = guess[EYE_BRIGHT] - guess[EYE_DARK];
    if (!(contrast > LEAST_CONTRAST))
        return EYE_NO_CONTRAST;
    /* Two columns of the inverse: the covariance of unit and sag. */
    double inverse[EYE_PARAMETERS * 2] = {0};
    inverse[EYE_UNIT * 2] = inverse[EYE_SAG * 2 + 1] = 1;
    if (!eye_solve(sums->normal, inverse, EYE_PARAMETERS, 2))
        return EYE_NO_SCALE;
    double variance = inflation(sums->rests, rows) * sums->variance;
    double more = edge_variance(guess, contrast, bin);
    out->middle = guess[EYE_MIDDLE];
    out->unit = guess[EYE_UNIT];
    out->sag = guess[EYE_SAG];
    out->blur = guess[EYE_BLUR];
    out->growth = guess[EYE_GROWTH];
    out->leak = guess[EYE_LEAK];
    out->unit_sigma = sqrt(variance * inverse[EYE_UNIT * 2]) / guess[EYE_UNIT];
    out->unit_doubt = sqrt(more * inverse[EYE_UNIT * 2]) / guess[EYE_UNIT];
    out->sag_sigma = 1.0;
    out->sag_doubt = 0;
    /* Sag is shared by all poles of a picture and weighed against them later: here it is what the
     * code itself says, its prior taken out again. */
    double information = 1 / inverse[EYE_SAG * 2 + 1] - sums->sag_pull;
    if (information > 0) {
        out->sag = guess[EYE_SAG] * (information + sums->sag_pull) / information;
        out->sag_sigma = sqrt(variance / information);
        out->sag_doubt = sqrt(more / information);
    }
    out->sag = eye_limit(out->sag, -MOST_SAG, MOST_SAG);
    out->noise = sqrt(sums->plain / rows) / contrast;
    return EYE_READ;
}

/* Fits the whole code to one channel's light; the reason where it does not settle near the guess,
 * which is another channel's fit or, without that, the candidate. */
static int fit_channel(const eye_upright *u, profile *seen, const char *code,
                       const eye_candidate *candidate, double constant, const eye_scale *begin,
                       eye_scale *out)
{
    equations sums;
    eye_wave wave;
    double guess[EYE_PARAMETERS] = {0};
    int segments = 2 * candidate->bits + 5, from, to;
    double unit = (candidate->bottom - candidate->top) / (segments - 4);
    double middle = (candidate->top + candidate->bottom) / 2;
    eye_wave_of(code, segments, &wave);
    guess[EYE_MIDDLE] = begin ? begin->middle : middle;
    guess[EYE_UNIT] = begin ? begin->unit : unit;
    guess[EYE_BLUR] = begin ? begin->blur : BLUR_GUESS;
    guess[EYE_GROWTH] = begin ? begin->growth : 0;
    choose_rows(u, &wave, guess, candidate->open_top, candidate->open_bottom, &from, &to);
    center(seen->beside, from, to);
    if (to - from < EYE_PARAMETERS || !fit_levels(u, seen, &wave, guess, from, to))
        return EYE_NO_SCALE;
    weigh(seen, from, to);
    for (int round = 0; round < ROUNDS; round++) {
        compare(u, seen, &wave, guess, constant, from, to, &sums);
        double moved = move(&sums, unit, segments, guess);
        if (moved < 0 || !(fabs(guess[EYE_MIDDLE] - middle) <= unit + 1) ||
            !(fabs(guess[EYE_UNIT] / unit - 1) <= 0.2))
            return EYE_NO_SCALE;
        /* The step after this one would be the square of it, about. */
        if (moved < SETTLED)
            break;
    }
    return conclude(&sums, guess, to - from, u->bin, out);
}

/* The mean of two estimates, weighed by their uncertainty; where they contradict each other it is
 * the larger for that. */
static void merge(double *value, double *sigma, double other, double other_sigma)
{
    double weight = 1 / (*sigma * *sigma), other_weight = 1 / (other_sigma * other_sigma);
    double apart = *value - other, total = weight + other_weight;
    double share = weight * other_weight / (total * total);
    *value = (*value * weight + other * other_weight) / total;
    *sigma = sqrt(1 / total + share * apart * apart);
}

/* Fits the whole code to the brightest channel, which has the least noise, or (``sharp``) to the
 * brightness; the reason where that cannot be. */
int eye_fit_scale(const eye_upright *u, const eye_task *task, const char *code,
                  const eye_candidate *candidate, int sharp, eye_scale *out)
{
    profile seen;
    int channel = u->channels == 1 ? 0 : task->high;
    for (int i = 0; i < u->rows; i++) {
        seen.light[i] = sharp ? u->light[i] : u->channel[i][channel];
        seen.beside[i] = u->beside[i][sharp ? 3 : channel];
    }
    return fit_channel(u, &seen, code, candidate, task->constant, NULL, out);
}

/* Fits a code again to the brightness, which cameras with a mosaic of colour filters and JPEG keep
 * sharper, and takes the mean of both: each says how uncertain it is. */
void eye_refine_scale(const eye_upright *u, const eye_task *task, const char *code,
                      const eye_candidate *candidate, eye_scale *out)
{
    profile seen;
    eye_scale other;
    for (int i = 0; i < u->rows; i++) {
        seen.light[i] = u->light[i];
        seen.beside[i] = u->beside[i][3];
    }
    if (fit_channel(u, &seen, code, candidate, task->constant, out, &other) != EYE_READ)
        return;
    /* One that went astray does not count. */
    if (other.noise > ASTRAY * out->noise && other.noise > USUAL_NOISE)
        return;
    if (out->noise > ASTRAY * other.noise && out->noise > USUAL_NOISE) {
        *out = other;
        return;
    }
    out->blur = other.blur < out->blur ? other.blur : out->blur;
    out->noise = other.noise < out->noise ? other.noise : out->noise;
    double middle_sigma = out->unit_sigma, other_sigma = other.unit_sigma;
    merge(&out->middle, &middle_sigma, other.middle, other_sigma);
    double unit_sigma = out->unit_sigma * out->unit;
    merge(&out->unit, &unit_sigma, other.unit, other.unit_sigma * other.unit);
    out->unit_sigma = unit_sigma / out->unit;
    merge(&out->sag, &out->sag_sigma, other.sag, other.sag_sigma);
}
