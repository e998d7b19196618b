/* Whether colour is blurred where brightness is sharp, as JPEG and a mosaic of colour filters leave it. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>

#define BLURRED 0.92 /* times as much bend for its slope as brightness has; sharp colour has as much */

/* Sums of the bends and slopes of a column, between two rows of the picture. */
typedef struct {
    int64_t bend, slope;
} unrest;

static void add_unrest(unrest *sum, int before, int here, int after)
{
    sum->bend += abs(before - 2 * here + after);
    sum->slope += abs(after - before);
}

int eye_has_blurred_colour(const eye_picture *p, const eye_task *task, const eye_candidate *c)
{
    double unit = (c->bottom - c->top) / (2 * c->bits + 1);
    int wide = (int)fmax(1, floor(0.7 * unit + 0.5)), middle = (int)floor(c->column + 0.5);
    int first = eye_clamp((int)(c->top - 2 * unit), 1, p->rows - 2);
    int last = eye_clamp((int)(c->bottom + 2 * unit), 1, p->rows - 2);
    int from = eye_clamp(middle - wide, 0, p->columns - 1);
    int to = eye_clamp(middle + wide, 0, p->columns - 1);
    unrest colour = {0, 0}, light = {0, 0};
    if (!eye_is_coloured(p->channels, task))
        return 0;
    for (int x = from; x <= to; x++) {
        const uint8_t *pixel = p->pixels + (ptrdiff_t)first * p->stride + x * p->channels;
        for (int y = first; y <= last; y++, pixel += p->stride) {
            const uint8_t *above = pixel - p->stride, *below = pixel + p->stride;
            add_unrest(&colour, above[task->high] - above[task->low],
                       pixel[task->high] - pixel[task->low], below[task->high] - below[task->low]);
            add_unrest(&light, eye_brightness(above, p->channels, task),
                       eye_brightness(pixel, p->channels, task),
                       eye_brightness(below, p->channels, task));
        }
    }
    return (double)colour.bend * (double)light.slope <
           BLURRED * (double)light.bend * (double)colour.slope;
}
