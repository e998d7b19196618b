#include "core/frame.h"

#include "core/crc16.h"

uint8_t frame_body[MAX_BODY];
uint8_t frame_length;
uint8_t frame_errors;

static uint8_t taken;    /* bytes of this frame so far */
static uint8_t filled;   /* bytes of the body so far */
static uint8_t left;     /* bytes until the next code byte */
static uint8_t skipping; /* too long: nothing counts until the next zero */

static void restart(void)
{
    taken = 0u;
    filled = 0u;
    left = 0u;
    skipping = 0u;
}

void frame_init(void)
{
    restart();
    frame_length = 0u;
    frame_errors = 0u;
}

static void take(uint8_t byte)
{
    if (skipping != 0u) {
        return;
    }
    if (taken == MAX_ENCODED) {
        skipping = 1u;
        frame_errors++;
        return;
    }
    taken++;
    if (left > 0u) {
        frame_body[filled] = byte;
        filled++;
        left--;
        return;
    }
    /* A code byte: between two blocks there was a zero. */
    if (taken > 1u) {
        frame_body[filled] = 0u;
        filled++;
    }
    left = (uint8_t)(byte - 1u);
}

static uint8_t good(void)
{
    uint8_t length;
    uint16_t sent;

    if ((left > 0u) || (filled < MIN_BODY)) {
        return 0u;
    }
    length = (uint8_t)(filled - CRC_SIZE);
    sent = (uint16_t)(frame_body[length] | ((uint16_t)frame_body[length + 1u] << 8));
    if (crc16(frame_body, length) != sent) {
        return 0u;
    }
    frame_length = length;
    return 1u;
}

uint8_t frame_push(uint8_t byte)
{
    uint8_t complete = 0u;

    if (byte != 0u) {
        take(byte);
        return 0u;
    }
    if ((skipping == 0u) && (taken > 0u)) {
        complete = good();
        if (complete == 0u) {
            frame_errors++;
        }
    }
    restart();
    return complete;
}

uint8_t frame_encode(uint8_t *bytes, uint8_t length)
{
    uint16_t crc = crc16(&bytes[1], length);
    uint8_t code = 0u; /* where the distance to the next zero belongs */
    uint8_t end = (uint8_t)(length + CRC_SIZE + 1u);
    uint8_t i;

    bytes[length + 1u] = (uint8_t)(crc & 0xFFu);
    bytes[length + 2u] = (uint8_t)(crc >> 8);
    for (i = 1u; i < end; i++) {
        if (bytes[i] == 0u) {
            bytes[code] = (uint8_t)(i - code);
            code = i;
        }
    }
    bytes[code] = (uint8_t)(end - code);
    bytes[end] = 0u;
    return (uint8_t)(end + 1u);
}
