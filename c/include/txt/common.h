/* The integer types of programs for the TXT itself. */
#ifndef FT_TXT_COMMON_H
#define FT_TXT_COMMON_H

#include "../detail/fish_x1.h"

#endif
