/* What a 10-bit converter reads, and what that means. References of 5 V. */
#ifndef POLEPILOT_SENSORS_H
#define POLEPILOT_SENSORS_H

#include <stdint.h>

/* Millimetres to what stands before an infrared ranger (Sharp GP2Y0A21YK: 80 to 800 mm), its
 * greatest range where nothing does; NO_SENSOR where the wire carries nothing at all. */
uint16_t sensors_proximity_mm(uint16_t adc);

/* Behind the divider of docs/hardware.md. */
uint16_t sensors_battery_mv(uint16_t adc);

#endif
