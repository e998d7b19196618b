/* The main loop, one pass at a time. */
#ifndef POLEPILOT_BOARD_H
#define POLEPILOT_BOARD_H

#include <stdint.h>

/* After reset, with the fault bits that tell its reason. */
void board_init(uint8_t reset_faults);

/* Clock, pins, bytes, deadlines, outputs, report; feeds the watchdog when all of them work. */
void board_pass(void);

#endif
