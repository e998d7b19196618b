/* What speaks for something in front of a bit, or of several, whether they read dark or bright.
 *
 * A landmark's dark segments are painted with one black, and its sides are straight. What covers a
 * bit has another black (or other paint, where it is bright), or ends amid the dark rows, or shows
 * beside the pole at just these rows, with the very light that the bit has. Each of that alone
 * happens without a cover, if rarely, so they are added up; only what is seen at both sides of the
 * pole is enough by itself. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ENOUGH 1.85     /* evidence; a piece is hardly ever more than 1 without a cover, */
#define MOST_OF_ONE 1.25 /* and counts no more than this; but for the one that is */
#define CERTAIN 2.85    /* by itself, whatever else there is */
#define LEAST_ROWS 3.5  /* of a cover with fewer only what is certain counts */
#define MIDST_WIDE 0.4  /* half of the midst of a bit: of the strip's, */
#define MIDST_HIGH 0.3  /* segments; blur leaves it alone */
#define MOST_SEEN 8     /* rows and columns of it that are looked at, at the most */
#define MOST_ROWS 512   /* of what is beside a side, */
#define ROWS_A_UNIT 5.0 /* and how many a segment if there are many more */
#define REACH 0.8       /* segments that it goes on above and below the code */
#define TILTS 8         /* slopes of what lies aslant, to either side, */
#define TILT 0.2        /* by so many more segments up or down each */
#define LEVEL_TILTS 1   /* of them what is seen at one side only may have */
#define SAME_BOTH 0.015 /* of bright - dark: how much one thing may differ on the pole and beside; or */
#define SAME_SHARE 0.05 /* of how much it stands out, as far as that is no more than bright - dark */
#define SAME_ONE 0.02
#define SAME_NOISE 0.2  /* times the fit's rest, more; */
#define UNLIKE 5.0      /* times as much of SAME_ONE says nothing any more */
#define STANDS_OUT 0.2  /* from what is above and below, of bright - dark: what SAME_BOTH takes; */
#define STANDS_OUT_LEAST 0.08 /* what stands out by less than that, but by so much, takes SAME_SHARE */
#define STANDS_OUT_ONE 0.5 /* and at one side so that nothing is missing */
#define OTHER_BLACK 0.04   /* of bright - dark, and times the spread of the other dark segments: */
#define OTHER_SPREAD 2.0
#define OTHER_PAINT 0.25   /* of bright - dark; gloss and shade differ by less */
#define LIKE_PAINT 0.4     /* evidence of that below which it is the bars' paint */
#define SWELLS 0.45        /* columns by which a side stands out, and times as much elsewhere: */
#define SWELLS_SPREAD 3.0
#define BACKGROUND 0.25 /* of bright - dark: least light behind against which a side shows */
#define MERGES 0.04     /* of bright - dark: what differs by less may be one thing */
#define EDGE_SEEN 0.2   /* segments at the picture's edge that tell */
#define STEP 0.06       /* of bright - dark, amid dark rows, and times the usual rest there: */
#define STEP_SPREAD 4.0
#define EDGE 1.1        /* rows, and times the blur, that a bright segment's edge lightens */
#define EDGE_BLUR 2.2

enum { AT, OFF, BEHIND, STRIPS }; /* beside a side: just there, a little off, what stands behind */

static const double from_side[STRIPS] = {0.2, 0.8, 3.2}, to_side[STRIPS] = {1.8, 2.4, 6.2};

/* Light beside one side of a strip, summed up from its first row on. */
typedef struct {
    int first, rows, step; /* each the light of one row in so many of the picture */
    int seen[STRIPS];      /* whether all of it lies in the picture */
    int from[STRIPS], to[STRIPS]; /* the channels: only what lies a little off is asked for all */
    float sum[STRIPS][MOST_ROWS + 1][3];
} margin;

