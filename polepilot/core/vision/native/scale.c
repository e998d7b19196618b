/* All edges of a code at once: a square wave seen through a lens, fitted to one scale.
 *
 * The straightened light is compared with what a code of that scale would give: levels of bright
 * and dark, a blurred step at every boundary, boundaries that crowd together towards one end where
 * the camera looks up or down. Gauss-Newton; the uncertainty comes out of the same fit. */
#include "eye.h"

#include <math.h>
#include <string.h>

#define ROUNDS 8
#define LINEAR 6    /* above, bright and its tilt, dark and its tilt, below */
#define PARAMETERS 11
#define MIDDLE 6    /* places of the others among the parameters */
#define UNIT 7
#define BLUR 8
#define GROWTH 9
#define SAG 10
#define MOST_EDGES (EYE_MOST_BITS * 2 + 4)

#define GROWTH_PRIOR 0.15 /* rows by which bright segments may seem to grow: glare, tone curve */
#define BLUR_PRIOR 0.4    /* rows by which blur may differ from BLUR_GUESS, about */
#define BLUR_GUESS 0.55
#define PITCH_PRIOR 0.03 /* radians by which camera or pole may lean towards each other */
#define MOST_LAG 3
#define ASTRAY 2.5      /* times the rest that the other channel leaves */
#define USUAL_NOISE 0.1 /* rest, of bright - dark, that says nothing about a channel */
#define SETTLED 0.02     /* rows by which boundaries still move when a fit may end */
#define RIDGE 1e-9

typedef struct {
    int edges;               /* boundaries between bright and dark, and the outer ones */
    double place[MOST_EDGES]; /* in segments from the code's middle */
    double sign[MOST_EDGES];  /* 1: brighter below */
    double segments;
} code_shape;

typedef struct {
    double step, by_place, by_blur;
} slope;

static void shape_of(const char *code, int segments, code_shape *out)
{
    double half = segments / 2.0;
    int n = 0;
    out->place[n] = -half;
    out->sign[n++] = 1;
    for (int i = 1; i < segments; i++)
        if (code[i] != code[i - 1]) {
            out->place[n] = i - half;
            out->sign[n++] = code[i] == '1' ? 1 : -1;
        }
    out->place[n] = half;
    out->sign[n++] = -1;
    out->edges = n;
    out->segments = segments;
}

/* Where a boundary lies, growth left out. */
static double row_of(const double *guess, double place)
{
    return guess[MIDDLE] + guess[UNIT] * place / (1 + guess[SAG] * place);
}

/* A step at ``place`` as the rows between two borders see it: the mean of the normal distribution's
 * cumulative function over them, and how that changes. */
static inline slope step_at(double upper, double lower, double place, double blur)
{
    double sharp = 1 / blur, size = 1 / (lower - upper);
    double z0 = (upper - place) * sharp, z1 = (lower - place) * sharp;
    if (z1 < -5)
        return (slope){0, 0, 0};
    if (z0 > 5)
        return (slope){1, 0, 0};
    double c0 = eye_cumulative(z0), c1 = eye_cumulative(z1);
    double b0 = eye_bell(z0), b1 = eye_bell(z1);
    return (slope){blur * size * (z1 * c1 + b1 - z0 * c0 - b0), -size * (c1 - c0),
                   size * (b1 - b0)};
}

/* Where all boundaries lie for one set of values, and what is the same for every row. */
typedef struct {
    double place[MOST_EDGES], squeeze[MOST_EDGES];
    double reach; /* rows on either side of a boundary in which it shows */
} layout;

static void lay_out(const code_shape *shape, const double *guess, layout *out)
{
    for (int k = 0; k < shape->edges; k++) {
        out->place[k] = row_of(guess, shape->place[k]) - guess[GROWTH] * shape->sign[k];
        out->squeeze[k] = 1 / (1 + guess[SAG] * shape->place[k]);
    }
    out->reach = 5 * guess[BLUR];
}

/* One row of the model: basis of the levels, derivatives by the rest; returns the prediction.
 * ``passed`` counts the boundaries above the row that no longer show in it; rows come in order. */
