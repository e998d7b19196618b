#include "core/crc16.h"

uint16_t crc16_add(uint16_t crc, uint8_t byte)
{
    uint8_t top = (uint8_t)((uint8_t)(crc >> 8) ^ byte);

    /* Eight steps of the shift register at once: the polynomial x^16 + x^12 + x^5 + 1 folds the
     * upper byte twice into itself and then onto three places. No table, no loop. */
    top = (uint8_t)(top ^ (top >> 4));
    crc = (uint16_t)(crc << 8);
    crc = (uint16_t)(crc ^ ((uint16_t)top << 12));
    crc = (uint16_t)(crc ^ ((uint16_t)top << 5));
    return (uint16_t)(crc ^ top);
}

uint16_t crc16(const uint8_t *bytes, uint8_t length)
{
    uint16_t crc = CRC16_START;

    while (length > 0u) {
        crc = crc16_add(crc, *bytes);
        bytes++;
        length--;
    }
    return crc;
}
