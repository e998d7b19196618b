/* The robot: states, deadlines, outputs, and everything by which it protects itself.
 *
 * There is one robot per microcontroller, so its state is static. It knows nothing of packets. */
#ifndef POLEPILOT_ROBOT_H
#define POLEPILOT_ROBOT_H

#include <stdint.h>

#include "core/hal.h"

/* What the pins said last, and what they get. */
extern struct inputs robot_inputs;
extern struct outputs robot_outputs;

/* All outputs off, nothing remembered; `reset_faults` tell why it has just started. */
void robot_init(uint8_t reset_faults);

/* Let `elapsed` milliseconds pass: whatever has had its time without a command returns to its
 * default. Before the bytes that came meanwhile, so that they cannot undo a missed deadline. */
void robot_advance(uint16_t elapsed);

/* After the commands of this pass: ramps, end stops, limits; sets robot_outputs. */
void robot_actuate(uint16_t elapsed);

uint8_t robot_state(void);
uint8_t robot_ready(void);

/* FAULT_... bits of now. */
uint8_t robot_faults(void);

/* Remember a fault until CLEAR. */
void robot_note(uint8_t fault);

/* A valid packet of any kind has come. */
void robot_heard(void);

/* HELLO: everything off; ready if the host speaks our version. A latched stop stays. */
void robot_hello(uint8_t ok);

void robot_estop(void);

/* DRIVE: ignored unless armed. Per mille and centidegrees; clamped. */
void robot_drive(int16_t left, int16_t right, int16_t steering);

/* ARM, PAN, CLEAR; return a STATUS_... */
uint8_t robot_arm(void);
uint8_t robot_pan(int16_t rate);
uint8_t robot_clear(uint16_t key);

#endif
