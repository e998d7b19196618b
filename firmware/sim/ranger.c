#include "sim/ranger.h"

#include <stddef.h>

#include "core/protocol.h"

uint32_t ranger_mv(uint16_t mm)
{
    static const int32_t CURVE[][2] = {
        {0, 300},    {20, 1400},  {30, 1900},  {40, 2400},  {50, 2800}, {60, 3100}, {80, 2750},
        {100, 2320}, {150, 1640}, {200, 1310}, {250, 1080}, {300, 920}, {400, 740}, {500, 610},
        {600, 520},  {700, 450},  {800, 410},  {1500, 300}, {65534, 280},
    };
    size_t i = 0;
    int32_t mv;

    if (mm == NO_SENSOR) {
        return 0u;
    }
    while (mm > CURVE[i + 1][0]) {
        i++;
    }
    mv = CURVE[i][1] +
         (CURVE[i + 1][1] - CURVE[i][1]) * (mm - CURVE[i][0]) / (CURVE[i + 1][0] - CURVE[i][0]);
    return (uint32_t)mv;
}
