/* Beside the copies, so its compiler finds them first. */
#ifndef TXT_HELPERS_H
#define TXT_HELPERS_H
#include "common.h"
#include "FtShmem.h"
inline BOOL32 pressed(FISH_X1_TRANSFER *area, int input) { return area->ftX1in.uni[input] != 0; }
#endif
