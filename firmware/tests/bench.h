/* A board without hardware for tests: its pins, clock and line are variables. */
#ifndef POLEPILOT_BENCH_H
#define POLEPILOT_BENCH_H

#include <stddef.h>
#include <stdint.h>

#include "core/hal.h"

extern uint32_t bench_ms;
extern struct inputs bench_inputs;
extern struct outputs bench_outputs;
extern uint8_t bench_measures;   /* whether the pins are measured anew */
extern uint8_t bench_room;       /* what hal_room() says */
extern uint8_t bench_overflowed; /* what hal_overflowed() says once */
extern unsigned bench_fed;       /* how often the watchdog was fed */
extern uint8_t bench_sent[65536];
extern size_t bench_sent_length;

/* Power up with these fault bits: centred pan, nothing near, a full battery. */
void bench_start(uint8_t reset_faults);

/* These bytes come in, in one pass at the present time or more where they are many. */
void bench_give(const uint8_t *bytes, size_t length);

/* Send a packet of the host. */
void bench_packet(uint8_t type, uint8_t seq, const uint8_t *payload, uint8_t length);

/* Let milliseconds pass, one pass of the main loop in each. */
void bench_run(uint32_t ms);

/* The last packet of `type` that the board has sent: its body without the CRC goes to `body`.
 * Returns its length, 0 where there is none. Ends the test where the board sent a bad one. */
size_t bench_last(uint8_t type, uint8_t *body);

/* One answer of the board on the line, zero included, after `*at`; telemetry and empty frames are
 * left out. Returns its length, 0 at the end. */
size_t bench_answer(size_t *at, const uint8_t **bytes);

#endif
