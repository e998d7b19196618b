/* Nonsense for the whole core: build/tests/fuzz SEED COUNT, or libFuzzer by way of `make libfuzzer`.
 *
 * An input is a script: each of its first bytes says what comes next, bytes for the line or time or
 * pins. Whatever comes: no packet is accepted that is not exactly its own encoding, and the outputs
 * are those that the rules allow. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/board.h"
#include "core/crc16.h"
#include "core/frame.h"
#include "core/link.h"
#include "core/protocol.h"
#include "core/robot.h"
#include "core/settings.h"
#include "tests/bench.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define DEMAND(truth)                                                                              \
    do {                                                                                           \
        if (!(truth)) {                                                                            \
            fprintf(stderr, "fuzz: not %s\n", #truth);                                             \
            abort();                                                                               \
        }                                                                                          \
    } while (0)

static uint32_t drive_ms; /* when DRIVE was last received while armed */
static uint32_t heard_ms;
static uint8_t wire[4 * MAX_ENCODED]; /* what has come since the last zero */
static size_t wire_length;

static void outputs_are_safe(void)
{
    const struct outputs *out = &bench_outputs;
    int moving = out->left != 0 || out->right != 0;
    int i, near = 0;

    for (i = 0; i < 3; i++) {
        near |= bench_inputs.proximity_mm[i] < settings.hard_limit_mm[i];
    }
    DEMAND(out->left <= 1000 && out->left >= -1000 && out->right <= 1000 && out->right >= -1000);
    DEMAND(out->pan <= 1000 && out->pan >= -1000);
    DEMAND(out->steering <= settings.max_steering && out->steering >= -settings.max_steering);
    DEMAND(!moving || robot_state() == STATE_ARMED);
    DEMAND(!moving || bench_ms - drive_ms < DRIVE_TIMEOUT_MS);
    DEMAND(!(moving || out->pan != 0) || bench_ms - heard_ms < LINK_TIMEOUT_MS);
    DEMAND(!near || (out->left <= 0 && out->right <= 0));
    DEMAND(robot_ready() || (!moving && out->pan == 0 && out->steering == 0 && !out->live));
    DEMAND(!bench_inputs.stop_button || robot_state() == STATE_ESTOP);
    DEMAND(out->pan >= 0 || bench_inputs.pan_adc > settings.pan_low);
    DEMAND(out->pan <= 0 || bench_inputs.pan_adc < settings.pan_high);
    DEMAND(robot_state() >= STATE_IDLE && robot_state() <= STATE_ESTOP);
}

static void receive(uint8_t byte)
{
    uint8_t again[MAX_BODY + 3u];
    uint8_t state = robot_state();

    if (link_byte(byte)) {
        heard_ms = bench_ms;
        memcpy(&again[1], frame_body, frame_length);
        DEMAND(frame_length >= HEADER_SIZE && frame_length <= HEADER_SIZE + MAX_PAYLOAD);
        DEMAND(frame_encode(again, frame_length) == wire_length + 1u);
        DEMAND(memcmp(again, wire, wire_length) == 0);
        if (frame_body[1] == MSG_DRIVE && state == STATE_ARMED) {
            drive_ms = bench_ms;
        }
        if (frame_body[1] == MSG_ESTOP) {
            DEMAND(robot_state() == STATE_ESTOP);
        }
    }
    if (byte == 0u) {
        wire_length = 0u;
    } else if (wire_length < sizeof wire) {
        wire[wire_length] = byte;
        wire_length++;
    }
}

static void packet(const uint8_t *data, size_t size)
{
    uint8_t bytes[MAX_BODY + 3u] = {0u, PROTOCOL_MAJOR};
    uint8_t length, i;

    if (size > HEADER_SIZE - 1u + MAX_PAYLOAD) {
        size = HEADER_SIZE - 1u + MAX_PAYLOAD;
    }
    memcpy(&bytes[2], data, size);
    if (size < 2u) {
        size = 2u;
    }
    length = frame_encode(bytes, (uint8_t)(size + 1u));
    receive(0u);
    for (i = 0u; i < length; i++) {
        receive(bytes[i]);
    }
}

