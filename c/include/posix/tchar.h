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
#define _tcscat strcat
#define _tcsncmp strncmp
#define _tcsncpy strncpy
#define _tcsicmp _stricmp
#define _tcschr strchr
#define _tcsrchr strrchr
#define _tcsstr strstr
#define _tcscpy_s strcpy_s
#define _tcscat_s strcat_s
#define _tcsncpy_s strncpy_s
#define _tcstol strtol
#define _tcstod strtod
#define _ttoi atoi
#define _tstoi atoi
#define _ttol atol
#define _tstof atof
#define _itot _itoa
#define _itot_s _itoa_s
#define _ftprintf fprintf
#define _tprintf_s printf_s
#define _stprintf_s sprintf_s
#define _sntprintf _snprintf
#define _sntprintf_s _snprintf_s
#define _vstprintf_s vsprintf_s
#define _tscanf scanf
#define _stscanf sscanf
#define _tscanf_s scanf_s
#define _stscanf_s sscanf_s
#define _tfopen fopen
#define _tfopen_s fopen_s
#define _fgetts fgets
#define _fputts fputs
#define _putts puts
#define _getts_s gets_s
#define _tsystem system
#define _tgetenv getenv
#endif

#endif
