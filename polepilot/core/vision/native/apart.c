/* How much a strip stands out from what is beside it.
 *
 * A pole hides what is behind it, so what shows beside knows nothing of the code, and hardly anything
 * is orange and black in turn at the same rows by chance. A pattern that lies in a picture, or on a
 * wall, goes on beside the strip: there it is what was taken for its segments. */
#include "internal.h"

#include <math.h>

#define ACROSS 3      /* samples across a segment, */
#define LOOKED_AT 0.4 /* and how far out the outer ones are, of the half width */
#define TRIM 0.25     /* of a segment, at both its ends */
#define MOST_ROWS 2   /* of a segment that are looked at */
#define NEAR 1.0      /* columns, and a quarter of the half width, from a side to what is beside it */
#define BESIDE 2      /* columns of that */
#define SAMPLES (ACROSS + 2 * BESIDE)

enum { INSIDE, LEFT, RIGHT, PARTS };

/* Mean linear light of a segment, and of what is beside it to the left and right; ``seen``: how many
 * samples of each lie in the picture. */
static void look(const eye_picture *p, const eye_upright *u, const eye_scale *scale,
                 const eye_side *side, double from, double light[PARTS][3],
                 int seen[PARTS])
{
    double gap = side->half + NEAR + side->half / 4;
    double offset[SAMPLES] = {-LOOKED_AT * side->half, 0, LOOKED_AT * side->half,
                             -gap - 1, -gap, gap, gap + 1};
    double upper = eye_row_at(scale, from + TRIM), lower = eye_row_at(scale, from + 1 - TRIM);
    int top = eye_ceil(upper), count = eye_floor(lower) - top + 1;
    if (count < 1) {
        top = eye_floor((upper + lower) / 2 + 0.5);
        count = 1;
    }
    int used = count < MOST_ROWS ? count : MOST_ROWS;
    for (int k = 0; k < PARTS; k++)
        light[k][0] = light[k][1] = light[k][2] = seen[k] = 0;
    for (int i = 0; i < used; i++) {
        int y = top + (2 * i + 1) * count / (2 * used);
        if (y < 0 || y >= p->rows)
            continue;
        const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride;
        double middle = side->column + u->lean * (y - u->row);
        for (int k = 0; k < SAMPLES; k++) {
            int of = k < ACROSS ? INSIDE : k < ACROSS + BESIDE ? LEFT : RIGHT;
            int x = eye_floor(middle + offset[k] + 0.5);
            if (x < 0 || x >= p->columns)
                continue;
            for (int c = 0; c < p->channels; c++)
                light[of][c] += eye_linear(row[x * p->channels + c]);
            seen[of]++;
        }
    }
    for (int k = 0; k < PARTS; k++)
        for (int c = 0; c < 3 && seen[k]; c++)
            light[k][c] /= seen[k];
}

static double distance(const double *one, const double *other, int channels)
{
    double sum = 0;
    for (int c = 0; c < channels; c++)
        sum += (one[c] - other[c]) * (one[c] - other[c]);
    return sqrt(sum);
}

/* Mean difference of light between the segments and what is beside them, of bright - dark, both
 * sides together; a side that is not in the picture counts as the other one. Bright and dark segments
 * count as much as each other, however few of either a code has. */
double eye_apart(const eye_picture *p, const eye_upright *u, const eye_scale *scale,
                 const eye_side *side, const char *code, int segments)
{
    double sum[PARTS][2] = {{0}}, mean[PARTS] = {0}, colour[2][3] = {{0}};
    int number[PARTS][2] = {{0}}, with[2] = {0};
    for (int i = 0; i < segments; i++) {
        double light[PARTS][3];
        int seen[PARTS], bright = code[i] == '1';
        look(p, u, scale, side, i - segments / 2.0, light, seen);
        if (!seen[INSIDE])
            continue;
        for (int c = 0; c < p->channels; c++)
            colour[bright][c] += light[INSIDE][c];
        with[bright]++;
        for (int k = LEFT; k <= RIGHT; k++)
            if (seen[k]) {
                sum[k][bright] += distance(light[INSIDE], light[k], p->channels);
                number[k][bright]++;
            }
    }
    for (int k = LEFT; k <= RIGHT; k++) {
        int known = number[k][0] && number[k][1];
        mean[k] = known ? (sum[k][0] / number[k][0] + sum[k][1] / number[k][1]) / 2 : -1;
    }
    if (!with[0] || !with[1] || (mean[LEFT] < 0 && mean[RIGHT] < 0))
        return 0;
    for (int c = 0; c < 3; c++) {
        colour[0][c] /= with[0];
        colour[1][c] /= with[1];
    }
    double left = mean[LEFT] < 0 ? mean[RIGHT] : mean[LEFT];
    double right = mean[RIGHT] < 0 ? left : mean[RIGHT];
    double contrast = distance(colour[1], colour[0], p->channels);
    return contrast > 0 ? (left + right) / contrast : 0;
}
