/* Far codes: their segments are so short that runs cannot be told apart. Where a column has colour
 * for a short stretch, all places and sizes of a code are tried on it.
 *
 * Colour ignores walls and floors. JPEG and cheap sensors blur it over several rows: what is left
 * of it says where to look, and the brightness, which they keep sharp, is read. */
#include "search.h"

#include <math.h>

#define LONGEST 72         /* rows of a far code */
#define GAP 22             /* rows without colour that a stretch may have */
#define LEAST_SEGMENTS 9   /* rows of colour at least, in the shortest segments */
#define BESIDE 4           /* rows above and below a stretch that take part */
#define APART 4            /* columns from the strip's middle to what is beside it, */
#define LEAK 0.4f          /* of which so much is blurred into it */
#define NEAR 3.3f          /* rows per segment from which on runs tell, */
#define SHARP 5.5f         /* and from which on blurred colour does */
#define ABOUT 3            /* segments about a near code whose colour is its own */
#define FRAYED 11          /* rows by which a code may be shorter than its stretch of colour, */
#define HIDDEN 2           /* and by which it may be longer */
#define ROWS_APART 3       /* every third row is asked for faint colour */
#define FAINT_GAP (GAP / ROWS_APART * ROWS_APART)
#define LEAST_DEPTH 9.0f   /* grey levels of a valley */
#define ASIDE 5            /* columns from a far landmark's middle, blurred colour included, to either side */
#define MOST_ASIDE 4       /* one row of so many may have colour there */
#define MOST_SUMS (3 * LONGEST + 32)

/* Puts something behind a running sum: whoever takes four of its numbers at once finds it. */
static void end_sum(float *last)
{
    for (int i = 1; i <= EYE_BEYOND; i++)
        last[i] = *last;
}

/* The running sum of the brightness of three columns, grey levels of one. What is beside them is in
 * part blurred into them: that part of a wall's or floor's pattern is taken off again. */
static void sum_brightness(const eye_hits *hits, int x, int from, int to, float *sum)
{
    enum { COLUMNS = 5 }; /* three, and one on either side */
    static const int beside[COLUMNS] = {-1, 0, 1, -APART, APART};
    const eye_picture *p = hits->picture;
    ptrdiff_t at[COLUMNS];
    for (int k = 0; k < COLUMNS; k++)
        at[k] = 3 * (ptrdiff_t)eye_clamp(x + beside[k], 0, p->columns - 1);
    sum[0] = 0;
    for (int y = from; y < to; y++) {
        const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride;
        int light[COLUMNS];
        for (int k = 0; k < COLUMNS; k++)
            light[k] = eye_brightness(row + at[k], 3, hits->task);
        sum[y - from + 1] = sum[y - from] + (float)(light[0] + light[1] + light[2]) / 48 -
                            LEAK * (float)(light[3] + light[4]) / 32;
    }
    end_sum(sum + (to - from));
}

/* The running sum of the signal of one column. */
static void sum_signal(const uint8_t *signal, int from, int to, float *sum)
{
    sum[0] = 0;
    for (int y = from; y < to; y++)
        sum[y - from + 1] = sum[y - from] + (float)signal[y];
    end_sum(sum + (to - from));
}

/* Whether the light has two valleys, as every code does. */
static int has_valleys(const float *sum, int rows)
{
    float top = sum[1] - sum[0], low = top;
    int valleys = 0, falling = 0;
    for (int i = 1; i < rows && valleys < 2; i++) {
        float light = sum[i + 1] - sum[i];
        if (falling && light - low > LEAST_DEPTH) {
            valleys++;
            falling = 0;
            top = light;
        } else if (!falling && top - light > LEAST_DEPTH) {
            falling = 1;
            low = light;
        }
        top = light > top ? light : top;
        low = light < low ? light : low;
    }
    return valleys == 2;
}

/* Tries all places and sizes of a code on the running sum from row ``top`` to ``bottom`` of a
 * column, of which those from ``from`` to ``end`` have colour; returns how many codes were found. */
