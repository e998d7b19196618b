#include "core/sensors.h"

#include "core/protocol.h"

#ifndef BATTERY_FULL_SCALE_MV
#define BATTERY_FULL_SCALE_MV 15000u /* 20 kOhm above, 10 kOhm below */
#endif
#define FULL_SCALE 1023u
#define NOTHING_WIRED 20u /* 0.1 V: less than any of these sensors gives */

struct point {
    uint16_t adc;
    uint16_t mm;
};

/* The data sheet's typical curve. Nearer than 60 mm the voltage falls again: such a sensor sits at
 * least so far behind the body's edge. */
static const struct point CURVE[] = {
    {84u, 800u},  {92u, 700u},  {106u, 600u}, {125u, 500u}, {151u, 400u}, {188u, 300u},
    {221u, 250u}, {268u, 200u}, {336u, 150u}, {475u, 100u}, {563u, 80u},  {634u, 60u},
};
#define LAST ((sizeof(CURVE) / sizeof(CURVE[0])) - 1u)

uint16_t sensors_proximity_mm(uint16_t adc)
{
    uint8_t i = 0u;
    uint16_t width;
    uint16_t height;
    uint16_t along;

    if (adc < NOTHING_WIRED) {
        return NO_SENSOR;
    }
    if (adc <= CURVE[0].adc) {
        return CURVE[0].mm;
    }
    if (adc >= CURVE[LAST].adc) {
        return CURVE[LAST].mm;
    }
    while (adc > CURVE[i + 1u].adc) {
        i++;
    }
    width = (uint16_t)(CURVE[i + 1u].adc - CURVE[i].adc);
    height = (uint16_t)(CURVE[i].mm - CURVE[i + 1u].mm);
    along = (uint16_t)(adc - CURVE[i].adc);
    return (uint16_t)(CURVE[i].mm - (uint16_t)((uint16_t)(height * along) / width));
}

uint16_t sensors_battery_mv(uint16_t adc)
{
    return (uint16_t)(((uint32_t)adc * BATTERY_FULL_SCALE_MV) / FULL_SCALE);
}
