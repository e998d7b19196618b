/* Packets and what they mean: answers, repetitions, telemetry. */
#ifndef POLEPILOT_LINK_H
#define POLEPILOT_LINK_H

#include <stdint.h>

/* Forget every packet so far, and end whatever half packet the host holds. */
void link_init(void);

/* Let `elapsed` milliseconds pass. */
void link_advance(uint16_t elapsed);

/* One byte from the host. Returns 1 when it completed a good packet, which was then obeyed: its
 * body is still in frame_body. */
uint8_t link_byte(uint8_t byte);

/* Send TELEMETRY if it is due. */
void link_report(void);

/* Milliseconds since power-up, of the latest link_advance(). */
uint32_t link_millis(void);

#endif
