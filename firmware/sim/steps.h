/* A board in step with a simulated world: standard input says how far its time goes on and what its
 * pins see, standard output what its pins do. Bytes of the link travel through the pseudo-terminal;
 * their totals are told here, so that nothing depends on how fast the kernel carries them.
 *
 *   step T_US BYTES STOP ADC MM MM MM MV COUNTS COUNTS   go on until T_US microseconds
 *   hang                                                 from now on the main loop does nothing
 *   power                                                cut the power for a moment
 *
 * BYTES: sent by the host since the program's start, all of which have to be taken first.
 * Each is answered by one line:
 *
 *   BYTES LEFT RIGHT STEERING PAN STARTS
 *
 * BYTES: sent to the host since the program's start; duties in per mille, the steering in
 * centidegrees; how often the board has started. */
#ifndef POLEPILOT_STEPS_H
#define POLEPILOT_STEPS_H

#include <stdint.h>

#include "core/hal.h"

struct step {
    enum { STEP, HANG, POWER, END } kind;
    uint64_t t_us;
    uint64_t bytes;
    struct inputs inputs;
};

/* The next line of standard input; END at its end. Ends the program with status 2 and a message
 * where the line cannot be understood. */
void steps_read(struct step *step);

/* What anything else prints on standard output goes nowhere from now on. */
void steps_own_stdout(void);

void steps_answer(uint64_t bytes, const struct outputs *outputs, unsigned starts);

#endif
