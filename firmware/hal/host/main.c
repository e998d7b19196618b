/* The core as a Linux program: its serial line is a pseudo-terminal, its clock the computer's or
 * that of a simulated world. */
#define _GNU_SOURCE
#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/board.h"
#include "core/frame.h"
#include "core/hal.h"
#include "core/protocol.h"
#include "core/settings.h"
#include "sim/pty.h"
#include "sim/steps.h"

#define LONGEST_LEAP_US 50000u
#define PATIENCE_MS 10000

struct settings settings = SETTINGS_FOR(BOARD_HOST, FEATURE_BATTERY | FEATURE_PAN);

static uint64_t now_us; /* the board's clock */
static struct inputs pins = {512u, {NO_SENSOR, NO_SENSOR, NO_SENSOR}, 12000u, {0, 0}, 0u};
static struct outputs driven;
static uint8_t received[4096];
static size_t received_first, received_end;
static uint64_t received_total;
static uint8_t unsent[1024];
static size_t unsent_length;
static uint64_t sent_total;
static uint8_t hanging;
static volatile sig_atomic_t ended;
static FILE *journal;
static uint8_t frame_ended; /* the core's last byte was a zero */

/* Write down the packet that the last byte has completed: what the core has obeyed. */
static void keep_journal(void)
{
    uint8_t i;

    if (journal == NULL || !frame_ended) {
        return;
    }
    for (i = 0u; i < frame_length; i++) {
        fprintf(journal, "%02x", frame_body[i]);
    }
    fputs(frame_length > 0u ? "\n" : "", journal);
    frame_length = 0u;
    frame_ended = 0u;
}

/* ---- what the core asks for */

uint32_t hal_millis(void)
{
    return (uint32_t)(now_us / 1000u);
}

uint8_t hal_receive(uint8_t *byte)
{
    keep_journal();
    if (received_first == received_end) {
        return 0u;
    }
    *byte = received[received_first];
    received_first++;
    frame_ended = (uint8_t)(*byte == 0u);
    return 1u;
}

uint8_t hal_overflowed(void)
{
    return 0u; /* the kernel holds back whoever sends too much */
}

uint8_t hal_room(void)
{
    size_t room = sizeof unsent - unsent_length;

    return (uint8_t)(room > 255u ? 255u : room);
}

void hal_send(uint8_t byte)
{
    if (unsent_length < sizeof unsent) {
        unsent[unsent_length] = byte;
        unsent_length++;
    }
}

uint8_t hal_read_inputs(struct inputs *inputs)
{
    *inputs = pins;
    return 1u;
}

void hal_write_outputs(const struct outputs *outputs)
{
    driven = *outputs;
}

void hal_feed_watchdog(void)
{
    /* A program has none: whoever started it sees it end. */
}

/* ---- the line */

static void fetch(void)
{
    size_t count;

    if (received_first < received_end) {
        return;
    }
    count = pty_read(received, sizeof received);
    received_first = 0u;
    received_end = count;
    received_total += count;
}

static void flush(void)
{
    size_t count = unsent_length > 0u ? pty_write(unsent, unsent_length) : 0u;

    sent_total += count;
    unsent_length -= count;
    memmove(unsent, &unsent[count], unsent_length);
}

static void pass(void)
{
    if (!hanging) {
        board_pass();
        keep_journal();
    }
    flush();
}

/* ---- the two clocks */

