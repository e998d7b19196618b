/* The eye's kernel: finds the strips of barcode poles in a picture and measures them in pixels.
 *
 * One call looks at one picture and keeps nothing. The steps are one file each:
 *   search.c   runs of bright and dark along the columns that have the proportions of a code
 *   upright.c  how the strip leans; its light by row, straightened, and by column
 *   scale.c    all edges of the code at once, fitted to one scale
 *   read.c     the light of the segments as bits, or why they are none
 *   side.c     where the strip's middle lies between its sides
 *   cover.c    whether something dark lies over it
 * Rows and columns count from the centre of the first pixel. Light is linear, 0 to 1.
 * docs/vision.md explains the method. */
#ifndef POLEPILOT_EYE_H
#define POLEPILOT_EYE_H

#include <stddef.h>
#include <stdint.h>

#define EYE_VERSION 1
#define EYE_MOST_SEGMENTS 21 /* of an 8-bit code */
#define EYE_MOST_BITS 8
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
    EYE_COVERED = 13
};

typedef struct {
    const uint8_t *pixels; /* rows x columns x channels, blue-green-red or grey */
    int32_t rows, columns, channels;
    ptrdiff_t stride; /* bytes from row to row */
} eye_picture;

/* What one id looks like. */
typedef struct {
    int32_t bits;  /* 0: there is no such landmark */
    int32_t flat;  /* not 0: a flat sticker, else a cylinder */
    double aspect; /* thickness over length of a segment */
    double segment; /* length of a segment in units of the camera constant's: metres */
} eye_kind;

/* What to look for. */
typedef struct {
    int32_t high, low; /* channels in which the bright paint is brightest and darkest; low -1: none */
    int32_t weights[3]; /* of blue, green, red in the brightness; they sum up to 256 */
    double constant;   /* camera constant, pixels */
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
    double front;        /* mean height of the surface that was measured, of the radius */
    double blur;         /* of the edges, rows */
    double noise;        /* what the fit leaves over, of bright - dark */
    double side_noise;   /* what the fit across the strip leaves over, of its peak */
    double tint;         /* the paint's darkest channel over its brightest, black taken off */
    double unit_sigma;   /* standard deviations: share of unit, */
    double sag_sigma;    /* of sag, */
    double column_sigma; /* columns */
    char code[EYE_MOST_SEGMENTS + 3];
} eye_strip;

#define EYE_PUBLIC __attribute__((visibility("default")))

/* Looks at a picture; returns how many strips were written (rejected ones too), or -1 where there
 * is no memory. */
EYE_PUBLIC int32_t eye_look(const eye_picture *picture, const eye_task *task, eye_strip *strips,
                            int32_t capacity);
EYE_PUBLIC int32_t eye_version(void);

/* ---- between the files ---- */

/* A candidate: neighbouring columns that show one code, good to about a pixel. */
typedef struct {
    int bits, id;
    double column;
    double top, bottom; /* the boundaries inside the end bars: after segment 2, before N - 2 */
    int evidence;       /* contrast, summed up over the columns that agreed */
    int open_top, open_bottom; /* something bright goes on beyond the end bar */
} eye_candidate;

#define EYE_FAINTEST 16 /* grey levels of colour that are none */
#define EYE_MOST_CANDIDATES 24
#define EYE_MOST_ROWS 512
#define EYE_MOST_COLUMNS 160

/* A straightened strip. */
typedef struct {
    int rows;                          /* of the profile; each is the mean of ``bin`` of the picture */
    int bin;
    int channels;
    double first;                      /* the upper border of row 0 */
    float light[EYE_MOST_ROWS];        /* linear brightness */
    float channel[EYE_MOST_ROWS][3];   /* the same for every channel */
    double column, row, lean;          /* the strip's middle */
    int columns;                       /* of ``across`` */
    int step;                          /* columns of the picture per entry */
    double across_first;               /* column of entry 0 */
    float across[EYE_MOST_COLUMNS];    /* bright minus dark by column */
    double across_noise;               /* standard deviation of one entry */
    double half_window;                /* half the columns that the profile averages */
} eye_upright;

