/* Slides codes of all sizes along the light of one column: where does one fit?
 *
 * At whole rows first, four places at once, then finer about the best one. */
#include "lanes.h"

#include <string.h>

#define ROUGH_REST 0.24f /* mean square that a code may leave over at whole rows, of bright - dark, */
#define MOST_REST 0.2f  /* and at quarters of a row */
#define LONE 0.75f       /* share of the light that a single bright segment keeps */
#define LEAST_RISE 5.0f  /* grey levels from a fence to the end bar beside it */
#define COARSE 0.33f     /* of a segment, or a row: by so much differ the lengths that are tried first */
#define FINE 0.25f       /* rows by which those differ that are tried in the end, */
#define FINE_LENGTH 0.75f /* up to so many longer or shorter than the best one, */
#define FINE_PLACE 0.5f  /* and so many off its middle */
#define HOPELESS 1e9f    /* the rest of what is no code at all */
#define MOST_PLACES 96
#define FOUR (EYE_BEYOND + 1) /* places that are tried at once */

/* The light of each segment of a code of that place and size, from the running sum over ``rows``;
 * 0 where it goes beyond them. */
static int read_levels(const float *sum, int rows, float top, float unit, int segments,
                       float *level)
{
    float here[EYE_MOST_SEGMENTS + 1];
    if (top < 0 || top + unit * (float)segments >= (float)rows)
        return 0;
    for (int k = 0; k <= segments; k++) {
        float place = top + unit * (float)k;
        int at = (int)place;
        here[k] = sum[at] + (place - (float)at) * (sum[at + 1] - sum[at]);
    }
    for (int k = 0; k < segments; k++)
        level[k] = (here[k + 1] - here[k]) / unit;
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
    for (int k = 0; k < 2; k++)
        rest += (level[k] - bright) * (level[k] - bright);
    for (int k = 2; k < segments - 2; k++) {
        float off = level[k] - dark;
        if (k % 2 == 1 && off > step / 2) {
            /* A lone bright segment loses light to its neighbours: as bright as it gets. */
            out->id |= 1 << (k - 3) / 2;
            off = off > LONE * step ? 0 : off - LONE * step;
        }
        rest += off * off;
    }
    for (int k = segments - 2; k < segments; k++)
        rest += (level[k] - bright) * (level[k] - bright);
    out->contrast = step;
    out->rest = rest / (step * step * (float)segments);
}

/* Four neighbouring rows at once. */
typedef float quad __attribute__((vector_size(FOUR * sizeof(float))));
typedef int32_t quad_mask __attribute__((vector_size(FOUR * sizeof(int32_t))));

static inline quad load(const float *at)
{
    quad four;
    memcpy(&four, at, sizeof four);
    return four;
}

static inline quad square(quad values) { return values * values; }

static inline quad lesser(quad one, quad other)
{
    quad_mask less = one < other;
    return (quad)(((quad_mask)one & less) | ((quad_mask)other & ~less));
}

/* A place of a code: whole rows from where it begins, and a share of the next one. */
typedef struct {
    int row;
    float share;
} place;

static inline place place_at(float rows)
{
    int row = (int)rows;
    return (place){row, rows - (float)row};
}

/* The running sum at a place of codes that begin at four rows: at whole rows, and what is more. */
static inline quad sum_at(const float *sum, place at) { return load(sum + at.row); }

static inline quad more_at(const float *sum, place at)
{
    return at.share * (load(sum + at.row + 1) - load(sum + at.row));
}

/* Leaves the places at which both end bars are brighter than the fences beside them; returns how
 * many there are from ``low`` on. */
static int narrow(const float *sum, float segments, float unit, int *low, int n)
{
    float least = LEAST_RISE * 2 * unit;
    place bar = place_at(2 * unit), fence = place_at(3 * unit);
    place other_fence = place_at((segments - 3) * unit), other_bar = place_at((segments - 2) * unit);
    place end = place_at(segments * unit);
    int first = n, last = 0;
    for (int i = 0; i < n; i += FOUR) {
        const float *from = sum + *low + i;
        quad at = sum_at(from, bar), more = more_at(from, bar);
        quad light = at + more - load(from);
        quad shade = sum_at(from, fence) + more_at(from, fence) - at - more;
        quad_mask out = light - 2 * shade - least < 0;
        if (eye_are_all((eye_lanes)out))
            continue;
        at = sum_at(from, other_bar);
        more = more_at(from, other_bar);
        light = sum_at(from, end) + more_at(from, end) - at - more;
        shade = at + more - sum_at(from, other_fence) - more_at(from, other_fence);
        out |= light - 2 * shade - least < 0;
        int32_t is_out[FOUR];
        memcpy(is_out, &out, sizeof out);
        for (int k = 0; k < FOUR && i + k < n; k++)
            if (!is_out[k]) {
                first = i + k < first ? i + k : first;
                last = i + k + 1;
            }
    }
    *low += first;
    return last - first;
}

/* What `compare` does, for four places at once, of those from ``low`` on. The better one of bright
 * and dark is taken for every bit. */
static void sweep(const float *sum, int bits, float unit, int low, int n, eye_slid *best)
{
    int segments = 2 * bits + 5;
    float scale = 1 / unit;
    place places[EYE_MOST_SEGMENTS];
    for (int k = 0; k < segments; k++)
        places[k] = place_at(unit * (float)(k + 1));
    for (int i = 0; i < n; i += FOUR) {
        const float *from = sum + low + i;
        quad level[EYE_MOST_SEGMENTS], before = load(from), dark = {0}, rest = {0};
        for (int k = 0; k < segments; k++) {
            quad here = sum_at(from, places[k]) + more_at(from, places[k]);
            level[k] = (here - before) * scale;
            before = here;
        }
        quad bright = (level[0] + level[1] + level[segments - 2] + level[segments - 1]) / 4;
        for (int k = 2; k < segments - 2; k += 2)
            dark += level[k] / (float)(bits + 1);
        quad step = bright - dark, lone = LONE * step;
        if (eye_are_all((eye_lanes)(step <= EYE_LEAST_STEP)))
            continue;
        for (int k = 0; k < 2; k++)
            rest += square(level[k] - bright);
        for (int k = 2; k < segments - 3; k += 2) {
            quad off = level[k + 1] - dark, less = lone - off;
            rest += square(level[k] - dark);
            rest += lesser(square(off), square((quad)((quad_mask)less & (less > 0))));
        }
        rest += square(level[segments - 3] - dark);
        for (int k = segments - 2; k < segments; k++)
            rest += square(level[k] - bright);
        quad size = step * step * (float)segments;
        for (int k = 0; k < FOUR && i + k < n; k++)
            if (step[k] > EYE_LEAST_STEP && rest[k] < best->rest * size[k]) {
                best->rest = rest[k] / size[k];
                best->top = (float)(low + i + k);
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
 * 0 where none does. Behind the sum there are EYE_BEYOND more numbers, whatever they are. */
int eye_slide(const float *sum, int rows, int bits, float least, float most, int from, int end,
              eye_slid *best)
{
    float segments = (float)(2 * bits + 5);
    *best = (eye_slid){.rest = ROUGH_REST};
    least = least < EYE_SHORTEST ? EYE_SHORTEST : least;
    for (float unit = least; unit <= most;
         unit += (COARSE * unit > 1 ? COARSE * unit : 1) / segments) {
        float length = segments * unit;
        int low = eye_ceil((float)(end - EYE_BLEEDING) - length), high = from + EYE_BLEEDING;
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