static void pins(uint8_t choice)
{
    bench_inputs.stop_button = (choice & 0x0Fu) == 0u;
    bench_inputs.proximity_mm[choice % 3u] = (choice & 0x10u) ? 90u : 1500u;
    bench_inputs.pan_adc = (uint16_t)((choice & 0xE0u) << 2 | (choice & 0x1Fu));
    bench_inputs.battery_mv = (uint16_t)(8000u + 20u * choice);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    bench_start(0);
    drive_ms = heard_ms = 0u;
    wire_length = 0u;
    while (size >= 2u) {
        uint8_t kind = data[0] & 3u;
        size_t length = data[0] >> 2; /* up to 63 bytes */

        data++;
        size--;
        if (length > size) {
            length = size;
        }
        if (kind == 0u) {
            size_t i;

            for (i = 0; i < length; i++) {
                receive(data[i]);
            }
        } else if (kind == 1u) {
            packet(data, length);
        } else {
            length = 1u;
            if (kind == 2u) {
                uint32_t ms = data[0];

                while (ms > 0u) {
                    uint32_t leap = ms > 7u && (data[0] & 1u) ? 7u : 1u;

                    bench_ms += leap;
                    ms -= leap;
                    board_pass();
                    outputs_are_safe();
                }
            } else {
                pins(data[0]);
            }
        }
        board_pass();
        outputs_are_safe();
        bench_sent_length = 0u;
        data += length;
        size -= length;
    }
    return 0;
}

#ifndef LIBFUZZER

static uint64_t state = 1u;

/* xorshift64*, seeded: the same case on every computer. */
static uint32_t draw(uint32_t below)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (uint32_t)((state * 0x2545F4914F6CDD1Du) >> 32) % below;
}

/* Mostly sensible packets: pure noise never gets past the CRC. */
static size_t script(uint8_t *bytes, size_t most)
{
    static const uint8_t TYPES[] = {1, 1, 2, 3, 3, 3, 3, 4, 4, 5, 5, 5, 6, 7, 7, 8};
    static const uint8_t LENGTHS[] = {0, 2, 0, 6, 2, 0, 0, 2, 4};
    size_t used = 0, i, length;

    while (used + 60u < most) {
        uint32_t choice = draw(10);

        if (choice < 5u) {
            uint8_t type = TYPES[draw(sizeof TYPES)];

            length = draw(12) ? LENGTHS[type] : draw(42);
            bytes[used] = (uint8_t)((length + 2u) << 2 | 1u);
            bytes[used + 1] = draw(40) ? type : (uint8_t)draw(256);
            bytes[used + 2] = (uint8_t)draw(8);
            for (i = 0; i < length; i++) {
                bytes[used + 3u + i] = (uint8_t)draw(256);
            }
            if (type == MSG_HELLO && draw(8)) {
                bytes[used + 3u] = 1u;
            } else if (type == MSG_CLEAR && draw(4)) {
                bytes[used + 3u] = 0xA5u;
                bytes[used + 4u] = 0x5Au;
            }
            used += length + 3u;
        } else if (choice < 8u) {
            bytes[used] = 2u;
            bytes[used + 1] = (uint8_t)(draw(3) ? draw(40) : draw(256));
            used += 2u;
        } else if (choice < 9u) {
            bytes[used] = 3u;
            bytes[used + 1] = (uint8_t)draw(256);
            used += 2u;
        } else {
            length = draw(50);
            bytes[used] = (uint8_t)(length << 2);
            for (i = 0; i < length; i++) {
                bytes[used + 1u + i] = (uint8_t)(draw(6) ? draw(256) : 0);
            }
            used += length + 1u;
        }
    }
    return used;
}

int main(int count, char **words)
{
    static uint8_t bytes[600];
    unsigned long inputs, i, armed = 0, moved = 0;

    if (count != 3) {
        fputs("usage: fuzz SEED COUNT\n", stderr);
        return 2;
    }
    inputs = strtoul(words[2], NULL, 10);
    for (i = 0; i < inputs; i++) {
        state = (strtoull(words[1], NULL, 10) << 32 | i) * 0x9E3779B97F4A7C15u + 1u;
        size_t size = script(bytes, 70u + draw(sizeof bytes - 70u));

        (void)LLVMFuzzerTestOneInput(bytes, size);
        armed += robot_state() == STATE_ARMED;
        moved += bench_outputs.left != 0;
    }
    printf("fuzz: %lu inputs, %lu ended armed, %lu moving\n", inputs, armed, moved);
    return 0;
}

#endif
