/* Set a strip upright: how it leans, its light by row along the lean, and by column across it.
 *
 * Rolling shutter and roll lean a strip over. The lean is the one under which the difference of
 * bright and dark segments, averaged along the strip, stands out most: beside the strip it is about
 * nothing, whatever colour is there. */
#include "internal.h"

#include <math.h>
#include <string.h>

#define LARGEST 1e6     /* pixels; no strip is larger, nor could its columns be counted with an int */
#define MARGIN 1.3      /* segments above and below the code that are kept */
#define UNSURE 3.0      /* rows per segment below which a steeper one is taken for upright, */
#define UPRIGHT 0.95    /* if it stands out so much then, of how it does with its lean */
#define SETTLED_LEAN 0.05 /* columns per row, and columns, by which a likeliest code may be off: */
#define SETTLED_COLUMN 1.0
#define STEEPEST 0.118  /* columns per row: 60 degrees/s, a slow shutter and 2 degrees of roll */
#define MOST_LEANS 12   /* that are tried to either side at first */
#define ROUNDS 2        /* of parabolas after that */
#define ROWS_A_BAND 3   /* more rows than this are left out */
#define COLUMNS_ACROSS 7.0 /* more columns than this across the strip are averaged */
#define LOOKED_AT 0.70  /* share of the half width over which the profile is averaged, */
#define LEAST_LOOKED_AT 0.6 /* and columns at the least */
#define COLUMNS_A_HALF 2.5 /* more columns than this in the half of that are left out */
#define LEAST_SIGNAL 4.0 /* grey levels of bright minus dark */
#define ALL_ROWS 4.0    /* rows per segment up to which each is kept, */
#define ROWS_A_UNIT 5.0 /* and how many are kept if there are many more */
#define THIN 3.0        /* half of the columns looked at: nothing is blurred into the midst of more */
#define OUTSIDE 3       /* columns at either end that say what is beside the strip */
#define LEAN_NOISE 0.0085 /* of the width: how far off the lean has the bright segments */
#define LEAST_CUT 6.0    /* columns of a strip of which one side is looked for by itself, */
#define CUT_MARGIN 0.3   /* share of what shows of it that is left out at that side, */
#define HALF_PEAK 0.5    /* where it has so much of its light */
#define BESIDE 2.0      /* columns from the strip's side to what is beside it */

/* The rows of one run of the code, averaged. */
typedef struct {
    double row;    /* middle */
    double weight; /* in the difference of bright and dark */
    float light[EYE_MOST_COLUMNS];  /* of the paint's colour, by column */
    float signal[EYE_MOST_COLUMNS]; /* how bright the paint's colour is, no more than the paint */
} band;

/* Linear light of the paint's colour: grey gives about nothing, whatever its pattern. Of paint that
 * has no colour here, the brightness. */
static inline float light_of(const uint8_t *pixel, int channels, const eye_task *task, int sharp)
{
    if (!sharp && eye_is_coloured(channels, task))
        return eye_linear(pixel[task->high]) - eye_linear(pixel[task->low]);
    return eye_linear_sixteenths(eye_brightness(pixel, channels, task));
}

/* Adds one row of the picture to a band, ``step`` of its columns to each, as `fill_band` does: what
 * nearly always is asked, so it has a loop of its own. */
static __attribute__((noinline)) void add_colour(const uint8_t *row, int last, const eye_task *task,
                                                 int first, int step, int columns, band *out)
{
    for (int c = 0, x = first; c < columns; c++) {
        float light = out->light[c], signal = out->signal[c];
        for (int end = x + step; x < end; x++) {
            const uint8_t *pixel = row + 3 * (ptrdiff_t)eye_clamp(x, 0, last);
            light += eye_linear(pixel[task->high]) - eye_linear(pixel[task->low]);
            if (eye_colour(pixel, task) > 4 * EYE_FAINTEST) /* else it is nothing */
                signal += (float)eye_signal(pixel, 3, task);
        }
        out->light[c] = light;
        out->signal[c] = signal;
    }
}

/* Light and signal of one band by column, between two rows: the mean of up to ROWS_A_BAND of them,
 * and of ``step`` columns of the picture. */
