#include "core/link.h"

#include "core/frame.h"
#include "core/hal.h"
#include "core/protocol.h"
#include "core/robot.h"
#include "core/settings.h"

#define PAYLOAD (&frame_body[HEADER_SIZE])
#define ACK_SIZE 11u /* on the line */

static uint32_t t_ms;
static uint8_t last_seq;
static uint8_t telemetry_seq;
static uint16_t telemetry_left;
static uint8_t telemetry_due;

/* The last acknowledged command, for 500 ms. None of them that can be repeated has more than two
 * bytes of payload. */
static uint16_t memory_left;
static uint8_t memory_type;
static uint8_t memory_seq;
static uint8_t memory_status;
static uint8_t memory_payload[2];

/* The packet that is being written: room for the first code byte, the body, CRC and zero. */
static uint8_t out[MAX_BODY + 2u];
static uint8_t out_length;

static void put8(uint8_t value)
{
    out[out_length] = value;
    out_length++;
}

static void put16(uint16_t value)
{
    put8((uint8_t)(value & 0xFFu));
    put8((uint8_t)(value >> 8));
}

static void put32(uint32_t value)
{
    put16((uint16_t)(value & 0xFFFFu));
    put16((uint16_t)(value >> 16));
}

static void begin(uint8_t type, uint8_t seq)
{
    out_length = 1u;
    put8(PROTOCOL_MAJOR);
    put8(type);
    put8(seq);
}

/* Send the packet, whole or not at all; `reserve` bytes must stay free behind it. */
static void finish(uint8_t reserve)
{
    uint8_t length = frame_encode(out, (uint8_t)(out_length - 1u));
    uint8_t room = hal_room();
    uint8_t i;

    if ((room < length) || ((uint8_t)(room - length) < reserve)) {
        return;
    }
    for (i = 0u; i < length; i++) {
        hal_send(out[i]);
    }
}

static uint16_t get16(uint8_t at)
{
    return (uint16_t)(PAYLOAD[at] | ((uint16_t)PAYLOAD[at + 1u] << 8));
}

void link_init(void)
{
    t_ms = 0u;
    last_seq = 0u;
    telemetry_seq = 0u;
    telemetry_left = TELEMETRY_PERIOD_MS;
    telemetry_due = 0u;
    memory_left = 0u;
    frame_init();
    hal_send(0u);
}

void link_advance(uint16_t elapsed)
{
    uint16_t late;

    t_ms += elapsed;
    memory_left = (memory_left > elapsed) ? (uint16_t)(memory_left - elapsed) : 0u;
    if (telemetry_left > elapsed) {
        telemetry_left = (uint16_t)(telemetry_left - elapsed);
    } else {
        /* Late by some milliseconds: the next one comes the sooner. */
        late = (uint16_t)(elapsed - telemetry_left) % TELEMETRY_PERIOD_MS;
        telemetry_left = (uint16_t)(TELEMETRY_PERIOD_MS - late);
        telemetry_due = 1u;
    }
}

uint32_t link_millis(void)
{
    return t_ms;
}

static void acknowledge(uint8_t status)
{
    begin(MSG_ACK, last_seq);
    put8(last_seq);
    put8(frame_body[1]);
    put8(status);
    put8(robot_state());
    finish(0u);
}

static void greet(uint8_t ok)
{
    robot_hello(ok);
    memory_left = 0u;
    begin(MSG_HELLO_ACK, last_seq);
    put8(PROTOCOL_MAJOR);
    put8(PROTOCOL_MINOR);
    put8(ok);
    put8(robot_state());
    put8(MAX_PAYLOAD);
    put8(TELEMETRY_PERIOD_MS);
    put16(LINK_TIMEOUT_MS);
    put8(settings.board);
    put8(FIRMWARE_MAJOR);
    put8(FIRMWARE_MINOR);
    put8(settings.features);
    finish(0u);
}

static void remember(uint8_t type, uint8_t length, uint8_t status)
{
    memory_left = DUPLICATE_MS;
    memory_type = type;
    memory_seq = last_seq;
    memory_status = status;
    memory_payload[0] = (length > 0u) ? PAYLOAD[0] : 0u;
    memory_payload[1] = (length > 1u) ? PAYLOAD[1] : 0u;
}

