/* Near codes that the picture's edge cuts: one end bar is out of the picture, and often a part of what
 * lies between the bars. What is left has to be the code of one landmark only. Whether it is dark there, or
 * hidden by something black, front.c asks. */
#include "search.h"

#include <math.h>

#define LEAST_SHOWN 6.0f /* segments beside the bar that the picture shows at least: two bits */
#define SLACK 0.05f      /* share of a segment by which a run may miss its length or place, */
#define ROUNDING 1.5f    /* and rows: near edges are sharp */
#define TELLS 0.5f       /* share of a segment that the picture shows if it tells bright from dark */

/* What a column shows of a code, from the end bar that is in the picture on to the picture's edge. */
typedef struct {
    int down;    /* the bar is the upper one */
    float room;  /* rows to the picture's edge */
    int ones;    /* bright runs on the way, */
    float begin[EYE_MOST_BITS], end[EYE_MOST_BITS]; /* rows from the bar */
} shown;

/* Measures runs beside a bar, from the first one that has not been measured to ``ones`` of them. */
static void measure_runs(const eye_run *bar, int ones, shown *out)
{
    int down = out->down;
    for (int k = out->ones; k < ones; k++) {
        const eye_run *one = down ? bar + 1 + k : bar - 1 - k;
        out->begin[k] = down ? one->start - bar->end : bar->start - one->end;
        out->end[k] = down ? one->end - bar->end : bar->start - one->start;
    }
    out->ones = ones;
}

static int is_cut(const shown *s, int k) { return s->end[k] >= s->room - 0.5f; }

/* Rows per segment if the run ``k`` is this bit, counted from the bar on. */
static float unit_of(const shown *s, int k, int bit)
{
    return is_cut(s, k) ? s->begin[k] / (float)(2 * bit + 1) : s->end[k] / (float)(2 * bit + 2);
}

/* The bits that are bright; 0 where the runs are not where bits are. ``unit``: about so many rows per
 * segment, and then as the last run has it. */
static unsigned read_shown(const shown *s, float *unit)
{
    unsigned bright = 0;
    int last = -1;
    float slack = SLACK * *unit + ROUNDING;
    for (int k = 0; k < s->ones; k++) {
        int bit = eye_floor((s->begin[k] / *unit - 1) / 2 + 0.5f);
        float length = s->end[k] - s->begin[k], begin = *unit * (float)(2 * bit + 1);
        if (bit <= last || bit >= EYE_MOST_BITS || fabsf(s->begin[k] - begin) > slack ||
            length > *unit + slack || (length < *unit - slack && !is_cut(s, k)))
            return 0;
        last = bit;
        bright |= 1u << bit;
    }
    *unit = unit_of(s, s->ones - 1, last);
    return bright;
}

/* The landmark of which the picture shows so many segments beside the bar, these bits of them bright; 0
 * where there is none, or where it may be any of several. */
static int landmark_with(const eye_task *task, int down, unsigned bright, float segments_shown)
{
    enum { MOST = EYE_CODE_SIZE + 2 };
    char part[MOST];
    int count = 0;
    for (; count < MOST; count++) {
        int at = count - 2; /* beside the bar */
        if (at >= 0 && (float)at + TELLS > segments_shown && bright >> at / 2 == 0)
            break;
        part[down ? count : MOST - 1 - count] =
            at < 0 || (at % 2 && bright >> at / 2 & 1) ? '1' : '0';
    }
    return eye_only_one(task, down ? part : part + MOST - count, count);
}

/* Adds the codes that end at the picture's edge and have this bar. */
static void match_bar(eye_hits *hits, const eye_run *bar, int ones, int most, int down,
                      float column)
{
    int rows = hits->picture->rows;
    float length = bar->end - bar->start;
    int bar_cut = down ? bar->start <= 0.0f : bar->end >= (float)(rows - 1);
    shown s;
    s.down = down;
    s.room = down ? (float)rows - 0.5f - bar->end : bar->start + 0.5f;
    s.ones = 0;
    measure_runs(bar, 1, &s); /* most bars fail by the first one */
    if (bar_cut && ones == 1 && is_cut(&s, 0)) /* no run as a whole: nothing tells its length */
        return;
    for (int first = 0; first < most; first++) {
        float unit = unit_of(&s, 0, first), slack = SLACK * unit + ROUNDING, whole = EYE_BAR * unit;
        if (unit < EYE_CUT_UNIT || length > whole + slack)
            return; /* still smaller ones will not do either */
        if (s.room < LEAST_SHOWN * unit ||
            length < (bar_cut ? EYE_BOTH_CUT * unit : whole - slack))
            continue;
        measure_runs(bar, ones, &s);
        unsigned bright = read_shown(&s, &unit);
        int contrast = bright ? eye_contrast(down ? bar : bar - ones, down ? bar + ones : bar) : 0;
        if (contrast == 0)
            continue;
        int id = landmark_with(hits->task, down, bright, s.room / unit);
        if (id == 0 || hits->n_hits >= EYE_MOST_HITS)
            continue;
        int bits = hits->task->kinds[id].bits;
        float inner = unit * (float)(2 * bits + 1);
        hits->hits[hits->n_hits++] = (eye_hit){
            .column = column,
            .top = down ? bar->end : bar->start - inner,
            .bottom = down ? bar->end + inner : bar->start,
            .bits = (int16_t)bits,
            .id = (int16_t)id,
            .open_top = !down || bar_cut,
            .open_bottom = down || bar_cut,
            .contrast = (uint8_t)contrast,
            .cut = 1,
        };
    }
}

/* Whether a run is not too long for an end bar, if the one beside it is a bit: most are, or are short. */
static inline int is_like_bar(const eye_run *bar, const eye_run *bit, int rows)
{
    float length = bit->end - bit->start;
    return bit->start <= 0.0f || bit->end >= (float)(rows - 1) || /* of a cut one who knows */
           bar->end - bar->start <= (EYE_BAR + 4 * SLACK) * length + 4 * ROUNDING;
}

/* Codes that are cut by the lower or upper edge of the picture. */
void eye_match_cut(eye_hits *hits, const eye_run *runs, int count, float column)
{
    int most = hits->n_bits > 0 ? hits->bits[hits->n_bits - 1] : 0, rows = hits->picture->rows;
    for (int ones = 1; ones <= most && ones < count; ones++) {
        const eye_run *upper = runs + count - 1 - ones, *lower = runs + ones;
        if (is_like_bar(upper, upper + 1, rows))
            match_bar(hits, upper, ones, most, 1, column);
        if (is_like_bar(lower, lower - 1, rows))
            match_bar(hits, lower, ones, most, 0, column);
    }
}
