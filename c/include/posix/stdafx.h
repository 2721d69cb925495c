/* What projects of Visual Studio include first, as it makes this file, for those that are published without it. */
#ifndef FT_POSIX_STDAFX_H
#define FT_POSIX_STDAFX_H

#include "targetver.h"

#include <stdio.h>

#include "tchar.h"

#endif
