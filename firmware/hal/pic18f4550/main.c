/* PIC18F4550 at 48 MHz: the paper's microcontroller. README.md has its pins as a table.
 *
 * Low interrupts: the millisecond, the line, the pan motor. The high one has nothing but the servo's
 * two edges, which nothing may delay. Ports are changed by single bits, each in one instruction, so that
 * no write undoes another. */
#include "hal/pic18f4550/registers.h"

#include "core/board.h"
#include "core/hal.h"
#include "core/protocol.h"
#include "core/sensors.h"
#include "core/settings.h"

#define INSTRUCTIONS 12000000UL /* per second */
#ifndef BAUD
#define BAUD 115200UL
#endif
#define BAUD_DIVISOR (((INSTRUCTIONS + (BAUD / 2UL)) / BAUD) - 1UL)

#define RING 128u /* bytes, a power of two */
#define RING_MASK (RING - 1u)

/* Port B */
#define STOP 0x01u
#define PAN_ENABLE 0x08u
/* Port C; the enable inputs of the wheels' bridges are CCP1 (RC2) and CCP2 (RC1) */
#define SERVO 0x01u
#define RIGHT_ENABLE 0x02u
#define LEFT_ENABLE 0x04u
/* Port D */
#define LEFT_FORWARD 0x01u
#define LEFT_BACKWARD 0x02u
#define RIGHT_FORWARD 0x04u
#define RIGHT_BACKWARD 0x08u
#define PAN_LEFT 0x10u
#define PAN_RIGHT 0x20u
#define LAMP 0x80u

/* PIR1, PIE1, IPR1 */
#define OF_TIMER1 0x01u
#define OF_TIMER2 0x02u
#define OF_TRANSMIT 0x10u
#define OF_RECEIVE 0x20u
/* PIR2, PIE2, IPR2 */
#define OF_TIMER3 0x02u

#define TRANSMIT 0x40u /* RC6: the line */
#define OERR 0x02u     /* RCSTA: bytes were lost */
#define CREN 0x10u     /* RCSTA: receive */
#define GO 0x02u       /* ADCON0: converting */
#define PWM_ON 0x0Cu   /* CCPxCON */
#define RUNNING 0x01u  /* T3CON */

#define TIMER3_PER_MS 1500u
#define PAN_LEAST 60u /* counts: what is shorter cannot be cut by an interrupt */

#define SERVO_PERIOD 60000u /* of timer 1 at 3 MHz: 20 ms */
#define SERVO_CENTER 4500u  /* 1.5 ms */
#define SERVO_ANGLE 3       /* centidegrees for each count: 1 ms in 90 degrees */
#define SERVO_LOADING 12u   /* counts from the pin's edge until the timer runs */
#define SERVO_STRAIGHT (SERVO_CENTER - SERVO_LOADING)
#ifndef SERVO_DIRECTION
#define SERVO_DIRECTION 1 /* -1: longer pulses turn right */
#endif
#define STOP_SAMPLES 3u /* milliseconds until the button counts: longer than a spark of the motors */

#define ADC_PAN 0u
#define ADC_PROXIMITY 1u /* and the two after it: left, centre, right */
#define ADC_BATTERY 4u
#define ADC_COUNT 5u

SETTINGS_STORAGE struct settings settings =
    SETTINGS_FOR(BOARD_PIC18F4550, FEATURE_PROXIMITY | FEATURE_BATTERY | FEATURE_PAN);

static volatile uint32_t ticks;
static volatile uint8_t stop_seen; /* milliseconds for which the button was pressed */

static volatile uint8_t received[RING];
static volatile uint8_t received_in;
static volatile uint8_t received_out;
static volatile uint8_t overflowed;
static volatile uint8_t unsent[RING];
static volatile uint8_t unsent_in;
static volatile uint8_t unsent_out;

static volatile uint16_t pan_width; /* of each millisecond, in counts of timer 3 */
static volatile uint16_t servo_width;
static volatile uint8_t servo_on;
static uint8_t servo_high;
static int16_t servo_angle; /* of servo_width */

static uint16_t measured[ADC_COUNT];
static uint8_t channel;

/* ---- interrupts */

HIGH_INTERRUPT(on_servo);
LOW_INTERRUPT(on_rest);

HIGH_INTERRUPT(on_servo)
{
    uint16_t rest;

    PIR1 &= (uint8_t)~OF_TIMER1;
    if (servo_high != 0u) {
        LATC &= (uint8_t)~SERVO;
        servo_high = 0u;
        rest = (uint16_t)(servo_width - SERVO_PERIOD);
    } else {
        if (servo_on != 0u) {
            LATC |= SERVO;
        }
        servo_high = 1u;
        rest = (uint16_t)(0u - servo_width);
    }
    TMR1H = (uint8_t)(rest >> 8);
    TMR1L = (uint8_t)rest;
}

