/* AVR machine code as a board: the chip is emulated by simavr, its serial line is a pseudo-terminal,
 * its pins are those of sim/steps.h. Bytes travel at the pace of the line. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <avr_adc.h>
#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>
#include <sim_time.h>

#include "core/protocol.h"
#include "sim/line.h"
#include "sim/pty.h"
#include "sim/ranger.h"
#include "sim/steps.h"

#define HZ 16000000u
#define CYCLES_PER_US (HZ / 1000000u)
#define COUNTS 1023u
#define SUPPLY_MV 5000u
#define BATTERY_DIVIDER 3u
#define ENDLESS_LOOP 0xCFFFu /* rjmp .-2 */

/* Registers, as data addresses. */
#define TCCR0A 0x44
#define OCR0A 0x47
#define OCR0B 0x48
#define TCCR1A 0x80
#define OCR1A 0x88
#define TCCR2A 0xB0
#define OCR2A 0xB3
#define OCR2B 0xB4
#define COM_A 0x80
#define COM_B 0x20

struct pin {
    avr_io_addr_t port; /* its DDR is the address before */
    uint8_t bit;
};

struct wiring {
    const char *chip;
    struct pin left[3], right[3], pan[3]; /* enable, forward or left, backward or right */
    struct pin servo;
    char stop_port;
    int stop_bit;
};

/* hal/avr/pins.h, from the other side. */
static const struct wiring WIRINGS[] = {
    {"atmega328p",
     {{0x25, 3}, {0x2B, 4}, {0x2B, 7}},
     {{0x2B, 3}, {0x25, 0}, {0x25, 2}},
     {{0x2B, 5}, {0x2B, 6}, {0x25, 4}},
     {0x25, 1},
     'C',
     5},
    {"atmega2560",
     {{0x25, 4}, {0x22, 0}, {0x22, 1}},
     {{0x102, 6}, {0x22, 2}, {0x22, 3}},
     {{0x34, 5}, {0x22, 4}, {0x22, 5}},
     {0x25, 5},
     'A',
     6},
};

static const struct wiring *wiring;
static avr_t *avr;
static void (*reset_of_chip)(avr_t *avr);
static unsigned starts;
static uint64_t cycles_per_byte;

/* ---- the line */

static uint8_t held_back; /* simavr reads a byte of its own queue only after the one before */

static void hold_back(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    if (value != 0u) {
        held_back = param != NULL;
    }
}

static avr_cycle_count_t next_byte(avr_t *chip, avr_cycle_count_t when, void *param)
{
    uint8_t byte;

    (void)param;
    if (!held_back && line_next(&byte)) {
        avr_raise_irq(avr_io_getirq(chip, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), byte);
    }
    return when + cycles_per_byte;
}

static void from_chip(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)param;
    line_put((uint8_t)value);
}

/* ---- pins */

static void set_voltage(int channel, uint32_t mv)
{
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + channel), mv);
}

static void set_pins(const struct inputs *inputs)
{
    uint32_t port = (uint32_t)AVR_IOCTL_IOPORT_GETIRQ(wiring->stop_port);
    avr_irq_t *stop = avr_io_getirq(avr, port, wiring->stop_bit);
    uint32_t high = inputs->stop_button ? 1u : 0u;
    avr_ioport_external_t wire = {
        .name = (unsigned)wiring->stop_port & 0x7Fu,
        .mask = 1u << wiring->stop_bit & 0xFFu,
        .value = high << wiring->stop_bit & 0xFFu,
    };
    int i;

    set_voltage(0, (inputs->pan_adc * SUPPLY_MV + COUNTS - 1u) / COUNTS);
    for (i = 0; i < 3; i++) {
        set_voltage(1 + i, ranger_mv(inputs->proximity_mm[i]));
    }
    set_voltage(4, inputs->battery_mv / BATTERY_DIVIDER);
    (void)avr_ioctl(avr, (uint32_t)AVR_IOCTL_IOPORT_SET_EXTERNAL(wiring->stop_port), &wire);
    /* Twice, because after a reset of the chip simavr takes a level that it knows for no change. */
    avr_raise_irq(stop, !high);
    avr_raise_irq(stop, high);
}

static uint8_t level(const struct pin *pin)
{
    return (uint8_t)((avr->data[pin->port - 1] & avr->data[pin->port]) >> pin->bit & 1);
}

/* Per mille of the time for which a pin is high that a timer may drive. */
static int high_time(const struct pin *pin, uint8_t connected, uint8_t compare, uint8_t top)
{
    if (!connected) {
        return level(pin) * 1000;
    }
    return (avr->data[pin->port - 1] >> pin->bit & 1) ? (compare * 1000 + top / 2) / top : 0;
}

static int16_t bridge(const struct pin *pins, uint8_t connected, uint8_t compare, uint8_t top)
{
    return (int16_t)(high_time(&pins[0], connected, compare, top) *
                     (level(&pins[1]) - level(&pins[2])));
}

