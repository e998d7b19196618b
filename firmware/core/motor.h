/* A motor's duty: its slew limit, and no plugging. */
#ifndef POLEPILOT_MOTOR_H
#define POLEPILOT_MOTOR_H

#include <stdint.h>

struct motor {
    int16_t duty;  /* per mille */
    int16_t speed; /* what the motor may still be doing, in 1/8 per mille of full speed */
};

/* `value`, or the end of the range -limit..limit that it is beyond. */
int16_t clamp(int16_t value, int16_t limit);

/* From `value` towards `target`, by at most `reach`. */
int16_t approach(int16_t value, int16_t target, uint16_t reach);

/* No duty, at once. How fast the motor may still turn is kept. */
void motor_off(struct motor *motor);

/* Let `elapsed` milliseconds pass on the way to `target`, at `slew` per mille per millisecond.
 *
 * A motor that turns the other way gets nothing until it has nearly stopped: a reversed supply would
 * add to its own voltage, and draw twice the current of a standing one. */
void motor_run(struct motor *motor, int16_t target, uint16_t elapsed, uint8_t slew);

#endif