static double model_row(const code_shape *shape, const layout *at, const double *guess,
                        double upper, double lower, int *passed, double *row)
{
    int last_edge = shape->edges - 1;
    while (*passed <= last_edge && at->place[*passed] < upper - at->reach)
        ++*passed;
    /* Signs alternate, the first is 1: what has been passed leaves bright or dark. */
    double bright = *passed % 2 && *passed <= last_edge ? 1 : 0;
    double first = *passed > 0 ? 1 : 0, last = *passed > last_edge ? 1 : 0;
    double by_middle = 0, by_unit = 0, by_blur = 0, by_growth = 0, by_sag = 0;
    double shift = 2 * ((upper + lower) / 2 - guess[MIDDLE]) / (guess[UNIT] * shape->segments);
    shift = shift < -1.2 ? -1.2 : shift > 1.2 ? 1.2 : shift;
    double light = guess[1] + guess[2] * shift, shade = guess[3] + guess[4] * shift;
    for (int k = *passed; k <= last_edge && at->place[k] < lower + at->reach; k++) {
        double q = shape->place[k], sign = shape->sign[k];
        slope s = step_at(upper, lower, at->place[k], guess[BLUR]);
        bright += sign * s.step;
        double jump = sign * (light - shade);
        if (k == 0) {
            first = s.step;
            jump = light - guess[0];
        } else if (k == last_edge) {
            last = s.step;
            jump = guess[5] - light;
        }
        double move = jump * s.by_place, moved = move * q * at->squeeze[k];
        by_middle += move;
        by_unit += moved;
        by_sag -= moved * guess[UNIT] * q * at->squeeze[k];
        by_growth -= move * sign;
        by_blur += jump * s.by_blur;
    }
    double dark = first - last - bright;
    row[0] = 1 - first;
    row[1] = bright;
    row[2] = bright * shift;
    row[3] = dark;
    row[4] = dark * shift;
    row[5] = last;
    row[MIDDLE] = by_middle;
    row[UNIT] = by_unit;
    row[BLUR] = by_blur;
    row[GROWTH] = by_growth;
    row[SAG] = by_sag;
    double sum = 0;
    for (int i = 0; i < LINEAR; i++)
        sum += row[i] * guess[i];
    return sum;
}

/* Adds a row to the normal equations; most of its entries are nought. */
static void add_row(double *normal, double *right, const double *row, double rest, double weight)
{
    int used[PARAMETERS], n = 0;
    for (int i = 0; i < PARAMETERS; i++) {
        used[n] = i;
        n += row[i] != 0;
    }
    for (int a = 0; a < n; a++) {
        double scaled = row[used[a]] * weight;
        double *line = normal + used[a] * PARAMETERS;
        right[used[a]] += scaled * rest;
        for (int b = 0; b <= a; b++)
            line[used[b]] += scaled * row[used[b]];
    }
}

static void mirror(double *normal, double ridge)
{
    for (int i = 0; i < PARAMETERS; i++) {
        normal[i * PARAMETERS + i] += ridge * (1 + normal[i * PARAMETERS + i]);
        for (int j = 0; j < i; j++)
            normal[j * PARAMETERS + i] = normal[i * PARAMETERS + j];
    }
}

/* First values for the levels: linear least squares with the edges where they are. */
static int fit_levels(const eye_upright *u, const double *light, const code_shape *shape,
                      double *guess, int from, int to)
{
    double matrix[LINEAR * LINEAR] = {0}, right[LINEAR] = {0}, row[PARAMETERS];
    layout at;
    int passed = 0;
    lay_out(shape, guess, &at);
    for (int i = from; i < to; i++) {
        double upper = u->first + i * u->bin;
        model_row(shape, &at, guess, upper, upper + u->bin, &passed, row);
        for (int a = 0; a < LINEAR; a++) {
            right[a] += row[a] * light[i];
            for (int b = 0; b < LINEAR; b++)
                matrix[a * LINEAR + b] += row[a] * row[b];
        }
    }
    for (int a = 0; a < LINEAR; a++)
        matrix[a * LINEAR + a] += 1e-4;
    if (!eye_solve(matrix, right, LINEAR, 1))
        return 0;
    memcpy(guess, right, sizeof right);
    return 1;
}

/* The rows that take part: a bar's outer edge only where something else begins behind it. */
static void choose_rows(const eye_upright *u, const code_shape *shape, const double *guess,
                        int open_top, int open_bottom, int *from, int *to)
{
    double margin = 1.5 * guess[BLUR] + 1.0 + 0.5 * u->bin, inside = 0.6 * guess[UNIT];
    double half = shape->segments / 2;
    double top = row_of(guess, -half) + (open_top ? inside : -margin);
    double bottom = row_of(guess, half) - (open_bottom ? inside : -margin);
    *from = (int)ceil((top - u->first) / u->bin);
    *to = (int)floor((bottom - u->first) / u->bin);
    *from = *from < 0 ? 0 : *from;
    *to = *to > u->rows ? u->rows : *to;
}

static double limit(double value, double most)
{
    return value < -most ? -most : value > most ? most : value;
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
    double factor = 1 + 2 * sum;
    return factor < 1 ? 1 : factor > 6 ? 6 : factor;
}

/* Fits the whole code to one channel's light; the reason where it does not settle near the guess,
 * which is another channel's fit or, without that, the candidate. */
