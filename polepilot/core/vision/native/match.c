/* Near codes: runs of one column that have the proportions of a code's inner part. */
#include "search.h"

#include <math.h>

#define SHALLOWEST 0.7 /* share of the dimmest run above which fences are none */
#define SPARE 1.001f   /* times as long; less is left to exact comparisons */
#define CUT_BAR 1.5f    /* and what shows at least of one that the picture's edge cuts */

/* The bits that ``ones`` runs after ``upper`` say, each a segment long and at its place; else 0. */
static int read_runs(const eye_run *upper, int ones, int bits, float top, float unit, float slack)
{
    int id = 0, last = -1;
    for (const eye_run *one = upper + 1; one <= upper + ones; one++) {
        float length = one->end - one->start;
        float middle = ((one->start + one->end) / 2 - top) / unit;
        int bit = eye_floor((middle - 1.5f) / 2 + 0.5f);
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
int eye_contrast(const eye_run *upper, const eye_run *lower)
{
    int dimmest = lower->peak, brightest = 0;
    for (const eye_run *one = upper; one < lower; one++) {
        dimmest = one->peak < dimmest ? one->peak : dimmest;
        brightest = one->valley > brightest ? one->valley : brightest;
    }
    return brightest > SHALLOWEST * dimmest ? 0 : dimmest - brightest;
}

/* Whether two runs are long enough for end bars, as far as the picture shows them, and ``one`` as
 * long as a bit: most of what looks like a code for a moment does not for longer. */
static inline int are_bars(const eye_hits *hits, const eye_run *upper, const eye_run *lower,
                           const eye_run *one, float unit)
{
    float above = upper->end - upper->start, below = lower->end - lower->start;
    int cut_above = upper->start <= 0.0f;
    int cut_below = lower->end >= (float)(hits->picture->rows - 1);
    float slack = EYE_SLACK * unit + (EYE_ROUNDING + EYE_FRAYED), whole = EYE_BAR * unit - slack;
    float cut = unit < EYE_CUT_UNIT ? CUT_BAR * unit - slack : 0;
    return above >= (cut_above ? cut : whole) && below >= (cut_below ? cut : whole) &&
           (!cut_above || !cut_below || above >= EYE_BOTH_CUT * unit || below >= EYE_BOTH_CUT * unit) &&
           fabsf(one->end - one->start - unit) <= EYE_SLACK * unit + EYE_ROUNDING;
}

/* Adds the code between two end bars; whether there is one. */
static int match_bars(eye_hits *hits, const eye_run *upper, const eye_run *lower, int bits,
                      float unit, float column)
{
    float slack = EYE_SLACK * unit + EYE_ROUNDING, little = CUT_BAR * unit - slack - EYE_FRAYED;
    float above = upper->end - upper->start, below = lower->end - lower->start;
    int cut_above = upper->start <= 0.0f;
    int cut_below = lower->end >= (float)(hits->picture->rows - 1);
    /* Of a longer code a bit or a fence may lie at the picture's edge, where this one has a bar. */
    float least = bits < hits->bits[hits->n_bits - 1] ? CUT_BAR * unit : 0;
    if ((cut_above && above < least) || (cut_below && below < least))
        return 0;
    int id = read_runs(upper, (int)(lower - upper) - 1, bits, upper->end, unit, slack);
    int contrast = id ? eye_contrast(upper, lower) : 0;
    if (contrast == 0 || hits->n_hits >= EYE_MOST_HITS)
        return 0;
    hits->hits[hits->n_hits++] = (eye_hit){
        .column = column,
        .top = upper->end,
        .bottom = lower->start,
        .bits = (int16_t)bits,
        .id = (int16_t)id,
        .open_top = cut_above || above > EYE_BAR * unit + slack,
        .open_bottom = cut_below || below > EYE_BAR * unit + slack,
        .contrast = (uint8_t)contrast,
        .cut = above < little || below < little,
    };
    return 1;
}

/* Every sequence of runs that looks like a code becomes a hit. */
void eye_match_runs(eye_hits *hits, const eye_run *runs, int count, float column)
{
    eye_match_cut(hits, runs, count, column);
    for (int b = 0; b < hits->n_bits; b++) {
        int bits = hits->bits[b];
        float segments = (float)(2 * bits + 1); /* of the inner part */
        for (int i = 0; i + 2 < count; i++) {
            const eye_run *upper = runs + i;
            /* How long the inner part is at most, where the run is an end bar as a whole. */
            float bar = upper->end - upper->start + (EYE_FRAYED + EYE_ROUNDING);
            float most = upper->start <= 0.0f ? 1e9f : segments * bar / (EYE_BAR - EYE_SLACK);
            /* And by the first bit: all but what rounding may do of what `are_bars` says. */
            float bit = upper[1].end - upper[1].start;
            float longest = SPARE * segments * (bit + EYE_ROUNDING) / (1 - EYE_SLACK);
            float least = segments * (bit - EYE_ROUNDING) / (1 + EYE_SLACK) / SPARE;
            most = longest < most ? longest : most;
            if (most < segments * EYE_SHORTEST)
                continue;
            for (int ones = 1; ones <= bits && i + ones + 1 < count; ones++) {
                const eye_run *lower = upper + ones + 1;
                float length = lower->start - upper->end;
                if (length > most)
                    break;
                if (length < least)
                    continue;
                float unit = length / segments;
                if (unit >= EYE_SHORTEST && are_bars(hits, upper, lower, upper + 1, unit))
                    match_bars(hits, upper, lower, bits, unit, column);
            }
        }
    }
}
