/* Where everything is wired. README.md has the same as a table with the boards' own names. */
#ifndef POLEPILOT_AVR_PINS_H
#define POLEPILOT_AVR_PINS_H

#include <avr/io.h>

/* A pin is its port's letter and its bit: PIN_DDR(SERVO) is DDRB for SERVO = B, 1. */
#define JOIN2(a, b) a##b
#define JOIN(a, b) JOIN2(a, b)
#define PORT_OF(port, bit) JOIN(PORT, port)
#define DDR_OF(port, bit) JOIN(DDR, port)
#define INPUT_OF(port, bit) JOIN(PIN, port)
#define MASK_OF(port, bit) ((uint8_t)(1u << (bit)))
#define PIN_PORT(...) PORT_OF(__VA_ARGS__)
#define PIN_DDR(...) DDR_OF(__VA_ARGS__)
#define PIN_INPUT(...) INPUT_OF(__VA_ARGS__)
#define PIN_MASK(...) MASK_OF(__VA_ARGS__)

/* Timer 0: the millisecond, and OC0B for the pan motor. Timer 1: OC1A for the servo. Timer 2: OC2A
 * for the left wheel, OC2B for the right one. */
#if defined(__AVR_ATmega328P__)
#define BOARD_NUMBER BOARD_ATMEGA328P
#define LEFT_PWM B, 3
#define LEFT_FORWARD D, 4
#define LEFT_BACKWARD D, 7
#define RIGHT_PWM D, 3
#define RIGHT_FORWARD B, 0
#define RIGHT_BACKWARD B, 2
#define PAN_PWM D, 5
#define PAN_LEFT D, 6
#define PAN_RIGHT B, 4
#define SERVO B, 1
#define STOP C, 5
#define LAMP B, 5
#elif defined(__AVR_ATmega2560__)
#define BOARD_NUMBER BOARD_ATMEGA2560
#define LEFT_PWM B, 4
#define LEFT_FORWARD A, 0
#define LEFT_BACKWARD A, 1
#define RIGHT_PWM H, 6
#define RIGHT_FORWARD A, 2
#define RIGHT_BACKWARD A, 3
#define PAN_PWM G, 5
#define PAN_LEFT A, 4
#define PAN_RIGHT A, 5
#define SERVO B, 5
#define STOP A, 6
#define LAMP B, 7
#else
#error "no pins are assigned for this microcontroller"
#endif

/* Analog inputs, 10 bits of 5 V. */
#define ADC_PAN 0u
#define ADC_PROXIMITY 1u /* and the two after it: left, centre, right */
#define ADC_BATTERY 4u
#define ADC_COUNT 5u

#endif
