#define _GNU_SOURCE
#include "sim/pty.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static int master = -1;
static char device[64];
static const char *link_path;

static void refuse(const char *what)
{
    fprintf(stderr, "polepilot-board: %s: %s\n", what, strerror(errno));
    exit(2);
}

static void make_link(const char *path)
{
    struct stat there;
    char fresh[4096];

    if (lstat(path, &there) == 0 && !S_ISLNK(there.st_mode)) {
        fprintf(stderr, "polepilot-board: --link %s: there is a file that is no link\n", path);
        exit(2);
    }
    if (snprintf(fresh, sizeof fresh, "%s.%ld", path, (long)getpid()) >= (int)sizeof fresh) {
        errno = ENAMETOOLONG;
        refuse(path);
    }
    if (symlink(device, fresh) != 0 || rename(fresh, path) != 0) {
        refuse(path);
    }
    link_path = path;
}

void pty_open(const char *path)
{
    struct termios line;
    int slave;

    master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 ||
        ptsname_r(master, device, sizeof device) != 0) {
        refuse("no pseudo-terminal");
    }
    /* The settings outlive this first opening. */
    slave = open(device, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (slave < 0 || tcgetattr(slave, &line) != 0) {
        refuse(device);
    }
    cfmakeraw(&line);
    if (tcsetattr(slave, TCSANOW, &line) != 0) {
        refuse(device);
    }
    (void)close(slave);
    make_link(path);
}

void pty_close(void)
{
    char target[sizeof device];
    ssize_t length;

    if (link_path == NULL) {
        return;
    }
    length = readlink(link_path, target, sizeof target - 1u);
    if (length > 0 && (size_t)length == strlen(device) && memcmp(target, device, (size_t)length) == 0) {
        (void)unlink(link_path);
    }
    link_path = NULL;
}

static int nobody_there(void)
{
    struct pollfd watched = {master, POLLOUT, 0};

    return poll(&watched, 1, 0) > 0 && (watched.revents & POLLHUP);
}

void pty_wait(int ms)
{
    struct pollfd watched = {master, POLLIN, 0};
    struct timespec rest = {ms / 1000, (ms % 1000) * 1000000L};

    if (poll(&watched, 1, ms) > 0 && !(watched.revents & POLLIN)) {
        (void)nanosleep(&rest, NULL);
    }
}

size_t pty_read(uint8_t *bytes, size_t size)
{
    ssize_t count = read(master, bytes, size);

    return count > 0 ? (size_t)count : 0u;
}

/* What was sent last and not read must not wait for whoever opens the line next. */
static void forget(void)
{
    int slave = open(device, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);

    if (slave >= 0) {
        (void)tcflush(slave, TCIFLUSH);
        (void)close(slave);
    }
}

size_t pty_write(const uint8_t *bytes, size_t length)
{
    static int open_before;
    ssize_t count;

    if (nobody_there()) {
        if (open_before) {
            forget();
        }
        open_before = 0;
        return length;
    }
    open_before = 1;
    count = write(master, bytes, length);
    return count > 0 ? (size_t)count : 0u;
}
