/* Where landmarks may be: columns in which bright and dark runs have the proportions of a code.
 *
 * The inner part of a code, from the end of the upper end bar to the begin of the lower one, begins
 * and ends dark and holds bright runs one segment long at odd places. It is looked for by itself:
 * what the end bars touch may be as bright as they are. */
#include "lanes.h"

#include <stdlib.h>
#include <string.h>

#define ROWS_APART 3     /* every third row is asked for colour: the farthest end bar is as high */
#define LINE 64          /* bytes of a cache line */
#define LEAST_PEAK 30    /* grey levels of colour, somewhere in a column that is looked at */
#define LIGHT_APART (2 * EYE_APART) /* columns from one that is also read by brightness to the next */
#define MOST_COLOUR 0.5f /* share of a column's coloured rows that a code by itself explains */
#define LEAST_COLOURED 2 /* rows with colour, of those asked, in a column that is looked at */

/* Which part of a column has the paint's colour at all, by the rows that were asked. */
typedef struct {
    int first, last, count; /* rows, both included; how many have it */
    int strong;             /* whether any has much */
    int faint;              /* rows that have at least a little */
} extent;

/* Notes what colour a row has in the columns from ``from`` to ``to`` of the survey. */
static inline void note_colour(const uint8_t *row, const eye_task *task, int y, int from, int to,
                               extent *extents)
{
    for (int c = from; c < to; c++) {
        int colour = eye_colour(row + 3 * EYE_APART * c, task);
        if (colour <= EYE_FAINT)
            continue;
        extent *e = extents + c;
        e->faint++;
        if (colour <= 4 * EYE_FAINTEST)
            continue;
        e->first = y < e->first ? y : e->first;
        e->last = y;
        e->count++;
        e->strong |= colour > 4 * LEAST_PEAK;
    }
}

/* Asks every third row of every second column whether it has colour. */
static void survey(const eye_picture *p, const eye_task *task, extent *extents)
{
    int columns = (p->columns + EYE_APART - 1) / EYE_APART;
    int coloured = eye_is_coloured(p->channels, task);
    extent whole = {0, p->rows - 1, p->rows, 1, 0}, none = {p->rows, -1, 0, 0, 0};
    for (int c = 0; c < columns; c++)
        extents[c] = coloured ? none : whole;
    for (int y = 0; coloured && y < p->rows; y += ROWS_APART) {
        const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride;
        ptrdiff_t ahead = y + ROWS_APART < p->rows ? ROWS_APART * p->stride : 0;
        int c = 0;
        for (; 3 * (p->columns - EYE_APART * c) >= EYE_SPAN; c += EYE_LANES) {
            const uint8_t *at = row + 3 * EYE_APART * c;
            /* Hardware foresees the next cache line, not the next third row. */
            __builtin_prefetch(at + ahead);
            __builtin_prefetch(at + ahead + LINE);
            eye_lanes high = eye_gather_lanes(at + task->high);
            eye_lanes low = eye_gather_lanes(at + task->low);
            if (!eye_are_all(eye_lanes_without(high, low, EYE_FAINT))) /* seldom */
                note_colour(row, task, y, c, c + EYE_LANES, extents);
        }
        note_colour(row, task, y, c, columns, extents);
    }
}

/* ``eye_signal`` of pixels in the colour of which there is enough. */
static inline eye_lanes signal_of(const eye_lanes *channels, const eye_task *task)
{
    eye_lanes out = {0};
    for (int odd = 0; odd < 2; odd++) {
        eye_words light = {0}, high = eye_half_of(channels[task->high], odd);
        for (int c = 0; c < 3; c++)
            light += (uint16_t)task->weights[c] * eye_half_of(channels[c], odd);
        eye_words colour = (6 * high - 7 * eye_half_of(channels[task->low], odd)) >> 2;
        eye_signs value = (eye_signs)(3 * (light >> 4) >> 5);
        value = eye_lesser(value, (eye_signs)colour) - EYE_FAINTEST;
        value = eye_lesser(value & (value > 0), (eye_signs){0} + 255);
        out |= (eye_lanes)((eye_words)value << 8 * odd);
    }
    return out;
}

/* Bytes from one column of signal to the next: some rows beyond the last one may be written. */
static ptrdiff_t column_room(const eye_picture *p) { return (ptrdiff_t)p->rows + EYE_TURNED; }

