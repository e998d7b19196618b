/* ATmega328P (Arduino Uno, Nano) and ATmega2560 (Arduino Mega), 16 MHz. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#include "core/board.h"
#include "core/hal.h"
#include "core/protocol.h"
#include "core/sensors.h"
#include "core/settings.h"
#include "hal/avr/pins.h"

#define RING 128u /* bytes, a power of two */
#define RING_MASK (RING - 1u)
#define BAUD_DIVISOR (((F_CPU + (BAUD * 4UL)) / (BAUD * 8UL)) - 1UL)

#define TICK_TOP 249u       /* of timer 0 at 250 kHz: 1 kHz */
#define SERVO_PERIOD 39999u /* of timer 1 at 2 MHz: 20 ms */
#define SERVO_CENTER 3000   /* 1.5 ms */
#define SERVO_COUNTS 2      /* per SERVO_ANGLE centidegrees: 1 ms in 90 degrees */
#define SERVO_ANGLE 9
#ifndef SERVO_DIRECTION
#define SERVO_DIRECTION 1 /* -1: longer pulses turn right */
#endif
#define STOP_SAMPLES 3u /* milliseconds until the button counts: longer than a spark of the motors */

SETTINGS_STORAGE struct settings settings =
    SETTINGS_FOR(BOARD_NUMBER, FEATURE_PROXIMITY | FEATURE_BATTERY | FEATURE_PAN);

static volatile uint32_t ticks;
static volatile uint8_t stop_seen; /* milliseconds for which the button was pressed */

static volatile uint8_t received[RING];
static volatile uint8_t received_in;
static volatile uint8_t received_out;
static volatile uint8_t overflowed;
static volatile uint8_t unsent[RING];
static volatile uint8_t unsent_in;
static volatile uint8_t unsent_out;

static uint16_t measured[ADC_COUNT];
static uint8_t channel;

/* Why the chip has started, saved before the C library clears memory. */
static uint8_t reset_reason __attribute__((section(".noinit")));

void save_reset_reason(void) __attribute__((naked, used, section(".init3")));
void save_reset_reason(void)
{
    reset_reason = MCUSR;
    MCUSR = 0u;
    wdt_disable(); /* after a watchdog reset it runs on at its shortest */
}

/* ---- interrupts */

ISR(TIMER0_OVF_vect)
{
    ticks++;
    /* A closed contact to ground is good. Pressed, or with a broken wire, the pin is high. */
    if ((PIN_INPUT(STOP) & PIN_MASK(STOP)) == 0u) {
        stop_seen = 0u;
    } else if (stop_seen < STOP_SAMPLES) {
        stop_seen++;
    } else {
        /* It stays pressed. */
    }
}

#if defined(USART_RX_vect)
ISR(USART_RX_vect)
#else
ISR(USART0_RX_vect)
#endif
{
    uint8_t status = UCSR0A;
    uint8_t byte = UDR0;
    uint8_t next = (uint8_t)((received_in + 1u) & RING_MASK);

    if (((status & (1u << DOR0)) != 0u) || (next == received_out)) {
        overflowed = 1u;
    }
    if (next != received_out) {
        received[received_in] = byte;
        received_in = next;
    }
}

#if defined(USART_UDRE_vect)
ISR(USART_UDRE_vect)
#else
ISR(USART0_UDRE_vect)
#endif
{
    if (unsent_out == unsent_in) {
        UCSR0B = (uint8_t)(UCSR0B & ~(1u << UDRIE0));
        return;
    }
    UDR0 = unsent[unsent_out];
    unsent_out = (uint8_t)((unsent_out + 1u) & RING_MASK);
}

/* ---- what the core asks for */

uint32_t hal_millis(void)
{
    uint32_t now;

    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        now = ticks;
    }
    return now;
}

uint8_t hal_receive(uint8_t *byte)
{
    uint8_t out = received_out;

    if (out == received_in) {
        return 0u;
    }
    *byte = received[out];
    received_out = (uint8_t)((out + 1u) & RING_MASK);
    return 1u;
}