static void fill_band(const eye_picture *p, const eye_task *task, double from, double to,
                      int first, int step, int columns, int sharp, band *out)
{
    int top = (int)ceil(from), bottom = (int)floor(to);
    if (bottom < top)
        top = bottom = (int)lround((from + to) / 2);
    top = eye_clamp(top, 0, p->rows - 1);
    bottom = eye_clamp(bottom, 0, p->rows - 1);
    int count = bottom - top + 1, used = count < ROWS_A_BAND ? count : ROWS_A_BAND;
    double middle = 0;
    memset(out->light, 0, sizeof *out->light * (size_t)columns);
    memset(out->signal, 0, sizeof *out->signal * (size_t)columns);
    for (int i = 0; i < used; i++) {
        int y = top + (2 * i + 1) * count / (2 * used);
        const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride;
        middle += y;
        if (!sharp && eye_is_coloured(p->channels, task)) {
            add_colour(row, p->columns - 1, task, first, step, columns, out);
            continue;
        }
        for (int k = 0; k < columns * step; k++) {
            int x = eye_clamp(first + k, 0, p->columns - 1), c = k / step;
            const uint8_t *pixel = row + x * p->channels;
            out->light[c] += light_of(pixel, p->channels, task, sharp);
            out->signal[c] += sharp ? (float)eye_brightness(pixel, p->channels, task) / 12
                                    : (float)eye_signal(pixel, p->channels, task);
        }
    }
    for (int c = 0; c < columns; c++) {
        out->light[c] /= (float)(used * step);
        out->signal[c] /= (float)(used * step);
    }
    out->row = middle / used;
}

/* No signal is to be brighter than the paint: a wall of its colour beside the strip, or a white
 * one seen without colour, would lend the difference more than the strip itself. */
static void cap_signal(band *bands, int n, int columns, int at)
{
    float most = 0;
    at = eye_clamp(at, 1, columns - 2);
    for (int b = 0; b < n; b++)
        if (bands[b].weight > 0)
            for (int c = at - 1; c <= at + 1; c++)
                most = bands[b].signal[c] > most ? bands[b].signal[c] : most;
    for (int b = 0; b < n; b++)
        for (int c = 0; c < columns; c++)
            if (bands[b].signal[c] > most)
                bands[b].signal[c] = most;
}

/* Takes the straight line through both ends off: what is beside the strip is not the paint's. */
static void level_out(float *values, int n)
{
    float left = 0, right = 0;
    if (n < 4 * OUTSIDE)
        return;
    for (int i = 0; i < OUTSIDE; i++) {
        left += values[i] / OUTSIDE;
        right += values[n - 1 - i] / OUTSIDE;
    }
    for (int i = 0; i < n; i++)
        values[i] -= left + (right - left) * (float)i / (float)(n - 1);
}

/* Bright minus dark by column, each band moved back by ``lean``. */
static void difference(const band *bands, int n, int columns, int step, double row, double lean,
                       int light, int sharp, float *restrict out)
{
    memset(out, 0, sizeof *out * (size_t)columns);
    for (int b = 0; b < n; b++) {
        double shift = lean * (bands[b].row - row) / step;
        int whole = eye_floor(shift);
        float part = (float)(shift - whole), weight = (float)bands[b].weight;
        float near = weight * (1 - part), far = weight * part;
        const float *of = light ? bands[b].light : bands[b].signal;
        int from = whole < 0 ? -whole : 0, to = whole < 0 ? columns : columns - whole;
        from = from > columns ? columns : from;
        to = to > columns - 1 - whole ? columns - 1 - whole : to;
        for (int c = 0; c < from; c++) /* beyond what was looked at: as its edge */
            out[c] += weight * of[0];
        for (int c = from; c < to; c++)
            out[c] += near * of[c + whole] + far * of[c + whole + 1];
        for (int c = to > from ? to : from; c < columns; c++)
            out[c] += weight * of[columns - 1];
    }
    if (sharp)
        level_out(out, columns);
}

/* How much a difference stands out: its energy, or (``edges``) that of its slope. Of a strip that the
 * picture's side cuts only one silhouette is seen, and that is where the slope is. */
static double energy(const float *values, int n, int edges)
{
    double sum = 0;
    for (int i = 1; edges && i < n; i++)
        sum += (double)(values[i] - values[i - 1]) * (values[i] - values[i - 1]);
    if (edges)
        return sum;
    for (int i = 0; i < n; i++)
        if (values[i] > 0)
            sum += (double)values[i] * values[i];
    return sum;
}

/* The lean under which the difference stands out most; ``stands``: how much it stands out without
 * one, as a share of that. */
