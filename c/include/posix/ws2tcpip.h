/* For programs that include it beside winsock2.h. */
#ifndef FT_POSIX_WS2TCPIP_H
#define FT_POSIX_WS2TCPIP_H

#include "winsock2.h"

#endif
