/* For programs that include it alone: windows.h has all of it. */
#ifndef FT_POSIX_WINDEF_H
#define FT_POSIX_WINDEF_H

#include "windows.h"

#endif
