/* The integer types of FtTxtLib. */
#ifndef FT_FTTXTLIB_COMMON_H
#define FT_FTTXTLIB_COMMON_H

#include "../detail/fish_x1.h"

#endif
