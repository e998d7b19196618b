/* What a board supplies to the core. No register is named anywhere above this line. */
#ifndef POLEPILOT_HAL_H
#define POLEPILOT_HAL_H

#include <stdint.h>

struct inputs {
    uint16_t pan_adc;         /* counts, 10 bits */
    uint16_t proximity_mm[3]; /* left, centre, right, from each sensor; NO_SENSOR */
    uint16_t battery_mv;
    int32_t odometer[2]; /* encoder counts since power-up, left and right */
    uint8_t stop_button; /* pressed, or its wire is broken */
};

struct outputs {
    int16_t left; /* duty, per mille, forward positive */
    int16_t right;
    int16_t steering; /* centidegrees, left positive */
    int16_t pan;      /* duty, per mille, left positive */
    uint8_t live;     /* 0 from reset to HELLO: every motor pin off, not even braking */
};

/* Milliseconds since reset. */
uint32_t hal_millis(void);

/* The next byte from the host; returns 0 when there is none. */
uint8_t hal_receive(uint8_t *byte);

/* Whether bytes were lost since the last call because nobody fetched them. */
uint8_t hal_overflowed(void);

/* How many bytes can be sent now without waiting. */
uint8_t hal_room(void);

/* Queue one byte. Called only as often as hal_room() allows. */
void hal_send(uint8_t byte);

/* What the pins say; returns whether each was measured anew since the last call that said so. */
uint8_t hal_read_inputs(struct inputs *inputs);

/* Set the pins. Called in each pass of the main loop. */
void hal_write_outputs(const struct outputs *outputs);

/* The main loop is healthy. */
void hal_feed_watchdog(void);

#endif
