/* The chip, as each compiler names it: registers, interrupts, configuration. Nothing below this line
 * knows which compiler it is.
 *
 * XC8 brings the registers itself. SDCC's own headers for them are not free and so not in Debian:
 * these are the data sheet's addresses (DS39632E, table 5-1), in its order. The names are Microchip's. */
#ifndef POLEPILOT_PIC18F4550_REGISTERS_H
#define POLEPILOT_PIC18F4550_REGISTERS_H

#if !defined(__SDCC)
#include <xc.h>
#endif

#if defined(__SDCC)

#define REGISTER(address, name) __sfr __at(address) name
#define HIGH_INTERRUPT(name) void name(void) __interrupt(1)
#define LOW_INTERRUPT(name) void name(void) __interrupt(2)
#define CLEAR_WATCHDOG() __asm__("clrwdt")

REGISTER(0xF81, PORTB);
REGISTER(0xF8A, LATB);
REGISTER(0xF8B, LATC);
REGISTER(0xF8C, LATD);
REGISTER(0xF93, TRISB);
REGISTER(0xF94, TRISC);
REGISTER(0xF95, TRISD);
REGISTER(0xF9D, PIE1);
REGISTER(0xF9E, PIR1);
REGISTER(0xF9F, IPR1);
REGISTER(0xFA0, PIE2);
REGISTER(0xFA1, PIR2);
REGISTER(0xFA2, IPR2);
REGISTER(0xFAB, RCSTA);
REGISTER(0xFAC, TXSTA);
REGISTER(0xFAD, TXREG);
REGISTER(0xFAE, RCREG);
REGISTER(0xFAF, SPBRG);
REGISTER(0xFB0, SPBRGH);
REGISTER(0xFB1, T3CON);
REGISTER(0xFB2, TMR3L);
REGISTER(0xFB3, TMR3H);
REGISTER(0xFB4, CMCON);
REGISTER(0xFB8, BAUDCON);
REGISTER(0xFBA, CCP2CON);
REGISTER(0xFBB, CCPR2L);
REGISTER(0xFBD, CCP1CON);
REGISTER(0xFBE, CCPR1L);
REGISTER(0xFC0, ADCON2);
REGISTER(0xFC1, ADCON1);
REGISTER(0xFC2, ADCON0);
REGISTER(0xFC3, ADRESL);
REGISTER(0xFC4, ADRESH);
REGISTER(0xFCA, T2CON);
REGISTER(0xFCB, PR2);
REGISTER(0xFCD, T1CON);
REGISTER(0xFCE, TMR1L);
REGISTER(0xFCF, TMR1H);
REGISTER(0xFD0, RCON);
REGISTER(0xFF1, INTCON2);
REGISTER(0xFF2, INTCON);
REGISTER(0xFFC, STKPTR);

#else

#define HIGH_INTERRUPT(name) void __interrupt(high_priority) name(void)
#define LOW_INTERRUPT(name) void __interrupt(low_priority) name(void)
#define CLEAR_WATCHDOG() CLRWDT()

#endif

/* ---- configuration: both compilers read these */

/* A crystal of 20 MHz; 96 MHz of its PLL by two are 48 MHz, 12 million instructions a second. */
#pragma config PLLDIV = 5
#pragma config CPUDIV = OSC1_PLL2
#pragma config USBDIV = 2
#pragma config FOSC = HSPLL_HS
#pragma config FCMEN = OFF
#pragma config IESO = OFF
/* Below 4.33 V the chip may not run at 48 MHz: it stays in reset, and its pins float. */
#pragma config PWRT = ON
#pragma config BOR = ON
#pragma config BORV = 1
#pragma config VREGEN = OFF
/* Never off: 32 times 4 ms, 109 to 151 ms with the tolerance of its oscillator. */
#pragma config WDT = ON
#pragma config WDTPS = 32
#pragma config MCLRE = ON
#pragma config LPT1OSC = OFF
#pragma config PBADEN = OFF
#pragma config CCP2MX = ON
#pragma config STVREN = ON
#pragma config LVP = OFF
#pragma config XINST = OFF

#endif