static void on_millisecond(void)
{
    uint16_t rest;

    ticks++;
    /* A closed contact to ground is good. Pressed, or with a broken wire, the pin is high. */
    if ((PORTB & STOP) == 0u) {
        stop_seen = 0u;
    } else if (stop_seen < STOP_SAMPLES) {
        stop_seen++;
    } else {
        /* It stays pressed. */
    }
    /* The pan motor's pulse begins with the millisecond, timer 3 ends it. */
    if (pan_width == 0u) {
        LATB &= (uint8_t)~PAN_ENABLE;
    } else {
        LATB |= PAN_ENABLE;
        if (pan_width < TIMER3_PER_MS) {
            rest = (uint16_t)(0u - pan_width);
            TMR3H = (uint8_t)(rest >> 8);
            TMR3L = (uint8_t)rest;
            T3CON |= RUNNING;
        }
    }
}

static void on_byte(void)
{
    uint8_t byte = RCREG;
    uint8_t next = (uint8_t)((received_in + 1u) & RING_MASK);

    if ((RCSTA & OERR) != 0u) {
        overflowed = 1u;
        RCSTA &= (uint8_t)~CREN;
        RCSTA |= CREN;
    }
    if (next == received_out) {
        overflowed = 1u;
    } else {
        received[received_in] = byte;
        received_in = next;
    }
}

static void on_line_free(void)
{
    if (unsent_out == unsent_in) {
        PIE1 &= (uint8_t)~OF_TRANSMIT;
    } else {
        TXREG = unsent[unsent_out];
        unsent_out = (uint8_t)((unsent_out + 1u) & RING_MASK);
    }
}

LOW_INTERRUPT(on_rest)
{
    if ((PIR1 & OF_RECEIVE) != 0u) {
        on_byte();
    }
    if ((PIR2 & OF_TIMER3) != 0u) {
        PIR2 &= (uint8_t)~OF_TIMER3;
        T3CON &= (uint8_t)~RUNNING;
        LATB &= (uint8_t)~PAN_ENABLE;
    }
    /* Not while the main loop writes a width of two bytes. */
    if (((PIR1 & OF_TIMER2) != 0u) && ((PIE1 & OF_TIMER2) != 0u)) {
        PIR1 &= (uint8_t)~OF_TIMER2;
        on_millisecond();
    }
    if (((PIR1 & OF_TRANSMIT) != 0u) && ((PIE1 & OF_TRANSMIT) != 0u)) {
        on_line_free();
    }
}

/* ---- what the core asks for */

uint32_t hal_millis(void)
{
    uint32_t now;

    do {
        now = ticks;
    } while (now != ticks); /* it may change between its bytes */
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
    PIE1 |= OF_TRANSMIT;
}

static void convert(uint8_t next)
{
    channel = next;
    ADCON0 = (uint8_t)((uint8_t)(next << 2) | 0x01u);
    ADCON0 |= GO; /* acquires first, by itself */
}

