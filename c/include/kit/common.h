/* The integer types of kit 4.1.6. */
#ifndef FT_KIT_COMMON_H
#define FT_KIT_COMMON_H

#include "../detail/fish_x1.h"

#endif