/* What is asked about. */
typedef struct {
    const eye_scale *scale;
    const char *code;
    double (*levels)[EYE_LIGHTS];
    int segments, channels;
    double dark[EYE_LIGHTS], bright[EYE_LIGHTS], contrast;
    double black, usual; /* brightness of the dark rows: the middle one and how far others are from it, */
    int has_rows;        /* if there are enough of them */
    int coloured;        /* whether the sides can be asked for */
    margin beside[2];
    double width[2][EYE_MOST_SEGMENTS], straight[2]; /* how far a side stands out, and usually does, */
    int shows[2];                                    /* if it is to be seen */
} scene;

/* Bits next to each other that one thing may lie over: one, or several dark ones. */
typedef struct {
    int first, last; /* segments */
    int top, bottom; /* the run of dark segments that they are in, and the first segment below it */
    double level[3]; /* their mean light, */
    double seen[3];  /* and that of their middle as it is in the picture */
    double along;    /* of dark ones: evidence that what is there goes on beside the pole */
} block;

static double row_of(const scene *s, double place)
{
    return eye_row_at(s->scale, place - s->segments / 2.0);
}

/* The largest difference in any channel, of bright - dark. */
static double apart(const scene *s, const double *one, const double *other)
{
    double most = 0;
    for (int c = 0; c < s->channels; c++)
        most = fmax(most, fabs(one[c] - other[c]));
    return most / s->contrast;
}

static double at_most(double evidence) { return eye_limit(evidence, 0, MOST_OF_ONE); }

static void fill_margin(const eye_picture *p, const eye_upright *u, const eye_side *side,
                        const scene *s, int low, int sign, margin *out)
{
    double half = (s->segments / 2.0 + REACH) * s->scale->unit;
    int last = (int)fmin(floor(s->scale->middle + half), p->rows - 1);
    out->first = (int)fmax(ceil(s->scale->middle - half), 0);
    out->step = (int)fmax(s->scale->unit / ROWS_A_UNIT, 1);
    if (last - out->first >= out->step * MOST_ROWS)
        out->step = (last - out->first) / MOST_ROWS + 1;
    out->rows = last < out->first ? 0 : (last - out->first) / out->step + 1;
    for (int k = 0; k < STRIPS; k++) {
        int all = k == OFF || low < 0 || p->channels < 3;
        out->from[k] = all ? 0 : low;
        out->to[k] = all ? p->channels - 1 : low;
        out->seen[k] = 1;
        memset(out->sum[k][0], 0, sizeof out->sum[k][0]);
    }
    for (int r = 0; r < out->rows; r++) {
        int y = out->first + r * out->step;
        double edge = side->column + u->lean * (y - u->row) + sign * side->half;
        const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride;
        for (int k = 0; k < STRIPS; k++) {
            int from = eye_ceil(edge + (sign > 0 ? from_side[k] : -to_side[k]));
            int to = eye_floor(edge + (sign > 0 ? to_side[k] : -from_side[k]));
            float part = 1 / (float)(to - from + 1);
            if (from < 0 || to >= p->columns)
                out->seen[k] = 0;
            for (int c = out->from[k]; c <= out->to[k]; c++) {
                float light = 0;
                for (int x = from; x <= to && out->seen[k]; x++)
                    light += eye_linear(row[x * p->channels + c]);
                out->sum[k][r + 1][c] = out->sum[k][r][c] + light * part;
            }
        }
    }
}

/* Mean light between two rows, in the strip's channels; 0 where they are not to be seen. */
static int light_between(const margin *of, int strip, double from, double to, double *light)
{
    double first = (from - of->first) / of->step, last = (to - of->first) / of->step;
    int a = eye_ceil(first), b = eye_floor(last);
    if (b < a)
        a = b = eye_floor((first + last) / 2 + 0.5);
    if (a < 0 || b >= of->rows || !of->seen[strip])
        return 0;
    for (int c = of->from[strip]; c <= of->to[strip]; c++)
        light[c] = (of->sum[strip][b + 1][c] - of->sum[strip][a][c]) / (float)(b - a + 1);
    return 1;
}

