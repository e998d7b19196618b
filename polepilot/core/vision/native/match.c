/* Near codes: runs of one column that have the proportions of a code's inner part. */
#include "search.h"

#include <math.h>

#define SLACK 0.28f     /* share of a segment by which a run may miss its length or place */
#define ROUNDING 0.75f  /* rows by which it may miss besides */
#define FRAYED 0.35f    /* rows by which a bar may be shorter besides: its end has lost colour */
#define SHALLOWEST 0.7 /* share of the dimmest run above which fences are none */
#define BAR 2.0f        /* segments of an end bar, */
#define CUT_BAR 1.5f    /* and what shows at least of one that the picture's edge cuts */

/* The bits that ``ones`` runs after ``upper`` say, each a segment long and at its place; else 0. */
static int read_runs(const eye_run *upper, int ones, int bits, float top, float unit, float slack)
{
    int id = 0, last = -1;
    for (const eye_run *one = upper + 1; one <= upper + ones; one++) {
        float length = one->end - one->start;
        float middle = ((one->start + one->end) / 2 - top) / unit;
        int bit = (int)floorf((middle - 1.5f) / 2 + 0.5f);
        if (bit <= last || bit >= bits || fabsf(length - unit) > slack ||
            fabsf(middle - 1.5f - 2 * (float)bit) * unit > slack)
            return 0;
        last = bit;
        id |= 1 << bit;
    }
    return id;
}

/* The dimmest of the runs from ``upper`` to ``lower`` against the brightest valley between them; 0
 * where that is hardly darker. */
static int contrast_of(const eye_run *upper, const eye_run *lower)
{
    int dimmest = lower->peak, brightest = 0;
    for (const eye_run *one = upper; one < lower; one++) {
        dimmest = one->peak < dimmest ? one->peak : dimmest;
        brightest = one->valley > brightest ? one->valley : brightest;
    }
    return brightest > SHALLOWEST * dimmest ? 0 : dimmest - brightest;
}

/* Adds the code between two end bars, if there is one. */
static void match_bars(eye_hits *hits, const eye_run *upper, const eye_run *lower, int bits,
                       float unit, float column)
{
    float slack = SLACK * unit + ROUNDING, bar_slack = slack + FRAYED;
    float above = upper->end - upper->start, below = lower->end - lower->start;
    int cut_above = upper->start <= 0.0f;
    int cut_below = lower->end >= (float)(hits->picture->rows - 1);
    if (above < (cut_above ? CUT_BAR : BAR) * unit - bar_slack ||
        below < (cut_below ? CUT_BAR : BAR) * unit - bar_slack)
        return;
    int id = read_runs(upper, (int)(lower - upper) - 1, bits, upper->end, unit, slack);
    int contrast = id ? contrast_of(upper, lower) : 0;
    if (contrast == 0 || hits->n_hits >= EYE_MOST_HITS)
        return;
    hits->hits[hits->n_hits++] = (eye_hit){
        .column = column,
        .top = upper->end,
        .bottom = lower->start,
        .bits = (int16_t)bits,
        .id = (int16_t)id,
        .open_top = cut_above || above > BAR * unit + slack,
        .open_bottom = cut_below || below > BAR * unit + slack,
        .contrast = (uint8_t)contrast,
    };
}

/* Every sequence of runs that looks like a code becomes a hit. */
void eye_match_runs(eye_hits *hits, const eye_run *runs, int count, float column)
{
    for (int b = 0; b < hits->n_bits; b++) {
        int bits = hits->bits[b];
        float segments = (float)(2 * bits + 1); /* of the inner part */
        for (int i = 0; i + 2 < count; i++) {
            const eye_run *upper = runs + i;
            /* How long the inner part is at most, where the run is an end bar as a whole. */
            float bar = upper->end - upper->start + (FRAYED + ROUNDING);
            float most = upper->start <= 0.0f ? 1e9f : segments * bar / (BAR - SLACK);
            if (most < segments * EYE_SHORTEST)
                continue;
            for (int ones = 1; ones <= bits && i + ones + 1 < count; ones++) {
                const eye_run *lower = upper + ones + 1;
                float length = lower->start - upper->end, unit = length / segments;
                if (length > most)
                    break;
                if (unit >= EYE_SHORTEST)
                    match_bars(hits, upper, lower, bits, unit, column);
            }
        }
    }
}
