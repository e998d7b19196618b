/* The likeliest of all codes, where segments are a few rows high and one by one say little.
 *
 * So whole codes are laid on the light, each at all places about a candidate, in some sizes and leans,
 * and the one that explains most is taken. What there is to explain is the light of the strip alone: in
 * every row it is told from what stands to its left and right by how a lens spreads the three. Where the
 * code ends nothing may go on. Brightness and colour are two witnesses, each with the blur that it
 * usually has and the noise that the code leaves over: of normal noise the odds are a power of how many
 * times less that is. */
#include "internal.h"

#include <math.h>
#include <string.h>

#define MOST_ROWS 160   /* that are looked at: a multiple of four */
#define HALF 6          /* columns to either side of a place across that are told apart; */
#define TAPS (2 * HALF + 1)
#define NEARER 3.5      /* from so many off they count less */
#define ACROSS 17       /* places across, half a column apart */
#define SPAN ((ACROSS - 1) / 2 + TAPS) /* columns that take part */
#define SOFT 0.65       /* columns by which lens and mosaic spread light */
#define FINE 8          /* parts of a column */
#define BLUR 0.67       /* rows by which brightness is blurred, pixels included, */
#define COLOUR_BLUR 1.14 /* and colour, by a mosaic or JPEG */
#define SHOWS 2.5       /* times the blur: light does not reach farther */
#define STEP 0.25       /* segments from one place that is tried to the next, */
#define STEP_SIZE 0.04  /* and the share by which sizes differ */
#define CLIMBS 4        /* steps that the likeliest may be off a candidate's place and size */
#define LEAN 0.035      /* columns per row */
#define PROMISING 12.0   /* odds, as a logarithm, where a candidate is: less is not looked at closely */
#define ENOUGH 24.0     /* odds against no code at all */
#define ENOUGH_APART 2.0 /* and against any other code */
#define HOPELESS 6.0    /* and by how much less is of no use, however well it fits */
#define END 0.4         /* segments, and half a row, beyond an end that its blur reaches, */
#define BEYOND 2.0      /* and up to which nothing may go on */
#define GREY 0.004      /* light: one grey level, which says nothing */
#define PARTS (EYE_MOST_BITS + 1)
#define FOUR 4

enum { LIGHT, COLOUR, PLANES };

/* The strip's light by plane, place across and row: told from what is beside it, and what it has more. */
typedef struct {
    int planes, first, rows;
    int free;      /* rows of the candidate that may tell codes apart */
    double column; /* of the first place across */
    float line[PLANES][SPAN][MOST_ROWS]; /* the picture's light by column, */
    float taps[2][2][TAPS];              /* the filters: light and more, for whole and half columns */
    int known[ACROSS];
    float light[PLANES][ACROSS][MOST_ROWS], more[PLANES][ACROSS][MOST_ROWS];
} field;

/* A code of some place and size in parts: its end bars, and every bit; what is the same in all rows or
 * changes evenly along them is taken off. Behind the rows there are noughts, up to a multiple of four. */
typedef struct {
    int first, rows, parts;
    int above[2], below[2]; /* rows beyond its ends: the first, and behind the last */
    float even[2][MOST_ROWS];
    float part[PLANES][PARTS][MOST_ROWS];
    double common[PLANES][PARTS][PARTS]; /* products of two parts */
} pattern;

/* A place of a code. */
typedef struct {
    double row, unit, lean; /* row: of its middle */
    int across;
} spot;

/* What is known of one spot. */
typedef struct {
    const field *field;
    const pattern *of;
    double seen[PLANES][PARTS]; /* products of light and part */
    double total[PLANES];       /* sum of squares that a code may explain, */
    double rest[PLANES];        /* and of what none does: beyond its ends, and a grey level a row */
} sums;

/* The odds of every code, as a logarithm, and where the likeliest is. */
typedef struct {
    double odds[EYE_IDS];
    int id;
    spot at;
} likeliest;

typedef float quad __attribute__((vector_size(FOUR * sizeof(float))));