/* Half of the rows in the midst of a block that are looked at, segments: what is round is widest there. */
static double half_of(const block *over) { return MIDST_HIGH + (over->last - over->first) / 4.0; }

/* How much the light beside bits, ``shift`` segments lower, differs from theirs, and by how much it
 * stands out from what is beside the ends of their dark run. 0 where that is not to be seen, or where
 * it differs by more than ``most``. A cover that leaves a code hides no bright segment by halves: it
 * ends within the run. */
static int look_beside(const scene *s, int way, const block *over, double shift, double most,
                       double *unlike, double *out)
{
    double above[3], below[3], at[3];
    const margin *of = s->beside + way;
    double top = over->top + shift, bottom = over->bottom + shift;
    double middle = (over->first + over->last + 1) / 2.0 + shift;
    double half = half_of(over);
    if (!light_between(of, OFF, row_of(s, middle - half), row_of(s, middle + half), at))
        return 0;
    *unlike = apart(s, at, over->seen);
    if (*unlike > most ||
        !light_between(of, OFF, row_of(s, top - 1), row_of(s, top - 0.15), above) ||
        !light_between(of, OFF, row_of(s, bottom + 0.15), row_of(s, bottom + 1), below))
        return 0;
    *out = fmin(apart(s, above, over->seen), apart(s, below, over->seen));
    return 1;
}

/* Whether it is the same thing that differs so much on the pole and beside, and stands out so much. */
static int is_same(double unlike, double out, double both)
{
    double share = SAME_SHARE * fmin(out, 1);
    return out > 3 * both && unlike < (out < STANDS_OUT ? share : fmax(both, share));
}

/* Whether what is there goes on at both sides of the pole, and ends: evidence. */
static double goes_on(const scene *s, const block *over)
{
    double noise = SAME_NOISE * s->scale->noise, one = SAME_ONE + noise, both = SAME_BOTH + noise;
    double most = 0;
    int same[2][2 * TILTS + 1] = {{0}};
    for (int way = 0; way < 2; way++)
        for (int k = -TILTS; k <= TILTS; k++) {
            double unlike, out;
            if (!look_beside(s, way, over, TILT * k, UNLIKE * one, &unlike, &out) ||
                out < STANDS_OUT_LEAST)
                continue;
            same[way][k + TILTS] = is_same(unlike, out, both);
            if (abs(k) <= LEVEL_TILTS)
                most = fmax(most, fmin(out / STANDS_OUT_ONE, 1) * one / fmax(unlike, one / 2));
        }
    /* A straight thing lies as much higher on one side as it lies lower on the other. */
    for (int k = 0; k <= 2 * TILTS; k++)
        if (same[0][k] && same[1][2 * TILTS - k])
            return CERTAIN;
    /* Of a pole that a side of the picture cuts one side is all there is to see. */
    for (int way = 0; way < 2; way++)
        for (int k = TILTS - LEVEL_TILTS; k <= TILTS + LEVEL_TILTS; k++)
            if (same[way][k] && !s->beside[1 - way].seen[OFF])
                return CERTAIN;
    return at_most(most);
}

/* Whether their black is another one than that of the other dark segments: evidence. All channels
 * count alike: one thing differs in colour, another one in how light it is. */
static double other_black(const scene *s, const block *over)
{
    double squares = 0;
    for (int c = 0; c < s->channels; c++) {
        double values[EYE_MOST_SEGMENTS];
        int n = 0;
        for (int k = 2; k < s->segments - 2; k++)
            if (s->code[k] == '0' && (k < over->first - 1 || k > over->last + 1))
                values[n++] = s->levels[k][c];
        if (n < 3)
            return 0;
        double middle = eye_median(values, n);
        double spread = fmax(values[n - 1] - middle, middle - values[0]) / s->contrast;
        double off = fabs(over->level[c] - middle) / s->contrast;
        double much = off / (OTHER_BLACK + OTHER_SPREAD * spread);
        squares += much * much;
    }
    return at_most(sqrt(squares / s->channels));
}