/* What `fill` does, for EYE_LANES columns of a picture with colour, and for paint that has some. */
static void fill_lanes(const eye_picture *p, const eye_task *task, int first, int top, int bottom,
                       uint8_t *signal)
{
    for (int y = top; y <= bottom; y += EYE_TURNED) {
        eye_lanes rows[EYE_TURNED] = {{0}};
        int coloured = 0;
        for (int k = 0; k < EYE_TURNED && y + k <= bottom; k++) {
            const uint8_t *at =
                p->pixels + (ptrdiff_t)(y + k) * p->stride + (ptrdiff_t)first * EYE_APART * 3;
            /* As in `survey`: two rows of three have not been read yet. */
            ptrdiff_t ahead = y + k + EYE_TURNED <= bottom ? EYE_TURNED * p->stride : 0;
            __builtin_prefetch(at + ahead);
            __builtin_prefetch(at + ahead + LINE);
            eye_lanes channels[3];
            for (int c = 0; c < 3; c++)
                channels[c] = eye_gather_lanes(at + c);
            eye_lanes without =
                eye_lanes_without(channels[task->high], channels[task->low], 4 * EYE_FAINTEST);
            if (eye_are_all(without))
                continue;
            rows[k] = signal_of(channels, task) & ~without;
            coloured = 1;
        }
        if (coloured)
            eye_store_turned(rows, signal + y, column_room(p));
    }
}

/* The signal of some neighbouring columns of the survey, one after the other; nothing above the row
 * ``top`` and below ``bottom``. */
static void fill(const eye_picture *p, const eye_task *task, int first, int count, int top,
                 int bottom, uint8_t *signal)
{
    int n = p->channels, coloured = eye_is_coloured(n, task);
    memset(signal, 0, (size_t)column_room(p) * EYE_LANES);
    if (coloured && 3 * (p->columns - EYE_APART * first) >= EYE_SPAN) {
        fill_lanes(p, task, first, top, bottom, signal);
        return;
    }
    for (int y = top; y <= bottom; y++) {
        const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride + (ptrdiff_t)first * EYE_APART * n;
        for (int c = 0; c < count; c++) {
            const uint8_t *pixel = row + EYE_APART * n * c;
            if (!coloured || eye_colour(pixel, task) > 4 * EYE_FAINTEST)
                signal[c * column_room(p) + y] = (uint8_t)eye_signal(pixel, n, task);
        }
    }
}

/* The brightness of a column from the first row with colour to the last one. What has no colour, as
 * black has none, is no brighter than what is between it and colour. */
static void fill_light(const eye_hits *hits, const uint8_t *signal, int first, int last, int x,
                       uint8_t *restrict light)
{
    const eye_picture *p = hits->picture;
    memset(light, 0, (size_t)p->rows);
    while (first <= last && signal[first] == 0)
        first++;
    while (last > first && signal[last] == 0)
        last--;
    if (first > last)
        return;
    int begin = first > EYE_BLEEDING ? first - EYE_BLEEDING : 0;
    int end = last + EYE_BLEEDING + 1 < p->rows ? last + EYE_BLEEDING + 1 : p->rows;
    const uint8_t *pixel = p->pixels + begin * p->stride + (ptrdiff_t)p->channels * x;
    for (int y = begin; y < end; y++, pixel += p->stride)
        light[y] = (uint8_t)(eye_brightness(pixel, p->channels, hits->task) >> 4);
    while ((first = eye_end_of_stretch(signal, first, last, 1, 2 * EYE_BLEEDING + 1)) < last) {
        int from = first + EYE_BLEEDING + 1;
        while (signal[++first] == 0)
            ;
        int to = first - EYE_BLEEDING;
        uint8_t most = light[from - 1] < light[to] ? light[from - 1] : light[to];
        for (int k = from; k < to; k++)
            light[k] = light[k] < most ? light[k] : most;
    }
}

/* Near codes among the runs of a column, with and without noise. */
static void match(eye_hits *hits, const uint8_t *signal, int x)
{
    eye_run runs[EYE_MOST_RUNS], smooth[EYE_MOST_RUNS];
    int n = eye_find_runs(signal, hits->picture->rows, runs);
    if (n >= EYE_LEAST_RUNS) {
        eye_match_runs(hits, runs, n, (float)x);
        int left = eye_smooth_runs(runs, n, smooth);
        if (left < n && left >= EYE_LEAST_RUNS)
            eye_match_runs(hits, smooth, left, (float)x);
    }
}

