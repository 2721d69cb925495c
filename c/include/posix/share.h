/* How others may use a file that is open, which other systems than Windows do not limit. */
#ifndef FT_POSIX_SHARE_H
#define FT_POSIX_SHARE_H

#include "ft_windows_c.h"

#define _SH_DENYRW 0x10
#define _SH_DENYWR 0x20
#define _SH_DENYRD 0x30
#define _SH_DENYNO 0x40
#define _fsopen(name, mode, share) fopen((name), (mode))

#endif
