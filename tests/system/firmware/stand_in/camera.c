/* Stands in for a USB camera with V4L2. Each of its pictures is the file /tmp/picture.jpg, with a number in its last
   bytes, so that no two are the same. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <time.h>
#include <unistd.h>

#include "camera.h"

enum { BUFFERS = 32, LARGEST = 1 << 20 };

/* The descriptor is memory with the buffers, one after the other, which the program maps. */
static int camera = -1;
static uint32_t size, queue[BUFFERS], queued, per_second = 15, number;
static struct timespec next;
static uint8_t picture[LARGEST];
static int length;

int camera_open(void)
{
    int file = open("/tmp/picture.jpg", O_RDONLY);

    if (file < 0) return -1;
    length = read(file, picture, sizeof picture);
    close(file);
    queued = 0;
    return camera = memfd_create("camera", 0);
}

int camera_is(int fd)
{
    return fd >= 0 && fd == camera;
}

void camera_closed(int fd)
{
    if (camera_is(fd)) camera = -1;
}

static int format(struct v4l2_pix_format *wanted)
{
    wanted->bytesperline = 2 * wanted->width;
    wanted->sizeimage = size = (wanted->bytesperline * wanted->height + 4095) & ~4095u;
    wanted->field = V4L2_FIELD_NONE;
    return 0;
}

static int rate(struct v4l2_fract *wanted)
{
    if (wanted->numerator && wanted->denominator >= wanted->numerator)
        per_second = wanted->denominator / wanted->numerator;
    return 0;
}

static int fill(struct v4l2_buffer *buffer)
{
    int used = length < (int)size ? length : (int)size;

    if (!queued) {
        errno = EAGAIN;
        return -1;
    }
    buffer->index = queue[0];
    memmove(queue, queue + 1, --queued * sizeof *queue);
    buffer->sequence = number++;
    memcpy(picture + used - 4, &buffer->sequence, 4);
    buffer->bytesused = used;
    return pwrite(camera, picture, used, (off_t)buffer->index * size) < 0 ? -1 : 0;
}

int camera_ioctl(unsigned long request, void *argument)
{
    struct v4l2_buffer *buffer = argument;
    struct v4l2_requestbuffers *buffers = argument;

    switch (request & 0xFFFFFFFF) {
    case VIDIOC_QUERYCAP:
        ((struct v4l2_capability *)argument)->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
        return 0;
    case VIDIOC_G_FMT:
    case VIDIOC_S_FMT:
    case VIDIOC_TRY_FMT:
        return format(&((struct v4l2_format *)argument)->fmt.pix);
    case VIDIOC_G_PARM:
        return 0;
    case VIDIOC_S_PARM:
        return rate(&((struct v4l2_streamparm *)argument)->parm.capture.timeperframe);
    case VIDIOC_REQBUFS:
        if (buffers->count > BUFFERS) buffers->count = BUFFERS;
        queued = 0;
        return ftruncate(camera, (off_t)buffers->count * size);
    case VIDIOC_QUERYBUF:
        buffer->length = size;
        buffer->m.offset = buffer->index * size;
        return 0;
    case VIDIOC_QBUF:
        if (queued < BUFFERS) queue[queued++] = buffer->index;
        return 0;
    case VIDIOC_DQBUF:
        return fill(buffer);
    case VIDIOC_STREAMON:
        clock_gettime(CLOCK_MONOTONIC, &next);
        return 0;
    case VIDIOC_STREAMOFF:
        return 0;
    default:
        errno = EINVAL;
        return -1;
    }
}

/* The program waits for a picture with this. */
int select(int count, fd_set *reading, fd_set *writing, fd_set *others, struct timeval *limit)
{
    static int (*real)(int, fd_set *, fd_set *, fd_set *, struct timeval *);

    if (camera < 0 || !reading || camera >= count || !FD_ISSET(camera, reading)) {
        if (!real) real = dlsym(RTLD_NEXT, "select");
        return real(count, reading, writing, others, limit);
    }
    next.tv_nsec += 1000000000 / per_second;
    next.tv_sec += next.tv_nsec / 1000000000;
    next.tv_nsec %= 1000000000;
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
    return 1;
}

/* The program decodes each picture to look for colours and balls, with a libjpeg that is not here. It sends only
   pictures that can be decoded. */
int _Z12ftProJpegDecPhiS_i(unsigned char *jpeg, int bytes, unsigned char *out, int out_bytes)
{
    (void)jpeg, (void)bytes, (void)out, (void)out_bytes;
    return 1;
}
