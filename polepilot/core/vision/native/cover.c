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
#define ROWS 2
#define COLUMNS 2

/* What is to be seen beside a segment. */
typedef struct {
    int clear; /* whether it differs from the segment's black, */
    int same;  /* or is the very same, higher or lower if it lies aslant */
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

/* Whether the dark beside bit ``i`` ends above and below. */
static int has_ends(const flank *beside, int segments, int i)
{
    int above = i - beside[i].clear, below = i + beside[i].clear; /* aslant: it lies higher or lower */
    while (above >= 0 && !beside[above].clear)
        above--;
    while (below < segments && !beside[below].clear)
        below++;
    return above >= 0 && below < segments && below - above > 1;
}

/* Whether the same thing is to be seen on both sides of bit ``i`` and begins and ends there; a dark floor or
 * wall does not. */
static int lies_over(flank flanks[2][EYE_MOST_SEGMENTS], int segments, int i)
{
    return flanks[0][i].same && flanks[1][i].same && has_ends(flanks[0], segments, i) &&
           has_ends(flanks[1], segments, i);
}

/* Whether a bit that reads dark may be something else in front of it, which makes one landmark of
 * another. */
int eye_covered(const eye_picture *p, const eye_task *task, const eye_upright *u,
                const eye_scale *scale, const eye_side *side, const char *code,
                double levels[][EYE_LIGHTS], int segments, double noise)
{
    double contrast = 0, black[3];
    flank flanks[2][EYE_MOST_SEGMENTS];
    memset(flanks, 0, sizeof flanks);
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
                /* More like what is beside it than like the other black, which it is not. */
                here->same |= most < (SAME + noise) * contrast && most < UNLIKE * unlike &&
                              unlike > ANOTHER * (SAME + noise) * contrast;
            }
        }
    }
    for (int i = 3; i < segments - 3; i += 2)
        for (int last = i; last < segments - 3 && code[i] == '0' && code[last] == '0'; last += 2)
            if ((lies_over(flanks, segments, i) || lies_over(flanks, segments, last)) &&
                eye_mistakable(task, code, segments, i, last))
                return 1;
    return 0;
}
