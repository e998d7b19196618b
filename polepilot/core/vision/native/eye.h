/* The eye's kernel: finds the strips of barcode poles in a picture and measures them in pixels.
 *
 * One call looks at one picture and keeps nothing; any number of threads may call at the same time.
 * The steps, in their order, are one file each:
 *   exposure.c a grey picture made one of one channel, a dim one made brighter
 *   search.c   which columns to look at (sixteen at once: lanes.h), with
 *     runs.c     the bright runs of a column
 *     match.c    runs with the proportions of a code: near landmarks
 *     comb.c     codes too far for runs, with
 *     slide.c    codes laid along the light of a column
 *     chroma.c   whether colour is blurred there
 *     gather.c   columns that agree
 *   odds.c     the likeliest of all codes, where segments one by one say too little
 *   upright.c  how the strip leans; its light by row, straightened, and by column
 *   scale.c    all edges of the code at once, fitted to one scale, by the model in wave.c
 *   read.c     the light of the segments as bits, or why they are none
 *   side.c     where the strip's middle lies between its sides
 *   ends.c     whether the end bars are there, and end
 *   front.c    whether something is in front of a bit
 *   apart.c    how much the strip stands out from what is beside it
 * eye.c runs them; internal.h is what they share. Rows and columns count from the centre of the
 * first pixel. Light is linear, 0 to 1. docs/vision.md explains the method. */
#ifndef POLEPILOT_EYE_H
#define POLEPILOT_EYE_H

#include <stddef.h>
#include <stdint.h>

#define EYE_VERSION 4
#define EYE_MOST_BITS 8
#define EYE_MOST_SEGMENTS (2 * EYE_MOST_BITS + 5)
#define EYE_CODE_SIZE 24 /* bytes of a code as text, '1' for bright, with room for its end */
#define EYE_IDS 256

/* Why a strip is not reported; kernel.py has the words. */
enum eye_reason {
    EYE_READ = 0,
    EYE_NO_CONTRAST = 1,
    EYE_LEANS = 2,
    EYE_NO_SCALE = 3,
    EYE_POOR_FIT = 4,
    EYE_WRONG_COLOUR = 5,
    EYE_NOT_DARK = 6,
    EYE_ENDS_DIFFER = 7,
    EYE_NEITHER = 8,
    EYE_NO_CODE = 9,
    EYE_UNKNOWN_ID = 10,
    EYE_WRONG_WIDTH = 11,
    EYE_CUT_OFF = 12,
    EYE_COVERED = 13,
    EYE_NO_BAR = 14,
    EYE_GOES_ON = 15
};

typedef struct {
    const uint8_t *pixels; /* rows x columns x channels, blue-green-red or grey */
    int32_t rows, columns, channels;
    ptrdiff_t stride; /* bytes from row to row */
} eye_picture;

/* What one id looks like. */
typedef struct {
    int32_t bits;   /* 0: there is no such landmark */
    int32_t flat;   /* not 0: a flat sticker, else a cylinder */
    double aspect; /* thickness over length of a segment */
    double segment; /* length of a segment, metres */
} eye_kind;

/* What to look for. */
typedef struct {
    int32_t high, low; /* channels in which the bright paint is brightest and darkest; low -1: none */
    int32_t weights[3]; /* of blue, green, red in the brightness; none below 0, 256 together */
    /* Light of the third channel, as a share of that of ``high``: the paint's hue in any light. */
    double least_other, most_other;
    double constant;    /* camera constant, pixels */
    eye_kind kinds[EYE_IDS];
} eye_task;

/* A strip that was looked at closely. */
typedef struct {
    int32_t reason; /* enum eye_reason */
    int32_t id, bits;
    int32_t sides;       /* 2: both sides are in the picture, 1: one */
    double column, row;  /* the strip's middle */
    double unit;         /* rows per segment at ``row`` */
    double sag;          /* share by which rows per segment shrink from segment to segment, down */
    double lean;         /* columns per row, to the right going down */
    double width;        /* columns from side to side */
    double front;        /* mean height of the surface that was measured, of the radius, */
    double aside;        /* and how far to the right of its middle that was */
    double blur;         /* of the edges, rows */
    double noise;        /* what the fit leaves over, of bright - dark */
    double side_noise;   /* what the fit across the strip leaves over, of its peak */
    double tint;         /* the paint's darkest channel over its brightest, black taken off */
    double unit_sigma;   /* standard deviations: share of unit, */
    double sag_sigma;    /* of sag, */
    double column_sigma; /* columns */
    char code[EYE_CODE_SIZE];
} eye_strip;

#define EYE_PUBLIC __attribute__((visibility("default")))

/* Looks at a picture of 1 or 3 channels; returns how many strips were written (rejected ones too),
 * ``capacity`` at most, or -1 where there is no memory. What picture and task say is not checked. */
EYE_PUBLIC int32_t eye_look(const eye_picture *picture, const eye_task *task, eye_strip *strips,
                            int32_t capacity);
EYE_PUBLIC int32_t eye_version(void);

#endif