static int match_stretch(eye_hits *hits, const float *sum, int top, int bottom, int from, int end,
                         int longest, int x)
{
    int found = 0;
    for (int b = 0; b < hits->n_bits && hits->n_hits < EYE_MOST_HITS; b++) {
        int bits = hits->bits[b];
        float segments = (float)(2 * bits + 5);
        float least = (float)(end - from + 1 - FRAYED) / segments, most = (float)longest / segments;
        eye_slid best;
        if (!eye_slide(sum, bottom - top, bits, least, most > SHARP ? SHARP : most, from - top,
                       end - top, &best))
            continue;
        float begin = best.top + 2 * best.unit + (float)top - 0.5f;
        hits->hits[hits->n_hits++] = (eye_hit){
            .column = (float)x,
            .top = begin,
            .bottom = begin + (segments - 4) * best.unit,
            .bits = (int16_t)bits,
            .id = (int16_t)best.id,
            .contrast = (uint8_t)eye_limit(best.contrast, 0, 255),
        };
        found++;
    }
    return found;
}

/* Whether a near code that the runs have shown covers the stretch. */
static int is_known(const eye_hits *hits, int known, int x, int from, int end)
{
    for (const eye_hit *h = hits->hits + known; h < hits->hits + hits->n_hits; h++) {
        float unit = (h->bottom - h->top) / (float)(2 * h->bits + 1);
        if (unit > NEAR && !h->cut && fabsf(h->column - (float)x) < ABOUT * unit &&
            (float)from > h->top - ABOUT * unit && (float)end < h->bottom + ABOUT * unit)
            return 1;
    }
    return 0;
}

/* How many rows between two have at least faint colour, of those asked. */
static int count_faint(const eye_hits *hits, int x, int from, int end, int apart)
{
    const eye_picture *p = hits->picture;
    const uint8_t *column = p->pixels + (ptrdiff_t)p->channels * x;
    int count = 0;
    for (int y = from; y <= end; y += apart)
        count += eye_colour(column + y * p->stride, hits->task) > EYE_FAINT;
    return count;
}

/* Notes a stretch of colour in column ``x`` in which no code was found, if it is as high and as narrow as a
 * far one, has end bars, and its light (a running sum over ``height`` rows) valleys: as a candidate without a
 * code, as whole codes may be weighed there. */
static void note_stretch(eye_hits *hits, int x, int from, int end, const float *sum, int height)
{
    int rows = end - from + 1, asked = (rows + ROWS_APART - 1) / ROWS_APART;
    if (x < ASIDE || x + ASIDE >= hits->picture->columns)
        return;
    for (int b = 0; b < hits->n_bits && hits->n_hits < EYE_MOST_HITS; b++) {
        float unit = (float)rows / (float)(2 * hits->bits[b] + 5);
        int bar = (int)(2 * unit);
        if (unit < EYE_SHORTEST || unit >= (float)EYE_FEW_ROWS ||
            count_faint(hits, x, from, from + bar - 1, 1) < bar ||
            count_faint(hits, x, end - bar + 1, end, 1) < bar ||
            MOST_ASIDE * count_faint(hits, x - ASIDE, from, end, ROWS_APART) > asked ||
            MOST_ASIDE * count_faint(hits, x + ASIDE, from, end, ROWS_APART) > asked ||
            !has_valleys(sum, height))
            continue;
        hits->hits[hits->n_hits++] = (eye_hit){
            .column = (float)x,
            .top = (float)from - 0.5f + 2 * unit,
            .bottom = (float)end + 0.5f - 2 * unit,
            .bits = (int16_t)hits->bits[b],
        };
    }
}

