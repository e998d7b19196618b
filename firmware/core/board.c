#include "core/board.h"

#include "core/hal.h"
#include "core/link.h"
#include "core/protocol.h"
#include "core/robot.h"

#define MOST_BYTES 64u  /* per pass: a flood of bytes must not hold up the outputs */
#define LONGEST_MS 1000u /* beyond every deadline */

#define ALIVE_CLOCK 1u
#define ALIVE_INPUTS 2u
#define ALIVE_ALL 3u

static uint32_t then;
static uint8_t alive;

void board_init(uint8_t reset_faults)
{
    robot_init(reset_faults);
    link_init();
    hal_write_outputs(&robot_outputs);
    then = hal_millis();
    alive = 0u;
}

static uint16_t pass_time(void)
{
    uint32_t now = hal_millis();
    uint32_t gone = now - then;

    then = now;
    return (uint16_t)((gone > LONGEST_MS) ? LONGEST_MS : gone);
}

void board_pass(void)
{
    uint16_t elapsed = pass_time();
    uint8_t left = MOST_BYTES;
    uint8_t byte;

    if (elapsed > 0u) {
        alive |= ALIVE_CLOCK;
    }
    if (hal_read_inputs(&robot_inputs) != 0u) {
        alive |= ALIVE_INPUTS;
    }
    if (hal_overflowed() != 0u) {
        robot_note(FAULT_RECEIVE_OVERFLOW);
    }
    robot_advance(elapsed);
    link_advance(elapsed);
    while ((left > 0u) && (hal_receive(&byte) != 0u)) {
        (void)link_byte(byte);
        left--;
    }
    robot_actuate(elapsed);
    hal_write_outputs(&robot_outputs);
    link_report();
    /* A stopped clock would stop the deadlines, deaf inputs the end stops: better a reset. */
    if (alive == ALIVE_ALL) {
        alive = 0u;
        hal_feed_watchdog();
    }
}
