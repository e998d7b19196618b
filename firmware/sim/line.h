/* The bytes between the host's end of the line and an emulated chip's. */
#ifndef POLEPILOT_LINE_H
#define POLEPILOT_LINE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Fetch bytes of the host until `total` have come since the program's start. */
void line_take(uint64_t total);

/* The host's next byte; returns 0 when the chip has been given all of them. */
int line_next(uint8_t *byte);

/* The chip was switched off: what it has not been given yet is lost. */
void line_drop(void);

/* A byte from the chip; it goes to the host with line_flush(). */
void line_put(uint8_t byte);

/* Returns how many bytes the host was sent since the program's start. */
uint64_t line_flush(void);

/* End the program with status 1 and one line on standard error. */
void line_fail(const char *why);

#ifdef __cplusplus
}
#endif

#endif
