/* From the light of the segments to the code, or to the reason why there is none.
 *
 * The end bars say what bright looks like here, the fences between the bits what dark looks like.
 * Every segment must look like one of the two, in every channel, or (``sharp``) in brightness where
 * colour is blurred over more than a segment; anything in between is no code. */
#include "internal.h"

#include <math.h>

#define TOLERANCE 0.36     /* of the distance between bright and dark */
#define DARK_TOLERANCE 0.24
#define OPEN_TOLERANCE 0.14 /* of bright segments where an end bar's end is not to be seen, */
#define OPEN_SPREAD 2.0     /* and times as far as dark segments are off, more, */
#define OPEN_WIDTH 4.6      /* of a strip that has as many columns */
#define MOST_TOLERANCE 0.45
#define DARKEST_SHARE 0.45 /* of the bright paint's light that black gives back (haze, glare) */
#define THIN_SHARE 0.35    /* as much more where the strip is hardly a pixel wide */
#define FULL 0.92          /* light that nearly fills the scale: overexposed */
#define FULL_SHARE 0.2     /* as much more for black, as bright paint has lost its lead */
#define LEAST_COLOUR 0.25  /* of the bright paint's light: its brightest channel minus its darkest */

int eye_read(const eye_task *task, double levels[][EYE_LIGHTS], int segments, int channels, int sharp,
             double noise, double width, int open, char *code, double *tint)
{
    double first[EYE_LIGHTS], last[EYE_LIGHTS], dark[EYE_LIGHTS] = {0}, mean[EYE_LIGHTS];
    int from = sharp ? EYE_LIGHT : 0, to = sharp ? EYE_LIGHTS : channels; /* what is judged */
    double room = TOLERANCE + 2 * noise;
    room = room > MOST_TOLERANCE ? MOST_TOLERANCE : room;
    /* Where an end bar's end is not to be seen it may be something else that is as bright. */
    double bright_room = open ? OPEN_TOLERANCE + 2 * noise : room;
    double dark_room = DARK_TOLERANCE + 2 * noise;
    int fences = 0;
    for (int i = 2; i < segments - 2; i += 2, fences++)
        for (int c = 0; c < EYE_LIGHTS; c++)
            dark[c] += levels[i][c];
    double dimmest = 1e9, darkest = 0, differ = 0, powers = 0;
    for (int c = 0; c < EYE_LIGHTS; c++) {
        first[c] = (levels[0][c] + levels[1][c]) / 2;
        last[c] = (levels[segments - 1][c] + levels[segments - 2][c]) / 2;
        mean[c] = (first[c] + last[c]) / 2;
        dark[c] /= fences;
    }
    for (int c = from; c < to; c++) {
        differ += (first[c] - last[c]) * (first[c] - last[c]);
        powers += (mean[c] - dark[c]) * (mean[c] - dark[c]);
        if (dark[c] > darkest)
            darkest = dark[c];
    }
    double share[EYE_MOST_SEGMENTS], aside[EYE_MOST_SEGMENTS]; /* how bright; how far off that line */
    double dark_off = 0;
    int darks = 0;
    for (int i = 0; i < segments; i++) {
        double place = i / (segments - 1.0), power = 0, along = 0, sum = 0, off = 0, top = 0;
        double step[EYE_LIGHTS];
        for (int c = from; c < to; c++) {
            /* Light may change along the pole: bright is interpolated between the end bars. */
            double bright = first[c] * (1 - place) + last[c] * place;
            step[c] = bright - dark[c];
            power += step[c] * step[c];
            along += (levels[i][c] - dark[c]) * step[c];
            sum += step[c];
            if (bright > top)
                top = bright;
        }
        if (top < dimmest)
            dimmest = top;
        if (power <= 1e-7 || sum <= 0)
            return EYE_NO_CONTRAST;
        share[i] = along / power;
        for (int c = from; c < to; c++) {
            double rest = levels[i][c] - dark[c] - share[i] * step[c];
            off += rest * rest;
        }
        aside[i] = sqrt(off / power);
        code[i] = share[i] > 0.5 ? '1' : '0';
        if (code[i] == '0') {
            dark_off += share[i] * share[i] + off / power;
            darks++;
        }
    }
    if (open && width > OPEN_WIDTH && darks > 0)
        bright_room += OPEN_SPREAD * sqrt(dark_off / darks);
    int reason = EYE_READ;
    for (int i = 0; i < segments; i++) {
        /* Black is black everywhere on a pole; bright paint has shade and gloss. */
        double least = code[i] == '1' ? bright_room : dark_room;
        if (fabs(share[i] - (code[i] == '1')) > least || aside[i] > least)
            reason = EYE_NEITHER;
    }
    code[segments] = '\0';
    *tint = 0;
    if (channels == 3 && task->low >= 0) {
        double lead = mean[task->high] - dark[task->high];
        if (!(lead > 0)) /* what is judged by its brightness may lack it */
            return EYE_WRONG_COLOUR;
        *tint = (mean[task->low] - dark[task->low]) / lead;
        double high = mean[task->high], low = mean[task->low];
        int other = 3 - task->high - task->low;
        /* Where the brightest channel has reached the end of its scale the next one catches up. */
        int full = high > FULL;
        if (high - low < LEAST_COLOUR * high || mean[other] < task->least_other * high ||
            (!full && mean[other] > task->most_other * high))
            return EYE_WRONG_COLOUR;
    }
    /* A thin strip is blurred: what is beside it lightens its black. */
    double thin = width < 4 ? (4 - width) / 3 : 0;
    double most = DARKEST_SHARE + THIN_SHARE * (thin > 1 ? 1 : thin);
    if (mean[channels == 3 ? task->high : 0] > FULL)
        most += FULL_SHARE;
    if (darkest > most * dimmest)
        return EYE_NOT_DARK;
    if (sqrt(differ / powers) > 2 * room)
        return EYE_ENDS_DIFFER;
    return reason;
}
