/* One look at a picture: search, straighten, fit, read, measure. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_ROWS 8           /* of a picture; no code has fewer */
#define ATTEMPTS 2             /* the second one with the code that the first has read */
#define MOST_MISFIT 7.0        /* of a near code, */
#define FAR_MISFIT 1.5         /* and more of a far one, */
#define MISFIT_A_BIT 7.0       /* with every further bright bit the more: the more there is to fit, */
#define MISFIT_A_LAST_BIT 3.0  /* but less if all are bright: many things are evenly striped */
#define USUAL_NOISE 0.035      /* rms rest of the fit of the edges, of bright - dark */
#define MOST_NOISE 0.1         /* and the most that anything makes up for, */
#define IN_PLACE 4.0           /* from so many rows per segment on */
#define USUAL_SIDE_NOISE 0.08  /* rms rest of the fit across, of its peak */
#define USUAL_PITCH 0.035      /* radians between camera and pole */
#define USUAL_BEND 2.1          /* times what the sag's sigma and that pitch allow */
#define USUAL_TINT 0.17        /* as in eye_strip, */
#define USUAL_SHARP_TINT 0.28  /* and where colour is blurred: beside the strip and between its segments */
#define USUAL_SIGMA 0.0040      /* of the unit, as a share of it */
#define MOST_SIGMA 0.05         /* the same: more is no range */
#define LEAST_APART 1.4         /* of bright - dark, from what is beside it: what is missing is a */
#define USUAL_APART 0.3         /* misfit, in this, */
#define MISFIT_APART 3.0        /* and what is more makes up for so much of one, */
#define MOST_APART 2.0          /* up to this much */
#define SURE 6e-4              /* share of the unit: no second fit makes it better */
#define SHARP 5.0              /* rows per segment: blurred colour still parts them */
#define BLURRED 2.4            /* rows per segment: even pixels blur them */
#define MOST_WEIGHS 3          /* in one picture: it takes as long as all else of a candidate */
#define UNREAD (-1.0)          /* instead of a tint: not every segment reads by itself */
#define NEAR 7.5               /* rows per segment: from here on strips fit well, */
#define FAR 4.5                /* from here down they need not; */
#define EVEN_NEAR 4.0          /* the same for evenly striped ones */
#define EVEN_FAR 2.5
#define MOST_BLUR 0.5          /* rows, and three tenths of a segment */
#define SHORTEST 1.25          /* rows per segment */

int32_t eye_version(void) { return EYE_VERSION; }

/* The thickest landmark with that many bits, in segments. */
static double thickest(const eye_task *task, int bits)
{
    double most = 0;
    for (int id = 1; id < EYE_IDS; id++)
        if (task->kinds[id].bits == bits && task->kinds[id].aspect > most)
            most = task->kinds[id].aspect;
    return most;
}

/* Half of the columns between the silhouettes of a landmark whose segment covers ``unit`` rows, in the
 * picture's middle: `measure` knows where that is. */
static double half_width(const eye_task *task, const eye_kind *kind, double unit)
{
    double radius = kind->aspect * kind->segment / 2;
    double depth = task->constant * kind->segment / unit;
    if (kind->flat)
        return task->constant * radius / depth;
    double away = depth + radius;
    return task->constant * radius / sqrt(away * away - radius * radius);
}

/* How badly the edges fit a landmark: squares of what they leave over and of how vague the scale is, each
 * over what it usually is. Real strips seldom have more than a few. */
static double misfit_along(const eye_strip *strip)
{
    double edges = strip->noise / USUAL_NOISE, vague = strip->unit_sigma / USUAL_SIGMA;
    return edges * edges + vague * vague;
}

/* The same of the sides, the sag and the tint. */
static double misfit_besides(const eye_strip *strip, double constant, int sharp)
{
    double sag = hypot(strip->sag_sigma, USUAL_PITCH * strip->unit / constant);
    double sides = strip->side_noise / USUAL_SIDE_NOISE;
    double tint = strip->tint > 0 ? strip->tint / (sharp ? USUAL_SHARP_TINT : USUAL_TINT) : 0;
    double bend = strip->sag / (USUAL_BEND * sag);
    return sides * sides + bend * bend + tint * tint;
}

