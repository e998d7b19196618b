/* The core's own rules, one function for each; what bytes alone can show is in the conformance
 * suite. Built with sanitizers. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/board.h"
#include "core/crc16.h"
#include "core/frame.h"
#include "core/motor.h"
#include "core/protocol.h"
#include "core/sensors.h"
#include "core/settings.h"
#include "tests/bench.h"

#define CHECK(truth)                                                                               \
    do {                                                                                           \
        checks++;                                                                                  \
        if (!(truth)) {                                                                            \
            fprintf(stderr, "%s:%d: %s: not %s\n", __FILE__, __LINE__, __func__, #truth);          \
            exit(1);                                                                               \
        }                                                                                          \
    } while (0)

static unsigned checks;

static void hello(void)
{
    static const uint8_t OURS[] = {1, 0};

    bench_packet(MSG_HELLO, 1, OURS, 2);
}

static void drive(int left, int right, int steering)
{
    uint8_t payload[6] = {
        (uint8_t)left,        (uint8_t)(left >> 8), (uint8_t)right, (uint8_t)(right >> 8),
        (uint8_t)(steering), (uint8_t)(steering >> 8),
    };

    bench_packet(MSG_DRIVE, 7, payload, 6);
}

static void pan(int rate)
{
    static uint8_t seq;
    uint8_t payload[2] = {(uint8_t)rate, (uint8_t)(rate >> 8)};

    seq++;
    bench_packet(MSG_PAN, seq, payload, 2);
}

static void arm(void)
{
    bench_start(0);
    hello();
    bench_packet(MSG_ARM, 2, NULL, 0);
}

/* DRIVE at 100 Hz. */
static void keep_driving(int left, int right, int steering, unsigned ms)
{
    for (; ms >= 10u; ms -= 10u) {
        drive(left, right, steering);
        bench_run(10);
    }
}

static uint8_t telemetry(size_t field)
{
    uint8_t body[MAX_BODY];

    bench_run(20);
    CHECK(bench_last(MSG_TELEMETRY, body) == HEADER_SIZE + 32u);
    return body[HEADER_SIZE + field];
}

#define STATE 4
#define FAULTS 5

static void crc_of_the_check_string(void)
{
    CHECK(crc16((const uint8_t *)"123456789", 9) == 0x29B1u);
    CHECK(crc16(NULL, 0) == 0xFFFFu);
}

static void golden_packets(void)
{
    static const uint8_t ESTOP[] = {0x06, 0x01, 0x06, 0x09, 0x23, 0xC0, 0x00};
    uint8_t wire[MAX_BODY + 2u] = {0, 1, 6, 9};

    CHECK(frame_encode(wire, 3) == sizeof ESTOP);
    CHECK(memcmp(wire, ESTOP, sizeof ESTOP) == 0);
}

static void the_longest_packet_fits_and_one_byte_more_is_one_error(void)
{
    uint8_t wire[MAX_BODY + 2u] = {0, 1, 0x55, 9};
    uint8_t length, i, complete = 0;

    frame_init();
    length = frame_encode(wire, HEADER_SIZE + MAX_PAYLOAD);
    CHECK(length == MAX_ENCODED + 1u);
    for (i = 0; i < length; i++) {
        complete = frame_push(wire[i]);
    }
    CHECK(complete && frame_length == HEADER_SIZE + MAX_PAYLOAD && frame_errors == 0);
    for (i = 0; i < 200; i++) {
        CHECK(!frame_push(1));
    }
    CHECK(frame_errors == 1);
    CHECK(!frame_push(0) && frame_errors == 1);
}

static void nothing_is_live_before_hello(void)
{
    static const uint8_t OTHER[] = {2, 0};

    bench_start(0);
    drive(500, 500, 0);
    bench_packet(MSG_ARM, 3, NULL, 0);
    pan(500);
    bench_run(100);
    CHECK(!bench_outputs.live && bench_outputs.left == 0 && bench_outputs.pan == 0);
    hello();
    CHECK(bench_outputs.live);
    bench_packet(MSG_HELLO, 1, OTHER, 2);
    CHECK(!bench_outputs.live);
}

static void both_deadlines_to_the_millisecond(void)
{
    arm();
    keep_driving(300, 300, 0, 500);
    drive(300, 300, 0);
    bench_run(249);
    CHECK(bench_outputs.left == 300);
    bench_run(1);
    CHECK(bench_outputs.left == 0);
    CHECK(telemetry(STATE) == STATE_LINK_LOST);
    arm();
    keep_driving(300, 300, 0, 500);
    drive(300, 300, 0);
    bench_run(200);
    bench_packet(MSG_HEARTBEAT, 0, NULL, 0);
    bench_run(49);
    CHECK(bench_outputs.left == 300);
    bench_run(1);
    CHECK(bench_outputs.left == 0);
    CHECK(telemetry(STATE) == STATE_ARMED);
}

static void a_missed_deadline_is_not_undone_by_late_bytes(void)
{
    arm();
    keep_driving(300, 300, 0, 500);
    bench_ms += 300; /* the main loop was held up */
    drive(300, 300, 0);
    CHECK(bench_outputs.left == 0);
    CHECK(telemetry(STATE) == STATE_LINK_LOST);
}

