/* Where landmarks may be: columns in which bright and dark runs have the proportions of a code.
 *
 * The inner part of a code, from the end of the upper end bar to the begin of the lower one, begins
 * and ends dark and holds bright runs one segment long at odd places. It is looked for by itself:
 * what the end bars touch may be as bright as they are. Columns that agree form one candidate. */
#include "eye.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BLOCK 16          /* columns that are filled together */
#define APART 2           /* every second column is looked at, */
#define ROWS_APART 3      /* and every third row of it, for colour */
#define MOST_RUNS 384     /* bright runs in one column */
#define MOST_HITS 3000    /* columns with a code; a picture full of stripes has no landmark */
#define RECENT_GROUPS 200 /* that a hit may join: others ended some columns ago */
#define SHORTEST 1.15     /* rows per segment; shorter ones cannot be told apart */
#define SLACK 0.28        /* share of a segment by which a run may miss its length or place */
#define ROUNDING 0.75     /* rows by which it may miss besides */
#define FRAYED 0.35       /* rows by which a bar may be shorter besides: its end has lost colour */
#define HALF_LIGHT 0.60   /* half of the light as a share of the signal: 0.73 of brightness, 0.5 of colour */
#define LEAVES_DARK 0.30  /* share of a step above which an edge has begun */
#define SHORT_STRETCH 46  /* rows of colour, with gaps up to GAP, in which brightness is tried alone */
#define ROUGH_REST 0.15f   /* the same, at whole pixels */
#define MOST_REST 0.06f   /* mean square that a far code may leave over, of bright - dark */
#define NEAR 3.3f          /* rows per segment from which on colour parts the segments well */
#define GAP 22
#define BESIDE 4          /* rows above and below that take part */
#define LEAST_PEAK 30     /* grey levels of colour, somewhere in a column that is looked at */
#define LEAST_COLOURED 2  /* sampled rows of colour in a column that is looked at */
#define LEAST_STEP 12    /* grey levels; less is noise */
#define FAINT 0.35        /* share of the peaks beside it below which a run is noise */
#define SHALLOW 0.45      /* share of the peaks beside it above which a valley is texture or noise */
#define SHALLOWEST 0.7     /* share of the dimmest run above which fences are none */
#define SHOULDER 0.12     /* an edge has ended where it grows by less than this share */

typedef struct {
    float start, end; /* rows, between pixels */
    uint8_t peak;
    uint8_t valley; /* the darkest between this run and the next */
} run;

typedef struct {
    float column, top, bottom;
    int16_t bits, id;
    int8_t open_top, open_bottom;
    uint8_t contrast; /* of the dimmest run and the brightest valley */
} hit;

typedef struct {
    const eye_picture *picture;
    const eye_task *task;
    int n_bits, bits[4];
    hit hits[MOST_HITS];
    int n_hits;
} search;

/* Which part of which columns has the paint's colour at all. */
typedef struct {
    int first, last, count; /* rows, both included; how many of the sampled ones */
    int strong;             /* whether any has much */
} extent;

/* Every third row of every second column: even the farthest end bar is nearly three rows high. */
static void survey(const search *s, extent *extents)
{
    const eye_picture *p = s->picture;
    int high = s->task->high, low = s->task->low, columns = (p->columns + APART - 1) / APART;
    int coloured = p->channels == 3 && low >= 0;
    for (int c = 0; c < columns; c++)
        extents[c] = coloured ? (extent){p->rows, -1, 0, 0} : (extent){0, p->rows - 1, p->rows, 1};
    for (int y = 0; coloured && y < p->rows; y += ROWS_APART) {
        const uint8_t *pixel = p->pixels + (ptrdiff_t)y * p->stride;
        for (int c = 0; c < columns; c++, pixel += 3 * APART) {
            int colour = 6 * pixel[high] - 7 * pixel[low];
            if (colour <= 4 * EYE_FAINTEST)
                continue;
            extent *e = extents + c;
            e->first = y < e->first ? y : e->first;
            e->last = y;
            e->count++;
            e->strong |= colour > 4 * LEAST_PEAK;
        }
    }
}