/* How much of that a code may have: of a far one every bright bit more is evidence that it is one. */
static double most_misfit(const eye_strip *strip)
{
    double far = eye_limit((NEAR - strip->unit) / (NEAR - FAR), 0, 1);
    double even = eye_limit((EVEN_NEAR - strip->unit) / (EVEN_NEAR - EVEN_FAR), 0, 1);
    int ones = 0;
    for (int bit = 0; bit < strip->bits; bit++)
        ones += strip->id >> bit & 1;
    if (ones == strip->bits)
        return MOST_MISFIT + MISFIT_A_LAST_BIT * (ones - 2) * even;
    return MOST_MISFIT + (FAR_MISFIT + MISFIT_A_BIT * (ones - 1)) * far;
}

/* What is known as soon as there is a scale. */
static void note_scale(const eye_scale *scale, double thick, eye_strip *out)
{
    out->row = scale->middle;
    out->unit = scale->unit;
    out->blur = scale->blur;
    out->noise = scale->noise;
    out->width = thick * scale->unit;
}

/* Fits and reads a straightened strip; the reason where it is no code. ``id`` is what the search
 * has read, and then what the levels say. */
static int read_strip(const eye_task *task, const eye_candidate *candidate,
                      eye_upright *upright, double thick, int sharp, int *id,
                      eye_scale *scale, double levels[][EYE_LIGHTS], eye_span *seen,
                      eye_strip *out)
{
    int segments = 2 * candidate->bits + 5, wanted = *id;
    char code[EYE_CODE_SIZE] = {0};
    eye_encode(wanted, candidate->bits, code);
    int reason = eye_fit_scale(upright, task, code, candidate, sharp, scale);
    if (reason != EYE_READ)
        return reason;
    note_scale(scale, thick, out);
    eye_take_leak(upright, scale->leak);
    if (!eye_segment_levels(upright, scale, code, segments, levels, seen))
        return EYE_NO_SCALE;
    double noise = scale->noise / sqrt(scale->unit > 1 ? scale->unit : 1);
    reason = eye_read(task, levels, segments, upright->channels, sharp, noise, out->width,
                      candidate->open_top || candidate->open_bottom, out->code, &out->tint);
    int read = reason == EYE_READ ? eye_decode(out->code, segments) : 0;
    if (candidate->settled && read != wanted) { /* its segments say too little one by one */
        memcpy(out->code, code, sizeof out->code);
        out->tint = UNREAD;
        return EYE_READ;
    }
    if (reason != EYE_READ)
        return reason;
    if (read == 0)
        return EYE_NO_CODE;
    *id = read;
    return read == wanted ? EYE_READ : EYE_NO_CODE;
}

/* Straightens, fits and reads a candidate; the reason where it is no code. */
static int read_candidate(const eye_picture *picture, const eye_task *task,
                          const eye_candidate *candidate, double thick, int sharp,
                          eye_upright *upright, eye_scale *scale, double levels[][EYE_LIGHTS],
                          eye_span *seen, eye_strip *out)
{
    int id = candidate->id, before = 0, reason = EYE_NO_CODE, coloured = picture->channels == 3;
    for (int attempt = 0; attempt < ATTEMPTS && reason != EYE_READ && id != before; attempt++) {
        char code[EYE_CODE_SIZE];
        eye_encode(id, candidate->bits, code);
        reason = eye_straighten(picture, task, candidate, code, thick, sharp, upright);
        if (reason != EYE_READ)
            return reason;
        out->column = upright->column;
        out->lean = upright->lean;
        before = id;
        reason = read_strip(task, candidate, upright, thick, sharp, &id, scale, levels, seen, out);
        if (reason == EYE_READ && coloured && !sharp && scale->unit_sigma > SURE)
            eye_refine_scale(upright, task, out->code, candidate, scale);
    }
    if (reason != EYE_READ)
        return reason;
    out->id = id;
    note_scale(scale, thick, out);
    return EYE_READ;
}

/* Whether both sides of a strip are in the picture as far down and up as its rows are. */
static int shows_sides(const eye_picture *p, const eye_upright *u, const eye_side *side)
{
    double rows[2] = {u->first, u->first + u->rows * u->bin};
    for (int end = 0; end < 2; end++) {
        double middle = side->column + u->lean * (rows[end] - u->row);
        if (middle - side->half < -0.5 || middle + side->half > p->columns - 0.5)
            return 0;
    }
    return 1;
}

