/* An infrared ranger (Sharp GP2Y0A21YK) before a wall. */
#ifndef POLEPILOT_RANGER_H
#define POLEPILOT_RANGER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Its voltage in millivolts, after the data sheet's curve with its fall below 60 mm; 0 for NO_SENSOR,
 * where there is none. */
uint32_t ranger_mv(uint16_t mm);

#ifdef __cplusplus
}
#endif

#endif
