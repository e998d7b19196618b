/* Stands for XC8's header of this name, so that compilers and analyzers of this computer read
 * hal/pic18f4550 the way XC8 does: its registers, its word for interrupts, its CLRWDT. */
#ifndef XC8_STAND_IN_H
#define XC8_STAND_IN_H

#include <stdint.h>

#define __interrupt(priority)
#define CLRWDT() ((void)0)

extern volatile uint8_t PORTB, LATB, LATC, LATD, TRISB, TRISC, TRISD;
extern volatile uint8_t PIE1, PIR1, IPR1, PIE2, PIR2, IPR2;
extern volatile uint8_t RCSTA, TXSTA, TXREG, RCREG, SPBRG, SPBRGH, BAUDCON;
extern volatile uint8_t T1CON, TMR1L, TMR1H, T2CON, PR2, T3CON, TMR3L, TMR3H;
extern volatile uint8_t CCP1CON, CCPR1L, CCP2CON, CCPR2L, CMCON;
extern volatile uint8_t ADCON0, ADCON1, ADCON2, ADRESL, ADRESH;
extern volatile uint8_t RCON, INTCON, INTCON2, STKPTR;

#endif
