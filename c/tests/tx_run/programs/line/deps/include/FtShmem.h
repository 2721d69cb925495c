/* A header of that time: with integers that are too long today. */
#ifndef FTSHMEM_H
#define FTSHMEM_H
#include "common.h"
typedef struct { UINT32 wrong[9]; } FISH_X1_TRANSFER;
#endif