/* Whether a bright bit's paint is another one than that of the end bars: evidence. */
static double other_paint(const scene *s, int i)
{
    double most = 0, share = (i - 0.5) / (s->segments - 2.0);
    for (int c = 0; c < s->channels; c++) {
        double first = (s->levels[0][c] + s->levels[1][c]) / 2;
        double last = (s->levels[s->segments - 1][c] + s->levels[s->segments - 2][c]) / 2;
        most = fmax(most, fabs(s->levels[i][c] - first - share * (last - first)));
    }
    return at_most(most / (OTHER_PAINT * s->contrast));
}

/* How far each side stands out at every segment. In the channel in which the paint is darkest, bright
 * and dark segments have the same sides. */
static void know_sides(scene *s, const eye_task *task, const eye_span *seen)
{
    double values[EYE_MOST_SEGMENTS], trim = eye_limit(0.5 - 0.6 / s->scale->unit, 0.1, 0.3);
    for (int way = 0; way < 2; way++) {
        double *width = s->width[way];
        int n = 0;
        for (int k = 0; k < s->segments; k++) {
            double at[3], behind[3], upper = row_of(s, k + trim), lower = row_of(s, k + 1 - trim);
            width[k] = NAN;
            if (!light_between(s->beside + way, AT, upper, lower, at) ||
                !light_between(s->beside + way, BEHIND, upper, lower, behind))
                continue;
            double room = behind[task->low] - s->dark[task->low];
            if (room < BACKGROUND * s->contrast)
                continue;
            width[k] = (to_side[AT] - from_side[AT]) * (behind[task->low] - at[task->low]) / room;
            values[n++] = width[k];
        }
        s->shows[way] = n >= seen->end - seen->first - 2;
        s->straight[way] = eye_median(values, n);
    }
}

/* Whether the sides stand out where the bits are, and nowhere else: evidence. */
static double swells(const scene *s, const block *over)
{
    double both = 0;
    for (int way = 0; way < 2; way++) {
        const double *width = s->width[way];
        double elsewhere = 0, usual = s->straight[way];
        if (!s->shows[way] || isnan(width[over->first]) || isnan(width[over->last]))
            continue;
        double here = INFINITY;
        for (int k = over->first; k <= over->last; k += 2)
            here = fmin(here, width[k]);
        for (int k = 0; k < s->segments; k++)
            if ((k < over->top || k >= over->bottom) && !isnan(width[k]))
                elsewhere = fmax(elsewhere, fabs(width[k] - usual));
        both += at_most((here - usual) / fmax(SWELLS, SWELLS_SPREAD * elsewhere));
    }
    return both;
}

/* The brightness of the dark rows, off the bright segments' edges, in the run from ``from`` to ``to`` or
 * (both 0) in all of them. */
static int dark_rows(const scene *s, const eye_upright *u, int from, int to, double *values)
{
    double keep = EDGE + EDGE_BLUR * s->scale->blur;
    int n = 0, r = 0;
    for (int i = 2, e; i < s->segments - 2; i = e) {
        for (e = i; e < s->segments - 2 && s->code[e] == s->code[i]; e++)
            ;
        if (s->code[i] == '1' || (to > 0 && (i != from || e != to)))
            continue;
        double upper = row_of(s, i) + keep, lower = row_of(s, e) - keep;
        for (; r < u->rows && u->first + r * u->bin + 0.5 <= upper; r++)
            ;
        for (; r < u->rows && u->first + (r + 1) * u->bin - 0.5 < lower; r++)
            values[n++] = u->light[r];
    }
    return n;
}

/* What is usual in the dark rows; 0 where there are hardly any. */
static int know_dark_rows(scene *s, const eye_upright *u)
{
    double values[EYE_MOST_ROWS];
    int n = dark_rows(s, u, 0, 0, values);
    if (n < 3)
        return 0;
    s->black = eye_median(values, n);
    for (int i = 0; i < n; i++)
        values[i] = fabs(values[i] - s->black);
    s->usual = 1.48 * eye_median(values, n);
    return 1;
}

