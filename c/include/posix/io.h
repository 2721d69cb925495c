/* Files by their names, as io.h of Windows has them, for other systems. */
#ifndef FT_POSIX_IO_H
#define FT_POSIX_IO_H

#include <unistd.h>

#include "ft_windows_c.h"

#ifdef __cplusplus
extern "C" {
#endif

/* 0 when the file is there and may be used: 0 in any way, 2 to write, 4 to read, 6 both. */
int _access(const char *name, int mode);
int _unlink(const char *name);
#define _isatty isatty
#define _fileno fileno

#ifdef __cplusplus
}
#endif

#endif