static uint64_t wall_us(void)
{
    struct timespec now;

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

/* A computer that stalls slows the board's clock down, for the bytes of that time arrive at once:
 * otherwise every hiccup would look like a lost host. */
static void run_in_real_time(void)
{
    uint64_t before = wall_us();

    while (!ended) {
        uint64_t wall, gone;

        pty_wait(1);
        wall = wall_us();
        gone = wall - before;
        before = wall;
        now_us += gone > LONGEST_LEAP_US ? LONGEST_LEAP_US : gone;
        fetch();
        pass();
    }
}

/* Every byte that the host has sent so far reaches the core at its present time. */
static void take_bytes(uint64_t total)
{
    uint64_t deadline = wall_us() + PATIENCE_MS * 1000u;

    while (received_total < total || received_first < received_end) {
        if (wall_us() > deadline) {
            fprintf(stderr, "polepilot-board: %llu bytes were announced and did not come\n",
                    (unsigned long long)(total - received_total));
            exit(1);
        }
        if (received_total < total && received_first == received_end) {
            pty_wait(10);
        }
        fetch();
        pass();
        if (hanging) {
            received_first = received_end;
        }
    }
}

static void restart(void)
{
    /* The clock that the core sees begins at zero again. */
    now_us = 0u;
    received_first = received_end;
    hanging = 0u;
    board_init(0u);
}

static void run_in_step(void)
{
    struct step step;
    uint64_t started = 0u; /* world time of the last start, microseconds */
    unsigned starts = 1u;

    for (;;) {
        steps_read(&step);
        if (step.kind == END) {
            return;
        }
        if (step.kind == HANG) {
            hanging = 1u;
        } else if (step.kind == POWER) {
            started += now_us;
            starts++;
            restart();
        } else {
            take_bytes(step.bytes);
            pins = step.inputs;
            while (started + now_us + 1000u <= step.t_us) {
                now_us += 1000u;
                pass();
            }
            flush();
        }
        steps_answer(sent_total, &driven, starts);
    }
}

/* ---- the command line */

static const char USAGE[] =
    "usage: polepilot-board --link PATH [--in-step] [--features BITS] [--hard-limits L,C,R]\n"
    "                       [--pan-ends LOW,HIGH] [--pan-falling] [--max-steering CENTIDEGREES]\n"
    "                       [--journal FILE]\n"
    "The microcontroller as a program: PATH becomes a link to its serial line. It runs in real time\n"
    "until it is ended, or with --in-step as far as standard input says (sim/steps.h). FILE gets the body\n"
    "of each packet that it obeyed.\n";

static void misused(const char *option, const char *text, const char *expected)
{
    fprintf(stderr, "polepilot-board: --%s %s: expected %s\n", option, text, expected);
    exit(2);
}

/* `count` whole numbers with commas between them. */
static void numbers(const char *option, const char *text, unsigned long most, uint16_t *into,
                    int count)
{
    const char *rest = text;
    char *end;
    int i;

    for (i = 0; i < count; i++) {
        unsigned long value = strtoul(rest, &end, 10);

        if (end == rest || value > most || *end != (i + 1 < count ? ',' : '\0')) {
            misused(option, text, count == 3 ? "three whole numbers, such as 107,100,107"
                                  : count == 2 ? "two whole numbers, such as 8,1015"
                                               : "a whole number in its range");
        }
        into[i] = (uint16_t)value;
        rest = end + 1;
    }
}

static void on_signal(int number)
{
    (void)number;
    ended = 1;
}

int main(int count, char **words)
{
    static const struct option options[] = {
        {"link", required_argument, NULL, 'l'},        {"in-step", no_argument, NULL, 's'},
        {"features", required_argument, NULL, 'f'},    {"hard-limits", required_argument, NULL, 'h'},
        {"pan-ends", required_argument, NULL, 'p'},    {"pan-falling", no_argument, NULL, 'd'},
        {"max-steering", required_argument, NULL, 'm'}, {"journal", required_argument, NULL, 'j'},
        {"help", no_argument, NULL, '?'},
        {NULL, 0, NULL, 0},
    };
    struct sigaction action = {.sa_handler = on_signal};
    const char *path = NULL;
    uint16_t value[3];
    int in_step = 0, option;

    opterr = 0;
    while ((option = getopt_long(count, words, "", options, NULL)) != -1) {
        switch (option) {
        case 'l':
            path = optarg;
            break;
        case 's':
            in_step = 1;
            break;
        case 'f':
            numbers("features", optarg, 15u, value, 1);
            settings.features = (uint8_t)value[0];
            break;
        case 'h':
            numbers("hard-limits", optarg, 65534u, settings.hard_limit_mm, 3);
            break;
        case 'p':
            numbers("pan-ends", optarg, 1023u, value, 2);
            settings.pan_low = value[0];
            settings.pan_high = value[1];
            break;
        case 'd':
            settings.pan_rising = 0u;
            break;
        case 'm':
            numbers("max-steering", optarg, 9000u, value, 1);
            settings.max_steering = (int16_t)value[0];
            break;
        case 'j':
            journal = fopen(optarg, "w");
            if (journal == NULL) {
                misused("journal", optarg, "a file that can be written");
            }
            (void)setvbuf(journal, NULL, _IOLBF, BUFSIZ);
            break;
        default:
            fputs(USAGE, stderr);
            return 2;
        }
    }
    if (path == NULL || optind != count) {
        fputs(USAGE, stderr);
        return 2;
    }
    pty_open(path);
    (void)atexit(pty_close);
    (void)sigaction(SIGTERM, &action, NULL);
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGHUP, &action, NULL);
    board_init(0u);
    if (in_step) {
        run_in_step();
    } else {
        run_in_real_time();
    }
    return 0;
}
