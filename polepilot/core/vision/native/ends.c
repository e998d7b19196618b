/* Whether the end bars are there, and end.
 *
 * No bit is as long as an end bar. A striped post begins and ends with one stripe, and with what is
 * behind it for the other half that passes for an end bar; behind the gaps of a post for both halves. So
 * two stories are told of a bar's outer half (where the picture cuts that off, of the inner one): it is the
 * paint of its inner half and of the bright bits, shaded across as they are; or it is what lies beside it
 * or beyond. How much less the second one leaves over is the doubt. And a bar has an end: where what is
 * beyond is like it, but not like what is beside it, a post goes on, and its stripes are no code. */
#include "internal.h"

#include <math.h>

#define MOST_SAMPLES 9     /* across the strip */
#define SAMPLES_A_COLUMN 0.85
#define LOOKED_AT 0.8      /* share of the half width */
#define MOST_ROWS 4        /* of a stretch along the strip that are averaged */
#define TRIM 0.25          /* segments: blurred ends of one that are left out, */
#define THIN_TRIM 0.4      /* and of a bit that has hardly two rows */
#define THIN 2.0           /* rows */
#define NEAR_END 0.3       /* segments from a bar's end to what is beyond it, */
#define NEAR_ROWS 0.8      /* rows besides where segments are short */
#define BEYOND 0.4         /* segments of that */
#define GAIN 0.15          /* by which light may change from the bits to an end bar */
#define FLOOR 0.0016       /* rest, of the square of bright - dark, that says nothing */
#define FREE 4.0           /* numbers in a segment's light, noise being alike in neighbours */
#define ALIKE 0.02         /* rest of one thing that goes on */
#define STANDS_OUT 12.0    /* times more than that: something else */

/* A strip as it is looked at here. */
typedef struct {
    const eye_picture *picture;
    const eye_scale *scale;
    double column, row, lean; /* the strip's middle in a row */
    double half;              /* half its width */
    int n;                    /* samples across */
    double offset[MOST_SAMPLES];
} view;

typedef struct {
    double light[MOST_SAMPLES][3];
} across;

/* Linear light between two places along the strip (segments from its middle), ``n`` samples across;
 * 0 where that lies outside the picture. */
static int look(const view *v, double from, double to, const double *offset, int n, across *out)
{
    const eye_picture *p = v->picture;
    double upper = eye_row_at(v->scale, from), lower = eye_row_at(v->scale, to);
    int top = (int)ceil(upper), bottom = (int)floor(lower);
    if (bottom < top)
        top = bottom = (int)lround((upper + lower) / 2);
    top = top < 0 ? 0 : top;
    bottom = bottom > p->rows - 1 ? p->rows - 1 : bottom;
    int count = bottom - top + 1, used = count < MOST_ROWS ? count : MOST_ROWS;
    if (count < 1 || p->columns < 2)
        return 0;
    *out = (across){{{0}}};
    for (int i = 0; i < used; i++) {
        int y = top + (2 * i + 1) * count / (2 * used);
        const uint8_t *line = p->pixels + (ptrdiff_t)y * p->stride;
        double middle = v->column + v->lean * (y - v->row);
        for (int k = 0; k < n; k++) {
            double x = eye_limit(middle + offset[k], 0, p->columns - 1);
            int at = eye_clamp((int)x, 0, p->columns - 2);
            const uint8_t *pixel = line + at * p->channels;
            for (int c = 0; c < p->channels; c++)
                out->light[k][c] += ((1 - (x - at)) * eye_linear(pixel[c]) +
                                     (x - at) * eye_linear(pixel[p->channels + c])) / used;
        }
    }
    return 1;
}

/* Mean square of what one leaves over of the other, as bright as it is times ``gain``. */
static double rest_of(const view *v, const across *one, const across *other, double gain)
{
    double sum = 0;
    for (int k = 0; k < v->n; k++)
        for (int c = 0; c < v->picture->channels; c++) {
            double off = one->light[k][c] - gain * other->light[k][c];
            sum += off * off;
        }
    return sum / (v->n * v->picture->channels);
}

/* The same of what is beside the strip: on its left, on its right, or from one to the other. */
static double rest_of_beside(const view *v, double from, double to, const across *seen)
{
    double least = HUGE_VAL, gap = v->half + 1 + v->half / 4;
    double offset[4] = {-gap - 1, -gap, gap, gap + 1};
    double middle = v->column + v->lean * (eye_row_at(v->scale, (from + to) / 2) - v->row);
    int left = middle - gap >= 1, right = middle + gap <= v->picture->columns - 2;
    across sides, ground;
    if (!look(v, from, to, offset, 4, &sides))
        return least;
    for (int story = 0; story < 3; story++) {
        if ((story < 2 && !left) || (story > 0 && !right))
            continue;
        for (int k = 0; k < v->n; k++)
            for (int c = 0; c < v->picture->channels; c++) {
                double one = (sides.light[0][c] + sides.light[1][c]) / 2;
                double other = (sides.light[2][c] + sides.light[3][c]) / 2;
                double share = story == 1 ? (v->offset[k] + gap) / (2 * gap) : story / 2.0;
                ground.light[k][c] = one + share * (other - one);
            }
        least = fmin(least, rest_of(v, seen, &ground, 1));
    }
    return least;
}

