/* A header of that time, which came with a program: for a 32-bit compiler. */
#ifndef KeLibTxtDl_H
#define KeLibTxtDl_H
#include "FtShmem.h"
typedef unsigned long uint32_t;
typedef long int32_t;
uint32_t StartTxtDownloadProg(void);
#endif
