/* Texts of char that are cut to what fits, as strsafe.h of Windows has them, for other systems. */
#ifndef FT_POSIX_STRSAFE_H
#define FT_POSIX_STRSAFE_H

#include "windows.h"

#ifdef __cplusplus
extern "C" {
#endif

#define S_OK 0
#define STRSAFE_MAX_CCH 2147483647
#define STRSAFE_E_INSUFFICIENT_BUFFER ((HRESULT) 0x8007007A)
#define STRSAFE_E_INVALID_PARAMETER ((HRESULT) 0x80070057)
#ifndef SUCCEEDED
#define SUCCEEDED(result) ((HRESULT) (result) >= 0)
#define FAILED(result) ((HRESULT) (result) < 0)
#endif

static __inline__ HRESULT StringCchCopyA(LPSTR to, size_t size, LPCSTR from)
{
    errno_t error = strncpy_s(to, size, from, _TRUNCATE);
    if (error == STRUNCATE)
        return STRSAFE_E_INSUFFICIENT_BUFFER;
    return error ? STRSAFE_E_INVALID_PARAMETER : S_OK;
}

static __inline__ HRESULT StringCchCatA(LPSTR to, size_t size, LPCSTR from)
{
    errno_t error = strncat_s(to, size, from, _TRUNCATE);
    if (error == STRUNCATE)
        return STRSAFE_E_INSUFFICIENT_BUFFER;
    return error ? STRSAFE_E_INVALID_PARAMETER : S_OK;
}

static __inline__ HRESULT StringCchPrintfA(LPSTR to, size_t size, LPCSTR format, ...)
{
    int length = -1;
    va_list values;
    if (!to || size == 0)
        return STRSAFE_E_INVALID_PARAMETER;
    va_start(values, format);
    length = vsnprintf(to, size, format, values);
    va_end(values);
    return length >= 0 && (size_t) length < size ? S_OK : STRSAFE_E_INSUFFICIENT_BUFFER;
}

static __inline__ HRESULT StringCchLengthA(LPCSTR text, size_t most, size_t *length)
{
    size_t found = text ? strlen(text) : most;
    if (length)
        *length = found < most ? found : 0;
    return found < most ? S_OK : STRSAFE_E_INVALID_PARAMETER;
}

#define StringCchCopy StringCchCopyA
#define StringCchCat StringCchCatA
#define StringCchPrintf StringCchPrintfA
#define StringCchLength StringCchLengthA

#ifdef __cplusplus
}
#endif

#endif
