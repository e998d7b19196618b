/* The bright runs of one column: ups and downs of its signal, with edges between the pixels. */
#include "search.h"

#include <string.h>

#define HALF_LIGHT 0.60f  /* half of the light as a share of the signal: 0.73 of brightness, 0.5 of colour */
#define LEAVES_DARK 0.30 /* share of a step above which an edge has begun */
#define SHOULDER 0.12    /* an edge has ended where it grows by less than this share */
#define FAINT 0.35       /* share of the peaks beside it below which a run is noise */
#define SHALLOW 0.45     /* share of the peaks beside it above which a valley is texture or noise */

/* A peak or a valley. */
typedef struct {
    int level, at;
} extremum;

/* From row ``y`` on past rows of nothing, eight at a time: most of a column is nothing. ``step``: 1
 * down, -1 up. */
static inline int pass_nothing(const uint8_t *s, int y, int to, int step)
{
    uint64_t eight = 0;
    if (step > 0)
        while (y + 8 <= to && (memcpy(&eight, s + y, 8), eight == 0))
            y += 8;
    else
        while (y - 8 >= to && (memcpy(&eight, s + y - 7, 8), eight == 0))
            y -= 8;
    return y;
}

/* Where a run's edge lies: from the dark row at ``from`` (level ``valley``) towards ``to``, that is down
 * (``step`` 1) or up (-1).
 *
 * The edge ends at a shoulder, not at the peak: behind a bar something brighter may go on. */
static inline float edge(const uint8_t *s, int from, int to, int valley, int peak, int step)
{
    int low = valley + (int)(LEAVES_DARK * (peak - valley));
    int y = pass_nothing(s, from, to, step);
    while (y != to && s[y] <= low)
        y += step;
    int top = y;
    while (top != to && s[top + step] - s[top] > SHOULDER * (s[top] - valley))
        top += step;
    float level = (float)valley + HALF_LIGHT * (float)(s[top] - valley);
    while (y != top && (float)s[y] < level)
        y += step;
    if (y == from)
        return (float)y;
    float here = s[y], before = s[y - step];
    float part = here > before ? (here - level) / (here - before) : 0.0f;
    part = part < 0.0f ? 0.0f : part > 1.0f ? 1.0f : part;
    return (float)y - (float)step * part;
}

/* A change by less than this is noise: a quarter of the peak beside it, or what the column says. */
static inline int least_change(int peak, int least)
{
    return peak / 4 > least ? peak / 4 : least;
}

/* Follows the dark from row ``y`` on to where it rises for good, or to the end; lowers ``valley``. */
static int pass_dark(const uint8_t *s, int rows, int y, int rise, extremum *valley)
{
    int level = valley->level, at = valley->at;
    for (; y < rows; y++) {
        if (s[y] <= level) {
            level = s[y];
            y = level == 0 ? pass_nothing(s, y + 1, rows, 1) - 1 : y;
            at = y;
        } else if (s[y] > level + rise) {
            break;
        }
    }
    *valley = (extremum){level, at};
    return y;
}

/* Follows a run from row ``y`` on to where it falls for good, or to the end; finds its peak. */
static int pass_bright(const uint8_t *s, int rows, int y, int least, extremum *peak)
{
    int level = s[y], at = y, low = level - least_change(level, least);
    for (; y < rows; y++) {
        if (s[y] > level) {
            level = s[y];
            at = y;
            low = level - least_change(level, least);
        } else if (s[y] < low) {
            break;
        }
    }
    *peak = (extremum){level, at};
    return y;
}

/* The bright runs of one column, top first; none where there are too many, or too few for a code. */
int eye_find_runs(const uint8_t *s, int rows, eye_run *runs)
{
    extremum peaks[EYE_MOST_RUNS], valleys[EYE_MOST_RUNS + 1], valley = {0, 0};
    uint8_t brightest = 0; /* a byte: many at a time */
    for (int y = 0; y < rows; y++)
        brightest = s[y] > brightest ? s[y] : brightest;
    int least = brightest / 10 > EYE_LEAST_STEP ? brightest / 10 : EYE_LEAST_STEP;
    int count = 0, y = 0, before = 0; /* level of the last peak */
    while (count < EYE_MOST_RUNS) {
        y = pass_dark(s, rows, y, least_change(before, least), &valley);
        valleys[count] = valley;
        if (y >= rows)
            break;
        y = pass_bright(s, rows, y, least, peaks + count);
        before = peaks[count++].level;
        if (y >= rows) { /* the picture ends bright */
            valleys[count] = (extremum){0, rows};
            break;
        }
        valley = (extremum){s[y], y};
    }
    if (count == EYE_MOST_RUNS || count < EYE_LEAST_RUNS)
        return 0;
    for (int i = 0; i < count; i++) {
        extremum above = valleys[i], below = valleys[i + 1], peak = peaks[i];
        runs[i].peak = (uint8_t)peak.level;
        runs[i].valley = (uint8_t)below.level;
        /* A picture that begins bright has no dark row to start from. */
        if (i == 0 && s[above.at] > LEAVES_DARK * peak.level)
            runs[i].start = -0.5f;
        else
            runs[i].start = edge(s, above.at, peak.at, above.level, peak.level, 1);
        runs[i].end = below.at >= rows ? (float)rows - 0.5f
                                       : edge(s, below.at, peak.at, below.level, peak.level, -1);
    }
    return count;
}

/* The same runs without what is noise or texture if the code is near: runs much fainter than those
 * beside them are left out, and runs that only a shallow valley parts are joined. Far fences are
 * shallow valleys as well, so both readings of a column are looked at. Returns how many are left. */
int eye_smooth_runs(const eye_run *runs, int count, eye_run *smooth)
{
    int n = 0;
    for (int i = 0; i < count; i++) {
        int above = i > 0 ? runs[i - 1].peak : 0;
        int below = i + 1 < count ? runs[i + 1].peak : 0;
        if (runs[i].peak < FAINT * above || runs[i].peak < FAINT * below) {
            if (n > 0 && runs[i].valley < smooth[n - 1].valley)
                smooth[n - 1].valley = runs[i].valley;
            continue;
        }
        if (n > 0) {
            eye_run *before = smooth + n - 1;
            int lower = before->peak < runs[i].peak ? before->peak : runs[i].peak;
            if (before->valley > SHALLOW * lower) {
                before->end = runs[i].end;
                before->valley = runs[i].valley;
                before->peak = before->peak > runs[i].peak ? before->peak : runs[i].peak;
                continue;
            }
        }
        smooth[n++] = runs[i];
    }
    return n;
}