/* The signal of some neighbouring columns of the survey, one after the other. */
static void fill(const search *s, int first, int count, int top, int bottom, uint8_t *signal,
                 int rows_padded)
{
    const eye_picture *p = s->picture;
    int n = p->channels, coloured = n == 3 && s->task->low >= 0;
    int high = s->task->high, low = s->task->low;
    memset(signal, 0, (size_t)rows_padded * (size_t)count);
    for (int y = top; y <= bottom; y++) {
        const uint8_t *pixel = p->pixels + (ptrdiff_t)y * p->stride + (ptrdiff_t)first * APART * n;
        uint8_t *to = signal + y;
        for (int c = 0; c < count; c++, pixel += APART * n, to += rows_padded)
            if (!coloured || 6 * pixel[high] - 7 * pixel[low] > 4 * EYE_FAINTEST)
                *to = (uint8_t)eye_signal(pixel, n, s->task);
    }
}

/* The running sum of the brightness of three columns, grey levels of one. */
static void fill_brightness(const search *s, int x, int from, int to, float *sum)
{
    const eye_picture *p = s->picture;
    int n = p->channels, last = p->columns - 1;
    sum[0] = 0;
    for (int y = from; y < to; y++) {
        const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride;
        int total = 0;
        for (int side = -1; side <= 1; side++) {
            int at = x + side;
            at = at < 0 ? 0 : at > last ? last : at;
            total += eye_brightness(row + at * n, n, s->task);
        }
        sum[y - from + 1] = sum[y - from] + (float)total / 48;
    }
}

/* The running sum of the signal of one column. */
static void fill_colour(const uint8_t *signal, int from, int to, float *sum)
{
    sum[0] = 0;
    for (int y = from; y < to; y++)
        sum[y - from + 1] = sum[y - from] + (float)signal[y];
}

/* Where a run's edge lies: from the dark row at ``from`` (level ``valley``) towards ``to``.
 *
 * The edge ends at a shoulder, not at the peak: behind a bar something brighter may go on. */
static float edge(const uint8_t *s, int from, int to, int valley, int peak)
{
    int step = to > from ? 1 : -1, y = from;
    int low = valley + (int)(LEAVES_DARK * (peak - valley));
    while (y != to && s[y] <= low)
        y += step;
    int top = y;
    while (top != to && s[top + step] - s[top] > SHOULDER * (s[top] - valley))
        top += step;
    float level = (float)valley + (float)HALF_LIGHT * (float)(s[top] - valley);
    while (y != top && (float)s[y] < level)
        y += step;
    if (y == from)
        return (float)y;
    float here = s[y], before = s[y - step];
    float part = here > before ? (here - level) / (here - before) : 0.0f;
    if (part < 0.0f)
        part = 0.0f;
    if (part > 1.0f)
        part = 1.0f;
    return (float)y - (float)step * part;
}

/* The bright runs of one column, top first: the signal's ups and downs larger than a share of it. */
static int find_runs(const uint8_t *s, int rows, run *runs)
{
    int least = 0;
    for (int y = 0; y < rows; y++)
        least = s[y] > least ? s[y] : least;
    least = least / 10 > LEAST_STEP ? least / 10 : LEAST_STEP;
    int count = 0, y = 0;
    int valley = 0, valley_at = 0, before = 0; /* the last peak */
    int peaks[MOST_RUNS], valleys[MOST_RUNS + 1], places[MOST_RUNS + 1];
    while (count < MOST_RUNS) {
        int rise = before / 4 > least ? before / 4 : least;
        for (; y < rows; y++) { /* dark: wait for a rise */
            if (s[y] == 0) {
                uint64_t eight = 0;
                while (y + 8 <= rows && (memcpy(&eight, s + y, 8), eight == 0))
                    y += 8;
                valley = 0;
                if (y >= rows)
                    break;
                valley_at = y > 0 ? y - 1 : 0;
            }
            if (s[y] <= valley) {
                valley = s[y];
                valley_at = y;
            } else if (s[y] - valley > rise) {
                break;
            }
        }
        valleys[count] = valley;
        places[count] = valley_at;
        if (y >= rows)
            break;
        int peak = s[y], peak_at = y;
        for (; y < rows; y++) { /* bright: wait for a fall */
            int fall = peak / 4 > least ? peak / 4 : least;
            if (s[y] > peak) {
                peak = s[y];
                peak_at = y;
            } else if (peak - s[y] > fall) {
                break;
            }
        }
        runs[count].peak = (uint8_t)peak;
        peaks[count] = peak_at;
        before = peak;
        count++;
        valley = y < rows ? s[y] : 0;
        valley_at = y < rows ? y : rows - 1;
        if (y >= rows) {
            valleys[count] = 0;
            places[count] = rows; /* the picture ends bright */
            break;
        }
    }
    if (count == MOST_RUNS)
        return 0;
    for (int i = 0; i < count; i++) {
        int above = places[i], below = places[i + 1];
        runs[i].valley = (uint8_t)valleys[i + 1];
        /* A picture that begins bright has no dark row to start from. */
        if (i == 0 && s[above] > LEAVES_DARK * runs[0].peak)
            runs[i].start = -0.5f;
        else
            runs[i].start = edge(s, above, peaks[i], valleys[i], runs[i].peak);
        runs[i].end = below >= rows ? (float)rows - 0.5f
                                    : edge(s, below, peaks[i], valleys[i + 1], runs[i].peak);
    }
    return count;
}

