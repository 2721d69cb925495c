/* Threads as process.h of Windows has them, for other systems. */
#ifndef FT_POSIX_PROCESS_H
#define FT_POSIX_PROCESS_H

#include "windows.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Return a HANDLE as a number; (uintptr_t) -1 or 0 when there can be no thread. The handle of the first
   closes by itself when the thread ends. */
uintptr_t _beginthread(void (*start)(void *), unsigned stack, void *argument);
uintptr_t _beginthreadex(void *security, unsigned stack, unsigned (__stdcall *start)(void *),
                         void *argument, unsigned flags, unsigned *id);

#ifdef __cplusplus
}
#endif

#endif
