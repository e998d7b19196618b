/* What SDCC's start-up code and library ask for, beyond hal/pic18f4550/registers.h. Not for XC8. */

#define REGISTER(address, name) __sfr __at(address) name

REGISTER(0xFD8, STATUS);
REGISTER(0xFE1, FSR1L);
REGISTER(0xFE3, PLUSW1);
REGISTER(0xFE4, PREINC1);
REGISTER(0xFE5, POSTDEC1);
REGISTER(0xFE6, POSTINC1);
REGISTER(0xFE8, WREG);
REGISTER(0xFE9, FSR0L);
REGISTER(0xFEA, FSR0H);
REGISTER(0xFED, POSTDEC0);
REGISTER(0xFEE, POSTINC0);
REGISTER(0xFEF, INDF0);
REGISTER(0xFF3, PRODL);
REGISTER(0xFF4, PRODH);
REGISTER(0xFF5, TABLAT);
REGISTER(0xFF6, TBLPTRL);
REGISTER(0xFF7, TBLPTRH);
REGISTER(0xFF8, TBLPTRU);

/* Nothing here points into the EEPROM. A pointer that does is broken: start again. */
#define NOWHERE(name)                                                                              \
    void name(void) __naked                                                                        \
    {                                                                                              \
        __asm__("reset");                                                                          \
    }

NOWHERE(__eeprom_gptrget1)
NOWHERE(__eeprom_gptrget2)
NOWHERE(__eeprom_gptrget3)
NOWHERE(__eeprom_gptrget4)
NOWHERE(__eeprom_gptrput1)
NOWHERE(__eeprom_gptrput2)
NOWHERE(__eeprom_gptrput3)
NOWHERE(__eeprom_gptrput4)
