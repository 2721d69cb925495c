/* The transfer area as programs for the TXT itself include it. */
#ifndef FT_TXT_FTSHMEM_H
#define FT_TXT_FTSHMEM_H

#include "../detail/fish_x1.h"
#include "../detail/fish_x1_callbacks.h"
#include "../detail/fish_x1_kit_constants.h"

#endif