static int fit_channel(const eye_upright *u, const double *light, const char *code,
                       const eye_candidate *candidate, double constant, const eye_scale *begin,
                       eye_scale *out)
{
    double left_over[EYE_MOST_ROWS];
    code_shape shape;
    double guess[PARAMETERS] = {0}, normal[PARAMETERS * PARAMETERS], right[PARAMETERS];
    double row[PARAMETERS];
    int segments = 2 * candidate->bits + 5, from, to;
    double unit = (candidate->bottom - candidate->top) / (segments - 4);
    double middle = (candidate->top + candidate->bottom) / 2;
    shape_of(code, segments, &shape);
    guess[MIDDLE] = middle;
    guess[UNIT] = unit;
    guess[BLUR] = BLUR_GUESS;
    if (begin) {
        guess[MIDDLE] = begin->middle;
        guess[UNIT] = begin->unit;
        guess[BLUR] = begin->blur;
        guess[GROWTH] = begin->growth;
    }
    choose_rows(u, &shape, guess, candidate->open_top, candidate->open_bottom, &from, &to);
    if (to - from < PARAMETERS || !fit_levels(u, light, &shape, guess, from, to))
        return EYE_NO_SCALE;
    double variance = 0, plain = 0, sag_pull = 0;
    for (int round = 0; round < ROUNDS; round++) {
        memset(normal, 0, sizeof normal);
        memset(right, 0, sizeof right);
        double rests = 0;
        layout at;
        int passed = 0;
        lay_out(&shape, guess, &at);
        plain = 0;
        for (int i = from; i < to; i++) {
            double upper = u->first + i * u->bin;
            double rest = light[i] - model_row(&shape, &at, guess, upper, upper + u->bin,
                                             &passed, row);
            /* Photon noise: the variance of light grows with the light. */
            double weight = 1 / (fabs(light[i]) + 0.01);
            add_row(normal, right, row, rest, weight);
            rests += rest * rest * weight;
            plain += rest * rest;
            left_over[i - from] = rest * sqrt(weight);
        }
        int free = to - from - PARAMETERS;
        variance = rests / (free > 4 ? free : 4) + 1e-7;
        /* Weak priors hold what a code cannot tell. */
        double pull = variance / (GROWTH_PRIOR * GROWTH_PRIOR);
        normal[GROWTH * PARAMETERS + GROWTH] += pull;
        right[GROWTH] -= pull * guess[GROWTH];
        pull = variance / (BLUR_PRIOR * BLUR_PRIOR);
        normal[BLUR * PARAMETERS + BLUR] += pull;
        right[BLUR] -= pull * (guess[BLUR] - BLUR_GUESS);
        double sag = PITCH_PRIOR * guess[UNIT] / constant;
        sag_pull = variance / (sag * sag);
        normal[SAG * PARAMETERS + SAG] += sag_pull;
        right[SAG] -= sag_pull * guess[SAG];
        mirror(normal, RIDGE);
        double solving[PARAMETERS * PARAMETERS];
        memcpy(solving, normal, sizeof normal);
        if (!eye_solve(solving, right, PARAMETERS, 1))
            return EYE_NO_SCALE;
        for (int i = 0; i < LINEAR; i++)
            guess[i] += right[i];
        double by_middle = limit(right[MIDDLE], 0.6 * unit);
        double by_unit = limit(right[UNIT], 0.08 * unit);
        guess[MIDDLE] += by_middle;
        guess[UNIT] += by_unit;
        guess[BLUR] += limit(right[BLUR], 0.25);
        guess[GROWTH] += limit(right[GROWTH], 0.3);
        guess[SAG] += limit(right[SAG], 0.01);
        double widest = 0.25 * guess[UNIT] + 1.2;
        guess[BLUR] = guess[BLUR] < 0.2 ? 0.2 : guess[BLUR] > widest ? widest : guess[BLUR];
        if (!(fabs(guess[MIDDLE] - middle) <= unit + 1) || !(fabs(guess[UNIT] / unit - 1) <= 0.2))
            return EYE_NO_SCALE;
        /* The step after this one would be the square of it, about. */
        if (fabs(by_middle) < SETTLED && fabs(by_unit) * segments < SETTLED)
            break;
    }
    double contrast = guess[1] - guess[3];
    if (!(contrast > 0.002))
        return EYE_NO_CONTRAST;
    /* Columns of the inverse: the covariance. Where sag is shared by all poles it is weighed
     * against them later, so its prior is taken out of its own uncertainty again. */
    double inverse[PARAMETERS * 2] = {0};
    inverse[UNIT * 2] = 1;
    inverse[SAG * 2 + 1] = 1;
    if (!eye_solve(normal, inverse, PARAMETERS, 2))
        return EYE_NO_SCALE;
    double factor = inflation(left_over, to - from);
    double information = 1 / inverse[SAG * 2 + 1] - sag_pull;
    out->middle = guess[MIDDLE];
    out->unit = guess[UNIT];
    out->sag = guess[SAG];
    out->blur = guess[BLUR];
    out->growth = guess[GROWTH];
    out->above = guess[0];
    out->bright = guess[1];
    out->bright_tilt = guess[2];
    out->dark = guess[3];
    out->dark_tilt = guess[4];
    out->below = guess[5];
    out->unit_sigma = sqrt(factor * variance * inverse[UNIT * 2]) / guess[UNIT];
    out->sag_sigma = information > 0 ? sqrt(factor * variance / information) : 1.0;
    /* The estimate without the prior: what the code itself says. */
    if (information > 0)
        out->sag = guess[SAG] * (information + sag_pull) / information;
    out->noise = sqrt(plain / (to - from)) / contrast;
    return EYE_READ;
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
    double light[EYE_MOST_ROWS];
    int channel = u->channels == 1 ? 0 : task->high;
    for (int i = 0; i < u->rows; i++)
        light[i] = sharp ? u->light[i] : u->channel[i][channel];
    return fit_channel(u, light, code, candidate, task->constant, NULL, out);
}

