/* Checks of the C library of Windows, which a program without its debugger does not have either. */
#ifndef FT_POSIX_CRTDBG_H
#define FT_POSIX_CRTDBG_H

#define _CRTDBG_ALLOC_MEM_DF 0x1
#define _CRTDBG_LEAK_CHECK_DF 0x20
#define _CRTDBG_REPORT_FLAG (-1)
#define _CrtDumpMemoryLeaks() 0
#define _CrtCheckMemory() 1
#define _ASSERT(condition) ((void) 0)
#define _ASSERTE(condition) ((void) 0)

static __inline__ int _CrtSetDbgFlag(int flags)
{
    (void) flags;
    return 0;
}

#endif
