/* Names of winsock2.h, for other systems. Programs use them in declarations only. */
#ifndef FT_POSIX_WINSOCK2_H
#define FT_POSIX_WINSOCK2_H

#include "windows.h"

/* As on these systems: a number that is negative when there is no socket. */
typedef int SOCKET;
#define INVALID_SOCKET (-1)
#define SOCKET_ERROR (-1)

#endif
