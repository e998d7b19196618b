/* What is compiled into one robot's firmware. Every board defines `settings`; the defaults are the
 * default robot's. Macros may be given on the compiler's command line (firmware/README.md). */
#ifndef POLEPILOT_SETTINGS_H
#define POLEPILOT_SETTINGS_H

#include <stdint.h>

#ifndef SETTINGS_STORAGE /* the host program changes its settings by options */
#define SETTINGS_STORAGE const
#endif

#ifndef MAX_STEERING
#define MAX_STEERING 4500
#endif
#ifndef DUTY_SLEW
#define DUTY_SLEW 4u
#endif
#ifndef PAN_SLEW
#define PAN_SLEW 10u
#endif
#ifndef STEERING_SLEW
#define STEERING_SLEW 40u
#endif
#ifndef HARD_LIMIT_LEFT
#define HARD_LIMIT_LEFT 107u
#endif
#ifndef HARD_LIMIT_CENTER
#define HARD_LIMIT_CENTER 100u
#endif
#ifndef HARD_LIMIT_RIGHT
#define HARD_LIMIT_RIGHT 107u
#endif
#ifndef PAN_LOW
#define PAN_LOW 8u
#endif
#ifndef PAN_HIGH
#define PAN_HIGH 1015u
#endif
#ifndef PAN_RISING
#define PAN_RISING 1u
#endif
#ifndef LOW_BATTERY_MV
#define LOW_BATTERY_MV 9900u
#endif

#if DUTY_SLEW < 1 || PAN_SLEW < 1
#error "the slew limit of a duty is at least 1 per mille per millisecond"
#endif
#if STEERING_SLEW < 1
#error "the slew limit of the servo is at least 1 centidegree per millisecond"
#endif
#if MAX_STEERING < 0 || MAX_STEERING > 9000
#error "the servo turns by 9000 centidegrees at most"
#endif

struct settings {
    uint8_t board;             /* BOARD_... */
    uint8_t features;          /* FEATURE_... */
    uint8_t duty_slew;         /* largest change of a wheel's duty, per mille per millisecond */
    uint8_t pan_slew;          /* the same for the pan motor */
    uint8_t steering_slew;     /* centidegrees per millisecond */
    uint8_t pan_rising;        /* whether the counts rise as the camera turns left */
    int16_t max_steering;      /* centidegrees */
    uint16_t hard_limit_mm[3]; /* left, centre, right: nearer than this nothing turns forward */
    uint16_t pan_low;          /* ADC counts: at or below, the pan motor turns only back */
    uint16_t pan_high;
    uint16_t low_battery_mv;
};

#define SETTINGS_FOR(board_number, feature_bits)                                                   \
    {                                                                                              \
        (board_number), (feature_bits), DUTY_SLEW, PAN_SLEW, STEERING_SLEW, PAN_RISING,            \
            MAX_STEERING, {HARD_LIMIT_LEFT, HARD_LIMIT_CENTER, HARD_LIMIT_RIGHT}, PAN_LOW,         \
            PAN_HIGH, LOW_BATTERY_MV                                                               \
    }

extern SETTINGS_STORAGE struct settings settings;

#endif
