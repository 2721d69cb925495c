/* The transfer area as programs of kit 4.6.6 include it: that of kit 4.1.6 under further names. */
#ifndef FT_KIT_FTSHMEMTXT_H
#define FT_KIT_FTSHMEMTXT_H

#include "FtShmem.h"

typedef enum ShmIfId ShmIfId_TXT;

/* The areas of a controller and of one extension. */
#define IF_TXT_MAX 2

#endif
