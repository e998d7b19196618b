/* Between the files of the search: runs.c, match.c, comb.c, slide.c, gather.c, search.c. */
#ifndef POLEPILOT_SEARCH_H
#define POLEPILOT_SEARCH_H

#include "internal.h"

#define EYE_MOST_RUNS 384 /* bright runs in one column */
#define EYE_LEAST_RUNS 2  /* a bar and a bit, the other bar out of the picture */
#define EYE_MOST_HITS 3000 /* a picture full of stripes has no landmark */
#define EYE_MOST_SLIDES 2400 /* by faint colour, of one length each; 1600x1200 may need 2000 */
#define EYE_MOST_LENGTHS 4 /* different numbers of bits that are looked for */
#define EYE_LEAST_STEP 12  /* grey levels of signal; less is noise */
#define EYE_SHORTEST 1.15f /* rows per segment; shorter ones cannot be told apart */
#define EYE_APART 2        /* every second column is looked at */
#define EYE_FAINT 32       /* quarters of a grey level of colour; what has less has none */
#define EYE_BLEEDING 3     /* rows by which colour may go on beyond a code */
#define EYE_BEYOND 3       /* numbers behind a running sum */
#define EYE_SLACK 0.28f    /* share of a segment by which a run may miss its length or place */
#define EYE_ROUNDING 0.75f /* rows by which it may miss besides */
#define EYE_FRAYED 0.35f   /* rows by which a bar may be shorter besides: its end has lost colour */
#define EYE_BAR 2.0f       /* segments of an end bar; */
#define EYE_CUT_UNIT 6.0f  /* rows per segment from which on it may be out of the picture: the pole is near */
#define EYE_BOTH_CUT 0.5f  /* so much shows at least of the only one that the picture does */

/* A bright stretch of one column's signal. */
typedef struct {
    float start, end; /* rows, between pixels */
    uint8_t peak;
    uint8_t valley; /* the darkest between this run and the next */
} eye_run;

/* A code in one column. */
typedef struct {
    float column, top, bottom; /* the inner part: between the end bars */
    int16_t bits, id;
    int8_t open_top, open_bottom; /* an end bar's end is not to be seen */
    int8_t cut;                   /* hardly anything of an end bar is in the picture */
    uint8_t contrast;             /* of the dimmest bright segment and the brightest dark one */
} eye_hit;

/* A code laid along the light of a column, and what it leaves over (`eye_slide`). */
typedef struct {
    float top, unit; /* rows: where it begins, and per segment */
    float rest;      /* mean square, of bright - dark squared */
    float contrast;  /* grey levels */
    int id;
} eye_slid;

/* All of a picture. */
typedef struct {
    const eye_picture *picture;
    const eye_task *task;
    int n_bits, bits[EYE_MOST_LENGTHS];
    int slides; /* that are left, of EYE_MOST_SLIDES */
    int n_hits;
    eye_hit hits[EYE_MOST_HITS];
} eye_hits;

/* The last row of the stretch of signal that begins at row ``from``: ``gap`` rows after it there is no
 * other one with ``least`` of it. Looked for from the gap's far end, as most rows of a stretch have. */
static inline int eye_end_of_stretch(const uint8_t *signal, int from, int last, int least, int gap)
{
    int end = from;
    for (int y = from + gap < last ? from + gap : last; y > end; y--)
        if (signal[y] >= least) {
            end = y;
            y = (end + gap < last ? end + gap : last) + 1;
        }
    return end;
}

int eye_find_runs(const uint8_t *signal, int rows, eye_run *runs);
int eye_smooth_runs(const eye_run *runs, int count, eye_run *smooth);
void eye_match_runs(eye_hits *hits, const eye_run *runs, int count, float column);
void eye_match_cut(eye_hits *hits, const eye_run *runs, int count, float column);
int eye_contrast(const eye_run *upper, const eye_run *lower);
void eye_match_comb(eye_hits *hits, const uint8_t *signal, int first, int last, int x, int known);
void eye_match_faint(eye_hits *hits, int x);
int eye_slide(const float *sum, int rows, int bits, float least, float most, int from, int end,
              eye_slid *best);
int eye_gather(eye_hits *hits, eye_candidate *found);

#endif