/* Whether there is something brighter amid the run of dark rows: evidence. */
static double step(const scene *s, const eye_upright *u, int from, int to)
{
    double values[EYE_MOST_ROWS], most = 0, room = s->bright[EYE_LIGHT] - s->black;
    int n = dark_rows(s, u, from, to, values);
    for (int i = 0; i < n; i++)
        most = fmax(most, values[i] - s->black);
    return room > 0 ? at_most(most / (STEP * room + STEP_SPREAD * s->usual)) : 0;
}

/* Light of the midst of the strip between two rows, as it is in the picture. */
static void see(const eye_picture *p, const eye_upright *u, const eye_side *side, double from,
                double to, double *light)
{
    int a = eye_ceil(from), b = eye_floor(to), n = 0;
    if (b < a)
        a = b = eye_floor((from + to) / 2 + 0.5);
    a = eye_clamp(a, 0, p->rows - 1);
    b = eye_clamp(b, 0, p->rows - 1);
    int down = (b - a) / MOST_SEEN + 1;
    for (int y = a; y <= b; y += down) {
        double middle = side->column + u->lean * (y - u->row), half = MIDST_WIDE * side->half;
        int left = eye_ceil(middle - half), right = eye_floor(middle + half);
        if (right < left)
            left = right = eye_floor(middle + 0.5);
        int across = (right - left) / MOST_SEEN + 1;
        for (int x = left; x <= right; x += across, n++) {
            const uint8_t *pixel =
                p->pixels + y * p->stride + eye_clamp(x, 0, p->columns - 1) * p->channels;
            for (int c = 0; c < p->channels; c++)
                light[c] += eye_linear(pixel[c]);
        }
    }
    for (int c = 0; c < p->channels; c++)
        light[c] /= n;
}

/* The block from bit to bit. The light of several is that of what lies between them: bright segments
 * above and below lighten the ends. */
static block block_of(const scene *s, const eye_picture *p, const eye_upright *u, const eye_side *side,
                      int first, int last)
{
    block over = {.first = first, .last = last, .top = first, .bottom = last + 1};
    int from = last > first ? first + 1 : first, to = last > first ? last - 1 : last;
    for (int i = from; i <= to; i++)
        for (int c = 0; c < s->channels; c++)
            over.level[c] += s->levels[i][c] / (to - from + 1);
    while (s->code[first] == '0' && s->code[over.top - 1] == '0')
        over.top--;
    while (s->code[last] == '0' && s->code[over.bottom] == '0')
        over.bottom++;
    double middle = (first + last + 1) / 2.0, half = half_of(&over);
    see(p, u, side, row_of(s, middle - half), row_of(s, middle + half), over.seen);
    if (s->code[first] == '0')
        over.along = goes_on(s, &over);
    return over;
}

/* All that speaks for something in front of these bits; over few rows only what is certain. */
static double evidence_of(const scene *s, const eye_upright *u, const block *over)
{
    int bright = s->code[over->first] == '1';
    double rows = s->scale->unit * ((over->last - over->first) / 2.0 + 1);
    double paint = bright ? other_paint(s, over->first) : 0;
    if (bright && paint < LIKE_PAINT)
        return 0;
    double evidence = bright ? goes_on(s, over) : over->along;
    if (evidence > ENOUGH || rows < LEAST_ROWS)
        return evidence;
    evidence += bright ? paint : other_black(s, over);
    if (!bright && s->has_rows)
        evidence += step(s, u, over->top, over->bottom);
    return s->coloured && evidence <= ENOUGH ? evidence + swells(s, over) : evidence;
}

/* Whether what the picture shows last of a strip, at row ``edge``, is as black as what is beside it: then
 * something else may begin anywhere in this run of dark segments. */
