#include "core/crc16.h"

/* `crc` with one more byte. */
static uint16_t add(uint16_t crc, uint8_t byte)
{
    uint8_t top = (uint8_t)((uint8_t)(crc >> 8) ^ byte);
    uint16_t next = (uint16_t)(crc << 8);

    /* Eight steps of the shift register at once: the polynomial x^16 + x^12 + x^5 + 1 folds the
     * upper byte twice into itself and then onto three places. No table, no loop. */
    top = (uint8_t)(top ^ (top >> 4));
    next = (uint16_t)(next ^ ((uint16_t)top << 12));
    next = (uint16_t)(next ^ ((uint16_t)top << 5));
    return (uint16_t)(next ^ top);
}

uint16_t crc16(const uint8_t *bytes, uint8_t length)
{
    uint16_t crc = CRC16_START;
    uint8_t i;

    for (i = 0u; i < length; i++) {
        crc = add(crc, bytes[i]);
    }
    return crc;
}
