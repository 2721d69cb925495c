/* Time as mmsystem.h of Windows has it, for other systems. */
#ifndef FT_POSIX_MMSYSTEM_H
#define FT_POSIX_MMSYSTEM_H

#include "../detail/ft_windows_types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define TIMERR_NOERROR 0
typedef UINT MMRESULT;

/* Milliseconds since some moment in the past. */
DWORD timeGetTime(void);
/* How exactly the system waits: always to a millisecond. */
MMRESULT timeBeginPeriod(UINT milliseconds);
MMRESULT timeEndPeriod(UINT milliseconds);

#ifdef __cplusplus
}
#endif

#endif