/* The same runs without what is noise or texture if the code is near: runs much fainter than those
 * beside them are left out, and runs that only a shallow valley parts are joined. Far fences are
 * shallow valleys as well, so both readings of a column are looked at. Returns how many are left. */
static int smooth_runs(const run *runs, int count, run *smooth)
{
    int n = 0;
    for (int i = 0; i < count; i++) {
        int above = i > 0 ? runs[i - 1].peak : 0;
        int below = i + 1 < count ? runs[i + 1].peak : 0;
        if (runs[i].peak < FAINT * above || runs[i].peak < FAINT * below) {
            if (n > 0 && runs[i].valley < smooth[n - 1].valley)
                smooth[n - 1].valley = runs[i].valley;
            continue;
        }
        if (n > 0) {
            run *before = smooth + n - 1;
            int lower = before->peak < runs[i].peak ? before->peak : runs[i].peak;
            if (before->valley > SHALLOW * lower) {
                before->end = runs[i].end;
                before->valley = runs[i].valley;
                before->peak = before->peak > runs[i].peak ? before->peak : runs[i].peak;
                continue;
            }
        }
        smooth[n++] = runs[i];
    }
    return n;
}

/* Every sequence of runs that looks like a code becomes a hit. */
static void match(search *s, const run *runs, int count, float column)
{
    int rows = s->picture->rows;
    for (int b = 0; b < s->n_bits; b++) {
        int bits = s->bits[b];
        float inner = (float)(2 * bits + 1);
        for (int i = 0; i + 2 < count; i++) {
            float most = runs[i].start <= 0 ? 1e9f : inner * (runs[i].end - runs[i].start + (float)(FRAYED + ROUNDING)) /
                         (float)(2 - SLACK);
            if (most < inner * (float)SHORTEST)
                continue; /* too short for an end bar */
            for (int ones = 1; ones <= bits && i + ones + 1 < count; ones++) {
                const run *upper = runs + i, *lower = runs + i + ones + 1;
                float top = upper->end, unit = (lower->start - top) / inner;
                if (lower->start - top > most)
                    break;
                if (unit < SHORTEST)
                    continue;
                float slack = (float)SLACK * unit + (float)ROUNDING;
                float bar_slack = slack + (float)FRAYED;
                float above = upper->end - upper->start, below = lower->end - lower->start;
                /* A bar that the picture's edge cuts shows three quarters of itself at least. */
                float least_above = (upper->start <= 0.0f ? 1.5f : 2.0f) * unit - bar_slack;
                float least_below = (lower->end >= (float)(rows - 1) ? 1.5f : 2.0f) * unit - bar_slack;
                if (above < least_above || below < least_below)
                    continue;
                int id = 0, last = -1, good = 1, dimmest = 255, brightest = 0;
                for (int k = 0; k <= ones + 1; k++) {
                    const run *one = upper + k;
                    if (one->peak < dimmest)
                        dimmest = one->peak;
                    if (k <= ones && one->valley > brightest)
                        brightest = one->valley;
                    if (k == 0 || k == ones + 1)
                        continue;
                    float length = one->end - one->start;
                    float middle = ((one->start + one->end) / 2 - top) / unit;
                    int bit = (int)floorf((middle - 1.5f) / 2 + 0.5f);
                    if (bit <= last || bit >= bits || fabsf(length - unit) > slack ||
                        fabsf(middle - 1.5f - 2 * (float)bit) * unit > slack) {
                        good = 0;
                        break;
                    }
                    last = bit;
                    id |= 1 << bit;
                }
                if (!good || brightest > SHALLOWEST * dimmest || s->n_hits >= MOST_HITS)
                    continue;
                hit *h = s->hits + s->n_hits++;
                h->column = column;
                h->top = upper->end;
                h->bottom = lower->start;
                h->bits = (int16_t)bits;
                h->id = (int16_t)id;
                h->open_top = above > 2 * unit + slack || upper->start <= 0.0f;
                h->open_bottom = below > 2 * unit + slack || lower->end >= (float)(rows - 1);
                h->contrast = (uint8_t)(dimmest - brightest);
            }
        }
    }
}

