/* A code's light by row: the model, and the levels of its segments by the same model.
 *
 * Levels of bright and dark, a blurred step at every boundary, boundaries that crowd together
 * towards one end where the camera looks up or down. */
#include "wave.h"

#include <math.h>
#include <string.h>

#define LEAST_LEAK 0.01 /* share of what is beside the strip that is worth the work */
#define SHOWS 5.0        /* times the blur: a boundary does not show farther away */
#define MOST_SHIFT 1.2   /* half codes from the middle: light does not go on changing beyond */
#define SEEN 0.3         /* share of a segment that lies in the picture if it is seen, */
#define SEEN_ROWS 3.0    /* or so many rows */
#define LEVEL_RIDGE 2e-3 /* rows of nothing: hold the levels that no row shows */

/* A step, and how it changes with its place and blur. */
typedef struct {
    double step, by_place, by_blur;
} slope;

/* The boundaries of a code. */
void eye_wave_of(const char *code, int segments, eye_wave *out)
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

/* The row of a boundary ``place`` segments from the middle, growth left out. */
double eye_row_of(const double *guess, double place)
{
    return guess[EYE_MIDDLE] + guess[EYE_UNIT] * place / (1 + guess[EYE_SAG] * place);
}

/* A step at ``place`` as the rows between two borders see it: the mean of the normal distribution's
 * cumulative function over them, and how that changes. ``sharp``: 1 / blur. */
static inline slope step_at(double upper, double lower, double place, double blur, double sharp)
{
    double size = 1 / (lower - upper);
    double z0 = (upper - place) * sharp, z1 = (lower - place) * sharp;
    if (z1 < -SHOWS)
        return (slope){0, 0, 0};
    if (z0 > SHOWS)
        return (slope){1, 0, 0};
    double c0, c1, b0, b1;
    eye_normal(z0, &c0, &b0);
    eye_normal(z1, &c1, &b1);
    return (slope){blur * size * (z1 * c1 + b1 - z0 * c0 - b0), -size * (c1 - c0),
                   size * (b1 - b0)};
}

/* Where the boundaries lie, before the first row. */
void eye_lay_out(const eye_wave *wave, const double *guess, eye_layout *out)
{
    for (int k = 0; k < wave->edges; k++) {
        out->place[k] = eye_row_of(guess, wave->place[k]) - guess[EYE_GROWTH] * wave->sign[k];
        out->squeeze[k] = 1 / (1 + guess[EYE_SAG] * wave->place[k]);
    }
    out->reach = SHOWS * guess[EYE_BLUR];
    out->sharp = 1 / guess[EYE_BLUR];
    out->share = 2 / (guess[EYE_UNIT] * wave->segments);
    out->passed = 0;
}

/* One row of the model: the derivatives by all parameters; returns the light that it predicts. Rows
 * come in order. */
double eye_wave_row(const eye_wave *wave, eye_layout *at, const double *guess, double upper,
                    double lower, double beside, double *row)
{
    int last_edge = wave->edges - 1;
    while (at->passed <= last_edge && at->place[at->passed] < upper - at->reach)
        at->passed++;
    int passed = at->passed;
    /* Signs alternate, the first is 1: what has been passed leaves bright or dark. */
    double bright = passed % 2 && passed <= last_edge ? 1 : 0;
    double first = passed > 0 ? 1 : 0, last = passed > last_edge ? 1 : 0;
    double by_middle = 0, by_unit = 0, by_blur = 0, by_growth = 0, by_sag = 0;
    double off = (upper + lower) / 2 - guess[EYE_MIDDLE];
    double shift = off * at->share;
    shift = eye_limit(shift, -MOST_SHIFT, MOST_SHIFT);
    double light = guess[EYE_BRIGHT] + guess[EYE_BRIGHT_TILT] * shift;
    double shade = guess[EYE_DARK] + guess[EYE_DARK_TILT] * shift;
    int k = passed;
    for (; k <= last_edge && at->place[k] < lower + at->reach; k++) {
        double q = wave->place[k], sign = wave->sign[k];
        slope s = step_at(upper, lower, at->place[k], guess[EYE_BLUR], at->sharp);
        bright += sign * s.step;
        double jump = sign * (light - shade);
        if (k == 0) {
            first = s.step;
            jump = light - guess[EYE_ABOVE];
        } else if (k == last_edge) {
            last = s.step;
            jump = guess[EYE_BELOW] - light;
        }
        double move = jump * s.by_place, moved = move * q * at->squeeze[k];
        by_middle += move;
        by_unit += moved;
        by_sag -= moved * guess[EYE_UNIT] * q * at->squeeze[k];
        by_growth -= move * sign;
        by_blur += jump * s.by_blur;
    }
    at->shows = k - passed;
    double dark = first - last - bright;
    row[EYE_ABOVE] = 1 - first;
    row[EYE_BRIGHT] = bright;
    row[EYE_BRIGHT_TILT] = bright * shift;
    row[EYE_DARK] = dark;
    row[EYE_DARK_TILT] = dark * shift;
    row[EYE_BELOW] = last;
    row[EYE_LEAK] = beside;
    row[EYE_MIDDLE] = by_middle;
    row[EYE_UNIT] = by_unit;
    row[EYE_BLUR] = by_blur;
    row[EYE_GROWTH] = by_growth;
    row[EYE_SAG] = by_sag;
    double sum = 0;
    for (int i = 0; i < EYE_LINEAR; i++)
        sum += row[i] * guess[i];
    return sum;
}

