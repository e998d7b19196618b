#include "sim/line.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "sim/pty.h"

#define PATIENCE_S 10

static uint8_t received[65536];
static size_t received_first, received_end;
static uint64_t received_total;
static uint8_t unsent[65536];
static size_t unsent_length;
static uint64_t sent_total;

void line_fail(const char *why)
{
    fprintf(stderr, "polepilot-board: %s\n", why);
    exit(1);
}

void line_take(uint64_t total)
{
    time_t deadline = time(NULL) + PATIENCE_S;

    received_end -= received_first;
    memmove(received, &received[received_first], received_end);
    received_first = 0u;
    while (received_total < total) {
        size_t count = pty_read(&received[received_end], sizeof received - received_end);

        received_end += count;
        received_total += count;
        if (time(NULL) > deadline) {
            line_fail("bytes were announced and did not come");
        }
        if (count == 0u) {
            pty_wait(10);
        }
    }
}

int line_next(uint8_t *byte)
{
    if (received_first == received_end) {
        return 0;
    }
    *byte = received[received_first];
    received_first++;
    return 1;
}

void line_drop(void)
{
    received_first = received_end;
}

void line_put(uint8_t byte)
{
    if (unsent_length < sizeof unsent) {
        unsent[unsent_length] = byte;
        unsent_length++;
    }
}

uint64_t line_flush(void)
{
    time_t deadline = time(NULL) + PATIENCE_S;
    size_t first = 0u;

    while (first < unsent_length) {
        first += pty_write(&unsent[first], unsent_length - first);
        if (time(NULL) > deadline) {
            line_fail("nobody reads the line");
        }
    }
    sent_total += unsent_length;
    unsent_length = 0u;
    return sent_total;
}
