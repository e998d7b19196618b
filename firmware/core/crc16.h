/* CRC-16/IBM-3740: polynomial 1021, start FFFF, nothing reflected or inverted. */
#ifndef POLEPILOT_CRC16_H
#define POLEPILOT_CRC16_H

#include <stdint.h>

#define CRC16_START 0xFFFFu

/* Of `length` bytes; of "123456789" it is 29B1. */
uint16_t crc16(const uint8_t *bytes, uint8_t length);

#endif