/* Of rows up to a multiple of four, which are noughts behind the last. */
static float product(const float *one, const float *other, int rows)
{
    quad sum = {0};
    for (int i = 0; i < rows; i += FOUR) {
        quad a, b;
        memcpy(&a, one + i, sizeof a);
        memcpy(&b, other + i, sizeof b);
        sum += a * b;
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

static void add(float *to, const float *other, float share, int rows)
{
    for (int i = 0; i < rows; i += FOUR) {
        quad a, b;
        memcpy(&a, to + i, sizeof a);
        memcpy(&b, other + i, sizeof b);
        a += share * b;
        memcpy(to + i, &a, sizeof a);
    }
}

/* The filters that tell the light of a strip ``wide`` columns wide from that at its sides: least squares
 * of three things side by side, each spread by a lens. ``off``: where its middle is. */
static int make_taps(double wide, double off, float *light, float *more)
{
    double shape[TAPS][3] = {{0}}, weight[TAPS], normal[9] = {0};
    for (int i = 0; i < TAPS; i++) {
        double far = (i - HALF - off) / NEARER;
        for (int k = 0; k < FINE; k++) {
            double x = i - HALF - off + (k + 0.5) / FINE - 0.5;
            double left = eye_cumulative((-wide / 2 - x) / SOFT);
            double right = eye_cumulative((x - wide / 2) / SOFT);
            shape[i][0] += (1 - left - right) / FINE;
            shape[i][1] += left / FINE;
            shape[i][2] += right / FINE;
        }
        weight[i] = exp(-far * far / 2);
        for (int a = 0; a < 9; a++)
            normal[a] += weight[i] * shape[i][a / 3] * shape[i][a % 3];
    }
    /* The strip's level, and that less the mean of the others'. */
    double row[3][2] = {{1, 1}, {0, -0.5}, {0, -0.5}};
    if (!eye_solve(normal, row[0], 3, 2))
        return 0;
    for (int i = 0; i < TAPS; i++) {
        const double *s = shape[i];
        light[i] = (float)(weight[i] * (row[0][0] * s[0] + row[1][0] * s[1] + row[2][0] * s[2]));
        more[i] = (float)(weight[i] * (row[0][1] * s[0] + row[1][1] * s[1] + row[2][1] * s[2]));
    }
    return 1;
}

static int has_bits(const eye_task *task, int bits)
{
    for (int id = 1; id < EYE_IDS; id++)
        if (task->kinds[id].bits == bits)
            return 1;
    return 0;
}

static int longest_of(const eye_task *task)
{
    int bits = EYE_MOST_BITS;
    while (bits > 0 && !has_bits(task, bits))
        bits--;
    return bits;
}

/* The light about a candidate; 0 where there is too much of it, or nothing beside it. */
static int fill_field(const eye_picture *p, const eye_task *task, const eye_candidate *c,
                      double wide, double unit, int segments, field *out)
{
    int longest = 2 * longest_of(task) + 5;
    double reach = (longest - segments / 2.0 + BEYOND) * (1 + STEP_SIZE * CLIMBS) + CLIMBS * STEP;
    double middle = (c->top + c->bottom) / 2;
    int top = eye_clamp(eye_floor(middle - reach * unit), 0, p->rows - 1);
    int bottom = eye_clamp(eye_ceil(middle + reach * unit), 0, p->rows - 1);
    int left = (int)lround(c->column) - (ACROSS - 1) / 4;
    if (bottom - top >= MOST_ROWS - FOUR || !make_taps(wide, 0, out->taps[0][0], out->taps[0][1]) ||
        !make_taps(wide, 0.5, out->taps[1][0], out->taps[1][1]))
        return 0;
    out->planes = eye_is_coloured(p->channels, task) ? PLANES : 1;
    out->first = top;
    out->rows = bottom - top + 1;
    out->free = (int)(segments * unit) - 2;
    out->column = left;
    memset(out->known, 0, sizeof out->known);
    for (int r = 0; r < out->rows; r++) {
        const uint8_t *row = p->pixels + (ptrdiff_t)(top + r) * p->stride;
        for (int i = 0; i < SPAN; i++) {
            const uint8_t *pixel =
                row + (ptrdiff_t)p->channels * eye_clamp(left - HALF + i, 0, p->columns - 1);
            out->line[LIGHT][i][r] =
                eye_linear_sixteenths(eye_brightness(pixel, p->channels, task));
            if (out->planes > COLOUR)
                out->line[COLOUR][i][r] =
                    eye_linear(pixel[task->high]) - eye_linear(pixel[task->low]);
        }
    }
    return 1;
}

/* The strip's light at one place across, as soon as somebody asks for it. */
static void know(field *f, int across)
{
    if (f->known[across])
        return;
    f->known[across] = 1;
    for (int k = 0; k < f->planes; k++) {
        float *light = f->light[k][across], *more = f->more[k][across];
        memset(light, 0, sizeof *light * MOST_ROWS);
        memset(more, 0, sizeof *more * MOST_ROWS);
        for (int i = 0; i < TAPS; i++) {
            add(light, f->line[k][across / 2 + i], f->taps[across % 2][0][i], f->rows);
            add(more, f->line[k][across / 2 + i], f->taps[across % 2][1][i], f->rows);
        }
    }
}

static void take_even_off(const pattern *of, float *values)
{
    for (int k = 0; k < 2; k++)
        add(values, of->even[k], -product(of->even[k], values, of->rows), of->rows);
}

/* What is the same in all rows, and what changes evenly along them. */
static void fill_even(pattern *out)
{
    double middle = (out->rows - 1) / 2.0, norm = 0;
    for (int i = 0; i < out->rows; i++)
        norm += (i - middle) * (i - middle);
    memset(out->even, 0, sizeof out->even);
    for (int i = 0; i < out->rows; i++) {
        out->even[0][i] = (float)(1 / sqrt(out->rows));
        out->even[1][i] = (float)((i - middle) / sqrt(norm));
    }
}

/* A bright stretch between two places, rows of the pattern, blurred; a dark one if they are the other way
 * round. */
static void fill_stretch(double from, double to, double blur, int rows, float *out)
{
    int first = eye_clamp(eye_ceil(fmin(from, to) - SHOWS * blur), 0, rows);
    int last = eye_clamp(eye_ceil(fmax(from, to) + SHOWS * blur), 0, rows);
    double sharp = 1 / blur;
    memset(out, 0, sizeof *out * MOST_ROWS);
    for (int i = first; i < last; i++)
        out[i] = (float)(eye_cumulative((i - from) * sharp) - eye_cumulative((i - to) * sharp));
}

/* The parts of a code at a spot; 0 where it is not in the field. */
static int make_pattern(const field *f, const spot *at, int bits, pattern *out)
{
    double unit = at->unit, half = (bits + 2.5) * unit;
    double top = at->row - half - f->first, bottom = at->row + half - f->first;
    int first = eye_floor(top + 0.5), last = eye_ceil(bottom - 0.5);
    first = first < 0 ? 0 : first;
    last = last > f->rows - 1 ? f->rows - 1 : last;
    if (top < -1 || bottom > f->rows || last - first < 2 * bits + 5)
        return 0;
    out->first = first;
    out->rows = last - first + 1;
    out->parts = bits + 1;
    out->above[0] = eye_clamp(eye_ceil(top - BEYOND * unit), 0, f->rows);
    out->above[1] = eye_clamp(eye_ceil(top - END * unit - 0.5), 0, f->rows);
    out->below[0] = eye_clamp(eye_ceil(bottom + END * unit + 0.5), 0, f->rows);
    out->below[1] = eye_clamp(eye_ceil(bottom + BEYOND * unit), 0, f->rows);
    fill_even(out);
    top -= first;
    bottom -= first;
    for (int k = 0; k < f->planes; k++) {
        double blur = k == LIGHT ? BLUR : COLOUR_BLUR;
        /* The end bars: what is between them, upside down. What all rows share is taken off. */
        fill_stretch(bottom - 2 * unit, top + 2 * unit, blur, out->rows, out->part[k][0]);
        for (int bit = 0; bit < bits; bit++) {
            double from = top + (3 + 2 * bit) * unit;
            fill_stretch(from, from + unit, blur, out->rows, out->part[k][bit + 1]);
        }
        for (int a = 0; a <= bits; a++) {
            take_even_off(out, out->part[k][a]);
            for (int b = 0; b <= a; b++)
                out->common[k][a][b] = out->common[k][b][a] =
                    product(out->part[k][a], out->part[k][b], out->rows);
        }
    }
    return 1;
}

/* The strip's light at a spot, in ``light`` and ``more``: every row at the place across that the lean
 * leads to. */
static void follow(field *f, const spot *at, int plane, float *light, float *more)
{
    for (int r = 0; r < f->rows; r++) {
        double aside = 2 * at->lean * (f->first + r - at->row);
        int across = eye_clamp(at->across + eye_floor(aside + 0.5), 0, ACROSS - 1);
        know(f, across);
        light[r] = f->light[plane][across][r];
        more[r] = f->more[plane][across][r];
    }
}

/* What goes on beyond the ends. */
static double goes_on(const pattern *of, const float *more)
{
    double sum = 0;
    for (int r = of->above[0]; r < of->above[1]; r++)
        sum += more[r] * more[r];
    for (int r = of->below[0]; r < of->below[1]; r++)
        sum += more[r] * more[r];
    return sum;
}

static void sum_up(field *f, const pattern *of, const spot *at, sums *out)
{
    float aslant[2][MOST_ROWS], light[MOST_ROWS];
    out->field = f;
    out->of = of;
    know(f, at->across);
    for (int k = 0; k < f->planes; k++) {
        const float *seen = f->light[k][at->across], *more = f->more[k][at->across];
        if (at->lean != 0) {
            follow(f, at, k, aslant[0], aslant[1]);
            seen = aslant[0];
            more = aslant[1];
        }
        memset(light + of->rows / FOUR * FOUR, 0, sizeof *light * FOUR);
        memcpy(light, seen + of->first, sizeof *light * (size_t)of->rows);
        take_even_off(of, light);
        out->total[k] = product(light, light, of->rows);
        out->rest[k] = goes_on(of, more) + of->rows * GREY * GREY;
        for (int a = 0; a < of->parts; a++)
            out->seen[k][a] = product(light, of->part[k][a], of->rows);
    }
}

/* How many times less a code leaves over than no code does, of all planes together; 1 where it would be
 * bright where it is dark. */
static double times_less(const sums *s, int id)
{
    double times = 1;
    for (int k = 0; k < s->field->planes; k++) {
        const double(*common)[PARTS] = s->of->common[k];
        double seen = s->seen[k][0], norm = common[0][0];
        for (int a = 1; a < s->of->parts; a++) {
            if (!(id >> (a - 1) & 1))
                continue;
            seen += s->seen[k][a];
            norm += common[a][a] + 2 * common[0][a];
            for (int b = 1; b < a; b++)
                norm += id >> (b - 1) & 1 ? 2 * common[a][b] : 0;
        }
        if (seen <= 0)
            return 1;
        double left = fmax(s->total[k] - seen * seen / norm, 0);
        times *= (s->total[k] + s->rest[k]) / (left + s->rest[k]);
    }
    return times;
}

static void note(const sums *s, const spot *at, int id, double times, likeliest *best)
{
    double odds = s->field->free / 2.0 * log(times);
    if (odds <= best->odds[id])
        return;
    best->odds[id] = odds;
    if (odds > best->odds[best->id] || id == best->id) {
        best->id = id;
        best->at = *at;
    }
}

/* Notes the likeliest code of a spot, and (``rivals``) those of which one bit or two differ. */
static void try_spot(field *f, const pattern *of, const spot *at, int rivals, likeliest *best)
{
    sums s;
    int id = best->id, bits = of->parts - 1;
    sum_up(f, of, at, &s);
    double times = times_less(&s, id);
    for (int same = 0, bit = 0; same < bits; same++, bit = (bit + 1) % bits) {
        double other = times_less(&s, id ^ 1 << bit);
        if (other > times) {
            times = other;
            id ^= 1 << bit;
            same = -1;
        }
    }
    note(&s, at, id, times, best);
    for (int a = 0; rivals && a < bits; a++)
        for (int b = 0; b <= a; b++) {
            int other = id ^ 1 << a ^ (b < a ? 1 << b : 0);
            note(&s, at, other, times_less(&s, other), best);
        }
}

/* Where to look about a spot: steps to either side of it. */
typedef struct {
    double step; /* of place and size, in STEP and STEP_SIZE */
    int off, size, across, leans;
    int columns; /* half ones, a step across */
    int rivals;  /* whether codes that are hardly likely are of interest */
} reach;

/* Tries all codes at the spots about one: that differ from it in place, or in size, or across. */
static void try_about(field *f, spot about, double unit, int bits, const reach *to, likeliest *best)
{
    pattern of;
    for (int j = -to->size; j <= to->size; j++)
        for (int i = -to->off; i <= to->off; i++) {
            int here = i == 0 && j == 0, leans = here ? to->leans : 0, across = here ? to->across : 0;
            spot at = {.row = about.row + i * to->step * STEP * unit,
                       .unit = about.unit + j * to->step * STEP_SIZE * unit};
            if ((i != 0 && j != 0) || !make_pattern(f, &at, bits, &of))
                continue;
            for (int k = -leans; k <= leans; k++)
                for (int c = -across; c <= across; c++) {
                    at.lean = about.lean + k * LEAN;
                    at.across = eye_clamp(about.across + to->columns * c, 0, ACROSS - 1);
                    try_spot(f, &of, &at, to->rivals, best);
                }
        }
}

/* Looks for the likeliest code, from where a candidate is upwards; 0 where there is no trace of one. */
static int climb(field *f, spot here, int bits, likeliest *best)
{
    static const reach seed = {1, 0, 1, 1, 0, 2, 0}, near = {1, 1, 1, 1, 0, 2, 0},
                       aslant = {1, 0, 0, 1, 1, 1, 1}, fine = {0.5, 1, 1, 0, 0, 1, 1};
    double unit = here.unit, before = -1;
    try_about(f, here, unit, bits, &seed, best);
    if (best->id == 0 || best->odds[best->id] < PROMISING)
        return 0;
    for (int i = 0; i < CLIMBS && best->odds[best->id] > fmax(before, i * PROMISING); i++) {
        before = best->odds[best->id];
        try_about(f, best->at, unit, bits, &near, best);
    }
    try_about(f, best->at, unit, bits, &aslant, best);
    try_about(f, best->at, unit, bits, &fine, best);
    return best->id != 0 && best->odds[best->id] > ENOUGH - HOPELESS;
}

/* The odds of the likeliest code of another length: of the same height, or of the same segments from either
 * end on, or about the middle. */
static double odds_of_others(field *f, const eye_task *task, int bits, const spot *at)
{
    double most = 0;
    for (int other = 1; other <= EYE_MOST_BITS; other++) {
        if (other == bits || !has_bits(task, other))
            continue;
        double sizes[] = {1, (2 * bits + 5) / (2.0 * other + 5), (2 * bits + 1) / (2.0 * other + 1)};
        for (int k = 0; k < 3; k++)
            for (int way = k ? 0 : -1; way <= (k ? 0 : 1); way++) {
                spot here = {.row = at->row + way * (other - bits) * at->unit,
                             .unit = at->unit * sizes[k], .across = at->across};
                likeliest best = {.id = 0};
                f->free = (int)((2 * other + 5) * here.unit) - 2;
                climb(f, here, other, &best);
                most = fmax(most, best.odds[best.id]);
            }
    }
    return most;
}

/* Puts a candidate where the likeliest of all codes is, as far as that can be told; 0 where none is
 * likely. */
int eye_weigh_codes(const eye_picture *p, const eye_task *task, double aspect, eye_candidate *c)
{
    int segments = 2 * c->bits + 5;
    double unit = (c->bottom - c->top) / (segments - 4), rival = 0;
    spot here = {.row = (c->top + c->bottom) / 2, .unit = unit, .across = ACROSS / 2};
    field f;
    likeliest best = {.id = 0};
    if (!fill_field(p, task, c, aspect * unit, unit, segments, &f))
        return 1; /* too long for this: it is examined where it is */
    if (!climb(&f, here, c->bits, &best))
        return 0;
    for (int id = 0; id < 1 << c->bits; id++)
        if (id != best.id && best.odds[id] > rival)
            rival = best.odds[id];
    if (odds_of_others(&f, task, c->bits, &best.at) > best.odds[best.id] - ENOUGH_APART)
        return 0;
    double half = (segments / 2.0 - 2) * best.at.unit;
    c->odds = fmin(best.odds[best.id] - ENOUGH, best.odds[best.id] - rival - ENOUGH_APART);
    c->id = best.id;
    c->column = f.column + best.at.across / 2.0;
    c->top = best.at.row - half;
    c->bottom = best.at.row + half;
    c->lean = best.at.lean;
    c->settled = 1;
    return 1;
}
