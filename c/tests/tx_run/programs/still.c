/* In the place of the C library's function: the disk with the notes of transfers stands still when one is removed. */
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

int unlink(const char *path)
{
    while (strstr(path, "/transfers/") != NULL)
        pause();
    return syscall(SYS_unlinkat, -100, path, 0);
}
