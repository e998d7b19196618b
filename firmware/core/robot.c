#include "core/robot.h"

#include "core/motor.h"
#include "core/protocol.h"
#include "core/settings.h"

#define BATTERY_HYSTERESIS_MV 200u
#define PAN_STUCK_MS 1000u
#define PAN_STUCK_COUNTS 3u
#define PAN_STUCK_DUTY 300

struct inputs robot_inputs;
struct outputs robot_outputs;

static uint8_t state;
static uint8_t ready;
static uint8_t kept_faults; /* until CLEAR */
static uint8_t low_battery;

/* Milliseconds that are left; 0: expired. */
static uint16_t link_left;
static uint16_t drive_left;
static uint16_t steering_left;
static uint16_t pan_left;

static int16_t wanted_left;
static int16_t wanted_right;
static int16_t wanted_steering;
static int16_t wanted_pan;
static int16_t steering;
static struct motor left_motor;
static struct motor right_motor;
static struct motor pan_motor;

static int8_t pan_stuck;        /* sign of the direction that did not move; 0 while it does */
static uint16_t pan_mark;       /* potentiometer when it was last seen to move */
static uint16_t pan_still_left; /* milliseconds that it may stay there under duty */

/* Let a timer run; returns whether it has expired, now or before. */
static uint8_t expired(uint16_t *timer, uint16_t elapsed)
{
    if (*timer > elapsed) {
        *timer = (uint16_t)(*timer - elapsed);
        return 0u;
    }
    *timer = 0u;
    return 1u;
}

static int8_t sign(int16_t value)
{
    if (value == 0) {
        return 0;
    }
    return (value > 0) ? 1 : -1;
}

/* Wheels off at once; the servo stays, or a robot that still rolls would swerve. */
static void halt(void)
{
    wanted_left = 0;
    wanted_right = 0;
    motor_off(&left_motor);
    motor_off(&right_motor);
}

static void pan_off(void)
{
    wanted_pan = 0;
    motor_off(&pan_motor);
}

static void stop(uint8_t next)
{
    state = next;
    halt();
    pan_off();
}

static void publish(void)
{
    robot_outputs.left = left_motor.duty;
    robot_outputs.right = right_motor.duty;
    robot_outputs.steering = steering;
    robot_outputs.pan = pan_motor.duty;
    robot_outputs.live = ready;
}

void robot_init(uint8_t reset_faults)
{
    uint8_t i;

    robot_inputs.pan_adc = 512u;
    for (i = 0u; i < 3u; i++) {
        robot_inputs.proximity_mm[i] = NO_SENSOR;
    }
    robot_inputs.battery_mv = 12000u;
    robot_inputs.odometer[0] = 0;
    robot_inputs.odometer[1] = 0;
    robot_inputs.stop_button = 0u;
    ready = 0u;
    kept_faults = reset_faults;
    low_battery = 0u;
    link_left = LINK_TIMEOUT_MS;
    drive_left = 0u;
    steering_left = 0u;
    pan_left = 0u;
    wanted_steering = 0;
    steering = 0;
    left_motor.speed = 0;
    right_motor.speed = 0;
    pan_motor.speed = 0;
    pan_stuck = 0;
    pan_mark = 512u;
    pan_still_left = PAN_STUCK_MS;
    stop(STATE_IDLE);
    publish();
}

uint8_t robot_state(void)
{
    return state;
}

uint8_t robot_ready(void)
{
    return ready;
}

static uint8_t blocked(void)
{
    uint8_t i;

    if ((settings.features & FEATURE_PROXIMITY) == 0u) {
        return 0u;
    }
    for (i = 0u; i < 3u; i++) {
        if (robot_inputs.proximity_mm[i] < settings.hard_limit_mm[i]) {
            return 1u;
        }
    }
    return 0u;
}

uint8_t robot_faults(void)
{
    uint8_t faults = kept_faults;

    if (robot_inputs.stop_button != 0u) {
        faults |= FAULT_STOP_BUTTON;
    }
    if (blocked() != 0u) {
        faults |= FAULT_PROXIMITY_STOP;
    }
    if (low_battery != 0u) {
        faults |= FAULT_LOW_BATTERY;
    }
    if (pan_stuck != 0) {
        faults |= FAULT_PAN_STUCK;
    }
    return faults;
}

void robot_note(uint8_t fault)
{
    kept_faults |= fault;
}

void robot_heard(void)
{
    link_left = LINK_TIMEOUT_MS;
}

void robot_advance(uint16_t elapsed)
{
    if (robot_inputs.stop_button != 0u) {
        stop(STATE_ESTOP);
    }
    if (expired(&link_left, elapsed) != 0u) {
        pan_off();
        if (state == STATE_ARMED) {
            stop(STATE_LINK_LOST);
        }
    }
    if (expired(&drive_left, elapsed) != 0u) {
        halt();
    }
    if (expired(&steering_left, elapsed) != 0u) {
        wanted_steering = 0;
    }
    if (expired(&pan_left, elapsed) != 0u) {
        pan_off();
    }
}