/* Whether one of the codes from ``known`` on explains most of the colour between two rows. */
static int explains(const eye_hits *hits, int known, int first, int last)
{
    for (const eye_hit *h = hits->hits + known; h < hits->hits + hits->n_hits; h++)
        if (h->bottom - h->top > MOST_COLOUR * (float)(last - first))
            return 1;
    return 0;
}

/* Codes in one column: near ones among the runs of its colour, and in some columns (LIGHT_APART) of
 * its brightness where that does not explain most of it, as JPEG and cheap sensors leave brightness
 * sharper; far ones. ``light``: room for a column. */
static void look_at(eye_hits *hits, const uint8_t *signal, int first, int last, int x,
                    uint8_t *light)
{
    int known = hits->n_hits;
    match(hits, signal, x);
    if (x % LIGHT_APART == 0 && !explains(hits, known, first, last) &&
        eye_is_coloured(hits->picture->channels, hits->task)) {
        fill_light(hits, signal, first, last, x, light);
        match(hits, light, x);
    }
    if (eye_is_coloured(hits->picture->channels, hits->task))
        eye_match_comb(hits, signal, first, last, x, known);
}

/* Which numbers of bits the landmarks have that are looked for. */
static void choose_bits(eye_hits *hits)
{
    for (int bits = 4; bits <= EYE_MOST_BITS; bits++)
        for (int id = 1; id < EYE_IDS; id++)
            if (hits->task->kinds[id].bits == bits && hits->n_bits < EYE_MOST_LENGTHS) {
                hits->bits[hits->n_bits++] = bits;
                break;
            }
}

/* Looks at all columns that may hold a code, some neighbouring ones at a time. */
static void look_at_all(eye_hits *hits, const extent *extents, uint8_t *signal, uint8_t *light)
{
    const eye_picture *p = hits->picture;
    int columns = (p->columns + EYE_APART - 1) / EYE_APART;
    for (int c = 0; c < columns;) {
        int first = c, top = p->rows, bottom = -1;
        for (; c < columns && c - first < EYE_LANES && extents[c].strong &&
               extents[c].count >= LEAST_COLOURED;
             c++) {
            top = extents[c].first < top ? extents[c].first : top;
            bottom = extents[c].last > bottom ? extents[c].last : bottom;
        }
        if (c == first) {
            c++;
            continue;
        }
        top = top > 2 * ROWS_APART ? top - 2 * ROWS_APART : 0;
        bottom = bottom + 2 * ROWS_APART < p->rows ? bottom + 2 * ROWS_APART : p->rows - 1;
        fill(p, hits->task, first, c - first, top, bottom, signal);
        for (int k = first; k < c; k++)
            look_at(hits, signal + (k - first) * column_room(p), top, bottom, EYE_APART * k,
                    light);
    }
}

/* Whether a column is amid the colour there: neither beside it has clearly more. */
static int is_amid(const extent *extents, size_t columns, size_t c)
{
    int most = extents[c].faint + 1;
    return (c == 0 || extents[c - 1].faint <= most) &&
           (c + 1 == columns || extents[c + 1].faint <= most);
}

/* The candidates of a picture, the clearest first; -1 where there is no memory. */
int eye_search(const eye_picture *picture, const eye_task *task, eye_candidate *found)
{
    size_t columns = (size_t)(picture->columns + EYE_APART - 1) / EYE_APART;
    int n = -1;
    eye_hits *hits = malloc(sizeof *hits);
    extent *extents = malloc(sizeof *extents * columns);
    uint8_t *signal = malloc((size_t)column_room(picture) * EYE_LANES), *light = malloc((size_t)picture->rows);
    if (hits && extents && signal && light) {
        hits->picture = picture;
        hits->task = task;
        hits->n_hits = hits->n_bits = 0;
        hits->slides = EYE_MOST_SLIDES;
        choose_bits(hits);
        survey(picture, task, extents);
        look_at_all(hits, extents, signal, light);
        for (size_t c = 0; c < columns; c++)
            if (extents[c].faint >= LEAST_COLOURED && is_amid(extents, columns, c))
                eye_match_faint(hits, (int)c * EYE_APART);
        n = eye_gather(hits, found);
    }
    free(hits);
    free(extents);
    free(signal);
    free(light);
    return n;
}
