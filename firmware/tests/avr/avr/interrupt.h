#include <avr/io.h> /* all of them in one */
