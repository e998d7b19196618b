/* What the kernel's files share. */
#ifndef POLEPILOT_INTERNAL_H
#define POLEPILOT_INTERNAL_H

#include "eye.h"

#define EYE_MOST_CANDIDATES 32
#define EYE_MOST_ROWS 512    /* of a profile: about 4 a segment are needed */
#define EYE_MOST_COLUMNS 160 /* of a profile across */
#define EYE_LIGHTS 4         /* what is known of a segment: three channels and */
#define EYE_LIGHT 3          /* the brightness */
#define EYE_FAINTEST 16      /* grey levels of colour that are none */
#define EYE_FEW_ROWS 3.0     /* per segment: codes are weighed as a whole */

/* ---- the steps ---- */

/* Neighbouring columns that show one code, good to about a pixel. */
typedef struct {
    int bits, id;              /* id 0: a mere stretch of colour, as high and narrow as a far one */
    double column;
    double top, bottom;        /* the inner borders of the end bars: after segment 2, before N - 2 */
    int evidence;              /* contrast, summed up over the columns that agreed */
    int open_top, open_bottom; /* the end bar's end is not to be seen */
    int settled;               /* it is where, and the code that, is the likeliest of all, */
    double lean;               /* which leans so much, */
    double odds;               /* and so much likelier than is enough, as a logarithm */
} eye_candidate;

/* A straightened strip. */
typedef struct {
    int rows;                        /* of the profile, */
    int bin;                         /* each the mean of so many of the picture */
    int channels;
    double first;                    /* the upper border of row 0 */
    float light[EYE_MOST_ROWS];      /* linear brightness */
    float channel[EYE_MOST_ROWS][3]; /* the same for every channel */
    float beside[EYE_MOST_ROWS][4];  /* every channel and brightness just beside the strip */
    double column, row, lean;        /* the strip's middle */
    int columns;                     /* of ``across``, */
    int step;                        /* each the mean of so many of the picture */
    double across_first;             /* middle of entry 0 */
    float across[EYE_MOST_COLUMNS];  /* bright minus dark by column */
    double half_window;              /* half the columns that the profile averages */
    double bright_row;               /* middle of the bright segments that tell the lean, */
    double lean_sigma;               /* whose deviation is known if the picture cuts off a bar */
} eye_upright;

/* A code's place and size along the strip. */
typedef struct {
    double middle, unit;         /* row of the code's middle; rows per segment there */
    double sag, blur;            /* as in eye_strip */
    double growth;               /* rows by which bright segments seem to grow at either end */
    double unit_sigma, sag_sigma; /* standard deviations: share of unit; of sag; */
    double unit_doubt, sag_doubt; /* and what errors that all edges may have add to them */
    double noise;                /* rms rest of the fit, of bright - dark */
    double leak;                 /* share of what is beside the strip that is blurred into it */
} eye_scale;

/* The segments that the picture shows. */
typedef struct {
    int first, end;
} eye_span;

/* Its place across. */
typedef struct {
    double column, half, blur; /* middle, half width, softness of the sides; columns */
    double sigma;              /* of ``column`` */
    double front, aside, noise; /* as in eye_strip; side_noise */
    int sides;
} eye_side;

/* Each says in its file what it does; those that return a reason return one of enum eye_reason. */
int eye_make_grey(const eye_picture *picture, eye_picture *out);
int eye_brighten(const eye_picture *picture, const eye_task *task, eye_picture *out);
int eye_search(const eye_picture *picture, const eye_task *task, eye_candidate *found);
int eye_straighten(const eye_picture *picture, const eye_task *task,
                   const eye_candidate *candidate, const char *code, double aspect, int sharp,
                   eye_upright *out);
/* Whether the colour of what a candidate covers is blurred along it, and its brightness is not. */
int eye_has_blurred_colour(const eye_picture *picture, const eye_task *task,
                           const eye_candidate *candidate);
int eye_weigh_codes(const eye_picture *picture, const eye_task *task, double aspect,
                    eye_candidate *candidate);
/* ``sharp``, here and below: by brightness instead of the paint's colour. */
int eye_fit_scale(const eye_upright *upright, const eye_task *task, const char *code,
                  const eye_candidate *candidate, int sharp, eye_scale *out);
