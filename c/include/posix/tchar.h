/* Texts of char or wchar_t, as tchar.h of Windows has them, for other systems. They are of char, unless
   UNICODE or _UNICODE is defined. */
#ifndef FT_POSIX_TCHAR_H
#define FT_POSIX_TCHAR_H

#include "windows.h"

typedef TCHAR _TCHAR;

#define _T(text) TEXT(text)
#define _TEXT(text) TEXT(text)

/* A system that is not Windows knows `main` alone. */
#if !defined(UNICODE) && !defined(_UNICODE)
#define _tmain main
#define _tprintf printf
#define _stprintf sprintf
#define _tcslen strlen
#define _tcscmp strcmp
#define _tcscpy strcpy
#define _ttoi atoi
#endif

#endif
