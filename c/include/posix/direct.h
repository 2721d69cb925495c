/* Folders, as direct.h of Windows has them, for other systems. */
#ifndef FT_POSIX_DIRECT_H
#define FT_POSIX_DIRECT_H

#include <unistd.h>

#include "ft_windows_c.h"

#ifdef __cplusplus
extern "C" {
#endif

/* 0 when it is done, or else -1 with the reason in errno. */
int _mkdir(const char *folder);
int _rmdir(const char *folder);
int _chdir(const char *folder);
/* The current folder; without a place for it in new memory, for free. */
char *_getcwd(char *to, int size);

#ifdef __cplusplus
}
#endif

#endif