/* One channel after the other, each in its own pass of the main loop. */
uint8_t hal_read_inputs(struct inputs *inputs)
{
    uint8_t i;

    inputs->stop_button = (uint8_t)(stop_seen >= STOP_SAMPLES);
    if ((ADCON0 & GO) != 0u) {
        return 0u;
    }
    measured[channel] = (uint16_t)(((uint16_t)ADRESH << 8) | ADRESL);
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

/* The direction pins of an L298 bridge: at zero both are low, and the motor is shorted and brakes
 * while the bridge is enabled. */
#define DIRECTION(duty, one_way, other_way)                                                        \
    do {                                                                                           \
        if ((duty) > 0) {                                                                          \
            LATD &= (uint8_t)~(other_way);                                                         \
            LATD |= (one_way);                                                                     \
        } else if ((duty) < 0) {                                                                   \
            LATD &= (uint8_t)~(one_way);                                                           \
            LATD |= (other_way);                                                                   \
        } else {                                                                                   \
            LATD &= (uint8_t)~(one_way);                                                           \
            LATD &= (uint8_t)~(other_way);                                                         \
        }                                                                                          \
    } while (0)

/* How long the bridge is enabled, per mille. */
static uint16_t share(int16_t duty, uint8_t live)
{
    if (duty == 0) {
        return (live != 0u) ? (uint16_t)MAX_DUTY : 0u;
    }
    return (uint16_t)((duty < 0) ? -duty : duty);
}

static void enable_pan(uint16_t size)
{
    uint16_t width = (uint16_t)(size + (size / 2u));

    if ((width > 0u) && (width < PAN_LEAST)) {
        width = PAN_LEAST;
    } else if (width > (TIMER3_PER_MS - PAN_LEAST)) {
        width = TIMER3_PER_MS;
    } else {
        /* as it is */
    }
    PIE1 &= (uint8_t)~OF_TIMER2;
    pan_width = width;
    PIE1 |= OF_TIMER2;
}

static void turn_servo(int16_t angle)
{
    int16_t off;
    uint16_t width;

    if (angle == servo_angle) {
        return;
    }
    servo_angle = angle;
    off = SERVO_DIRECTION * (angle / SERVO_ANGLE);
    width = (uint16_t)(SERVO_STRAIGHT + (uint16_t)off);
    PIE1 &= (uint8_t)~OF_TIMER1;
    servo_width = width;
    PIE1 |= OF_TIMER1;
}

void hal_write_outputs(const struct outputs *outputs)
{
    uint16_t size;

    DIRECTION(outputs->left, LEFT_FORWARD, LEFT_BACKWARD);
    DIRECTION(outputs->right, RIGHT_FORWARD, RIGHT_BACKWARD);
    DIRECTION(outputs->pan, PAN_LEFT, PAN_RIGHT);
    /* Timer 2 counts 250 times four quarters: a duty of 1000 is always on. */
    size = share(outputs->left, outputs->live);
    CCPR1L = (uint8_t)(size >> 2);
    CCP1CON = (uint8_t)(PWM_ON | (uint8_t)((size & 3u) << 4));
    size = share(outputs->right, outputs->live);
    CCPR2L = (uint8_t)(size >> 2);
    CCP2CON = (uint8_t)(PWM_ON | (uint8_t)((size & 3u) << 4));
    enable_pan(share(outputs->pan, outputs->live));
    turn_servo(outputs->steering);
    servo_on = outputs->live;
    if (outputs->live != 0u) {
        LATD |= LAMP;
    } else {
        LATD &= (uint8_t)~LAMP;
        LATC &= (uint8_t)~SERVO; /* no pulses: the servo is slack */
    }
}

void hal_feed_watchdog(void)
{
    CLEAR_WATCHDOG();
}

/* ---- start */

/* Why the chip has started. A healthy one never fills or empties its stack of calls: that ends in a
 * reset as well, and means the same as a loop that hangs. */
static uint8_t reset_faults(void)
{
    uint8_t faults = 0u;

    if ((RCON & 0x02u) == 0u) {
        /* Power-up from nothing; the other bits mean nothing yet. */
    } else if ((RCON & 0x01u) == 0u) {
        faults = FAULT_BROWN_OUT_RESET;
    } else if (((RCON & 0x08u) == 0u) || ((RCON & 0x10u) == 0u) || ((STKPTR & 0xC0u) != 0u)) {
        /* The watchdog, a reset that the program has called, or its stack. */
        faults = FAULT_WATCHDOG_RESET;
    } else {
        /* the reset pin */
    }
    STKPTR &= (uint8_t)~0xC0u;
    RCON = 0x93u; /* interrupts of two priorities; the reasons are forgotten */
    return faults;
}

static void start_pins(void)
{
    LATB = 0u;
    LATC = TRANSMIT; /* the line rests high */
    LATD = 0u;
    ADCON1 = 0x0Au; /* AN0 to AN4 are analog, against the supply */
    CMCON = 0x07u;  /* no comparators */
    TRISB = (uint8_t)~PAN_ENABLE;
    TRISC = (uint8_t)~(SERVO | LEFT_ENABLE | RIGHT_ENABLE | TRANSMIT);
    TRISD = 0x40u;
    INTCON2 &= (uint8_t)~0x80u; /* pull-ups on port B, for the stop button */
}

static void start_timers(void)
{
    PR2 = 249u;
    CCPR1L = 0u;
    CCPR2L = 0u;
    T2CON = 0x16u; /* by 16: 3 kHz of PWM; an interrupt after three of them, each millisecond */
    T3CON = 0xB0u; /* 16 bits at once, by 8: 1.5 MHz; starts with a pulse */
    servo_width = SERVO_STRAIGHT;
    T1CON = 0xA1u; /* 16 bits at once, by 4: 3 MHz */
    IPR1 = OF_TIMER1;
    IPR2 = 0u;
    PIE1 = OF_TIMER1 | OF_TIMER2 | OF_RECEIVE;
    PIE2 = OF_TIMER3;
}

static void start_line(void)
{
    BAUDCON = 0x08u; /* a divisor of 16 bits */
    SPBRGH = (uint8_t)(BAUD_DIVISOR / 256UL);
    SPBRG = (uint8_t)BAUD_DIVISOR;
    TXSTA = 0x24u;
    RCSTA = 0x90u;
}

int main(void)
{
    uint8_t faults = reset_faults();

    start_pins();
    start_timers();
    start_line();
    ADCON2 = 0xAEu; /* right-justified; 12 clocks to acquire; clocks of 1.3 microseconds */
    convert(0u);
    board_init(faults);
    INTCON = 0xC0u;
    for (;;) {
        board_pass();
    }
}