/* How badly the segments' light, read off its running sum, fits any code of that place and size:
 * the mean square of what is left over, of bright - dark; ``id`` is what it reads. */
static float comb(const float *sum, int rows, float top, float unit, int bits, int *id,
                  float *contrast)
{
    int segments = 2 * bits + 5;
    float level[EYE_MOST_SEGMENTS], before = 0;
    for (int k = 0; k <= segments; k++) {
        float place = top + unit * (float)k;
        if (place < 0 || place >= (float)rows)
            return 1e9f;
        int at = (int)place;
        float here = sum[at] + (place - (float)at) * (sum[at + 1] - sum[at]);
        if (k > 0)
            level[k - 1] = (here - before) / unit;
        before = here;
    }
    float bright = (level[0] + level[1] + level[segments - 2] + level[segments - 1]) / 4;
    float dark = 0;
    for (int k = 2; k < segments - 2; k += 2)
        dark += level[k];
    dark /= (float)(bits + 1);
    float step = bright - dark, rest = 0;
    if (step < LEAST_STEP)
        return 1e9f;
    *id = 0;
    for (int k = 0; k < segments; k++) {
        int bit = k > 2 && k < segments - 2 && k % 2 == 1;
        float off = level[k] - (k < 2 || k >= segments - 2 ? bright : dark);
        if (bit && off > step / 2) {
            /* A lone bright segment loses light to its neighbours: as bright as it gets. */
            *id |= 1 << (k - 3) / 2;
            off = off > 0.75f * step ? 0 : off - 0.75f * step;
        }
        rest += off * off;
    }
    *contrast = step;
    return rest / (step * step * (float)segments);
}

/* The place and size of a code that fits best near a first guess. */
typedef struct {
    float rest, top, unit, contrast;
    int id;
} fit;

static void try_codes(const float *sum, int rows, int bits, float middle, float reach, float least,
                      float most, float fineness, fit *best)
{
    float segments = (float)(2 * bits + 5);
    for (float unit = least; unit <= most; unit += fineness / segments) {
        for (float off = -reach; off <= reach; off += fineness) {
            fit one = {.top = middle + off - unit * segments / 2, .unit = unit};
            one.rest = comb(sum, rows, one.top, unit, bits, &one.id, &one.contrast);
            if (one.rest < best->rest)
                *best = one;
        }
    }
}

/* Tries all places and sizes of a code on the rows from ``top`` to ``bottom`` of one column, of
 * which ``height`` from ``from`` on have colour; returns how many bits' codes were found. */
static int comb_column(search *s, const float *sum, int top, int bottom, int from, int height, int x)
{
    int found = 0;
    for (int b = 0; b < s->n_bits && s->n_hits < MOST_HITS; b++) {
        int bits = s->bits[b];
        float segments = (float)(2 * bits + 5), middle = (float)(from - top) + (float)height / 2;
        float least = ((float)height - 8) / segments, most = ((float)height + 2) / segments;
        fit best = {.rest = ROUGH_REST};
        least = least < (float)SHORTEST ? (float)SHORTEST : least;
        try_codes(sum, bottom - top, bits, middle, 1.5f + 0.3f * most, least, most, 1.0f, &best);
        if (best.rest >= ROUGH_REST)
            continue;
        middle = best.top + best.unit * segments / 2;
        float apart = 0.75f / segments;
        try_codes(sum, bottom - top, bits, middle, 0.5f, best.unit - apart, best.unit + apart, 0.25f,
                  &best);
        if (best.rest >= MOST_REST || best.id == 0)
            continue;
        float begin = best.top + 2 * best.unit + (float)top - 0.5f;
        s->hits[s->n_hits++] = (hit){.column = (float)x,
                                     .top = begin,
                                     .bottom = begin + (segments - 4) * best.unit,
                                     .bits = (int16_t)bits,
                                     .id = (int16_t)best.id,
                                     .contrast = (uint8_t)best.contrast};
        found++;
    }
    return found;
}

