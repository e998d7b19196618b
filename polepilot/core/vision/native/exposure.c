/* A picture is made what it is looked at as: without colour if it has none, brighter if it is dark. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>

#define APART 8         /* rows and columns from one pixel that is asked to the next, */
#define FEW 200         /* of which one in so many may be brighter: a lamp */
#define BRIGHT 80       /* grey levels that others should reach */
#define MOST_TIMES 4.0  /* what there is in the dark is mostly noise */

/* Whether three channels say the same everywhere, as a monochrome camera's often do. */
static int is_grey(const eye_picture *p)
{
    if (p->channels != 3)
        return 0;
    for (int y = 0; y < p->rows; y++) {
        const uint8_t *pixel = p->pixels + (ptrdiff_t)y * p->stride;
        for (int x = 0; x < p->columns; x++, pixel += 3)
            if (pixel[0] != pixel[1] || pixel[0] != pixel[2])
                return 0;
    }
    return 1;
}

/* Makes a copy with one channel of a picture the three of which say the same: 1, and its pixels have
 * to be freed. 0 if they do not, -1 where there is no memory. */
int eye_make_grey(const eye_picture *p, eye_picture *out)
{
    if (!is_grey(p))
        return 0;
    uint8_t *pixels = malloc((size_t)p->columns * (size_t)p->rows);
    if (!pixels)
        return -1;
    *out = (eye_picture){pixels, p->rows, p->columns, 1, p->columns};
    for (int y = 0; y < p->rows; y++)
        for (int x = 0; x < p->columns; x++)
            *pixels++ = p->pixels[(ptrdiff_t)y * p->stride + 3 * (ptrdiff_t)x];
    return 1;
}

/* The level, in the paint's brightest channel, that few pixels exceed; BRIGHT if it is that or more. */
static int brightest(const eye_picture *p, const eye_task *task)
{
    int counts[BRIGHT + 1] = {0}, channel = p->channels == 3 ? task->high : 0;
    int few = ((p->rows + APART - 1) / APART) * ((p->columns + APART - 1) / APART) / FEW;
    for (int y = 0; y < p->rows; y += APART) {
        const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride + channel;
        for (int x = 0; x < p->columns; x += APART) {
            int level = row[(ptrdiff_t)x * p->channels];
            counts[level < BRIGHT ? level : BRIGHT]++;
        }
        if (counts[BRIGHT] > few) /* most pictures end here */
            return BRIGHT;
    }
    int level = BRIGHT;
    for (int more = counts[level]; more <= few && level > 1; more += counts[level])
        level--;
    return level;
}

/* The brightest pixel of what may be paint, such as that of a landmark that alone is lit. */
static int brightest_paint(const eye_picture *p, const eye_task *task)
{
    int most = 0, coloured = eye_is_coloured(p->channels, task);
    int channel = p->channels == 3 ? task->high : 0;
    for (int y = 0; y < p->rows; y++) {
        const uint8_t *pixel = p->pixels + (ptrdiff_t)y * p->stride;
        for (int x = 0; x < p->columns; x++, pixel += p->channels)
            if (pixel[channel] > most && (!coloured || eye_colour(pixel, task) > 4 * EYE_FAINTEST))
                most = pixel[channel];
    }
    return most;
}

/* Makes a brighter copy of a picture if it is dim: 1, and its pixels have to be freed. 0 if it is
 * not, -1 where there is no memory. */
int eye_brighten(const eye_picture *p, const eye_task *task, eye_picture *out)
{
    int level = brightest(p, task);
    if (level >= BRIGHT)
        return 0;
    double room = 255.0 / (brightest_paint(p, task) + 1); /* no paint loses its shade */
    double times = fmin(fmin((double)BRIGHT / level, MOST_TIMES), room);
    if (times <= 1)
        return 0;
    uint8_t brighter[256];
    for (int i = 0; i < 256; i++)
        brighter[i] = (uint8_t)eye_limit(times * i + 0.5, 0, 255);
    ptrdiff_t width = (ptrdiff_t)p->columns * p->channels;
    uint8_t *pixels = malloc((size_t)(width * p->rows));
    if (!pixels)
        return -1;
    *out = *p;
    out->pixels = pixels;
    out->stride = width;
    for (int y = 0; y < p->rows; y++)
        for (ptrdiff_t x = 0; x < width; x++)
            pixels[y * width + x] = brighter[p->pixels[y * p->stride + x]];
    return 1;
}
