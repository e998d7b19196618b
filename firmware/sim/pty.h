/* A serial line for programs: a pseudo-terminal under a name of one's own. */
#ifndef POLEPILOT_PTY_H
#define POLEPILOT_PTY_H

#include <stddef.h>
#include <stdint.h>

/* Open a raw pseudo-terminal and make `path` a symbolic link to it, in place of an older link.
 * Ends the program with status 2 and one line on standard error where that cannot be. */
void pty_open(const char *path);

/* Remove the link, if it is still ours. */
void pty_close(void);

/* Wait for bytes of the host, `ms` milliseconds at most. */
void pty_wait(int ms);

/* Up to `size` bytes that the host has sent; never blocks. */
size_t pty_read(uint8_t *bytes, size_t size);

/* Returns how many of `length` bytes were taken; never blocks. While nobody has the line open all
 * are taken and lost, as on a cable that leads nowhere. */
size_t pty_write(const uint8_t *bytes, size_t length);

#endif