/* Looks closely at a candidate; the reason where it is no landmark. */
static int examine(const eye_picture *picture, const eye_task *task,
                   const eye_candidate *candidate, int sharp, eye_strip *out)
{
    int segments = 2 * candidate->bits + 5;
    double thick = thickest(task, candidate->bits);
    double levels[EYE_MOST_SEGMENTS][EYE_LIGHTS];
    eye_upright upright;
    eye_scale scale;
    eye_side side;
    eye_span seen;
    double doubt = 0;
    out->bits = candidate->bits;
    out->column = candidate->column;
    out->row = (candidate->top + candidate->bottom) / 2;
    out->unit = (candidate->bottom - candidate->top) / (segments - 4);
    out->width = thick * out->unit;
    eye_encode(candidate->id, candidate->bits, out->code);
    if (candidate->id == 0)
        return EYE_NO_CODE;
    int reason =
        read_candidate(picture, task, candidate, thick, sharp, &upright, &scale, levels, &seen,
                       out);
    if (reason != EYE_READ)
        return reason;
    if (scale.unit < SHORTEST || scale.blur > MOST_BLUR + 0.3 * scale.unit)
        return EYE_POOR_FIT;
    /* Bright bits are evidence, but where segments have rows enough their edges are in place. */
    if (scale.unit > IN_PLACE && scale.noise > MOST_NOISE)
        return EYE_POOR_FIT;
    const eye_kind *kind = task->kinds + out->id;
    if (kind->bits != candidate->bits)
        return EYE_UNKNOWN_ID;
    /* The picture cuts it off so that it might be another one, or stand higher or lower. */
    if (!eye_only_one(task, out->code + seen.first, seen.end - seen.first))
        return EYE_CUT_OFF;
    double half = half_width(task, kind, scale.unit);
    reason = eye_fit_side(picture, &upright, half, kind->flat, &side);
    if (reason != EYE_READ)
        return reason;
    /* A nearer landmark's segments may have the proportions of these: the width has to tell. */
    if ((seen.first > 2 || seen.end < segments - 2) && !shows_sides(picture, &upright, &side))
        return EYE_CUT_OFF;
    reason = eye_look_at_ends(picture, &upright, &scale, &side, out->code, levels, segments, &doubt);
    if (reason != EYE_READ)
        return reason;
    if (eye_in_front(picture, task, &upright, &scale, &side, out->code, levels, segments, &seen))
        return EYE_COVERED;
    out->side_noise = side.noise;
    out->sides = side.sides;
    out->column = side.column + upright.lean * (scale.middle - upright.row);
    out->sag = scale.sag;
    out->width = 2 * side.half;
    out->front = side.front;
    out->aside = side.aside;
    out->unit_sigma = scale.unit_sigma;
    out->sag_sigma = scale.sag_sigma;
    /* The bearing is that of the middle row, and the lean has to tell where the strip is there. */
    double away = picture->rows / 2.0 - upright.bright_row;
    out->column_sigma = hypot(side.sigma, upright.lean_sigma * away);
    double along = misfit_along(out), bad = misfit_besides(out, task->constant, sharp);
    double most = most_misfit(out);
    double apart = eye_apart(picture, &upright, &scale, &side, out->code, segments) - LEAST_APART;
    if (apart < 0)
        bad += apart * apart / (USUAL_APART * USUAL_APART);
    else
        most += MISFIT_APART * fmin(apart, MOST_APART);
    out->unit_sigma = hypot(scale.unit_sigma, scale.unit_doubt);
    out->sag_sigma = hypot(scale.sag_sigma, scale.sag_doubt);
    /* What the edges leave over the odds have counted already, if they are that code's: if its segments, read
     * one by one, say so too. */
    int agree = out->tint != UNREAD && scale.unit_sigma < MOST_SIGMA;
    /* Half of the squares are the logarithm by which normal errors make a strip less likely. */
    if (candidate->settled && apart >= USUAL_APART &&
        (bad + doubt + (agree ? 0 : along)) / 2 <= candidate->odds) {
        out->tint = fmax(out->tint, 0);
        return EYE_READ;
    }
    bad += along;
    if (!(bad <= most) || out->tint == UNREAD) /* or no number */
        return EYE_POOR_FIT;
    /* What makes it the likelier a code says nothing of its bars. */
    return bad + doubt <= most && doubt <= MOST_MISFIT ? EYE_READ : EYE_NO_BAR;
}

