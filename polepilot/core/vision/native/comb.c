/* Far codes: their segments are so short that runs cannot be told apart. Where a column has colour
 * for a short stretch, all places and sizes of a code are tried on it. */
#include "search.h"

#define STRETCH 46         /* rows of colour at most */
#define GAP 22             /* rows without colour that a stretch may have */
#define LEAST_SEGMENTS 9   /* rows of colour at least, in the shortest segments */
#define BESIDE 4           /* rows above and below a stretch that take part */
#define APART 4            /* columns from the strip's middle to what is beside it, */
#define LEAK 0.4f          /* of which so much is blurred into it */
#define NEAR 3.3f          /* rows per segment from which on colour parts the segments well */
#define ROUGH_REST 0.15f   /* mean square that a code may leave over at whole pixels, of bright - dark, */
#define MOST_REST 0.06f    /* and at fractions of a pixel */
#define MOST_SUMS (STRETCH + 2 * BESIDE + 1)
#define HOPELESS 1e9f      /* the rest of what is no code at all */
#define LONE 0.75f         /* share of the light that a single bright segment keeps */

/* A place and size of a code, and how well it fits. */
typedef struct {
    float rest, top, unit, contrast;
    int id;
} fit;

/* The running sum of the brightness of three columns, grey levels of one. What is beside them is in
 * part blurred into them: that part of a wall's or floor's pattern is taken off again. */
static void sum_brightness(const eye_hits *hits, int x, int from, int to, float *sum)
{
    const eye_picture *p = hits->picture;
    int n = p->channels, last = p->columns - 1;
    sum[0] = 0;
    for (int y = from; y < to; y++) {
        const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride;
        int total = 0, beside = 0;
        for (int side = -1; side <= 1; side++)
            total += eye_brightness(row + eye_clamp(x + side, 0, last) * n, n, hits->task);
        for (int side = -APART; side <= APART; side += 2 * APART)
            beside += eye_brightness(row + eye_clamp(x + side, 0, last) * n, n, hits->task);
        sum[y - from + 1] = sum[y - from] + (float)total / 48 - LEAK * (float)beside / 32;
    }
}

/* The running sum of the signal of one column. */
static void sum_signal(const uint8_t *signal, int from, int to, float *sum)
{
    sum[0] = 0;
    for (int y = from; y < to; y++)
        sum[y - from + 1] = sum[y - from] + (float)signal[y];
}

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
static void comb(const float *sum, int rows, int bits, fit *out)
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

/* Tries codes with ``least`` to ``most`` rows per segment whose middle is within ``reach``. */
static void try_codes(const float *sum, int rows, int bits, float middle, float reach, float least,
                      float most, float fineness, fit *best)
{
    float segments = (float)(2 * bits + 5);
    for (float unit = least; unit <= most; unit += fineness / segments) {
        for (float off = -reach; off <= reach; off += fineness) {
            fit one = {.top = middle + off - unit * segments / 2, .unit = unit};
            comb(sum, rows, bits, &one);
            if (one.rest < best->rest)
                *best = one;
        }
    }
}

/* Tries all places and sizes of a code on the rows from ``top`` to ``bottom`` of one column, of
 * which ``height`` from ``from`` on have colour; returns how many codes were found. */
static int match_stretch(eye_hits *hits, const float *sum, int top, int bottom, int from,
                         int height, int x)
{
    int found = 0;
    for (int b = 0; b < hits->n_bits && hits->n_hits < EYE_MOST_HITS; b++) {
        int bits = hits->bits[b];
        float segments = (float)(2 * bits + 5), middle = (float)(from - top) + (float)height / 2;
        float least = ((float)height - 8) / segments, most = ((float)height + 2) / segments;
        fit best = {.rest = ROUGH_REST};
        least = least < EYE_SHORTEST ? EYE_SHORTEST : least;
        try_codes(sum, bottom - top, bits, middle, 1.5f + 0.3f * most, least, most, 1.0f, &best);
        if (best.rest >= ROUGH_REST)
            continue;
        middle = best.top + best.unit * segments / 2;
        float apart = 0.75f / segments;
        try_codes(sum, bottom - top, bits, middle, 0.5f, best.unit - apart, best.unit + apart,
                  0.25f, &best);
        if (best.rest >= MOST_REST || best.id == 0)
            continue;
        float begin = best.top + 2 * best.unit + (float)top - 0.5f;
        hits->hits[hits->n_hits++] = (eye_hit){
            .column = (float)x,
            .top = begin,
            .bottom = begin + (segments - 4) * best.unit,
            .bits = (int16_t)bits,
            .id = (int16_t)best.id,
            .contrast = (uint8_t)best.contrast,
        };
        found++;
    }
    return found;
}

/* Whether a near code that the runs have shown covers the stretch. */
static int is_known(const eye_hits *hits, int known, int from, int end)
{
    for (const eye_hit *h = hits->hits + known; h < hits->hits + hits->n_hits; h++) {
        float unit = (h->bottom - h->top) / (float)(2 * h->bits + 1);
        if (unit > NEAR && (float)from > h->top - 3 * unit && (float)end < h->bottom + 3 * unit)
            return 1;
    }
    return 0;
}

/* Codes in column ``x``, whose signal between the rows ``first`` and ``last`` is given. The hits
 * from ``known`` on are those of its runs. */
void eye_match_comb(eye_hits *hits, const uint8_t *signal, int first, int last, int x, int known)
{
    float sum[MOST_SUMS];
    int y = first, rows = hits->picture->rows;
    while (y <= last) {
        while (y <= last && signal[y] < EYE_LEAST_STEP)
            y++;
        int from = y, end = y, peak = 0;
        for (; y <= last && y - end <= GAP; y++)
            if (signal[y] >= EYE_LEAST_STEP) {
                end = y;
                peak = signal[y] > peak ? signal[y] : peak;
            }
        int height = end - from + 1;
        if (from > last || height > STRETCH || (float)height < LEAST_SEGMENTS * EYE_SHORTEST ||
            peak < 2 * EYE_LEAST_STEP || is_known(hits, known, from, end))
            continue;
        int top = from < BESIDE ? 0 : from - BESIDE;
        int bottom = end + BESIDE + 1 < rows ? end + BESIDE + 1 : rows;
        /* Colour ignores walls and floors; brightness is sharper in pictures that were JPEG. */
        sum_signal(signal, top, bottom, sum);
        if (match_stretch(hits, sum, top, bottom, from, height, x))
            continue;
        sum_brightness(hits, x, top, bottom, sum);
        match_stretch(hits, sum, top, bottom, from, height, x);
    }
}