static double find_lean(const band *bands, int n, int columns, int step, double row, double length,
                        double wide, int sharp, int edges, double *stands)
{
    float values[EYE_MOST_COLUMNS];
    double best = -1, best_lean = 0;
    double apart = 0.4 * wide / length; /* ends of the code move by less than half a width */
    int reach = (int)ceil(STEEPEST / apart);
    if (reach > MOST_LEANS)
        reach = MOST_LEANS;
    for (int i = -reach; i <= reach; i++) {
        double lean = i * apart;
        difference(bands, n, columns, step, row, lean, 0, sharp, values);
        double e = energy(values, columns, edges);
        if (i == 0)
            *stands = e;
        if (e > best) {
            best = e;
            best_lean = lean;
        }
    }
    *stands = best > 0 ? *stands / best : 0;
    for (int round = 0; round < ROUNDS; round++) {
        /* A parabola through three energies has its top at the best lean. */
        double e[3];
        for (int i = 0; i < 3; i++) {
            difference(bands, n, columns, step, row, best_lean + (i - 1) * apart, 0, sharp, values);
            e[i] = energy(values, columns, edges);
        }
        double bend = e[0] - 2 * e[1] + e[2];
        double move = bend < 0 ? 0.5 * (e[0] - e[2]) / bend : 0;
        best_lean += apart * eye_limit(move, -1, 1);
        apart *= 0.4;
    }
    return best_lean;
}

/* Rows well inside every run of the code that is in the picture, as bands with the weights of
 * bright - dark; how many, 0 where only bright or only dark ones are there. ``whole``: all of them. */
static int fill_bands(const eye_picture *p, const eye_task *task, const eye_candidate *c,
                      const char *code, int segments, double unit, int first, int step,
                      int columns, int sharp, band *bands, int *whole)
{
    /* Kept off the edges, but for the middle row at least. */
    double trim = eye_limit(0.5 * unit - 0.52, 0, 0.2 * unit + 0.6);
    int n = 0, bright_weight = 0, darks = 0;
    *whole = 1;
    for (int i = 1; i < segments - 1;) {
        int end = i;
        while (end < segments - 1 && code[end] == code[i])
            end++;
        int bright = code[i] == '1', bar = i == 1 || end == segments - 1;
        double from = c->top + (i - 2) * unit + trim, to = c->top + (end - 2) * unit - trim;
        int weight = bright ? (bar ? 1 : 2) : 0;
        i = end;
        if (to < 0 || from > p->rows - 1) { /* out of the picture */
            *whole = 0;
            continue;
        }
        fill_band(p, task, from, to, first, step, columns, sharp, bands + n);
        bands[n++].weight = weight;
        bright_weight += weight;
        darks += !bright;
    }
    if (!bright_weight || !darks)
        return 0;
    for (int i = 0; i < n; i++)
        bands[i].weight = bands[i].weight > 0 ? bands[i].weight / bright_weight : -1.0 / darks;
    return n;
}

/* How certain a lean is: the farther apart the bright segments, the more. The whole code has its bars
 * for that, and what else is wrong with its lean is more. */
static void know_lean(const band *bands, int n, int whole, double wide, eye_upright *out)
{
    double mean = 0, square = 0;
    for (int i = 0; i < n; i++)
        mean += bands[i].weight > 0 ? bands[i].weight * bands[i].row : 0;
    for (int i = 0; i < n; i++)
        square += bands[i].weight > 0
                      ? bands[i].weight * (bands[i].row - mean) * (bands[i].row - mean)
                      : 0;
    out->bright_row = mean;
    out->lean_sigma = whole ? 0 : LEAN_NOISE * wide / sqrt(square + 1);
}

/* How much of a column at ``offset`` from the strip's middle takes part in the profile. */
static inline float share_of(double offset, double half)
{
    double inside = half + 0.5 - fabs(offset);
    return (float)(inside < 0 ? 0 : inside > 1 ? 1 : inside);
}

/* Light of every channel and brightness in one row just beside the strip, both sides together. */
static void fill_beside(const eye_picture *p, const eye_task *task, int y, const eye_upright *u,
                        float *beside)
{
    double middle = u->column + u->lean * (y - u->row), away = u->half_window / LOOKED_AT + BESIDE;
    const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride;
    memset(beside, 0, 4 * sizeof *beside);
    for (int k = 0; k < 4; k++) {
        double x = middle + (k < 2 ? -1 : 1) * (away + k % 2);
        const uint8_t *pixel = row + eye_clamp(eye_floor(x + 0.5), 0, p->columns - 1) * p->channels;
        for (int c = 0; c < p->channels; c++)
            beside[c] += eye_linear(pixel[c]) / 4;
        beside[3] += eye_linear_sixteenths(eye_brightness(pixel, p->channels, task)) / 4;
    }
}

