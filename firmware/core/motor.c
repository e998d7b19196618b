#include "core/motor.h"

#define LAG_MS 64       /* of the speed behind the duty, a power of two */
#define SCALE 8         /* of motor.speed */
#define REST (100 * SCALE) /* slower than a tenth of full speed a motor may be reversed */
#define LONGEST 256u    /* milliseconds; after that a ramp has ended and a motor stands */

int16_t clamp(int16_t value, int16_t limit)
{
    if (value > limit) {
        return limit;
    }
    return (int16_t)((value < -limit) ? -limit : value);
}

int16_t approach(int16_t value, int16_t target, uint16_t reach)
{
    uint16_t gap;

    if (value < target) {
        gap = (uint16_t)((uint16_t)target - (uint16_t)value);
        return (gap <= reach) ? target : (int16_t)(value + (int16_t)reach);
    }
    gap = (uint16_t)((uint16_t)value - (uint16_t)target);
    return (gap <= reach) ? target : (int16_t)(value - (int16_t)reach);
}

void motor_off(struct motor *motor)
{
    motor->duty = 0;
}

void motor_run(struct motor *motor, int16_t target, uint16_t elapsed, uint8_t slew)
{
    uint16_t left = (elapsed > LONGEST) ? LONGEST : elapsed;
    int16_t goal;

    while (left > 0u) {
        left--;
        motor->speed = (int16_t)(motor->speed + (((motor->duty * SCALE) - motor->speed) / LAG_MS));
        goal = target;
        if (((goal < 0) && (motor->speed > REST)) || ((goal > 0) && (motor->speed < -REST))) {
            goal = 0;
        }
        motor->duty = approach(motor->duty, goal, slew);
    }
}