typedef struct {
    double middle, unit, sag, blur, growth;
    double above, below, bright, bright_tilt, dark, dark_tilt;
    double unit_sigma, sag_sigma, noise;
} eye_scale;

typedef struct {
    double column, half, blur;
    double front;
    double sigma, noise;
    int sides;
} eye_side;

int eye_search(const eye_picture *picture, const eye_task *task, eye_candidate *found);
int eye_straighten(const eye_picture *picture, const eye_task *task,
                   const eye_candidate *candidate, const char *code, double aspect,
                   eye_upright *out);
int eye_fit_scale(const eye_upright *upright, const eye_task *task, const char *code,
                  const eye_candidate *candidate, int sharp, eye_scale *out);
int eye_refine_scale(const eye_upright *upright, const eye_task *task, const char *code,
                     const eye_candidate *candidate, eye_scale *scale);
int eye_segment_levels(const eye_upright *upright, const eye_scale *scale, int segments,
                       double levels[][3]);
int eye_read(const eye_task *task, double levels[][3], int segments, int channels, double noise,
             double width, int open, char *code, double *tint);
int eye_fit_side(const eye_picture *picture, const eye_upright *upright, double half,
                 int flat, eye_side *out);

int eye_covered(const eye_picture *picture, const eye_upright *upright, const eye_scale *scale,
                const eye_side *side, const char *code, double levels[][3], int segments,
                double noise);

/* algebra.c */
int eye_solve(double *matrix, double *right, int n, int rights);
int eye_decode(const char *code, int segments);
void eye_encode(int id, int bits, char *code);

/* Tables, filled before anything runs. */
#define EYE_STEPS 1200 /* of the normal distribution, from -EYE_REACH to EYE_REACH */
#define EYE_REACH 6.0
extern float eye_cumulative_table[EYE_STEPS + 2], eye_bell_table[EYE_STEPS + 2];
extern float eye_linear_table[256], eye_fine_table[4096];

static inline double eye_look_up(const float *table, double z)
{
    double place = (z + EYE_REACH) * (EYE_STEPS / (2 * EYE_REACH));
    int at = (int)place;
    double rest = place - at;
    return table[at] + rest * (table[at + 1] - table[at]);
}

/* The normal distribution's cumulative function, to 1e-5. */
static inline double eye_cumulative(double z)
{
    if (z <= -EYE_REACH)
        return 0.0;
    return z >= EYE_REACH ? 1.0 : eye_look_up(eye_cumulative_table, z);
}

/* The normal distribution's density, to 1e-5. */
static inline double eye_bell(double z)
{
    return z <= -EYE_REACH || z >= EYE_REACH ? 0.0 : eye_look_up(eye_bell_table, z);
}

/* Linear light of a grey level (0 to 255), and of sixteenths of one (0 to 4080). */
static inline float eye_linear(int grey) { return eye_linear_table[grey]; }
static inline float eye_linear_sixteenths(int level) { return eye_fine_table[level]; }

/* Brightness of a pixel, in sixteenths of a grey level. */
static inline int eye_brightness(const uint8_t *pixel, int channels, const eye_task *task)
{
    if (channels == 1)
        return 16 * pixel[0];
    return (task->weights[0] * pixel[0] + task->weights[1] * pixel[1] +
            task->weights[2] * pixel[2]) >> 4;
}

/* How bright the paint's colour is, in grey levels: brightness where there is colour.
 *
 * The weights keep grey below nothing in light that is a little warm. Where there is colour enough
 * the brightness (half as much again, about the brightest channel of orange) tells bright from
 * black: JPEG and cheap cameras keep it twice as sharp as colour. */
static inline int eye_signal(const uint8_t *pixel, int channels, const eye_task *task)
{
    int value = (3 * eye_brightness(pixel, channels, task)) >> 5;
    if (channels == 3 && task->low >= 0) {
        int colour = (6 * pixel[task->high] - 7 * pixel[task->low]) / 4;
        value = (colour < value ? colour : value) - EYE_FAINTEST;
        value = value < 0 ? 0 : value;
    }
    return value > 255 ? 255 : value;
}

#endif