/* Whether a candidate that failed in colour gets a second chance: a far one whose colour is blurred, or one
 * so far that pixels blur it, of which at least something was to be seen. */
static int may_be_read(const eye_picture *picture, const eye_task *task,
                       const eye_candidate *candidate, const eye_strip *strip, double unit)
{
    switch (strip->reason) {
    case EYE_READ:
    case EYE_COVERED:
    case EYE_GOES_ON:
        return 0;
    case EYE_NO_BAR:
    case EYE_NO_CONTRAST:
    case EYE_NO_SCALE:
        return unit < SHARP && eye_has_blurred_colour(picture, task, candidate);
    default: /* brightness alone is no second witness */
        return (unit < BLURRED && eye_is_coloured(picture->channels, task)) ||
               (unit < SHARP && eye_has_blurred_colour(picture, task, candidate));
    }
}

/* Examines a candidate by its colour and, if that is of no use on a far one, by its brightness: JPEG and
 * cheap sensors blur colour over as many rows as a segment has. Where that is a few rows, where the
 * likeliest code is; ``weighs``: how many more times that may be asked. */
static eye_strip look_closely(const eye_picture *picture, const eye_task *task,
                              const eye_candidate *candidate, int *weighs)
{
    eye_strip strip = {0}, other = {0};
    eye_candidate likeliest = *candidate;
    double unit = (candidate->bottom - candidate->top) / (2 * candidate->bits + 1);
    strip.reason = examine(picture, task, candidate, 0, &strip);
    if (!may_be_read(picture, task, candidate, &strip, unit))
        return strip;
    if (unit < EYE_FEW_ROWS &&
        ((*weighs)-- <= 0 ||
         !eye_weigh_codes(picture, task, thickest(task, candidate->bits), &likeliest)))
        return strip;
    other.reason = examine(picture, task, &likeliest, 1, &other);
    return other.reason == EYE_READ ? other : strip;
}

/* Whether a candidate lies within a strip that was read. */
static int is_within(const eye_candidate *c, const eye_strip *strip)
{
    double half = strip->unit * (2 * strip->bits + 5) / 2, row = (c->top + c->bottom) / 2;
    double off = c->column - strip->column - strip->lean * (row - strip->row);
    return strip->reason == EYE_READ && fabs(off) < strip->width / 2 &&
           c->top > strip->row - half && c->bottom < strip->row + half;
}

/* The strips of a picture that is bright enough; how many, or -1 where there is no memory. */
static int look(const eye_picture *picture, const eye_task *task, eye_strip *strips, int capacity)
{
    eye_candidate candidates[EYE_MOST_CANDIDATES];
    int n = eye_search(picture, task, candidates);
    if (n < 0)
        return -1;
    int looked = 0, weighs = MOST_WEIGHS;
    for (int i = 0; i < n && looked < capacity; i++) {
        int known = 0;
        for (int k = 0; k < looked && !known; k++)
            known = is_within(candidates + i, strips + k);
        if (!known)
            strips[looked++] = look_closely(picture, task, candidates + i, &weighs);
    }
    return looked;
}

int32_t eye_look(const eye_picture *picture, const eye_task *task, eye_strip *strips,
                 int32_t capacity)
{
    eye_picture grey, brighter;
    if (picture->rows < LEAST_ROWS || picture->columns < 1 || capacity < 1)
        return 0;
    int plain = eye_make_grey(picture, &grey);
    if (plain < 0)
        return -1;
    const eye_picture *seen = plain ? &grey : picture;
    int dim = eye_brighten(seen, task, &brighter);
    int looked = dim < 0 ? -1 : look(dim ? &brighter : seen, task, strips, capacity);
    if (dim > 0)
        free((void *)brighter.pixels);
    if (plain)
        free((void *)grey.pixels);
    return looked;
}