/* The straightened light by row, between the code's outer ends and a little beyond. */
static void fill_profile(const eye_picture *p, const eye_task *task, double top, double bottom,
                         double unit, eye_upright *out)
{
    int bin = unit < ALL_ROWS ? 1 : (int)(unit / ROWS_A_UNIT);
    bin = bin < 2 && unit >= ALL_ROWS ? 2 : bin;
    int first = (int)floor(top - MARGIN * unit - 1), last = (int)ceil(bottom + MARGIN * unit + 1);
    first = eye_clamp(first, 0, p->rows - 1);
    last = eye_clamp(last, 0, p->rows - 1);
    int rows = (last - first + 1) / bin;
    rows = rows > EYE_MOST_ROWS ? EYE_MOST_ROWS : rows;
    if (last == p->rows - 1) /* none is left out where the picture ends amid a code */
        first = last + 1 - rows * bin;
    out->bin = bin;
    out->rows = rows;
    out->first = first - 0.5;
    out->channels = p->channels;
    double half = out->half_window;
    int three = p->channels == 3;
    int step = (int)(half / COLUMNS_A_HALF);
    step = step < 1 ? 1 : step;
    for (int r = 0; r < rows; r++) {
        float light = 0, channel[3] = {0, 0, 0}, total = 0;
        for (int i = 0; i < bin; i++) {
            int y = first + r * bin + i;
            const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride;
            double middle = out->column + out->lean * (y - out->row);
            int from = eye_clamp(eye_ceil(middle - half - 0.5), 0, p->columns - 1);
            int to = eye_clamp(eye_floor(middle + half + 0.5), 0, p->columns - 1);
            for (int x = from; x <= to; x += step) {
                float share = share_of(x - middle, half);
                const uint8_t *pixel = row + x * p->channels;
                total += share;
                /* Rec. 601 luma, as in JPEG, for most paints: the part that is kept sharp. A mixture
                 * of black and one colour has a luma whose light is the mixture's share, so its
                 * edges are not displaced. */
                light += share *
                         eye_linear_sixteenths(eye_brightness(pixel, p->channels, task));
                for (int k = 0; k < (three ? 3 : 1); k++)
                    channel[k] += share * eye_linear(pixel[k]);
            }
        }
        float scale = total > 1e-6f ? 1 / total : 0;
        if (half < THIN)
            fill_beside(p, task, first + r * bin + bin / 2, out, out->beside[r]);
        else
            memset(out->beside[r], 0, sizeof out->beside[r]);
        out->light[r] = light * scale;
        for (int k = 0; k < 3; k++)
            out->channel[r][k] = channel[k] * scale;
    }
}

/* Where the strip's middle is: the window of its width that holds most, then the centre of mass of
 * that and a little more. 0 where there is no strip. */
static int find_middle(const eye_upright *u, double wide, double *middle)
{
    int window = (int)lround(wide / u->step);
    window = window < 1 ? 1 : window;
    double best = 0, at = 0, mass = 0, moment = 0;
    for (int i = 0; i + window <= u->columns; i++) {
        double sum = 0;
        for (int k = 0; k < window; k++)
            sum += u->across[i + k];
        if (sum > best) {
            best = sum;
            at = u->across_first + (i + (window - 1) / 2.0) * u->step;
        }
    }
    if (best / window < LEAST_SIGNAL)
        return 0;
    for (int i = 0; i < u->columns; i++) {
        double x = u->across_first + i * u->step;
        if (fabs(x - at) <= wide / 2 + u->step + 0.5 && u->across[i] > 0) {
            mass += u->across[i];
            moment += u->across[i] * x;
        }
    }
    if (mass <= 0)
        return 0;
    *middle = moment / mass;
    return 1;
}

/* Which side of the picture cuts a candidate: -1 the left one, 1 the right one, 0 neither. */
static int cut_by(const eye_picture *p, const eye_candidate *c, double wide)
{
    if (wide < LEAST_CUT)
        return 0;
    return c->column - wide / 2 < -0.5 ? -1 : c->column + wide / 2 > p->columns - 0.5;
}

/* What shows of a strip that a side of the picture cuts, in all rows between two: its middle, and in
 * ``half_window`` half of it. 0 where there is next to nothing. */
