/* Sixteen columns of the survey at once: a byte of each in a lane of a vector.
 *
 * GCC and clang make them what every x86-64 (SSE2) and aarch64 (NEON) has. SSE2 hardly moves bytes
 * about, so columns stay in the order in which bytes six apart come to lie in vectors of sixteen: the
 * first eight columns in the even lanes, the other eight in the odd ones. */
#ifndef POLEPILOT_LANES_H
#define POLEPILOT_LANES_H

#include "search.h"

#include <string.h>

#define EYE_LANES 16 /* columns that are looked at together, */
#define EYE_SPAN 96  /* and the bytes of a row that they are in */
#define EYE_TURNED 8 /* rows that become columns together */

typedef uint8_t eye_lanes __attribute__((vector_size(EYE_LANES)));
typedef uint16_t eye_words __attribute__((vector_size(EYE_LANES)));
typedef int16_t eye_signs __attribute__((vector_size(EYE_LANES)));
typedef uint64_t eye_halves __attribute__((vector_size(EYE_LANES)));

/* Which column a lane holds. */
static const uint8_t eye_lane_column[EYE_LANES] = {0, 13, 3, 8, 6,  11, 1, 14,
                                                   4, 9,  7, 12, 2, 15, 5, 10};

static inline eye_lanes eye_load(const uint8_t *at)
{
    eye_lanes lanes;
    memcpy(&lanes, at, sizeof lanes);
    return lanes;
}

/* One channel, whose first byte is at ``at``, of every second pixel of colour; reads 93 bytes. */
static inline eye_lanes eye_gather_lanes(const uint8_t *at)
{
    const eye_lanes k0 = {255, 0, 0, 0, 0, 0, 255, 0, 0, 0, 0, 0, 255, 0, 0, 0};
    const eye_lanes k1 = {0, 255, 0, 0, 0, 0, 0, 255, 0, 0, 0, 0, 0, 255, 0, 0};
    const eye_lanes k2 = {0, 0, 255, 0, 0, 0, 0, 0, 255, 0, 0, 0, 0, 0, 255, 0};
    const eye_lanes k3 = {0, 0, 0, 255, 0, 0, 0, 0, 0, 255, 0, 0, 0, 0, 0, 255};
    const eye_lanes k4 = {0, 0, 0, 0, 255, 0, 0, 0, 0, 0, 255, 0, 0, 0, 0, 0};
    const eye_lanes k5 = {0, 0, 0, 0, 0, 255, 0, 0, 0, 0, 0, 255, 0, 0, 0, 0};
    return (eye_load(at) & k0) | (eye_load(at + 16) & k2) | (eye_load(at + 32) & k4) |
           (eye_load(at + 45) & k3) | (eye_load(at + 61) & k5) | (eye_load(at + 77) & k1);
}

/* 255 where there is no more of the paint's colour (eye_colour) than ``least``, which is 64 at most. */
static inline eye_lanes eye_lanes_without(eye_lanes high, eye_lanes low, int least)
{
    /* 6 high - 7 low <= least is 6 more - least <= low, which is false from 47 on. */
    eye_lanes more = high - low, over = 6 * more - (uint8_t)least;
    return (eye_lanes)(high <= low) | (eye_lanes)(more <= (uint8_t)(least / 6)) |
           ((eye_lanes)(over <= low) & (eye_lanes)(more < 47));
}

/* The even (0) or odd (1) lanes, as words. */
static inline eye_words eye_half_of(eye_lanes lanes, int odd)
{
    return ((eye_words)lanes >> 8 * odd) & 255;
}

/* The lesser one of each two. */
static inline eye_signs eye_lesser(eye_signs one, eye_signs other)
{
    eye_signs less = one < other;
    return (one & less) | (other & ~less);
}

/* Lets blocks of ``size`` rows and lanes change places: those at the right above with those at the left
 * below. ``left``: the lanes of the left ones, in both halves. */
static inline void eye_turn_blocks(eye_halves *rows, int size, uint64_t left)
{
    for (int i = 0; i < EYE_TURNED; i++)
        if (!(i & size)) {
            eye_halves change = (rows[i] >> 8 * size ^ rows[i + size]) & left;
            rows[i + size] ^= change;
            rows[i] ^= change << 8 * size;
        }
}

/* Writes each lane of some rows as a column, ``apart`` bytes from one to the next. */
static inline void eye_store_turned(const eye_lanes *rows, uint8_t *out, ptrdiff_t apart)
{
    eye_halves turned[EYE_TURNED];
    memcpy(turned, rows, sizeof turned);
    eye_turn_blocks(turned, 4, 0xFFFFFFFF);
    eye_turn_blocks(turned, 2, 0xFFFF0000FFFF);
    eye_turn_blocks(turned, 1, 0xFF00FF00FF00FF);
    for (int lane = 0; lane < EYE_LANES; lane++) {
        uint64_t column = turned[lane % EYE_TURNED][lane / EYE_TURNED];
        memcpy(out + eye_lane_column[lane] * apart, &column, sizeof column);
    }
}

/* Whether all lanes are 255. */
static inline int eye_are_all(eye_lanes lanes)
{
    uint64_t halves[2];
    memcpy(halves, &lanes, sizeof halves);
    return (halves[0] & halves[1]) == UINT64_MAX;
}

#endif