static void read_pins(struct outputs *out)
{
    const uint8_t *data = avr->data;
    int counts = data[OCR1A] | data[OCR1A + 1] << 8;

    out->left = bridge(wiring->left, data[TCCR2A] & COM_A, data[OCR2A], 255);
    out->right = bridge(wiring->right, data[TCCR2A] & COM_B, data[OCR2B], 255);
    out->pan = bridge(wiring->pan, data[TCCR0A] & COM_B, data[OCR0B], data[OCR0A] ? data[OCR0A] : 1);
    out->steering = 0;
    if ((data[TCCR1A] & COM_A) && (data[wiring->servo.port - 1] >> wiring->servo.bit & 1)) {
        out->steering = (int16_t)((counts - 3000) * 9 / 2);
    }
}

/* ---- time */

static void do_not_sleep(avr_t *chip, avr_cycle_count_t how_long)
{
    (void)chip;
    (void)how_long; /* the computer need not wait for the chip */
}

static avr_cycle_count_t wake_up(avr_t *chip, avr_cycle_count_t when, void *param)
{
    (void)chip;
    (void)when;
    (void)param;
    return 0;
}

static void count_reset(avr_t *chip)
{
    starts++;
    held_back = 0u;
    if (reset_of_chip != NULL) {
        reset_of_chip(chip);
    }
    /* simavr forgets all timers. */
    avr_cycle_timer_register(chip, cycles_per_byte, next_byte, NULL);
}

static void run_until(avr_cycle_count_t end)
{
    if (avr->cycle < end) {
        avr_cycle_timer_register(avr, end - avr->cycle, wake_up, NULL);
    }
    while (avr->cycle < end) {
        int state = avr_run(avr);

        if (state == cpu_Done || state == cpu_Crashed) {
            line_fail("the chip has crashed");
        }
    }
}

/* The main loop does nothing any more, while interrupts go on. */
static void hang(void)
{
    uint32_t at;

    for (at = 0; at + 1u < avr->codeend; at += 2u) {
        if ((avr->flash[at] | avr->flash[at + 1u] << 8) == (int)ENDLESS_LOOP) {
            avr->pc = at;
            avr->state = cpu_Running;
            avr->sreg[S_I] = 1;
            return;
        }
    }
    line_fail("there is no endless loop in the program to hang in");
}

static void power_cycle(void)
{
    avr_reset(avr);
    line_drop();
}

/* simavr writes to standard output, which is taken. */
static void say(avr_t *chip, const int important, const char *format, va_list values)
{
    (void)chip;
    if (important <= LOG_ERROR) {
        (void)vfprintf(stderr, format, values);
    }
}

static void start(const char *chip, const char *program)
{
    elf_firmware_t firmware;
    uint32_t flags = 0;
    size_t i;

    for (i = 0; i < sizeof WIRINGS / sizeof WIRINGS[0]; i++) {
        if (strcmp(WIRINGS[i].chip, chip) == 0) {
            wiring = &WIRINGS[i];
        }
    }
    avr_global_logger_set(say);
    memset(&firmware, 0, sizeof firmware);
    if (wiring == NULL || elf_read_firmware(program, &firmware) != 0) {
        line_fail("no such chip or program");
    }
    avr = avr_make_mcu_by_name(chip);
    if (avr == NULL || avr_init(avr) != 0) {
        line_fail("simavr does not know the chip");
    }
    firmware.frequency = HZ;
    avr_load_firmware(avr, &firmware);
    avr->log = LOG_ERROR;
    avr->vcc = avr->avcc = avr->aref = SUPPLY_MV;
    avr->sleep = do_not_sleep;
    reset_of_chip = avr->reset;
    avr->reset = count_reset;
    starts = 1u;
    (void)avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    (void)avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT),
                            from_chip, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON),
                            hold_back, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF),
                            hold_back, &held_back);
    avr_cycle_timer_register(avr, cycles_per_byte, next_byte, NULL);
}

int main(int count, char **words)
{
    static const struct inputs AT_REST = {512u, {1500u, 1500u, 1500u}, 12000u, {0, 0}, 0u};
    struct step step;
    struct outputs outputs;

    if (count != 5) {
        fputs("usage: polepilot-board LINK CHIP PROGRAM.elf BAUD\n", stderr);
        return 2;
    }
    cycles_per_byte = 10u * HZ / (uint64_t)atol(words[4]);
    start(words[2], words[3]);
    pty_open(words[1]);
    (void)atexit(pty_close);
    set_pins(&AT_REST);
    memset(&outputs, 0, sizeof outputs);
    for (;;) {
        steps_read(&step);
        if (step.kind == END) {
            return 0;
        }
        if (step.kind == HANG) {
            hang();
        } else if (step.kind == POWER) {
            power_cycle();
        } else {
            line_take(step.bytes);
            set_pins(&step.inputs);
            run_until(step.t_us * CYCLES_PER_US);
        }
        read_pins(&outputs);
        steps_answer(line_flush(), &outputs, starts);
    }
}
