/* Stands in for the devices of a TXT that the maker's program opens, loaded into it with LD_PRELOAD:

   - the serial line to the I/O board and the I2C bus are connections to the socket that BOARD names, where the test
     has a simulated machine. The first byte says which of the two a connection is,
   - the sound chip only takes sounds, in their time,
   - the camera is in camera.c.

   A descriptor of a device is one of the program's own, so only what a device does differently is here. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <linux/spi/spidev.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "camera.h"

/* The function of the C library that has this name, too. */
#define REAL(name)                                                                                                     \
    static __typeof__(&name) real_##name;                                                                              \
    if (!real_##name) real_##name = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

static int serial = -1, sound = -1, i2c = -1;

static int connect_board(char kind)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_STREAM, 0);

    strncpy(address.sun_path, getenv("BOARD"), sizeof address.sun_path - 1);
    if (connect(fd, (struct sockaddr *)&address, sizeof address) || send(fd, &kind, 1, 0) != 1) {
        perror(address.sun_path);
        exit(9);
    }
    return fd;
}

/* Sends a length of 16 bits, and the bytes. */
static void send_frame(int fd, const void *bytes, uint16_t length)
{
    uint8_t frame[2 + UINT16_MAX];

    memcpy(frame, &length, 2);
    memcpy(frame + 2, bytes, length);
    send(fd, frame, 2 + length, MSG_NOSIGNAL);
}

int open(const char *path, int flags, ...)
{
    REAL(open);
    va_list arguments;
    int mode;

    va_start(arguments, flags);
    mode = va_arg(arguments, int);
    va_end(arguments);
    if (!strcmp(path, "/dev/ttyO2")) return serial = connect_board('S');
    if (!strncmp(path, "/dev/i2c-", 9)) return i2c = connect_board('I');
    if (!strncmp(path, "/dev/spidev", 11)) return sound = real_open("/dev/null", O_RDWR);
    if (!strcmp(path, "/dev/video0")) return camera_open();
    return real_open(path, flags, mode);
}

int close(int fd)
{
    REAL(close);
    if (fd >= 0) {
        if (fd == serial) serial = -1;
        if (fd == i2c) i2c = -1;
        if (fd == sound) sound = -1;
        camera_closed(fd);
    }
    return real_close(fd);
}

/* --- The serial line */

ssize_t write(int fd, const void *bytes, size_t length)
{
    REAL(write);
    if (fd < 0 || fd != serial) return real_write(fd, bytes, length);
    send_frame(fd, bytes, length);
    return length;
}

/* A serial line has what has come, and never ends. */
ssize_t read(int fd, void *bytes, size_t length)
{
    REAL(read);
    ssize_t got;

    if (fd < 0 || fd != serial) return real_read(fd, bytes, length);
    got = recv(fd, bytes, length, MSG_DONTWAIT);
    return got < 0 ? 0 : got;
}

int tcsetattr(int fd, int when, const struct termios *settings)
{
    REAL(tcsetattr);
    return fd >= 0 && fd == serial ? 0 : real_tcsetattr(fd, when, settings);
}

int tcflush(int fd, int queue)
{
    REAL(tcflush);
    char rest[512];

    if (fd < 0 || fd != serial) return real_tcflush(fd, queue);
    while (recv(fd, rest, sizeof rest, MSG_DONTWAIT) > 0);
    return 0;
}

/* --- The I2C bus: a request is what ioctl has, the address, the length to read, and the bytes to write. */

static int i2c_transfer(const struct i2c_rdwr_ioctl_data *transfer)
{
    uint8_t request[3 + 1024] = {0}, done = 0;
    uint16_t length = 3, reading = 0;
    struct i2c_msg *read_into = NULL;

    for (unsigned n = 0; n < transfer->nmsgs; n++) {
        struct i2c_msg *message = &transfer->msgs[n];
        request[0] = message->addr;
        if (message->flags & I2C_M_RD) {
            read_into = message;
            reading = message->len;
        } else if (length + message->len <= (int)sizeof request) {
            memcpy(request + length, message->buf, message->len);
            length += message->len;
        }
    }
    memcpy(request + 1, &reading, 2);
    send_frame(i2c, request, length);
    if (recv(i2c, &done, 1, MSG_WAITALL) != 1 || !done) {
        errno = EREMOTEIO;
        return -1;
    }
    if (reading) recv(i2c, read_into->buf, reading, MSG_WAITALL);
    return transfer->nmsgs;
}

/* --- The sound chip: it has room for four blocks of 20 ms. 0x90 clears it, 0x81 is a block. */

static double milliseconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1e3 + now.tv_nsec / 1e6;
}

static int sound_transfer(const struct spi_ioc_transfer *transfer, int count)
{
    static double blocks, then;
    double now = milliseconds();
    int total = 0;

    blocks -= (now - then) / 20;
    if (blocks < 0) blocks = 0;
    then = now;
    for (int n = 0; n < count; n++) {
        const uint8_t *out = (const uint8_t *)(uintptr_t)transfer[n].tx_buf;
        uint8_t *in = (uint8_t *)(uintptr_t)transfer[n].rx_buf;
        if (out && out[0] == 0x90) blocks = 0;
        if (out && out[0] == 0x81) blocks++;
        if (in) memset(in, 0, transfer[n].len);
        if (in && transfer[n].len >= 2) {
            in[0] = 0xBB;
            in[1] = blocks > 3 ? 0 : 4 - blocks;
        }
        total += transfer[n].len;
    }
    return total;
}

int ioctl(int fd, unsigned long request, ...)
{
    REAL(ioctl);
    va_list arguments;
    void *argument;

    va_start(arguments, request);
    argument = va_arg(arguments, void *);
    va_end(arguments);
    if (fd >= 0 && fd == serial) return request == FIONREAD ? real_ioctl(fd, request, argument) : 0;
    if (fd >= 0 && fd == i2c) return request == I2C_RDWR ? i2c_transfer(argument) : 0;
    if (fd >= 0 && fd == sound)
        return _IOC_TYPE(request) == SPI_IOC_MAGIC && !_IOC_NR(request)
            ? sound_transfer(argument, _IOC_SIZE(request) / sizeof(struct spi_ioc_transfer)) : 0;
    if (camera_is(fd)) return camera_ioctl(request, argument);
    return real_ioctl(fd, request, argument);
}

/* --- What differs between a TXT and this machine */

/* The old scandir fails on file systems of today, whose numbers of files have more than 32 bits. */
int scandir(const char *folder, struct dirent ***list, int (*filter)(const struct dirent *),
            int (*compare)(const struct dirent **, const struct dirent **))
{
    DIR *from = opendir(folder);
    struct dirent64 *next;
    struct dirent **found = NULL;
    int count = 0;

    if (!from) return -1;
    while ((next = readdir64(from))) {
        struct dirent *entry = calloc(1, sizeof *entry);
        entry->d_type = next->d_type;
        strcpy(entry->d_name, next->d_name);
        if (filter && !filter(entry)) {
            free(entry);
            continue;
        }
        found = realloc(found, (count + 1) * sizeof *found);
        found[count++] = entry;
    }
    closedir(from);
    if (compare && count) qsort(found, count, sizeof *found, (int (*)(const void *, const void *))compare);
    *list = found;
    return count;
}

/* The program expects its own folder, and that its lines are seen at once. */
__attribute__((constructor)) static void begin(void)
{
    setvbuf(stdout, NULL, _IOLBF, 0);
    if (chdir("/opt/knobloch")) perror("/opt/knobloch");
}