uint8_t hal_overflowed(void)
{
    if (overflowed == 0u) {
        return 0u;
    }
    overflowed = 0u;
    return 1u;
}

uint8_t hal_room(void)
{
    return (uint8_t)(((uint8_t)(unsent_out - unsent_in) - 1u) & RING_MASK);
}

void hal_send(uint8_t byte)
{
    unsent[unsent_in] = byte;
    unsent_in = (uint8_t)((unsent_in + 1u) & RING_MASK);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        UCSR0B = (uint8_t)(UCSR0B | (1u << UDRIE0));
    }
}

static void convert(uint8_t next)
{
    channel = next;
    ADMUX = (uint8_t)((1u << REFS0) | next);
    ADCSRA = (uint8_t)((1u << ADEN) | (1u << ADSC) | (1u << ADPS2) | (1u << ADPS1) | (1u << ADPS0));
}

/* One channel after the other, each in its own pass of the main loop. */
uint8_t hal_read_inputs(struct inputs *inputs)
{
    uint8_t i;

    inputs->stop_button = (uint8_t)(stop_seen >= STOP_SAMPLES);
    if ((ADCSRA & (1u << ADSC)) != 0u) {
        return 0u;
    }
    measured[channel] = ADC;
    if ((channel + 1u) < ADC_COUNT) {
        convert((uint8_t)(channel + 1u));
        return 0u;
    }
    convert(0u);
    inputs->pan_adc = measured[ADC_PAN];
    for (i = 0u; i < 3u; i++) {
        inputs->proximity_mm[i] = sensors_proximity_mm(measured[ADC_PROXIMITY + i]);
    }
    inputs->battery_mv = sensors_battery_mv(measured[ADC_BATTERY]);
    return 1u;
}

#define HIGH(...) (PIN_PORT(__VA_ARGS__) = (uint8_t)(PIN_PORT(__VA_ARGS__) | PIN_MASK(__VA_ARGS__)))
#define LOW(...) (PIN_PORT(__VA_ARGS__) = (uint8_t)(PIN_PORT(__VA_ARGS__) & (uint8_t)~PIN_MASK(__VA_ARGS__)))
#define OUTPUT(...) (PIN_DDR(__VA_ARGS__) = (uint8_t)(PIN_DDR(__VA_ARGS__) | PIN_MASK(__VA_ARGS__)))

/* An L298 bridge: its enable input gets the duty, the other two the direction. At zero both
 * direction pins are low and the bridge is on: the motor is shorted and brakes. */
#define BRIDGE(duty, live, one_way, other_way, enable, compare, control, connect, full)            \
    do {                                                                                           \
        if ((duty) > 0) {                                                                          \
            LOW(other_way);                                                                        \
            HIGH(one_way);                                                                         \
        } else if ((duty) < 0) {                                                                   \
            LOW(one_way);                                                                          \
            HIGH(other_way);                                                                       \
        } else {                                                                                   \
            LOW(one_way);                                                                          \
            LOW(other_way);                                                                        \
        }                                                                                          \
        if ((duty) != 0) {                                                                         \
            (compare) = share((duty), (full));                                                     \
            (control) = (uint8_t)((control) | (1u << (connect)));                                  \
        } else {                                                                                   \
            (control) = (uint8_t)((control) & (uint8_t)~(1u << (connect)));                        \
            if ((live) != 0u) {                                                                            \
                HIGH(enable);                                                                      \
            } else {                                                                               \
                LOW(enable);                                                                       \
            }                                                                                      \
        }                                                                                          \
    } while (0)

/* `duty` per mille of `full`, without its sign. */
static uint8_t share(int16_t duty, uint8_t full)
{
    uint16_t size = (uint16_t)((duty < 0) ? -duty : duty);

    return (uint8_t)(((uint32_t)size * full) / (uint16_t)MAX_DUTY);
}