static int peak_of(const uint8_t *signal, int from, int end)
{
    uint8_t peak = 0; /* a byte: many at a time */
    for (int y = from; y <= end; y++)
        peak = signal[y] > peak ? signal[y] : peak;
    return peak;
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
        int from = y, end = eye_end_of_stretch(signal, from, last, EYE_LEAST_STEP, GAP);
        y = end + GAP + 1;
        int height = end - from + 1;
        if (from > last || height > LONGEST || (float)height < LEAST_SEGMENTS * EYE_SHORTEST ||
            peak_of(signal, from, end) < 2 * EYE_LEAST_STEP || is_known(hits, known, x, from, end))
            continue;
        int top = from < BESIDE ? 0 : from - BESIDE;
        int bottom = end + BESIDE + 1 < rows ? end + BESIDE + 1 : rows;
        sum_signal(signal, top, bottom, sum);
        int found = match_stretch(hits, sum, top, bottom, from, end, height + HIDDEN, x);
        sum_brightness(hits, x, top, bottom, sum);
        found += match_stretch(hits, sum, top, bottom, from, end, height + HIDDEN, x);
        if (!found)
            note_stretch(hits, x, from, end, sum, bottom - top);
    }
}

/* Of a column and those beside it the one with most colour between two rows: only every second one was
 * asked, and a mosaic may leave a thin strip's colour in a single column. */
static int most_coloured(const eye_hits *hits, int x, int top, int bottom)
{
    const eye_picture *p = hits->picture;
    int most = -1, best = x;
    for (int k = eye_clamp(x - 1, 0, p->columns - 1); k <= x + 1 && k < p->columns; k++) {
        int sum = 0;
        for (int y = top; y < bottom; y += ROWS_APART) {
            int colour = eye_colour(p->pixels + y * p->stride + (ptrdiff_t)p->channels * k, hits->task);
            sum += colour > 0 ? colour : 0;
        }
        if (sum > most) {
            most = sum;
            best = k;
        }
    }
    return best;
}

/* As `eye_end_of_stretch`, of the rows with at least faint colour, of those that are asked. */
static int end_of_faint(const eye_hits *hits, const uint8_t *column, int from)
{
    const eye_picture *p = hits->picture;
    int end = from;
    for (int y = from + FAINT_GAP; y > end; y -= ROWS_APART)
        if (y < p->rows && eye_colour(column + y * p->stride, hits->task) > EYE_FAINT) {
            end = y;
            y = end + FAINT_GAP + ROWS_APART;
        }
    return end;
}

/* What `note_stretch` does, of all that has at least faint colour between two rows. */
static void note_faint_stretch(eye_hits *hits, int x, int top, int bottom, const float *sum)
{
    const eye_picture *p = hits->picture;
    const uint8_t *column = p->pixels + (ptrdiff_t)p->channels * x;
    int rows = bottom - top;
    while (top < bottom && eye_colour(column + top * p->stride, hits->task) <= EYE_FAINT)
        top++;
    while (bottom > top && eye_colour(column + (bottom - 1) * p->stride, hits->task) <= EYE_FAINT)
        bottom--;
    if (bottom > top)
        note_stretch(hits, x, top, bottom - 1, sum, rows);
}

/* Codes in column ``x`` that have hardly any colour left, somewhere: by their brightness. That takes
 * long, so it ends when a picture speckled with colour has used up what a landmark may cost. */
void eye_match_faint(eye_hits *hits, int x)
{
    const eye_picture *p = hits->picture;
    const uint8_t *column = p->pixels + (ptrdiff_t)p->channels * x;
    float sum[MOST_SUMS];
    int y = 0;
    while (y < p->rows && hits->slides > 0) {
        while (y < p->rows && eye_colour(column + y * p->stride, hits->task) <= EYE_FAINT)
            y += ROWS_APART;
        int from = y, end = end_of_faint(hits, column, from);
        y = end + FAINT_GAP + ROWS_APART;
        int height = end - from + 1;
        if (end == from || from >= p->rows || height > LONGEST || is_known(hits, 0, x, from, end))
            continue;
        int room = LONGEST - height + BESIDE;
        int top = from < room ? 0 : from - room;
        int bottom = end + room + 1 < p->rows ? end + room + 1 : p->rows;
        int best = most_coloured(hits, x, top, bottom);
        sum_brightness(hits, best, top, bottom, sum);
        int valleys = has_valleys(sum, bottom - top);
        hits->slides -= valleys ? hits->n_bits : 0;
        if (valleys && !match_stretch(hits, sum, top, bottom, from, end, LONGEST, x))
            note_faint_stretch(hits, best, top, bottom, sum);
    }
}
