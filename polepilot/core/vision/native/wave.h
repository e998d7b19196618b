/* A code as a square wave seen through a lens: the model that scale.c fits. */
#ifndef POLEPILOT_WAVE_H
#define POLEPILOT_WAVE_H

#include "internal.h"

#define EYE_MOST_EDGES (EYE_MOST_BITS * 2 + 4)

/* The parameters; those before EYE_LINEAR are levels of light, and the model is linear in them. */
enum {
    EYE_ABOVE,       /* what is above the code */
    EYE_BRIGHT,      /* bright segments, at the middle, */
    EYE_BRIGHT_TILT, /* and by how much more at the code's lower end */
    EYE_DARK,
    EYE_DARK_TILT,
    EYE_BELOW,
    EYE_LEAK, /* share of what is beside the strip that is blurred into it */
    EYE_LINEAR,
    EYE_MIDDLE = EYE_LINEAR, /* row of the code's middle */
    EYE_UNIT,                /* rows per segment there */
    EYE_BLUR,                /* standard deviation, rows */
    EYE_GROWTH,              /* rows by which bright segments grow at either end */
    EYE_SAG,                 /* share by which segments shrink from one to the next, down */
    EYE_PARAMETERS
};

/* The boundaries between bright and dark, and the outer ones. */
typedef struct {
    int edges;
    double place[EYE_MOST_EDGES]; /* in segments from the code's middle */
    double sign[EYE_MOST_EDGES];  /* 1: brighter below, -1: darker; they alternate */
    double segments;
} eye_wave;

/* Where all boundaries lie for one set of values, and what is the same for every row. */
typedef struct {
    double place[EYE_MOST_EDGES], squeeze[EYE_MOST_EDGES];
    double reach; /* rows on either side of a boundary in which it shows */
    double sharp; /* 1 / blur */
    double share; /* of half a code that a row is */
    int passed;   /* boundaries above the last row that no longer showed in it, */
    int shows;    /* and how many did */
} eye_layout;

double eye_row_of(const double *guess, double place);
void eye_wave_of(const char *code, int segments, eye_wave *out);
void eye_lay_out(const eye_wave *wave, const double *guess, eye_layout *out);
double eye_wave_row(const eye_wave *wave, eye_layout *at, const double *guess, double upper,
                    double lower, double beside, double *row);

#endif