void hal_write_outputs(const struct outputs *outputs)
{
    int16_t pulse =
        (int16_t)(SERVO_CENTER + (SERVO_DIRECTION * (int16_t)(((int32_t)outputs->steering * SERVO_COUNTS) /
                                                              SERVO_ANGLE)));

    BRIDGE(outputs->left, outputs->live, LEFT_FORWARD, LEFT_BACKWARD, LEFT_PWM, OCR2A, TCCR2A,
           COM2A1, 255u);
    BRIDGE(outputs->right, outputs->live, RIGHT_FORWARD, RIGHT_BACKWARD, RIGHT_PWM, OCR2B, TCCR2A,
           COM2B1, 255u);
    BRIDGE(outputs->pan, outputs->live, PAN_LEFT, PAN_RIGHT, PAN_PWM, OCR0B, TCCR0A, COM0B1,
           TICK_TOP);
    OCR1A = (uint16_t)pulse;
    if (outputs->live != 0u) {
        TCCR1A = (1u << COM1A1) | (1u << WGM11);
        HIGH(LAMP);
    } else {
        TCCR1A = 1u << WGM11; /* no pulses: the servo is slack */
        LOW(SERVO);
        LOW(LAMP);
    }
}

void hal_feed_watchdog(void)
{
    wdt_reset();
}

/* ---- start */

static void start_pins(void)
{
    /* The external interrupts stay off. Waiting for edges they do not watch the wheel's PWM pin, which
     * is one of theirs, for being low. */
    EICRA = (1u << ISC11) | (1u << ISC01);
    HIGH(STOP); /* pull-up */
    OUTPUT(LEFT_PWM);
    OUTPUT(LEFT_FORWARD);
    OUTPUT(LEFT_BACKWARD);
    OUTPUT(RIGHT_PWM);
    OUTPUT(RIGHT_FORWARD);
    OUTPUT(RIGHT_BACKWARD);
    OUTPUT(PAN_PWM);
    OUTPUT(PAN_LEFT);
    OUTPUT(PAN_RIGHT);
    OUTPUT(SERVO);
    OUTPUT(LAMP);
}

static void start_timers(void)
{
    OCR0A = TICK_TOP;
    TCCR0A = (1u << WGM01) | (1u << WGM00);              /* fast PWM up to OCR0A */
    TCCR0B = (1u << WGM02) | (1u << CS01) | (1u << CS00); /* 250 kHz */
    TIMSK0 = 1u << TOIE0;
    ICR1 = SERVO_PERIOD;
    OCR1A = SERVO_CENTER;
    TCCR1A = 1u << WGM11; /* fast PWM up to ICR1 */
    TCCR1B = (1u << WGM13) | (1u << WGM12) | (1u << CS11); /* 2 MHz */
    TCCR2A = 1u << WGM20; /* phase correct */
    TCCR2B = 1u << CS21;  /* 2 MHz: 3.9 kHz of PWM */
}

static void start_line(void)
{
    uint32_t divisor = BAUD_DIVISOR;

    UBRR0 = (uint16_t)divisor;
    UCSR0A = 1u << U2X0;
    UCSR0C = (1u << UCSZ01) | (1u << UCSZ00);
    UCSR0B = (1u << RXCIE0) | (1u << RXEN0) | (1u << TXEN0);
}

static uint8_t reset_faults(void)
{
    uint8_t faults = 0u;

    if ((reset_reason & (1u << WDRF)) != 0u) {
        faults |= FAULT_WATCHDOG_RESET;
    }
    /* Power-up from nothing passes through brown-out as well. */
    if (((reset_reason & (1u << BORF)) != 0u) && ((reset_reason & (1u << PORF)) == 0u)) {
        faults |= FAULT_BROWN_OUT_RESET;
    }
    return faults;
}

int main(void)
{
    wdt_enable(WDTO_120MS);
    start_pins();
    start_timers();
    start_line();
    convert(0u);
    board_init(reset_faults());
    SMCR = 0u; /* idle: timers and line go on */
    sei();
    for (;;) {
        board_pass();
        /* Until the next millisecond or byte. A byte that comes just before is seen 1 ms late. */
        sleep_mode();
    }
}
