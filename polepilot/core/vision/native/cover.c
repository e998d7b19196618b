/* Whether something dark lies over the strip.
 *
 * A branch or a sleeve in front turns a bright bit into a dark one, and a legal code into another.
 * It goes on to both sides of the strip and ends above and below. */
#include "internal.h"

#include <math.h>
#include <string.h>

#define STANDS_OUT 0.18 /* of bright - dark, in any channel */
#define SAME 0.03       /* the same, of one thing that goes on beside the strip */
#define ASLANT 0.6      /* segments */
#define UNLIKE 1.6      /* times nearer to the other black than to what is beside it: paint */
#define ANOTHER 0.3     /* times SAME, of two blacks */
#define PLACES 2        /* at either side where a border is looked for: there, */
#define FARTHER 4.0     /* and so many half widths farther out */
#define SLANTS 2        /* ways up and down in which it may go on there, */
#define SLANT 0.3       /* segments each */
#define BORDER 0.08     /* of bright - dark: least difference of the two things that meet, */
#define ONE_THING 0.3   /* and greatest of one and the same from place to place, */
#define ONE_BAND 0.15   /* and of what parts them */
#define ROWS 2
#define COLUMNS 2

/* What is to be seen beside a segment. */
typedef struct {
    int clear; /* whether it differs from the segment's black, */
    int alike; /* or is about the same, higher or lower if it lies aslant, */
    int same;  /* or the very same */
} flank;

/* Mean light beside a segment; 0 where that lies outside the picture. */
static int beside(const eye_picture *p, double row, double reach, double column, double step,
                  double *light)
{
    int n = 0;
    for (int c = 0; c < p->channels; c++)
        light[c] = 0;
    for (int i = 0; i < ROWS; i++) {
        int y = eye_floor(row + reach * (2 * i - 1) + 0.5);
        if (y < 0 || y >= p->rows)
            continue;
        for (int k = 0; k < COLUMNS; k++) {
            int x = eye_floor(column + step * k + 0.5);
            if (x < 0 || x >= p->columns)
                continue;
            const uint8_t *pixel = p->pixels + (ptrdiff_t)y * p->stride + x * p->channels;
            for (int c = 0; c < p->channels; c++)
                light[c] += eye_linear(pixel[c]);
            n++;
        }
    }
    for (int c = 0; c < p->channels; c++)
        light[c] /= n > 0 ? n : 1;
    return n >= 2;
}

/* The middle one of the dark segments' levels: the paint, even if some of them are covered. */
static double median_dark(double levels[][EYE_LIGHTS], const char *code, int segments, int channel)
{
    double values[EYE_MOST_SEGMENTS];
    int n = 0;
    for (int i = 2; i < segments - 2; i++)
        if (code[i] == '0')
            values[n++] = levels[i][channel];
    return eye_median(values, n);
}

/* The largest difference in any channel. */
static double apart(const double *one, const double *other, int channels)
{
    double most = 0;
    for (int c = 0; c < channels; c++)
        most = fmax(most, fabs(one[c] - other[c]));
    return most;
}

/* Where the dark beside bit ``i`` ends above and below: segments; 0 where it does not. */
static int find_ends(const flank *beside, int segments, int i, int *above, int *below)
{
    *above = i - beside[i].clear; /* aslant: beside it, it lies higher or lower */
    *below = i + beside[i].clear;
    while (*above >= 0 && !beside[*above].clear)
        --*above;
    while (*below < segments && !beside[*below].clear)
        ++*below;
    return *above >= 0 && *below < segments && *below - *above > 1;
}

/* Whether what is dark beside bit ``i``, between segments ``above`` and ``below`` at either side, parts
 * two things, as a skirting board parts the wall from the floor: it goes on far to both sides, and has
 * one thing above it and another one below. Then it is behind the pole: what hangs in front ends
 * soon, and hardly ever lies just along a border. ``gap``: columns from the middle to what is beside. */
