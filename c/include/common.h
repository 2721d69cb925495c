/* What the headers for PC programs have in common. */
#ifndef FT_TX_COMMON_H
#define FT_TX_COMMON_H

#include <stddef.h>

#include "detail/ft_types.h"

#ifndef TRUE
#define TRUE 1
#endif
#ifndef FALSE
#define FALSE 0
#endif

#endif
