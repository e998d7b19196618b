/* A webcam for tests on machines without one: preloaded into a process (LD_PRELOAD), it answers for
 * every path that ends in FAKE_CAMERA as a V4L2 driver does.
 *
 * A thread takes a picture 30 times a second, or as often as it is asked to, if a buffer is free
 * when it begins, and hands it over when the next one begins: with a single buffer every other
 * picture is lost, as with real USB cameras. The file FAKE_STATE steers it: "busy", "gone", "still" (no more pictures),
 * "damaged" (half pictures). Settings that it takes are written to FAKE_LOG, a line each.
 * FAKE_PICTURES is a folder with WIDTHxHEIGHT.jpg for each size that the camera knows.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define SLOTS 8
#define ROOM (4 << 20)

static const int sizes[][2] = {{640, 480}, {1280, 720}, {1600, 1200}};
static const __u32 controls[] = {V4L2_CID_FOCUS_AUTO, V4L2_CID_FOCUS_ABSOLUTE,
    V4L2_CID_EXPOSURE_AUTO, V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_AUTO_WHITE_BALANCE,
    V4L2_CID_WHITE_BALANCE_TEMPERATURE};

enum { FREE, QUEUED, FILLING, DONE };
static struct slot { int state; double begin; unsigned number; unsigned char *data; } slot[SLOTS];
static int camera = -1, width = 640, height = 480, rate = 30, count, streaming, started;
static unsigned taken;
static unsigned char *picture;
static size_t length;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + t.tv_nsec * 1e-9;
}

static int state(const char *word)
{
    char text[32] = "";
    FILE *file = fopen(getenv("FAKE_STATE"), "r");
    if (!file)
        return 0;
    if (!fgets(text, sizeof text, file))
        text[0] = 0;
    fclose(file);
    return strncmp(text, word, strlen(word)) == 0;
}

static void say(const char *what, long value)
{
    FILE *file = fopen(getenv("FAKE_LOG"), "a");
    if (file) {
        fprintf(file, "%s %ld\n", what, value);
        fclose(file);
    }
}

static void load(void)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%dx%d.jpg", getenv("FAKE_PICTURES"), width, height);
    FILE *file = fopen(path, "rb");
    if (!file)
        abort();
    if (!picture)
        picture = malloc(ROOM);
    length = fread(picture, 1, ROOM, file);
    fclose(file);
}

static void *shoot(void *unused)
{
    struct slot *filling = NULL;
    (void)unused;
    for (;;) {
        usleep(1000000 / rate);
        if (state("still"))
            continue;
        pthread_mutex_lock(&lock);
        if (filling && filling->state == FILLING) {
            size_t size = state("damaged") ? 300 : length;
            memcpy(filling->data, picture, size);
            filling->data[ROOM - 1] = size != length;
            filling->state = DONE;
            eventfd_write(camera, 1);
        }
        filling = NULL;
        for (int i = 0; streaming && i < count && !filling; i++)
            if (slot[i].state == QUEUED)
                filling = &slot[i];
        if (filling) {
            filling->state = FILLING;
            filling->begin = now();
            filling->number = taken++;
        }
        pthread_mutex_unlock(&lock);
    }
    return NULL;
}

static int is_camera(const char *path)
{
    const char *name = getenv("FAKE_CAMERA");
    size_t all = strlen(path), end = name ? strlen(name) : 0;
    return end && all >= end && strcmp(path + all - end, name) == 0;
}

static int open_camera(void)
{
    if (state("gone")) {
        errno = ENODEV;
        return -1;
    }
    if (camera < 0)
        camera = eventfd(0, EFD_NONBLOCK | EFD_SEMAPHORE);
    return dup(camera);
}

#define OPEN(name) \
    int name(const char *path, int flags, ...) \
    { \
        static int (*real)(const char *, int, ...); \
        va_list rest; \
        va_start(rest, flags); \
        int mode = va_arg(rest, int); \
        va_end(rest); \
        if (is_camera(path)) \
            return open_camera(); \
        if (!real) \
            real = dlsym(RTLD_NEXT, #name); \
        return real(path, flags, mode); \
    }
OPEN(open)
OPEN(open64)

#define MAP(name, offset_type) \
    void *name(void *at, size_t size, int rights, int flags, int fd, offset_type offset) \
    { \
        static void *(*real)(void *, size_t, int, int, int, offset_type); \
        if (!real) \
            real = dlsym(RTLD_NEXT, #name); \
        struct stat a, b; \
        if (camera < 0 || fd < 0 || size != ROOM || fstat(fd, &a) || fstat(camera, &b) || \
            a.st_ino != b.st_ino) \
            return real(at, size, rights, flags, fd, offset); \
        void *memory = real(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); \
        slot[offset / ROOM].data = memory; \
        return memory; \
    }
MAP(mmap, off_t)
MAP(mmap64, off64_t)

static int known(__u32 id)
{
    for (size_t i = 0; i < sizeof controls / sizeof *controls; i++)
        if (controls[i] == id)
            return 1;
    return 0;
}

static int fail(int number)
{
    errno = number;
    return -1;
}

static int take(struct v4l2_buffer *buffer)
{
    eventfd_t one;
    struct slot *oldest = NULL;
    if (eventfd_read(camera, &one))
        return fail(EAGAIN);
    for (int i = 0; i < count; i++)
        if (slot[i].state == DONE && (!oldest || slot[i].number < oldest->number))
            oldest = &slot[i];
    if (!oldest)
        return fail(EAGAIN);
    oldest->state = FREE;
    buffer->index = (__u32)(oldest - slot);
    buffer->length = ROOM;
    buffer->bytesused = oldest->data[ROOM - 1] ? 300 : (__u32)length;
    buffer->sequence = oldest->number;
    buffer->flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    buffer->timestamp.tv_sec = (time_t)oldest->begin;
    buffer->timestamp.tv_usec = (suseconds_t)((oldest->begin - (time_t)oldest->begin) * 1e6);
    return 0;
}

static int answer(unsigned long request, void *data)
{
    if (state("gone")) {
        streaming = count = 0;
        for (int i = 0; i < SLOTS; i++)
            slot[i].state = FREE;
        return fail(ENODEV);
    }
    switch (request) {
    case VIDIOC_QUERYCAP: {
        struct v4l2_capability *c = data;
        memset(c, 0, sizeof *c);
        c->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
        if (state("other data"))
            c->device_caps = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
        c->capabilities = c->device_caps | V4L2_CAP_DEVICE_CAPS;
        return 0;
    }
    case VIDIOC_S_FMT:
    case VIDIOC_TRY_FMT:
    case VIDIOC_G_FMT: {
        struct v4l2_pix_format *p = &((struct v4l2_format *)data)->fmt.pix;
        if (request == VIDIOC_S_FMT) {
            long best = -1;
            if (state("busy"))
                return fail(EBUSY);
            for (int i = 0; i < 3; i++) {
                long off = labs((long)sizes[i][0] * sizes[i][1] - (long)p->width * p->height);
                if (best < 0 || off < best) {
                    best = off;
                    width = sizes[i][0];
                    height = sizes[i][1];
                }
            }
            load();
        }
        p->width = width;
        p->height = height;
        p->pixelformat = V4L2_PIX_FMT_MJPEG;
        p->field = V4L2_FIELD_NONE;
        p->bytesperline = 0;
        p->sizeimage = ROOM;
        return 0;
    }
    case VIDIOC_REQBUFS: {
        struct v4l2_requestbuffers *r = data;
        if (state("busy"))
            return fail(EBUSY);
        if (r->count > SLOTS)
            r->count = SLOTS;
        count = (int)r->count;
        for (int i = 0; i < SLOTS; i++)
            slot[i].state = FREE;
        if (count)
            say("buffers", count);
        return 0;
    }
    case VIDIOC_QUERYBUF: {
        struct v4l2_buffer *b = data;
        b->length = ROOM;
        b->m.offset = b->index * ROOM;
        return 0;
    }
    case VIDIOC_QBUF:
        slot[((struct v4l2_buffer *)data)->index].state = QUEUED;
        return 0;
    case VIDIOC_DQBUF:
        return take(data);
    case VIDIOC_STREAMON:
        streaming = 1;
        if (!started++) {
            pthread_t thread;
            pthread_create(&thread, NULL, shoot, NULL);
        }
        return 0;
    case VIDIOC_STREAMOFF: {
        eventfd_t one;
        streaming = 0;
        while (!eventfd_read(camera, &one))
            ;
        return 0;
    }
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM: {
        struct v4l2_captureparm *c = &((struct v4l2_streamparm *)data)->parm.capture;
        c->capability = V4L2_CAP_TIMEPERFRAME;
        if (request == VIDIOC_S_PARM && c->timeperframe.numerator) {
            rate = (int)(c->timeperframe.denominator / c->timeperframe.numerator);
            say("rate", rate);
        }
        c->timeperframe.numerator = 1;
        c->timeperframe.denominator = (__u32)rate;
        return 0;
    }
    case VIDIOC_QUERYCTRL: {
        struct v4l2_queryctrl *q = data;
        if (!known(q->id))
            return fail(EINVAL);
        q->flags = 0;
        q->type = V4L2_CTRL_TYPE_INTEGER;
        q->minimum = 0;
        q->maximum = 10000;
        q->step = 1;
        return 0;
    }
    case VIDIOC_S_CTRL: {
        struct v4l2_control *c = data;
        char name[32];
        if (!known(c->id))
            return fail(EINVAL);
        if (c->id == V4L2_CID_EXPOSURE_AUTO && c->value == V4L2_EXPOSURE_AUTO)
            return fail(EINVAL); /* as webcams: by hand, or aperture priority */
        snprintf(name, sizeof name, "control %08x", c->id);
        say(name, c->value);
        return 0;
    }
    case VIDIOC_G_CTRL:
        return known(((struct v4l2_control *)data)->id) ? 0 : fail(EINVAL);
    case VIDIOC_ENUMINPUT:
    case VIDIOC_G_INPUT:
    case VIDIOC_S_INPUT:
        return ((struct v4l2_input *)data)->index ? fail(EINVAL) : 0;
    default:
        return fail(EINVAL);
    }
}

int ioctl(int fd, unsigned long request, ...)
{
    static int (*real)(int, unsigned long, ...);
    struct stat a, b;
    va_list rest;
    va_start(rest, request);
    void *data = va_arg(rest, void *);
    va_end(rest);
    if (!real)
        real = dlsym(RTLD_NEXT, "ioctl");
    request &= 0xffffffff;
    if (camera < 0 || (request >> 8 & 0xff) != 'V' || fstat(fd, &a) || fstat(camera, &b) ||
        a.st_ino != b.st_ino || a.st_dev != b.st_dev)
        return real(fd, request, data);
    pthread_mutex_lock(&lock);
    int result = answer(request, data);
    int number = errno;
    pthread_mutex_unlock(&lock);
    errno = number;
    return result;
}