static void a_repetition_ends_after_half_a_second(void)
{
    arm();
    bench_run(499);
    CHECK(telemetry(STATE) == STATE_LINK_LOST);
    arm();
    bench_run(499);
    bench_packet(MSG_ARM, 2, NULL, 0);
    CHECK(telemetry(STATE) == STATE_LINK_LOST);
    arm();
    bench_run(500);
    bench_packet(MSG_ARM, 2, NULL, 0);
    CHECK(telemetry(STATE) == STATE_ARMED);
}

static void duties_follow_their_slew_limit(void)
{
    int i;

    arm();
    for (i = 1; i <= 250; i++) {
        int16_t before = bench_outputs.left;

        if (i % 10 == 1) {
            drive(1000, -1000, 0);
        }
        bench_run(1);
        CHECK(bench_outputs.left - before == 4 && bench_outputs.right == -bench_outputs.left);
    }
    CHECK(bench_outputs.left == 1000);
}

/* The winding sees what the duty and its own turning have not in common. */
static void motors_are_never_plugged(void)
{
    double speed = 0; /* a motor with 80 ms of lag, in duties */
    int target, i;

    arm();
    for (i = 0; i < 12000; i++) {
        if (i % 10 == 0) {
            target = (i / 700) % 2 ? -1000 : 1000;
            drive(target, target, 0);
        }
        bench_run(1);
        speed += (bench_outputs.left - speed) / 80;
        CHECK(bench_outputs.left * speed >= 0 || (speed < 200 && speed > -200));
    }
}

static void backing_out_needs_no_dwell_after_standing(void)
{
    arm();
    keep_driving(0, 0, 0, 300);
    drive(-400, -400, 0);
    bench_run(100);
    CHECK(bench_outputs.left == -400);
}

static void steering_follows_its_slew_limit(void)
{
    arm();
    drive(0, 0, 4500);
    bench_run(1);
    CHECK(bench_outputs.steering == STEERING_SLEW);
    bench_run(112);
    CHECK(bench_outputs.steering == 4500);
    drive(0, 0, -9000);
    bench_run(240);
    CHECK(bench_outputs.steering == -4500);
}

static void an_obstacle_stops_in_the_same_pass(void)
{
    arm();
    keep_driving(800, 800, 0, 500);
    bench_inputs.proximity_mm[1] = HARD_LIMIT_CENTER - 1u;
    bench_run(1);
    CHECK(bench_outputs.left == 0 && bench_outputs.right == 0);
    bench_inputs.proximity_mm[1] = HARD_LIMIT_CENTER;
    drive(800, 800, 0);
    bench_run(10);
    CHECK(bench_outputs.left > 0);
}

static void pan_ends_hold_whatever_way_the_counts_rise(void)
{
    int rising;

    for (rising = 1; rising >= 0; rising--) {
        settings.pan_rising = (uint8_t)rising;
        arm();
        bench_inputs.pan_adc = rising ? 1020 : 3;
        pan(600);
        bench_run(50);
        CHECK(bench_outputs.pan == 0);
        pan(-600);
        bench_run(100);
        CHECK(bench_outputs.pan == -600);
    }
    settings.pan_rising = 1;
}

static void a_stuck_pan_motor_is_let_go_after_a_second(void)
{
    int i;

    bench_start(0);
    hello();
    pan(700);
    for (i = 0; i < 11; i++) {
        bench_run(100);
        pan(700);
    }
    CHECK(bench_outputs.pan == 0 && (telemetry(FAULTS) & FAULT_PAN_STUCK));
    bench_run(300);
    pan(-700);
    bench_run(1);
    CHECK(bench_outputs.pan < 0 && !(telemetry(FAULTS) & FAULT_PAN_STUCK));
    /* One that moves is not stuck. */
    arm();
    for (i = 0; i < 300; i++) {
        bench_inputs.pan_adc = (uint16_t)(200 + 2 * i);
        pan(700);
        bench_run(10);
    }
    CHECK(bench_outputs.pan == 700);
}

static void low_battery_has_hysteresis(void)
{
    arm();
    bench_inputs.battery_mv = LOW_BATTERY_MV - 1u;
    CHECK(telemetry(FAULTS) & FAULT_LOW_BATTERY);
    bench_inputs.battery_mv = LOW_BATTERY_MV + 199u;
    CHECK(telemetry(FAULTS) & FAULT_LOW_BATTERY);
    bench_inputs.battery_mv = LOW_BATTERY_MV + 200u;
    CHECK(!(telemetry(FAULTS) & FAULT_LOW_BATTERY));
}

static void restart_and_overflow_are_told_until_clear(void)
{
    static const uint8_t KEY[] = {0xA5, 0x5A};

    bench_start(FAULT_WATCHDOG_RESET);
    hello();
    bench_overflowed = 1;
    CHECK(telemetry(FAULTS) == (FAULT_WATCHDOG_RESET | FAULT_RECEIVE_OVERFLOW));
    bench_packet(MSG_CLEAR, 9, KEY, 2);
    CHECK(telemetry(FAULTS) == 0);
}