/* Far codes: their segments are so short that runs cannot be told apart. Where a column has colour
 * for a short stretch, all places and sizes of a code are tried. */
static void match_far(search *s, const uint8_t *signal, int first, int last, int x, int known)
{
    float sum[SHORT_STRETCH + 2 * BESIDE + 2];
    int y = first, rows = s->picture->rows;
    while (y <= last) {
        while (y <= last && signal[y] < LEAST_STEP)
            y++;
        int from = y, end = y, peak = 0;
        for (; y <= last && y - end <= GAP; y++)
            if (signal[y] >= LEAST_STEP) {
                end = y;
                peak = signal[y] > peak ? signal[y] : peak;
            }
        int height = end - from + 1;
        if (from > last || height > SHORT_STRETCH || height < 9 * SHORTEST || peak < 2 * LEAST_STEP)
            continue;
        int seen = 0;
        for (int i = known; i < s->n_hits && !seen; i++) {
            const hit *h = s->hits + i;
            float unit = (h->bottom - h->top) / (float)(2 * h->bits + 1);
            seen = unit > NEAR && (float)from > h->top - 3 * unit &&
                   (float)end < h->bottom + 3 * unit;
        }
        if (seen)
            continue;
        int top = from < BESIDE ? 0 : from - BESIDE;
        int bottom = end + BESIDE + 1 < rows ? end + BESIDE + 1 : rows;
        /* Colour ignores walls and floors; brightness is sharper in pictures that were JPEG. */
        fill_colour(signal, top, bottom, sum);
        if (comb_column(s, sum, top, bottom, from, height, x))
            continue;
        fill_brightness(s, x, top, bottom, sum);
        comb_column(s, sum, top, bottom, from, height, x);
    }
}

/* Codes in one column: near ones among its runs, with and without noise; far ones. */
static void look_at(search *s, const uint8_t *signal, int first, int last, int x, run *runs)
{
    int n = find_runs(signal, s->picture->rows, runs), known = s->n_hits;
    if (n >= 3) {
        match(s, runs, n, (float)x);
        int left = smooth_runs(runs, n, runs + MOST_RUNS);
        if (left < n && left >= 3)
            match(s, runs + MOST_RUNS, left, (float)x);
    }
    if (s->task->low >= 0 && s->picture->channels == 3)
        match_far(s, signal, first, last, x, known);
}

/* Columns whose codes begin and end at the same height become one candidate. */
typedef struct {
    int first, last_hit, count;
    float left, right, last_column;
    int16_t bits;
} group;

static int by_column(const void *a, const void *b)
{
    const hit *x = a, *y = b;
    if (x->column != y->column)
        return x->column < y->column ? -1 : 1;
    return x->top < y->top ? -1 : x->top > y->top;
}

static int by_evidence(const void *a, const void *b)
{
    const eye_candidate *x = a, *y = b;
    if (x->evidence != y->evidence)
        return y->evidence - x->evidence;
    return x->column < y->column ? -1 : x->column > y->column;
}

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