/* ---- commands */

void robot_hello(uint8_t ok)
{
    ready = ok;
    stop((state == STATE_ESTOP) ? STATE_ESTOP : STATE_IDLE);
    wanted_steering = 0;
    steering = 0;
    drive_left = 0u;
    pan_stuck = 0;
}

void robot_estop(void)
{
    stop(STATE_ESTOP);
}

void robot_drive(int16_t left, int16_t right, int16_t angle)
{
    if (state != STATE_ARMED) {
        return;
    }
    wanted_left = clamp(left, MAX_DUTY);
    wanted_right = clamp(right, MAX_DUTY);
    wanted_steering = clamp(angle, settings.max_steering);
    drive_left = DRIVE_TIMEOUT_MS;
    steering_left = STEERING_TIMEOUT_MS;
}

uint8_t robot_arm(void)
{
    if ((ready == 0u) || (state == STATE_ESTOP)) {
        return STATUS_NOT_READY;
    }
    if (state != STATE_ARMED) {
        halt();
        state = STATE_ARMED;
    }
    return STATUS_OK;
}

uint8_t robot_pan(int16_t rate)
{
    if ((ready == 0u) || ((state != STATE_IDLE) && (state != STATE_ARMED))) {
        return STATUS_NOT_READY;
    }
    wanted_pan = clamp(rate, MAX_DUTY);
    pan_left = PAN_TIMEOUT_MS;
    if (sign(wanted_pan) != pan_stuck) {
        pan_stuck = 0;
    }
    return STATUS_OK;
}

uint8_t robot_clear(uint16_t key)
{
    if (key != CLEAR_KEY) {
        return STATUS_RANGE;
    }
    if ((ready == 0u) || (robot_inputs.stop_button != 0u)) {
        return STATUS_NOT_READY;
    }
    if (state != STATE_LINK_LOST) {
        stop(STATE_IDLE);
    }
    kept_faults = 0u;
    pan_stuck = 0;
    return STATUS_OK;
}

/* ---- outputs */

static void actuate_wheels(uint16_t elapsed)
{
    int16_t left = wanted_left;
    int16_t right = wanted_right;

    if (blocked() != 0u) {
        /* Nothing turns forward before an obstacle, not even to slow down gently. */
        left = (left > 0) ? 0 : left;
        right = (right > 0) ? 0 : right;
        if (left_motor.duty > 0) {
            motor_off(&left_motor);
        }
        if (right_motor.duty > 0) {
            motor_off(&right_motor);
        }
    }
    motor_run(&left_motor, left, elapsed, settings.duty_slew);
    motor_run(&right_motor, right, elapsed, settings.duty_slew);
}

/* Whether the pan motor must not turn this way (the sign of a duty). */
static uint8_t pan_forbidden(int8_t way)
{
    int8_t rising = (settings.pan_rising != 0u) ? way : (int8_t)-way;

    if (((settings.features & FEATURE_PAN) == 0u) || ((way != 0) && (way == pan_stuck))) {
        return 1u;
    }
    return (uint8_t)(((rising < 0) && (robot_inputs.pan_adc <= settings.pan_low)) ||
                     ((rising > 0) && (robot_inputs.pan_adc >= settings.pan_high)));
}

static void watch_pan(uint16_t elapsed)
{
    uint16_t adc = robot_inputs.pan_adc;
    uint16_t moved = (uint16_t)(adc - pan_mark);
    int16_t duty = pan_motor.duty;

    if (adc < pan_mark) {
        moved = (uint16_t)(pan_mark - adc);
    }
    if ((moved >= PAN_STUCK_COUNTS) || ((duty < PAN_STUCK_DUTY) && (duty > -PAN_STUCK_DUTY))) {
        pan_mark = adc;
        pan_still_left = PAN_STUCK_MS;
    } else if (expired(&pan_still_left, elapsed) != 0u) {
        pan_stuck = sign(duty);
        motor_off(&pan_motor);
    } else {
        /* it may still begin to move */
    }
}

static void actuate_pan(uint16_t elapsed)
{
    int16_t wanted = (pan_forbidden(sign(wanted_pan)) != 0u) ? 0 : wanted_pan;

    motor_run(&pan_motor, wanted, elapsed, settings.pan_slew);
    if ((wanted == 0) || (pan_forbidden(sign(pan_motor.duty)) != 0u)) {
        motor_off(&pan_motor);
    }
}

static void watch_battery(void)
{
    uint16_t limit = settings.low_battery_mv;

    if ((settings.features & FEATURE_BATTERY) == 0u) {
        return;
    }
    if (low_battery != 0u) {
        limit = (uint16_t)(limit + BATTERY_HYSTERESIS_MV);
    }
    low_battery = (uint8_t)(robot_inputs.battery_mv < limit);
}

void robot_actuate(uint16_t elapsed)
{
    actuate_wheels(elapsed);
    steering = approach(steering, wanted_steering, (uint16_t)(elapsed * settings.steering_slew));
    watch_pan(elapsed);
    actuate_pan(elapsed);
    watch_battery();
    publish();
}