static int is_border(const eye_picture *p, const eye_upright *u, const eye_scale *scale,
                     const eye_side *side, int segments, int i, const int *above, const int *below,
                     const double *black, double gap, double step, double contrast)
{
    double first[2][3] = {{0}};
    for (int place = 0; place < 2 * PLACES; place++) {
        int way = place % 2, out = place / 2;
        double light[3][3], off = 1e9; /* above it, below it, amid; how far that is from the bit's black */
        for (int tilt = -SLANTS * (out + 1); tilt <= SLANTS * (out + 1); tilt++) {
            /* A segment farther, if there is one: off the blur. */
            double at[3] = {above[way] > 0 ? above[way] - 1 : 0,
                            below[way] < segments - 1 ? below[way] + 1 : segments - 1, i};
            double tried[3][3];
            for (int part = 0; part < 3; part++) {
                double row = eye_row_at(scale, at[part] + 0.5 + SLANT * tilt - segments / 2.0);
                double column = side->column + u->lean * (row - u->row) +
                                (2 * way - 1) * (gap + out * FARTHER * side->half);
                if (!beside(p, row, 0.2 * scale->unit, column, (2 * way - 1) * step, tried[part]))
                    return 0;
            }
            if (apart(tried[2], black, p->channels) < off) {
                off = apart(tried[2], black, p->channels);
                memcpy(light, tried, sizeof light);
            }
        }
        if (place == 0)
            memcpy(first, light, sizeof first);
        if (off > ONE_BAND * contrast || apart(light[0], light[1], p->channels) < BORDER * contrast)
            return 0;
        for (int part = 0; part < 2; part++)
            if (apart(light[part], first[part], p->channels) > ONE_THING * contrast ||
                apart(light[part], light[2], p->channels) < STANDS_OUT * contrast)
                return 0;
    }
    return 1;
}

/* Whether a bit that reads dark may be something else in front of it, which makes one landmark of
 * another. ``behind``: whether what is dark beside a bit is behind the pole. */
int eye_covered(const eye_picture *p, const eye_task *task, const eye_upright *u,
                const eye_scale *scale, const eye_side *side, const char *code,
                double levels[][EYE_LIGHTS], int segments, double noise, int *behind)
{
    double contrast = 0, black[3];
    flank flanks[2][EYE_MOST_SEGMENTS];
    memset(flanks, 0, sizeof flanks);
    memset(behind, 0, sizeof *behind * (size_t)segments);
    for (int c = 0; c < p->channels; c++) {
        black[c] = median_dark(levels, code, segments, c);
        double bright = (levels[0][c] + levels[1][c] + levels[segments - 2][c] +
                         levels[segments - 1][c]) / 4;
        contrast = bright - black[c] > contrast ? bright - black[c] : contrast;
    }
    double gap = side->half + 1.0 + 1.2 * side->blur;
    double step = side->half / 4 > 1 ? side->half / 4 : 1;
    for (int way = 0; way < 2; way++) {
        int sign = way == 0 ? -1 : 1;
        for (int i = 0; i < segments; i++) {
            int bit = code[i] == '0' && i % 2 == 1;
            for (int tilt = -bit; tilt <= bit; tilt++) { /* what lies across may lie aslant */
                double row = eye_row_at(scale, i + 0.5 + ASLANT * tilt - segments / 2.0);
                double column = side->column + u->lean * (row - u->row) + sign * gap;
                double light[3];
                if (row < 0 || row > p->rows - 1) /* out of the picture */
                    continue;
                if (!beside(p, row, 0.2 * scale->unit, column, sign * step, light))
                    return 0;
                double most = apart(light, code[i] == '0' ? levels[i] : black, p->channels);
                double unlike = apart(levels[i], black, p->channels);
                flank *here = flanks[way] + i;
                here->clear |= tilt == 0 && most > STANDS_OUT * contrast;
                here->alike |= most < (ONE_BAND + noise) * contrast;
                /* More like what is beside it than like the other black, which it is not. */
                here->same |= most < (SAME + noise) * contrast && most < UNLIKE * unlike &&
                              unlike > ANOTHER * (SAME + noise) * contrast;
            }
        }
    }
    for (int i = 3; i < segments - 3; i += 2) {
        int above[2], below[2];
        if (code[i] == '1' || !flanks[0][i].alike || !flanks[1][i].alike ||
            !eye_mistakable(task, code, segments, i))
            continue;
        /* It begins and ends beside the strip; a dark floor or wall does not. */
        if (!find_ends(flanks[0], segments, i, above, below) ||
            !find_ends(flanks[1], segments, i, above + 1, below + 1))
            continue;
        behind[i] = is_border(p, u, scale, side, segments, i, above, below, levels[i], gap, step,
                              contrast);
        if (flanks[0][i].same && flanks[1][i].same && !behind[i])
            return 1;
    }
    return 0;
}