void eye_refine_scale(const eye_upright *upright, const eye_task *task, const char *code,
                      const eye_candidate *candidate, eye_scale *scale);
void eye_take_leak(eye_upright *upright, double leak);
int eye_segment_levels(const eye_upright *upright, const eye_scale *scale, const char *code,
                       int segments, double levels[][EYE_LIGHTS], eye_span *seen);
int eye_read(const eye_task *task, double levels[][EYE_LIGHTS], int segments, int channels, int sharp,
             double noise, double width, int open, char *code, double *tint);
int eye_fit_side(const eye_picture *picture, const eye_upright *upright, double half, int flat,
                 eye_side *out);
int eye_look_at_ends(const eye_picture *picture, const eye_upright *upright,
                     const eye_scale *scale, const eye_side *side, const char *code,
                     double levels[][EYE_LIGHTS], int segments, double *doubt);
double eye_apart(const eye_picture *picture, const eye_upright *upright, const eye_scale *scale,
                 const eye_side *side, const char *code, int segments);
int eye_in_front(const eye_picture *picture, const eye_task *task, const eye_upright *upright,
                 const eye_scale *scale, const eye_side *side, const char *code,
                 double levels[][EYE_LIGHTS], int segments, const eye_span *seen);

/* ---- numbers ---- */

/* The row that lies so many segments below a code's middle. */
static inline double eye_row_at(const eye_scale *scale, double below)
{
    return scale->middle + scale->unit * below / (1 + scale->sag * below);
}

double eye_median(double *values, int n);
int eye_solve(double *matrix, double *right, int n, int rights);
int eye_decode(const char *code, int segments);
void eye_encode(int id, int bits, char *code);
int eye_only_one(const eye_task *task, const char *part, int count);
int eye_mistakable(const eye_task *task, const char *code, int segments, int first, int last);

static inline int eye_clamp(int value, int low, int high)
{
    return value < low ? low : value > high ? high : value;
}

/* As floor and ceil, which are slow on a plain x86-64; of numbers that an int can hold. */
static inline int eye_floor(double value)
{
    int whole = (int)value;
    return whole - (whole > value);
}

static inline int eye_ceil(double value) { return -eye_floor(-value); }

static inline double eye_limit(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

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
    if (!(z > -EYE_REACH)) /* or no number: there is no table for that */
        return 0.0;
    return z >= EYE_REACH ? 1.0 : eye_look_up(eye_cumulative_table, z);
}

/* That and the density of one ``z``, to 1e-5. */
static inline void eye_normal(double z, double *cumulative, double *bell)
{
    *cumulative = z >= EYE_REACH;
    *bell = 0.0;
    if (z > -EYE_REACH && z < EYE_REACH) {
        double place = (z + EYE_REACH) * (EYE_STEPS / (2 * EYE_REACH));
        int at = (int)place;
        double rest = place - at;
        const float *below = eye_cumulative_table + at, *height = eye_bell_table + at;
        *cumulative = below[0] + rest * (below[1] - below[0]);
        *bell = height[0] + rest * (height[1] - height[0]);
    }
}

/* ---- light and colour ---- */

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

/* Whether the paint's colour tells it from other things: not in grey pictures, nor white paint. */
static inline int eye_is_coloured(int channels, const eye_task *task)
{
    return channels == 3 && task->low >= 0;
}

/* How much of the paint's colour a pixel has, in quarters of a grey level. The weights keep grey
 * below nothing in light that is a little warm. */
static inline int eye_colour(const uint8_t *pixel, const eye_task *task)
{
    return 6 * pixel[task->high] - 7 * pixel[task->low];
}

/* How bright the paint's colour is, in grey levels: brightness where there is colour.
 *
 * Where there is colour enough the brightness (half as much again, about the brightest channel of
 * orange) tells bright from black: JPEG and cheap cameras keep it twice as sharp as colour. */
static inline int eye_signal(const uint8_t *pixel, int channels, const eye_task *task)
{
    int value = (3 * eye_brightness(pixel, channels, task)) >> 5;
    if (eye_is_coloured(channels, task)) {
        int colour = eye_colour(pixel, task) / 4;
        value = (colour < value ? colour : value) - EYE_FAINTEST;
        value = value < 0 ? 0 : value;
    }
    return value > 255 ? 255 : value;
}

#endif
