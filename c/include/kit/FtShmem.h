/* The transfer area as programs of kit 4.1.6 include it. */
#ifndef FT_KIT_FTSHMEM_H
#define FT_KIT_FTSHMEM_H

#include "../detail/fish_x1.h"
#include "../detail/fish_x1_callbacks.h"
#include "../detail/fish_x1_kit_constants.h"

#endif