static void the_watchdog_is_fed_by_a_healthy_loop_only(void)
{
    unsigned before;
    int i;

    arm();
    bench_run(5);
    before = bench_fed;
    bench_run(100);
    CHECK(bench_fed == before + 100);
    before = bench_fed;
    for (i = 0; i < 100; i++) {
        bench_packet(MSG_HEARTBEAT, 0, NULL, 0); /* passes, but the clock stands */
    }
    CHECK(bench_fed == before);
    bench_run(1);
    before = bench_fed;
    bench_measures = 0; /* the converter is dead */
    bench_run(100);
    CHECK(bench_fed == before);
}

static void a_full_line_drops_whole_packets(void)
{
    uint8_t body[MAX_BODY];
    const uint8_t *bytes;
    size_t at = 0;

    arm();
    bench_sent_length = 0;
    bench_room = 43;
    bench_run(100);
    CHECK(bench_last(MSG_TELEMETRY, body) == 0);
    bench_packet(MSG_ESTOP, 9, NULL, 0);
    CHECK(bench_answer(&at, &bytes) == 11); /* an answer still finds its room */
    bench_room = 60;
    bench_run(20);
    CHECK(bench_last(MSG_TELEMETRY, body) > 0);
}

static void a_flood_does_not_hold_up_the_outputs(void)
{
    static uint8_t flood[60000];
    uint8_t body[MAX_BODY];

    arm();
    keep_driving(500, 500, 0, 300);
    bench_inputs.stop_button = 1;
    memset(flood, 1, sizeof flood);
    bench_give(flood, 64); /* one pass' worth */
    CHECK(bench_outputs.left == 0);
    bench_give(flood, sizeof flood);
    bench_run(20);
    CHECK(bench_last(MSG_TELEMETRY, body) && body[HEADER_SIZE + STATE] == STATE_ESTOP);
}

static void telemetry_keeps_its_rhythm_through_late_passes(void)
{
    uint8_t body[MAX_BODY];
    unsigned count = 0, i;

    bench_start(0);
    for (i = 0; i < 1000; i++) {
        bench_sent_length = 0;
        bench_ms += 7;
        board_pass();
        count += bench_last(MSG_TELEMETRY, body) > 0;
    }
    CHECK(count == 350);
}

static void time_may_wrap(void)
{
    bench_start(0);
    bench_ms = 0xFFFFFFF0u;
    board_init(0);
    hello();
    bench_packet(MSG_ARM, 2, NULL, 0);
    keep_driving(300, 300, 0, 500);
    CHECK(bench_ms < 1000 && bench_outputs.left == 300);
    bench_run(250);
    CHECK(bench_outputs.left == 0);
}

static void sensors_follow_their_curve(void)
{
    uint16_t adc, before = 800;

    CHECK(sensors_proximity_mm(0) == NO_SENSOR && sensors_proximity_mm(19) == NO_SENSOR);
    for (adc = 20; adc < 1024; adc++) {
        uint16_t mm = sensors_proximity_mm(adc);

        CHECK(mm <= before && mm >= 60);
        before = mm;
    }
    CHECK(sensors_proximity_mm(475) == 100);
    CHECK(sensors_battery_mv(1023) == 15000 && sensors_battery_mv(0) == 0);
}

static void approach_takes_the_whole_range(void)
{
    CHECK(approach(-32768, 32767, 65535) == 32767);
    CHECK(approach(-1000, 1000, 4) == -996 && approach(1000, -1000, 4) == 996);
    CHECK(approach(2, 0, 4) == 0 && approach(-2, 0, 4) == 0);
    CHECK(clamp(-32768, 1000) == -1000 && clamp(32767, 1000) == 1000 && clamp(-3, 1000) == -3);
}

int main(void)
{
    crc_of_the_check_string();
    golden_packets();
    the_longest_packet_fits_and_one_byte_more_is_one_error();
    nothing_is_live_before_hello();
    both_deadlines_to_the_millisecond();
    a_missed_deadline_is_not_undone_by_late_bytes();
    a_repetition_ends_after_half_a_second();
    duties_follow_their_slew_limit();
    motors_are_never_plugged();
    backing_out_needs_no_dwell_after_standing();
    steering_follows_its_slew_limit();
    an_obstacle_stops_in_the_same_pass();
    pan_ends_hold_whatever_way_the_counts_rise();
    a_stuck_pan_motor_is_let_go_after_a_second();
    low_battery_has_hysteresis();
    restart_and_overflow_are_told_until_clear();
    the_watchdog_is_fed_by_a_healthy_loop_only();
    a_full_line_drops_whole_packets();
    a_flood_does_not_hold_up_the_outputs();
    telemetry_keeps_its_rhythm_through_late_passes();
    time_may_wrap();
    sensors_follow_their_curve();
    approach_takes_the_whole_range();
    printf("core: %u checks\n", checks);
    return 0;
}
