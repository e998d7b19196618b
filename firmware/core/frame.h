/* Frames: COBS(body) 00, and the CRC at the body's end. Takes any bytes, believes none. */
#ifndef POLEPILOT_FRAME_H
#define POLEPILOT_FRAME_H

#include <stdint.h>

#include "core/protocol.h"

/* The body of the packet that frame_push() has completed: major, type, seq, payload. */
extern uint8_t frame_body[MAX_BODY];
/* Its length without the CRC. Both stay until the next byte is pushed. */
extern uint8_t frame_length;
/* Frames thrown away, modulo 256: bad stuffing, bad CRC, too short, too long. One per frame. */
extern uint8_t frame_errors;

/* Forget everything. */
void frame_init(void);

/* One byte from the line; returns 1 when it completes a good packet. */
uint8_t frame_push(uint8_t byte);

/* Add CRC, stuffing and the final zero to `body`.
 *
 * bytes[0] is free, the body of `length` bytes begins at bytes[1], and behind it there is room for
 * CRC_SIZE + 1 bytes. Returns how many bytes of `bytes` are to be sent. */
uint8_t frame_encode(uint8_t *bytes, uint8_t length);

#endif