/* Fits a code again to the brightness, which cameras with a mosaic of colour filters and JPEG keep
 * sharper, and takes the mean of both: each says how uncertain it is. */
int eye_refine_scale(const eye_upright *u, const eye_task *task, const char *code,
                     const eye_candidate *candidate, eye_scale *out)
{
    double light[EYE_MOST_ROWS];
    eye_scale other;
    for (int i = 0; i < u->rows; i++)
        light[i] = u->light[i];
    if (fit_channel(u, light, code, candidate, task->constant, out, &other) != EYE_READ)
        return 0;
    /* One that went astray does not count. */
    if (other.noise > ASTRAY * out->noise && other.noise > USUAL_NOISE)
        return 0;
    if (out->noise > ASTRAY * other.noise && out->noise > USUAL_NOISE) {
        *out = other;
        return 1;
    }
    out->blur = other.blur < out->blur ? other.blur : out->blur;
    out->noise = other.noise < out->noise ? other.noise : out->noise;
    double middle_sigma = out->unit_sigma, other_sigma = other.unit_sigma;
    merge(&out->middle, &middle_sigma, other.middle, other_sigma);
    double unit_sigma = out->unit_sigma * out->unit;
    merge(&out->unit, &unit_sigma, other.unit, other.unit_sigma * other.unit);
    out->unit_sigma = unit_sigma / out->unit;
    merge(&out->sag, &out->sag_sigma, other.sag, other.sag_sigma);
    return 1;
}

/* Light of every segment with its neighbours' blur taken out, per channel. */
int eye_segment_levels(const eye_upright *u, const eye_scale *scale, int segments,
                       double levels[][3])
{
    enum { MOST = EYE_MOST_SEGMENTS + 2 };
    double matrix[MOST * MOST] = {0}, right[MOST * 3] = {0};
    double guess[PARAMETERS] = {0};
    int n = segments + 2;
    guess[MIDDLE] = scale->middle;
    guess[UNIT] = scale->unit;
    guess[SAG] = scale->sag;
    double half = segments / 2.0, place[MOST];
    for (int k = 0; k <= segments; k++)
        place[k] = row_of(guess, k - half);
    int passed = 0;
    double reach = 5 * scale->blur;
    for (int i = 0; i < u->rows; i++) {
        double upper = u->first + i * u->bin, lower = upper + u->bin;
        if (lower < place[0] - scale->unit || upper > place[segments] + scale->unit)
            continue;
        while (passed <= segments && place[passed] < upper - reach)
            passed++;
        /* Boundary k lies between segments k - 1 and k; 0 is what is above, n - 1 what is below. */
        double share[MOST], before = 1;
        int last = passed;
        for (int k = passed; k <= segments && place[k] < lower + reach; k++) {
            double step = step_at(upper, lower, place[k], scale->blur).step;
            share[k] = before - step;
            before = step;
            last = k + 1;
        }
        share[last] = before;
        for (int a = passed; a <= last; a++) {
            for (int c = 0; c < 3; c++)
                right[a * 3 + c] += share[a] * u->channel[i][c];
            for (int b = passed; b <= a; b++)
                matrix[a * n + b] += share[a] * share[b];
        }
    }
    for (int a = 0; a < n; a++)
        matrix[a * n + a] += 2e-3;
    if (!eye_solve(matrix, right, n, 3))
        return 0;
    for (int i = 0; i < segments; i++)
        memcpy(levels[i], right + (i + 1) * 3, sizeof levels[i]);
    return 1;
}