static int find_rest(const eye_picture *p, eye_upright *u, double wide, int cut, double top,
                     double bottom)
{
    float peak = 0;
    int at = 0, best = 0;
    for (int i = 0; i < u->columns; i++)
        if (u->across[i] > peak) {
            peak = u->across[i];
            best = i;
        }
    if (peak < LEAST_SIGNAL)
        return 0;
    for (at = best; at - cut >= 0 && at - cut < u->columns; at -= cut)
        if (u->across[at] <= HALF_PEAK * peak)
            break;
    double side = u->across_first + (at + cut / 2.0) * u->step;
    double most = fmax(u->lean * (fmax(top, 0) - u->row) * cut,
                       u->lean * (fmin(bottom, p->rows - 1) - u->row) * cut);
    double edge = (cut < 0 ? 0 : p->columns - 1) - cut * most;
    double shows = fmin((edge - side) * cut, wide);
    double margin = fmin(CUT_MARGIN * shows, (1 - LOOKED_AT) / 2 * wide);
    shows = fmin(shows, wide - margin);
    u->half_window = (shows - margin) / 2;
    u->column = side + cut * (shows + margin) / 2;
    return u->half_window >= LEAST_LOOKED_AT;
}

/* Sets a candidate upright; the reason where that cannot be. ``aspect``: thickness in segments. */
int eye_straighten(const eye_picture *p, const eye_task *task, const eye_candidate *c,
                   const char *code, double aspect, int sharp, eye_upright *out)
{
    int segments = 2 * c->bits + 5;
    double unit = (c->bottom - c->top) / (segments - 4), wide = aspect * unit;
    double length = (segments - 2) * unit, row = (c->top + c->bottom) / 2;
    if (wide > LARGEST || length > LARGEST)
        return EYE_WRONG_WIDTH;
    double reach = wide + 4 + 0.03 * length; /* columns on either side, as it may lean */
    int step = (int)ceil((2 * reach + 1) / EYE_MOST_COLUMNS);
    if (step < (int)(wide / COLUMNS_ACROSS))
        step = (int)(wide / COLUMNS_ACROSS);
    int first = (int)floor(c->column - reach);
    int columns = (int)(2 * reach / step) + 2;
    columns = columns > EYE_MOST_COLUMNS ? EYE_MOST_COLUMNS : columns;
    band bands[2 * EYE_MOST_BITS + 4];
    int whole;
    int n = fill_bands(p, task, c, code, segments, unit, first, step, columns, sharp, bands, &whole);
    if (n < 2)
        return EYE_NO_CONTRAST;
    int cut = cut_by(p, c, wide);
    know_lean(bands, n, whole && !cut, wide, out);
    double across_first = first + (step - 1) / 2.0;
    cap_signal(bands, n, columns, (int)lround((c->column - across_first) / step));
    double stands = 0, lean = find_lean(bands, n, columns, step, row, length, wide > 2 ? wide : 2,
                                        sharp, cut, &stands);
    if (fabs(lean) > STEEPEST) {
        if (!sharp && (unit > UNSURE || stands < UPRIGHT))
            return EYE_LEANS;
        lean = c->lean; /* what stands beside a far one pulls at it, and so does noise */
    }
    if (c->settled && fabs(lean - c->lean) > SETTLED_LEAN)
        lean = c->lean;
    difference(bands, n, columns, step, row, lean, 0, sharp, out->across);
    for (int i = 0; i < columns; i++)
        if (first + i * step < 0 || first + (i + 1) * step > p->columns)
            out->across[i] = 0; /* beyond the picture */
    out->row = row;
    out->lean = lean;
    out->columns = columns;
    out->step = step;
    out->across_first = across_first;
    out->half_window = fmax(LOOKED_AT * wide / 2, LEAST_LOOKED_AT);
    int found = cut || find_middle(out, wide, &out->column);
    if (c->settled && (!found || fabs(out->column - c->column) > SETTLED_COLUMN))
        out->column = c->column;
    else if (!found)
        return EYE_NO_CONTRAST;
    if (cut && !find_rest(p, out, wide, cut, c->top - 2 * unit, c->bottom + 2 * unit))
        return EYE_CUT_OFF;
    difference(bands, n, columns, step, row, lean, 1, sharp, out->across);
    fill_profile(p, task, c->top - 2 * unit, c->bottom + 2 * unit, unit, out);
    return EYE_READ;
}
