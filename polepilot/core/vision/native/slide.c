/* Slides codes of all sizes along the light of one column: where does one fit?
 *
 * At whole rows first, many places at once, then finer about the best one. */
#include "search.h"

#include <math.h>

#define ROUGH_REST 0.18f /* mean square that a code may leave over at whole rows, of bright - dark, */
#define MOST_REST 0.12f  /* and at quarters of a row */
#define LONE 0.75f       /* share of the light that a single bright segment keeps */
#define LEAST_RISE 5.0f  /* grey levels from a fence to the end bar beside it */
#define COARSE 0.33f     /* of a segment, or a row: by so much differ the lengths that are tried first */
#define FINE 0.25f       /* rows by which those differ that are tried in the end, */
#define FINE_LENGTH 0.75f /* up to so many longer or shorter than the best one, */
#define FINE_PLACE 0.5f  /* and so many off its middle */
#define HOPELESS 1e9f    /* the rest of what is no code at all */
#define MOST_PLACES 96

/* The light of each segment of a code of that place and size, from the running sum over ``rows``;
 * 0 where it goes beyond them. */
static int read_levels(const float *sum, int rows, float top, float unit, int segments,
                       float *level)
{
    float before = 0;
    for (int k = 0; k <= segments; k++) {
        float place = top + unit * (float)k;
        if (place < 0 || place >= (float)rows)
            return 0;
        int at = (int)place;
        float here = sum[at] + (place - (float)at) * (sum[at + 1] - sum[at]);
        if (k > 0)
            level[k - 1] = (here - before) / unit;
        before = here;
    }
    return 1;
}

/* How badly the light fits any code of that place and size: fills in all but these two. */
static void compare(const float *sum, int rows, int bits, eye_slid *out)
{
    int segments = 2 * bits + 5;
    float level[EYE_MOST_SEGMENTS];
    out->rest = HOPELESS;
    if (!read_levels(sum, rows, out->top, out->unit, segments, level))
        return;
    float bright = (level[0] + level[1] + level[segments - 2] + level[segments - 1]) / 4;
    float dark = 0;
    for (int k = 2; k < segments - 2; k += 2)
        dark += level[k];
    dark /= (float)(bits + 1);
    float step = bright - dark, rest = 0;
    if (step < EYE_LEAST_STEP)
        return;
    out->id = 0;
    for (int k = 0; k < segments; k++) {
        int bar = k < 2 || k >= segments - 2, bit = !bar && k % 2 == 1;
        float off = level[k] - (bar ? bright : dark);
        if (bit && off > step / 2) {
            /* A lone bright segment loses light to its neighbours: as bright as it gets. */
            out->id |= 1 << (k - 3) / 2;
            off = off > LONE * step ? 0 : off - LONE * step;
        }
        rest += off * off;
    }
    out->contrast = step;
    out->rest = rest / (step * step * (float)segments);
}

/* Light between two places of a code, summed up, for codes that begin at row ``low`` and the n - 1
 * rows after it. */
static void span(const float *sum, int low, int n, float from, float to, float *out)
{
    int first = (int)from, last = (int)to;
    float share = from - (float)first, rest = to - (float)last;
    const float *a = sum + low + first, *b = sum + low + last;
    for (int i = 0; i < n; i++)
        out[i] = b[i] + rest * (b[i + 1] - b[i]) - a[i] - share * (a[i + 1] - a[i]);
}

/* Leaves the places at which both end bars are brighter than the fences beside them; returns how
 * many there are from ``low`` on. */
static int narrow(const float *sum, float segments, float unit, int *low, int n)
{
    float bar[MOST_PLACES], fence[MOST_PLACES], upper[MOST_PLACES], lower[MOST_PLACES];
    float least = LEAST_RISE * 2 * unit;
    span(sum, *low, n, 0, 2 * unit, bar);
    span(sum, *low, n, 2 * unit, 3 * unit, fence);
    for (int i = 0; i < n; i++)
        upper[i] = bar[i] - 2 * fence[i] - least;
    int first = 0, last = n;
    while (first < n && upper[first] < 0)
        first++;
    if (first == n)
        return 0;
    span(sum, *low, n, (segments - 2) * unit, segments * unit, bar);
    span(sum, *low, n, (segments - 3) * unit, (segments - 2) * unit, fence);
    for (int i = 0; i < n; i++) {
        float other = bar[i] - 2 * fence[i] - least;
        lower[i] = other < upper[i] ? other : upper[i];
    }
    while (first < n && lower[first] < 0)
        first++;
    while (last > first && lower[last - 1] < 0)
        last--;
    *low += first;
    return last - first;
}

