/* For programs that include it alone: windows.h has all of it. */
#ifndef FT_POSIX_WINBASE_H
#define FT_POSIX_WINBASE_H

#include "windows.h"

#endif
