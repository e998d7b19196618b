#include "tests/bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/board.h"
#include "core/crc16.h"
#include "core/frame.h"
#include "core/protocol.h"
#include "core/settings.h"

struct settings settings = SETTINGS_FOR(5, FEATURE_PROXIMITY | FEATURE_BATTERY | FEATURE_PAN);

uint32_t bench_ms;
struct inputs bench_inputs;
struct outputs bench_outputs;
uint8_t bench_measures;
uint8_t bench_room;
uint8_t bench_overflowed;
unsigned bench_fed;
uint8_t bench_sent[65536];
size_t bench_sent_length;

static const uint8_t *given;
static size_t given_length;

uint32_t hal_millis(void)
{
    return bench_ms;
}

uint8_t hal_receive(uint8_t *byte)
{
    if (given_length == 0u) {
        return 0u;
    }
    *byte = *given;
    given++;
    given_length--;
    return 1u;
}

uint8_t hal_overflowed(void)
{
    uint8_t before = bench_overflowed;

    bench_overflowed = 0u;
    return before;
}

uint8_t hal_room(void)
{
    return bench_room;
}

void hal_send(uint8_t byte)
{
    if (bench_sent_length < sizeof bench_sent) {
        bench_sent[bench_sent_length] = byte;
        bench_sent_length++;
    }
}

uint8_t hal_read_inputs(struct inputs *inputs)
{
    *inputs = bench_inputs;
    return bench_measures;
}

void hal_write_outputs(const struct outputs *outputs)
{
    bench_outputs = *outputs;
}

void hal_feed_watchdog(void)
{
    bench_fed++;
}

void bench_start(uint8_t reset_faults)
{
    static const struct inputs FREE = {512u, {1500u, 1500u, 1500u}, 12000u, {0, 0}, 0u};

    bench_ms = 0u;
    bench_inputs = FREE;
    bench_measures = 1u;
    bench_room = 255u;
    bench_overflowed = 0u;
    bench_fed = 0u;
    bench_sent_length = 0u;
    given_length = 0u;
    board_init(reset_faults);
}

void bench_give(const uint8_t *bytes, size_t length)
{
    given = bytes;
    given_length = length;
    do {
        board_pass();
    } while (given_length > 0u);
}

void bench_packet(uint8_t type, uint8_t seq, const uint8_t *payload, uint8_t length)
{
    uint8_t wire[MAX_BODY + 2u] = {0u, PROTOCOL_MAJOR, type, seq};

    if (length > 0u) {
        memcpy(&wire[1u + HEADER_SIZE], payload, length);
    }
    bench_give(wire, frame_encode(wire, (uint8_t)(length + HEADER_SIZE)));
}

void bench_run(uint32_t ms)
{
    while (ms > 0u) {
        ms--;
        bench_ms++;
        board_pass();
    }
}

static size_t next_frame(size_t *at, const uint8_t **bytes)
{
    while (*at < bench_sent_length && bench_sent[*at] == 0u) {
        (*at)++;
    }
    *bytes = &bench_sent[*at];
    while (*at < bench_sent_length && bench_sent[*at] != 0u) {
        (*at)++;
    }
    return (size_t)(&bench_sent[*at] - *bytes);
}

size_t bench_answer(size_t *at, const uint8_t **bytes)
{
    size_t length;

    do {
        length = next_frame(at, bytes);
    } while (length > 0u && (*bytes)[2] == MSG_TELEMETRY);
    return length > 0u ? length + 1u : 0u;
}

/* A second decoder, written another way than the one that is tested. */
static size_t unstuff(const uint8_t *bytes, size_t length, uint8_t *body)
{
    size_t next_code = 0u, count = 0u, i;

    for (i = 0u; i < length; i++) {
        if (i == next_code) {
            next_code += bytes[i];
            if (i > 0u) {
                body[count++] = 0u;
            }
        } else {
            body[count++] = bytes[i];
        }
    }
    if (next_code != length || count < MIN_BODY ||
        crc16(body, (uint8_t)(count - 2u)) != (body[count - 2u] | body[count - 1u] << 8)) {
        fputs("the board has sent a bad packet\n", stderr);
        exit(1);
    }
    return count - CRC_SIZE;
}

size_t bench_last(uint8_t type, uint8_t *body)
{
    uint8_t one[MAX_ENCODED];
    const uint8_t *bytes;
    size_t at = 0u, found = 0u, length;

    while ((length = next_frame(&at, &bytes)) > 0u) {
        size_t count = unstuff(bytes, length, one);

        if (one[1] == type) {
            memcpy(body, one, count);
            found = count;
        }
    }
    return found;
}