/* Light of the bright bits, all together, and the mean square by which it differs from ``dark``. */
static double look_at_bits(const view *v, const char *code, int segments, const double *dark,
                           across *bits)
{
    double trim = v->scale->unit > THIN ? TRIM : THIN_TRIM, sum = 0;
    int ones = 0, channels = v->picture->channels;
    *bits = (across){{{0}}};
    for (int i = 3; i < segments - 3; i += 2) {
        across one;
        double place = i - segments / 2.0;
        if (code[i] != '1' || !look(v, place + trim, place + 1 - trim, v->offset, v->n, &one))
            continue;
        for (int k = 0; k < v->n; k++)
            for (int c = 0; c < channels; c++)
                bits->light[k][c] += one.light[k][c];
        ones++;
    }
    for (int k = 0; k < v->n && ones > 0; k++)
        for (int c = 0; c < channels; c++) {
            bits->light[k][c] /= ones;
            sum += (bits->light[k][c] - dark[c]) * (bits->light[k][c] - dark[c]);
        }
    return sum / (v->n * channels);
}

/* How much brighter one is than the other, within what light may do along a pole. */
static double gain_of(const view *v, const across *one, const across *other)
{
    double product = 0, power = 1e-12;
    for (int k = 0; k < v->n; k++)
        for (int c = 0; c < v->picture->channels; c++) {
            product += one->light[k][c] * other->light[k][c];
            power += other->light[k][c] * other->light[k][c];
        }
    return eye_limit(product / power, 1 - GAIN, 1 + GAIN);
}

/* Light of the segment that begins at a place and lies above (-1) or below (1) it, without its blurred
 * ends; 0 where the picture does not show it. */
static int look_at_segment(const view *v, double begin, int way, double *from, double *to,
                           across *out)
{
    *from = fmin(begin, begin + way) + TRIM;
    *to = fmax(begin, begin + way) - TRIM;
    return look(v, *from, *to, v->offset, v->n, out);
}

/* Looks at the end bar above (-1) or below (1); the reason where it does not end. ``contrast``: mean
 * square of bright - dark. */
static int look_at_bar(const view *v, const across *bits, double contrast, double half_code,
                       int way, double *doubt)
{
    double outer = way * half_code, begin = fmax(NEAR_END, NEAR_ROWS / v->scale->unit);
    double near = outer + way * begin, far = near + way * BEYOND;
    double from, to, inner_from, inner_to;
    across bar, inner, beyond;
    if (!look_at_segment(v, outer - 2 * way, way, &inner_from, &inner_to, &inner))
        return EYE_READ;
    if (!look_at_segment(v, outer - way, way, &from, &to, &bar)) { /* the picture cuts it off */
        bar = inner;
        from = inner_from;
        to = inner_to;
    }
    double paint = fmax(rest_of(v, &bar, bits, gain_of(v, &bar, bits)),
                        rest_of(v, &bar, &inner, gain_of(v, &bar, &inner))) / contrast;
    double ground = rest_of_beside(v, from, to, &bar) / contrast;
    from = fmin(near, far);
    to = fmax(near, far);
    if (eye_row_at(v->scale, from) >= 0 && eye_row_at(v->scale, to) <= v->picture->rows - 1 &&
        look(v, from, to, v->offset, v->n, &beyond)) {
        double alike = rest_of(v, &beyond, &inner, 1) / contrast;
        double beside = rest_of_beside(v, from, to, &beyond) / contrast;
        if (alike < ALIKE && beside > STANDS_OUT * (alike + FLOOR / 4))
            return EYE_GOES_ON;
        ground = fmin(ground, rest_of(v, &beyond, &bar, 1) / contrast);
    }
    double likelier = log((paint + FLOOR) / (ground + FLOOR));
    *doubt += likelier <= 0 ? 0 : FREE * likelier; /* no number stays none, and is refused */
    return EYE_READ;
}

/* Looks at both end bars; the reason where one goes on. ``doubt``: how much likelier what is behind them
 * is than paint, twice the logarithm: it adds up with squares of normal errors. */
int eye_look_at_ends(const eye_picture *p, const eye_upright *u, const eye_scale *scale,
                     const eye_side *side, const char *code, double levels[][EYE_LIGHTS],
                     int segments, double *doubt)
{
    view v = {.picture = p, .scale = scale, .column = side->column, .row = u->row,
              .lean = u->lean, .half = side->half};
    double dark[3] = {0};
    across bits;
    v.n = eye_clamp((int)(2 * SAMPLES_A_COLUMN * v.half) + 1, 3, MOST_SAMPLES);
    for (int k = 0; k < v.n; k++)
        v.offset[k] = LOOKED_AT * v.half * (2.0 * k / (v.n - 1) - 1);
    for (int i = 2; i < segments - 2; i += 2)
        for (int c = 0; c < p->channels; c++)
            dark[c] += levels[i][c] / (segments / 2 - 1);
    *doubt = 0;
    double contrast = look_at_bits(&v, code, segments, dark, &bits);
    if (!(contrast > 0))
        return EYE_NO_CONTRAST;
    int reason = look_at_bar(&v, &bits, contrast, segments / 2.0, -1, doubt);
    return reason != EYE_READ ? reason
                              : look_at_bar(&v, &bits, contrast, segments / 2.0, 1, doubt);
}