/* What `compare` does, for many places at once: the rows from ``low`` on, in loops that a compiler
 * makes vectors of. The better one of bright and dark is taken for every bit. */
static void sweep(const float *sum, int bits, float unit, int low, int n, eye_slid *best)
{
    int segments = 2 * bits + 5;
    float before[MOST_PLACES], level[EYE_MOST_SEGMENTS][MOST_PLACES];
    float bright[MOST_PLACES], dark[MOST_PLACES], rest[MOST_PLACES], scale = 1 / unit;
    for (int i = 0; i < n; i++)
        before[i] = sum[low + i];
    for (int k = 0; k < segments; k++) {
        float place = unit * (float)(k + 1);
        int at = (int)place;
        float share = place - (float)at;
        const float *from = sum + low + at;
        for (int i = 0; i < n; i++) {
            float here = from[i] + share * (from[i + 1] - from[i]);
            level[k][i] = (here - before[i]) * scale;
            before[i] = here;
        }
    }
    for (int i = 0; i < n; i++) {
        bright[i] = (level[0][i] + level[1][i] + level[segments - 2][i] + level[segments - 1][i]) / 4;
        dark[i] = rest[i] = 0;
    }
    for (int k = 2; k < segments - 2; k += 2)
        for (int i = 0; i < n; i++)
            dark[i] += level[k][i] / (float)(bits + 1);
    for (int k = 0; k < segments; k++) {
        int bar = k < 2 || k >= segments - 2;
        if (bar || k % 2 == 0) {
            const float *wanted = bar ? bright : dark;
            for (int i = 0; i < n; i++) {
                float off = level[k][i] - wanted[i];
                rest[i] += off * off;
            }
            continue;
        }
        for (int i = 0; i < n; i++) {
            float off = level[k][i] - dark[i], less = LONE * (bright[i] - dark[i]) - off;
            less = (less + fabsf(less)) / 2;
            off *= off;
            less *= less;
            rest[i] += off < less ? off : less;
        }
    }
    for (int i = 0; i < n; i++) {
        float step = bright[i] - dark[i], size = step * step * (float)segments;
        if (step > EYE_LEAST_STEP && rest[i] < best->rest * size) {
            best->rest = rest[i] / size;
            best->top = (float)(low + i);
            best->unit = unit;
        }
    }
}

/* Tries codes about the best one, by fractions of a row. */
static void refine(const float *sum, int rows, int bits, eye_slid *best)
{
    float segments = (float)(2 * bits + 5), apart = FINE_LENGTH / segments, unit = best->unit;
    float middle = best->top + unit * segments / 2;
    best->rest = HOPELESS; /* only what has been compared has an id */
    for (float size = unit - apart; size <= unit + apart; size += FINE / segments) {
        for (float off = -FINE_PLACE; off <= FINE_PLACE; off += FINE) {
            eye_slid one = {.top = middle + off - size * segments / 2, .unit = size};
            compare(sum, rows, bits, &one);
            if (one.rest < best->rest)
                *best = one;
        }
    }
}

/* The code that fits best to a column's light (its running sum over ``rows``), of ``least`` to
 * ``most`` rows per segment, that covers the rows from ``from`` to ``end`` but for EYE_BLEEDING;
 * 0 where none does. */
int eye_slide(const float *sum, int rows, int bits, float least, float most, int from, int end,
              eye_slid *best)
{
    float segments = (float)(2 * bits + 5);
    *best = (eye_slid){.rest = ROUGH_REST};
    least = least < EYE_SHORTEST ? EYE_SHORTEST : least;
    for (float unit = least; unit <= most; unit += fmaxf(1, COARSE * unit) / segments) {
        float length = segments * unit;
        int low = (int)ceilf((float)(end - EYE_BLEEDING) - length), high = from + EYE_BLEEDING;
        low = low < 0 ? 0 : low;
        high = high > rows - 2 - (int)length ? rows - 2 - (int)length : high;
        int n = high - low + 1;
        if (n > 0)
            n = narrow(sum, segments, unit, &low, n > MOST_PLACES ? MOST_PLACES : n);
        if (n > 0)
            sweep(sum, bits, unit, low, n, best);
    }
    if (best->rest >= ROUGH_REST)
        return 0;
    refine(sum, rows, bits, best);
    return best->rest < MOST_REST && best->id != 0;
}