static int merges(const scene *s, const eye_picture *p, const eye_upright *u, const eye_side *side,
                  double from, double to)
{
    double own[3] = {0}, at[3];
    int shown = 0, same = 0;
    see(p, u, side, from, to, own);
    for (int way = 0; way < 2; way++) {
        if (!light_between(s->beside + way, OFF, from, to, at))
            continue;
        shown++;
        same += apart(s, at, own) < MERGES + SAME_NOISE * s->scale->noise;
    }
    return same == shown;
}

/* Whether a strip that the picture cuts amid dark segments may be another one's, the end of which is
 * hidden by something black that reaches to the picture's edge. */
static int may_end_elsewhere(const scene *s, const eye_picture *p, const eye_task *task,
                             const eye_upright *u, const eye_side *side, const eye_span *seen)
{
    int first = seen->first, end = seen->end;
    double high = fmax(EDGE_SEEN * s->scale->unit, 2 * s->beside->step), last = p->rows - 1;
    if (end < s->segments && s->code[end - 1] == '0' && merges(s, p, u, side, last - high, last))
        while (s->code[end - 1] == '0')
            end--;
    if (first > 0 && s->code[first] == '0' && merges(s, p, u, side, 0, high))
        while (s->code[first] == '0')
            first++;
    return (first > seen->first || end < seen->end) &&
           !eye_only_one(task, s->code + first, end - first);
}

/* Whether something stands in front of bits, which makes one landmark of another. */
int eye_in_front(const eye_picture *p, const eye_task *task, const eye_upright *u,
                 const eye_scale *scale, const eye_side *side, const char *code,
                 double levels[][EYE_LIGHTS], int segments, const eye_span *seen)
{
    scene s; /* all but large tables set here */
    s.scale = scale;
    s.code = code;
    s.levels = levels;
    s.segments = segments;
    s.channels = p->channels;
    s.contrast = 0;
    double values[EYE_MOST_SEGMENTS];
    for (int c = 0; c < EYE_LIGHTS; c++) {
        int n = 0;
        for (int i = 2; i < segments - 2; i++)
            if (code[i] == '0')
                values[n++] = levels[i][c];
        s.dark[c] = eye_median(values, n);
        s.bright[c] = (levels[0][c] + levels[1][c] + levels[segments - 2][c] +
                       levels[segments - 1][c]) / 4;
        if (c < p->channels)
            s.contrast = fmax(s.contrast, s.bright[c] - s.dark[c]);
    }
    if (s.contrast <= 0)
        return 0;
    if (seen->first > 0 || seen->end < segments) {
        for (int way = 0; way < 2; way++)
            fill_margin(p, u, side, &s, task->low, way ? 1 : -1, s.beside + way);
        if (may_end_elsewhere(&s, p, task, u, side, seen))
            return 1;
    }
    block alone[EYE_MOST_SEGMENTS]; /* every bit by itself */
    int filled = 0;
    for (int i = 3; i < segments - 3; i += 2)
        for (int last = i; last < segments - 3; last += 2) {
            if ((last > i && (code[i] == '1' || code[last] == '1')) || i < seen->first ||
                last >= seen->end)
                break;
            if (!eye_mistakable(task, code, segments, i, last))
                continue;
            if (!filled) {
                for (int way = 0; way < 2; way++)
                    fill_margin(p, u, side, &s, task->low, way ? 1 : -1, s.beside + way);
                s.has_rows = know_dark_rows(&s, u);
                s.coloured = eye_is_coloured(p->channels, task);
                if (s.coloured)
                    know_sides(&s, task, seen);
                for (int k = 3; k < segments - 3; k += 2)
                    alone[k] = block_of(&s, p, u, side, k, k);
                filled = 1;
            }
            block over = last > i ? block_of(&s, p, u, side, i, last) : alone[i];
            if (alone[i].along >= CERTAIN || alone[last].along >= CERTAIN ||
                evidence_of(&s, u, &over) > ENOUGH)
                return 1;
        }
    return 0;
}
