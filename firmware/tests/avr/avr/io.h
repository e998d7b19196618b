/* Stands for avr-libc's headers of these names, so that analyzers see hal/avr and not avr-libc's
 * macros for registers. */
#ifndef AVR_STAND_IN_H
#define AVR_STAND_IN_H

#include <stdint.h>

#define ISR(vector)                                                                                \
    void vector(void);                                                                             \
    void vector(void)
#define ATOMIC_BLOCK(how)

void sei(void);
void sleep_mode(void);
void wdt_reset(void);
void wdt_disable(void);
void wdt_enable(uint8_t how_long);

extern volatile uint8_t PORTA, PORTB, PORTC, PORTD, PORTG, PORTH;
extern volatile uint8_t DDRA, DDRB, DDRC, DDRD, DDRG, DDRH;
extern volatile uint8_t PINA, PINB, PINC, PIND, PING, PINH;
extern volatile uint8_t MCUSR, SMCR, EICRA;
extern volatile uint8_t TCCR0A, TCCR0B, OCR0A, OCR0B, TIMSK0;
extern volatile uint8_t TCCR1A, TCCR1B, TCCR2A, TCCR2B, OCR2A, OCR2B;
extern volatile uint16_t OCR1A, ICR1, UBRR0, ADC;
extern volatile uint8_t UCSR0A, UCSR0B, UCSR0C, UDR0, ADMUX, ADCSRA;

#define PORF 0u
#define BORF 2u
#define WDRF 3u
#define ISC01 1u
#define ISC11 3u
#define WGM00 0u
#define WGM01 1u
#define WGM02 3u
#define CS00 0u
#define CS01 1u
#define TOIE0 0u
#define COM0B1 5u
#define WGM11 1u
#define WGM12 3u
#define WGM13 4u
#define CS11 1u
#define COM1A1 7u
#define WGM20 0u
#define CS21 1u
#define COM2A1 7u
#define COM2B1 5u
#define U2X0 1u
#define DOR0 3u
#define UCSZ00 1u
#define UCSZ01 2u
#define TXEN0 3u
#define RXEN0 4u
#define UDRIE0 5u
#define RXCIE0 7u
#define REFS0 6u
#define ADPS0 0u
#define ADPS1 1u
#define ADPS2 2u
#define ADSC 6u
#define ADEN 7u
#define WDTO_120MS 3u

#endif
