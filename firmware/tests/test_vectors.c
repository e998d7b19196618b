/* The C side of vectors.txt.gz, unpacked on standard input. tests/firmware/vectors.py writes it and
 * has its format. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/frame.h"
#include "core/protocol.h"
#include "tests/bench.h"

#define LONGEST 16384

static unsigned line_number;

static void fail(const char *why)
{
    fprintf(stderr, "vector in line %u: %s\n", line_number, why);
    exit(1);
}

static size_t from_hex(const char *text, uint8_t *bytes)
{
    size_t count = 0;
    unsigned value;

    while (sscanf(text, "%2x", &value) == 1) {
        bytes[count] = (uint8_t)value;
        count++;
        text += 2;
    }
    return count;
}

/* packet BODY WIRE */
static void packet(char *rest)
{
    uint8_t wire[64] = {0}, expected[64];
    size_t body = from_hex(strtok(rest, " "), &wire[1]);
    size_t length = from_hex(strtok(NULL, " "), expected);
    uint8_t made[64], i, complete = 0;

    memcpy(made, wire, sizeof made);
    if (frame_encode(made, (uint8_t)body) != length || memcmp(made, expected, length) != 0) {
        fail("is encoded otherwise");
    }
    frame_init();
    for (i = 0; i < length; i++) {
        complete = frame_push(expected[i]);
    }
    if (!complete || frame_length != body || memcmp(frame_body, &wire[1], body) != 0) {
        fail("is decoded otherwise");
    }
}

/* stream BYTES ERRORS BODY... */
static void stream(char *rest)
{
    static uint8_t bytes[LONGEST];
    size_t length = from_hex(strtok(rest, " "), bytes), i;
    int errors = atoi(strtok(NULL, " "));
    uint8_t body[64];

    frame_init();
    for (i = 0; i < length; i++) {
        if (frame_push(bytes[i])) {
            char *expected = strtok(NULL, " ");

            if (expected == NULL || from_hex(expected, body) != frame_length ||
                memcmp(body, frame_body, frame_length) != 0) {
                fail("another packet is found");
            }
        }
    }
    if (strtok(NULL, " ") != NULL) {
        fail("a packet is not found");
    }
    if (frame_errors != errors % 256) {
        fail("errors are counted otherwise");
    }
}

static void nothing_more(size_t *at)
{
    const uint8_t *answer;

    if (bench_answer(at, &answer) > 0) {
        fail("has one answer too many");
    }
    if (bench_sent_length > sizeof bench_sent / 2) {
        bench_sent_length = 0;
    }
    *at = bench_sent_length;
}

/* board STEP...: +MS time passes, bX the button, >BYTES come in, <BYTES are the answers */
static void board(char *rest)
{
    static uint8_t bytes[LONGEST];
    const uint8_t *answer;
    size_t at, length;
    char *step;

    bench_start(0);
    at = bench_sent_length;
    for (step = strtok(rest, " "); step != NULL; step = strtok(NULL, " ")) {
        if (step[0] != '<') {
            nothing_more(&at);
        }
        switch (step[0]) {
        case '+':
            bench_run((uint32_t)atoi(step + 1));
            break;
        case 'b':
            bench_inputs.stop_button = step[1] == '1';
            break;
        case '>':
            bench_give(bytes, from_hex(step + 1, bytes));
            break;
        default:
            length = bench_answer(&at, &answer);
            if (length != from_hex(step + 1, bytes) || memcmp(answer, bytes, length) != 0) {
                fail("is answered otherwise");
            }
        }
    }
    nothing_more(&at);
}

int main(void)
{
    static char line[4 * LONGEST];
    unsigned counts[3] = {0, 0, 0};

    while (fgets(line, sizeof line, stdin) != NULL) {
        line_number++;
        line[strcspn(line, "\n")] = '\0';
        if (strncmp(line, "packet ", 7) == 0) {
            packet(line + 7);
            counts[0]++;
        } else if (strncmp(line, "stream ", 7) == 0) {
            stream(line + 7);
            counts[1]++;
        } else if (strncmp(line, "board ", 6) == 0) {
            board(line + 6);
            counts[2]++;
        } else {
            fail("is of no kind");
        }
    }
    printf("vectors: %u packets, %u streams, %u boards\n", counts[0], counts[1], counts[2]);
    return counts[0] && counts[1] && counts[2] ? 0 : 1;
}