static uint8_t repeated(uint8_t type, uint8_t length)
{
    if ((memory_left == 0u) || (memory_type != type) || (memory_seq != last_seq)) {
        return 0u;
    }
    return (uint8_t)((length == 0u) ||
                     ((memory_payload[0] == PAYLOAD[0]) && (memory_payload[1] == PAYLOAD[1])));
}

/* ARM, PAN, CLEAR: once, however often they come. */
static void command(uint8_t type, uint8_t length)
{
    uint8_t status;

    if (repeated(type, length) != 0u) {
        acknowledge(memory_status);
        return;
    }
    if (type == MSG_ARM) {
        status = robot_arm();
    } else if (type == MSG_PAN) {
        status = robot_pan((int16_t)get16(0u));
    } else {
        status = robot_clear(get16(0u));
    }
    remember(type, length, status);
    acknowledge(status);
}

/* Payload bytes of a message from the host; 0xFF: there is no such type. */
static uint8_t length_of(uint8_t type)
{
    switch (type) {
    case MSG_HEARTBEAT:
    case MSG_ARM:
    case MSG_ESTOP:
        return 0u;
    case MSG_HELLO:
    case MSG_PAN:
    case MSG_CLEAR:
        return 2u;
    case MSG_PING:
        return 4u;
    case MSG_DRIVE:
        return 6u;
    default:
        return 0xFFu;
    }
}

static void pong(void)
{
    uint8_t i;

    begin(MSG_PONG, last_seq);
    put32(t_ms);
    for (i = 0u; i < 4u; i++) {
        put8(PAYLOAD[i]);
    }
    finish(0u);
}

/* ESTOP is carried out always: from any version, at any length, before HELLO, repeated or not. */
static void estop(uint8_t ours, uint8_t length)
{
    uint8_t status = ((ours == 0u) || (length == 0u)) ? STATUS_OK : STATUS_LENGTH;

    robot_estop();
    remember(MSG_ESTOP, 0u, status);
    acknowledge(status);
}

static void obey(void)
{
    uint8_t ours = (uint8_t)(frame_body[0] == PROTOCOL_MAJOR);
    uint8_t type = frame_body[1];
    uint8_t length = (uint8_t)(frame_length - HEADER_SIZE);
    uint8_t expected = length_of(type);

    if (type == MSG_ESTOP) {
        estop(ours, length);
    } else if (ours == 0u) {
        if (type == MSG_HELLO) {
            greet(0u);
        } else {
            acknowledge(STATUS_VERSION);
        }
    } else if (expected == 0xFFu) {
        acknowledge(STATUS_UNKNOWN_TYPE);
    } else if (length != expected) {
        acknowledge(STATUS_LENGTH);
    } else if (type == MSG_HELLO) {
        greet((uint8_t)(PAYLOAD[0] == PROTOCOL_MAJOR));
    } else if (type == MSG_PING) {
        pong();
    } else if (type == MSG_DRIVE) {
        robot_drive((int16_t)get16(0u), (int16_t)get16(2u), (int16_t)get16(4u));
    } else if (type != MSG_HEARTBEAT) {
        command(type, length);
    } else {
        /* HEARTBEAT: it has fed the link deadline, as every packet does. */
    }
}

uint8_t link_byte(uint8_t byte)
{
    if (frame_push(byte) == 0u) {
        return 0u;
    }
    robot_heard();
    last_seq = frame_body[2];
    obey();
    return 1u;
}

void link_report(void)
{
    uint8_t i;

    if (telemetry_due == 0u) {
        return;
    }
    telemetry_due = 0u;
    begin(MSG_TELEMETRY, telemetry_seq);
    put32(t_ms);
    put8(robot_state());
    put8(robot_faults());
    put8(last_seq);
    put8(frame_errors);
    for (i = 0u; i < 2u; i++) {
        put32(((settings.features & FEATURE_ENCODERS) != 0u) ? (uint32_t)robot_inputs.odometer[i] : 0u);
    }
    put16((uint16_t)robot_outputs.left);
    put16((uint16_t)robot_outputs.right);
    put16((uint16_t)robot_outputs.steering);
    put16(robot_inputs.pan_adc);
    for (i = 0u; i < 3u; i++) {
        put16(((settings.features & FEATURE_PROXIMITY) != 0u) ? robot_inputs.proximity_mm[i]
                                                              : NO_SENSOR);
    }
    put16(robot_inputs.battery_mv);
    /* An answer is worth more than a report: its room stays free. */
    finish(ACK_SIZE);
    telemetry_seq++;
}