/* Takes what is blurred into the strip from beside it out of its light. */
void eye_take_leak(eye_upright *u, double leak)
{
    float mean[4] = {0}, share = (float)leak;
    if (fabs(leak) < LEAST_LEAK)
        return;
    for (int i = 0; i < u->rows; i++)
        for (int c = 0; c < 4; c++)
            mean[c] += u->beside[i][c] / (float)u->rows;
    for (int i = 0; i < u->rows; i++) {
        for (int c = 0; c < u->channels; c++)
            u->channel[i][c] -= share * (u->beside[i][c] - mean[c]);
        u->light[i] -= share * (u->beside[i][3] - mean[3]);
    }
}

/* Gives segments that are out of the picture the light that they have in the code: those of an end bar
 * that of the bar's other segment, without that the mean of the bright bits; others the mean of all
 * bits, or fences, that are as bright. 0 where both bars are out of it, or all bright bits are. */
static int stand_in(const eye_span *span, const char *code, int segments,
                    double levels[][EYE_LIGHTS])
{
    int seen[EYE_MOST_SEGMENTS];
    for (int i = 0; i < segments; i++)
        seen[i] = i >= span->first && i < span->end;
    double mean[2][EYE_LIGHTS] = {{0}};
    int number[2] = {0}, bars = 0;
    for (int i = 2; i < segments - 2; i++) {
        int bright = code[i] == '1';
        number[bright] += seen[i];
        for (int c = 0; c < EYE_LIGHTS; c++)
            mean[bright][c] += seen[i] ? levels[i][c] : 0;
    }
    if (!number[0] || !number[1])
        return 0;
    for (int c = 0; c < EYE_LIGHTS; c++) {
        mean[0][c] /= number[0];
        mean[1][c] /= number[1];
    }
    for (int i = 2; i < segments - 2; i++)
        if (!seen[i])
            memcpy(levels[i], mean[code[i] == '1'], sizeof *mean);
    for (int bar = 0; bar < 2; bar++) {
        int outer = bar ? segments - 1 : 0, inner = bar ? segments - 2 : 1;
        if (!seen[inner])
            memcpy(levels[inner], seen[outer] ? levels[outer] : mean[1], sizeof *mean);
        if (!seen[outer])
            memcpy(levels[outer], levels[inner], sizeof *mean);
        bars += seen[inner] || seen[outer];
    }
    return bars > 0;
}

/* Light of every segment with its neighbours' blur taken out, of every channel and of the brightness,
 * and which ``seen`` ones that comes from; 0 where it cannot be told. */
int eye_segment_levels(const eye_upright *u, const eye_scale *scale, const char *code,
                       int segments, double levels[][EYE_LIGHTS], eye_span *seen)
{
    enum { MOST = EYE_MOST_SEGMENTS + 2 };
    double matrix[MOST * MOST] = {0}, right[MOST * EYE_LIGHTS] = {0};
    double guess[EYE_PARAMETERS] = {0};
    int n = segments + 2;
    guess[EYE_MIDDLE] = scale->middle;
    guess[EYE_UNIT] = scale->unit;
    guess[EYE_SAG] = scale->sag;
    double half = segments / 2.0, place[MOST];
    for (int k = 0; k <= segments; k++)
        place[k] = eye_row_of(guess, k - half);
    int passed = 0;
    double reach = SHOWS * scale->blur, sharp = 1 / scale->blur;
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
            double step = step_at(upper, lower, place[k], scale->blur, sharp).step;
            share[k] = before - step;
            before = step;
            last = k + 1;
        }
        share[last] = before;
        for (int a = passed; a <= last; a++) {
            double *sums = right + a * EYE_LIGHTS;
            for (int c = 0; c < 3; c++)
                sums[c] += share[a] * u->channel[i][c];
            sums[EYE_LIGHT] += share[a] * u->light[i];
            for (int b = passed; b <= a; b++)
                matrix[b * n + a] += share[a] * share[b];
        }
    }
    for (int a = 0; a < n; a++)
        matrix[a * n + a] += LEVEL_RIDGE;
    if (!eye_solve(matrix, right, n, EYE_LIGHTS))
        return 0;
    double begin = u->first, end = u->first + u->rows * u->bin;
    *seen = (eye_span){segments, 0};
    for (int i = 0; i < segments; i++) {
        double length = place[i + 1] - place[i];
        memcpy(levels[i], right + (i + 1) * EYE_LIGHTS, sizeof levels[i]);
        if (fmin(place[i + 1], end) - fmax(place[i], begin) < fmin(SEEN * length, SEEN_ROWS))
            continue;
        seen->first = i < seen->first ? i : seen->first;
        seen->end = i + 1;
    }
    return stand_in(seen, code, segments, levels);
}
