/* From the codes of single columns to candidates: columns that agree with their neighbours. */
#include "search.h"

#include <math.h>
#include <stdlib.h>

#define RECENT 200 /* groups that a hit may join: others ended some columns ago */
#define NEITHER (-1)

/* Hits whose codes begin and end at the same height, each in a column beside the one before. */
typedef struct {
    int first, last; /* hits */
    float left, right;
    int16_t bits;
} group;

/* What it takes; every array has room for all hits. */
typedef struct {
    group *groups;
    int *owner; /* of each hit: its group */
    float *tops, *bottoms;
    eye_candidate *candidates; /* of each group */
} workspace;

static int by_column(const void *a, const void *b)
{
    const eye_hit *x = a, *y = b;
    if (x->column != y->column)
        return x->column < y->column ? -1 : 1;
    return x->top < y->top ? -1 : x->top > y->top;
}

static int by_evidence(const void *a, const void *b)
{
    const eye_candidate *x = a, *y = b;
    if (x->evidence != y->evidence)
        return y->evidence - x->evidence;
    return x->column < y->column ? -1 : x->column > y->column;
}

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

static int belongs(const eye_hits *hits, const group *one, const eye_hit *h)
{
    const eye_hit *last = hits->hits + one->last;
    if (h->column - one->right > 2 * EYE_APART || one->bits != h->bits)
        return 0;
    float room = 0.5f * (h->bottom - h->top) / (float)(2 * h->bits + 1) + 1.0f;
    return fabsf(h->top - last->top) <= room && fabsf(h->bottom - last->bottom) <= room &&
           (last->id == 0) == (h->id == 0);
}

/* Puts every hit into a group; returns how many groups there are. */
static int group_hits(const eye_hits *hits, workspace *w)
{
    int n = 0;
    for (int i = 0; i < hits->n_hits; i++) {
        const eye_hit *h = hits->hits + i;
        w->owner[i] = NEITHER;
        for (int g = n - 1; g >= 0 && g >= n - RECENT && w->owner[i] == NEITHER; g--) {
            group *one = w->groups + g;
            if (belongs(hits, one, h)) {
                one->last = i;
                one->right = h->column;
                w->owner[i] = g;
            }
        }
        if (w->owner[i] == NEITHER) {
            w->groups[n] = (group){i, i, h->column, h->column, h->bits};
            w->owner[i] = n++;
        }
    }
    return n;
}

/* What the hits of a group say together: medians, and the id that most of them read. */
static eye_candidate candidate_of(const eye_hits *hits, int number, workspace *w)
{
    const group *one = w->groups + number;
    int votes[EYE_IDS] = {0};
    int n = 0, open_top = 0, open_bottom = 0, best = 0, contrast = 0;
    for (int i = one->first; i <= one->last; i++) {
        if (w->owner[i] != number)
            continue;
        const eye_hit *h = hits->hits + i;
        w->tops[n] = h->top;
        w->bottoms[n++] = h->bottom;
        open_top += h->open_top;
        open_bottom += h->open_bottom;
        contrast += h->contrast;
        if (++votes[h->id] > votes[best])
            best = h->id;
    }
    qsort(w->tops, (size_t)n, sizeof *w->tops, by_value);
    qsort(w->bottoms, (size_t)n, sizeof *w->bottoms, by_value);
    return (eye_candidate){
        .bits = one->bits,
        .id = best,
        .column = (one->left + one->right) / 2,
        .top = w->tops[n / 2],
        .bottom = w->bottoms[n / 2],
        .evidence = contrast,
        .open_top = 2 * open_top > n,
        .open_bottom = 2 * open_bottom > n,
    };
}

/* Whether two candidates are one landmark, torn in two by a column that was misread or not read. */
static int is_same(const eye_candidate *one, const eye_candidate *other)
{
    double room = 0.08 * (other->bottom - other->top) + 2.0;
    return one->bits == other->bits && (one->id == other->id || one->id == 0) &&
           fabs(one->top - other->top) < room && fabs(one->bottom - other->bottom) < room &&
           fabs(one->column - other->column) < 2 * room;
}

/* Every group becomes a candidate; the clearest ones are kept. */
static int choose(eye_hits *hits, workspace *w, eye_candidate *found)
{
    qsort(hits->hits, (size_t)hits->n_hits, sizeof *hits->hits, by_column);
    int n_groups = group_hits(hits, w), n = 0;
    for (int g = 0; g < n_groups; g++)
        w->candidates[g] = candidate_of(hits, g, w);
    qsort(w->candidates, (size_t)n_groups, sizeof *w->candidates, by_evidence);
    for (int g = 0; g < n_groups && n < EYE_MOST_CANDIDATES; g++) {
        int known = 0;
        for (int f = 0; f < n && !known; f++)
            known = is_same(w->candidates + g, found + f);
        if (!known)
            found[n++] = w->candidates[g];
    }
    return n;
}

/* The candidates, the clearest first; returns how many, at most EYE_MOST_CANDIDATES, or -1 where
 * there is no memory. Puts the hits in order. */
int eye_gather(eye_hits *hits, eye_candidate *found)
{
    size_t most = (size_t)hits->n_hits;
    if (most == 0)
        return 0;
    workspace w = {
        .groups = malloc(most * sizeof *w.groups),
        .owner = malloc(most * sizeof *w.owner),
        .tops = malloc(most * sizeof *w.tops),
        .bottoms = malloc(most * sizeof *w.bottoms),
        .candidates = malloc(most * sizeof *w.candidates),
    };
    int n = -1;
    if (w.groups && w.owner && w.tops && w.bottoms && w.candidates)
        n = choose(hits, &w, found);
    free(w.groups);
    free(w.owner);
    free(w.tops);
    free(w.bottoms);
    free(w.candidates);
    return n;
}