static int gather(search *s, eye_candidate *found)
{
    group *groups = malloc(sizeof *groups * (size_t)(s->n_hits + 1));
    int *owner = malloc(sizeof *owner * (size_t)(s->n_hits + 1));
    float *values = malloc(sizeof *values * (size_t)(2 * s->n_hits + 2));
    eye_candidate *all = malloc(sizeof *all * (size_t)(s->n_hits + 1));
    int n_groups = 0, n_found = 0;
    if (!groups || !owner || !values || !all) {
        n_found = -1;
        goto done;
    }
    qsort(s->hits, (size_t)s->n_hits, sizeof *s->hits, by_column);
    for (int i = 0; i < s->n_hits; i++) {
        const hit *h = s->hits + i;
        float room = 0.5f * (h->bottom - h->top) / (float)(2 * h->bits + 1) + 1.0f;
        owner[i] = -1;
        for (int g = n_groups - 1; g >= 0 && g >= n_groups - RECENT_GROUPS; g--) {
            group *one = groups + g;
            const hit *other = s->hits + one->last_hit;
            if (one->bits == h->bits &&
                h->column - one->last_column <= 2 * APART && fabsf(h->top - other->top) <= room &&
                fabsf(h->bottom - other->bottom) <= room) {
                one->last_hit = i;
                one->last_column = one->right = h->column;
                one->count++;
                owner[i] = g;
                break;
            }
        }
        if (owner[i] < 0) {
            groups[n_groups] = (group){i, i, 1, h->column, h->column, h->column, h->bits};
            owner[i] = n_groups++;
        }
    }
    for (int g = 0; g < n_groups; g++) {
        int votes[EYE_IDS] = {0};
        int n = 0, open_top = 0, open_bottom = 0, best = 0, contrast = 0;
        for (int i = groups[g].first; i < s->n_hits; i++) {
            if (owner[i] != g)
                continue;
            const hit *h = s->hits + i;
            values[n] = h->top;
            values[s->n_hits + n] = h->bottom;
            n++;
            open_top += h->open_top;
            contrast += h->contrast;
            open_bottom += h->open_bottom;
            if (++votes[h->id] > votes[best])
                best = h->id;
        }
        qsort(values, (size_t)n, sizeof *values, by_value);
        qsort(values + s->n_hits, (size_t)n, sizeof *values, by_value);
        all[g] = (eye_candidate){
            .bits = groups[g].bits,
            .id = best,
            .column = (groups[g].left + groups[g].right) / 2,
            .top = values[n / 2],
            .bottom = values[s->n_hits + n / 2],
            .evidence = contrast,
            .open_top = 2 * open_top > n,
            .open_bottom = 2 * open_bottom > n,
        };
    }
    qsort(all, (size_t)n_groups, sizeof *all, by_evidence);
    for (int g = 0; g < n_groups && n_found < EYE_MOST_CANDIDATES; g++) {
        int known = 0;
        for (int f = 0; f < n_found && !known; f++) {
            const eye_candidate *other = found + f;
            double room = 0.08 * (other->bottom - other->top) + 2.0;
            known = all[g].bits == other->bits && all[g].id == other->id && fabs(all[g].top - other->top) < room &&
                    fabs(all[g].bottom - other->bottom) < room &&
                    fabs(all[g].column - other->column) < 2 * room;
        }
        if (!known)
            found[n_found++] = all[g];
    }
done:
    free(groups);
    free(owner);
    free(values);
    free(all);
    return n_found;
}

/* The candidates of a picture, the clearest first; -1 where there is no memory. */
int eye_search(const eye_picture *picture, const eye_task *task, eye_candidate *found)
{
    int columns = (picture->columns + APART - 1) / APART, n = -1;
    int rows_padded = (picture->rows + 15) / 16 * 16;
    search *s = malloc(sizeof *s);
    extent *extents = malloc(sizeof *extents * (size_t)columns);
    uint8_t *signal = malloc((size_t)rows_padded * BLOCK);
    run *runs = malloc(sizeof *runs * 2 * MOST_RUNS);
    if (s && extents && signal && runs) {
        s->picture = picture;
        s->task = task;
        s->n_hits = s->n_bits = 0;
        for (int bits = 4; bits <= EYE_MOST_BITS; bits++)
            for (int id = 1; id < EYE_IDS; id++)
                if (task->kinds[id].bits == bits && s->n_bits < 4) {
                    s->bits[s->n_bits++] = bits;
                    break;
                }
        survey(s, extents);
        for (int c = 0; c < columns; c++) {
            int first = c, top = picture->rows, bottom = -1;
            for (; c < columns && c - first < BLOCK && extents[c].strong &&
                   extents[c].count >= LEAST_COLOURED;
                 c++) {
                top = extents[c].first < top ? extents[c].first : top;
                bottom = extents[c].last > bottom ? extents[c].last : bottom;
            }
            if (c == first)
                continue;
            top = top > 2 * ROWS_APART ? top - 2 * ROWS_APART : 0;
            bottom = bottom + 2 * ROWS_APART < picture->rows ? bottom + 2 * ROWS_APART
                                                             : picture->rows - 1;
            fill(s, first, c - first, top, bottom, signal, rows_padded);
            for (int k = first; k < c; k++)
                look_at(s, signal + (ptrdiff_t)(k - first) * rows_padded, top, bottom, APART * k,
                        runs);
            c--;
        }
        n = gather(s, found);
    }
    free(s);
    free(extents);
    free(signal);
    free(runs);
    return n;
}
