/* What the C library of Windows has and others have not: functions with the size of what they write to, and some with
   an underscore. Where Windows would end the program, because a size is too small, they return the error, with an empty
   text. */
#ifndef FT_WINDOWS_C_H
#define FT_WINDOWS_C_H

#include <ctype.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <wchar.h>

#include "ft_scanf_s.h"

#ifdef __APPLE__
#include <sys/_types/_errno_t.h>
#include <sys/_types/_rsize_t.h>
#else
typedef int errno_t;
typedef size_t rsize_t;
#endif

#define STRUNCATE 80
#define _TRUNCATE ((size_t) -1)
#define _countof(array) (sizeof(array) / sizeof((array)[0]))
#ifndef _MAX_PATH
#define _MAX_PATH 260
#endif

#define __max(one, other) (((one) > (other)) ? (one) : (other))
#define __min(one, other) (((one) < (other)) ? (one) : (other))
#define _alloca __builtin_alloca
#define _flushall() fflush(NULL)

#define printf_s printf
#define fprintf_s fprintf
#define vprintf_s vprintf
#define vfprintf_s vfprintf
#define _strdup strdup
#define _cprintf printf

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__STRICT_ANSI__) && !defined(__cplusplus)
/* C libraries hide these from programs in an old standard. */
int (vsnprintf)(char *to, size_t size, const char *format, va_list values);
char *(strdup)(const char *text);
struct tm *(localtime_r)(const time_t *time, struct tm *to);
struct tm *(gmtime_r)(const time_t *time, struct tm *to);
#endif

/* The end without last words, as unistd.h has it. */
void _exit(int status) __attribute__((__noreturn__));

/* Texts. A count of _TRUNCATE copies as much as fits. */
static __inline__ errno_t strncpy_s(char *to, size_t size, const char *from, size_t count)
{
    size_t length = 0;
    if (!to || size == 0)
        return EINVAL;
    while (from && length < count && from[length])
        length++;
    if (!from || (length >= size && count != _TRUNCATE)) {
        to[0] = 0;
        return from ? ERANGE : EINVAL;
    }
    if (length >= size) {
        memmove(to, from, size - 1);
        to[size - 1] = 0;
        return STRUNCATE;
    }
    memmove(to, from, length);
    to[length] = 0;
    return 0;
}

static __inline__ errno_t strcpy_s(char *to, size_t size, const char *from)
{
    return strncpy_s(to, size, from, _TRUNCATE - 1);
}

static __inline__ errno_t strncat_s(char *to, size_t size, const char *from, size_t count)
{
    size_t length = 0;
    errno_t error = EINVAL;
    if (!to || size == 0)
        return EINVAL;
    while (length < size && to[length])
        length++;
    if (length < size)
        error = strncpy_s(to + length, size - length, from, count);
    if (error != 0 && error != STRUNCATE)
        to[0] = 0;
    return error;
}

static __inline__ errno_t strcat_s(char *to, size_t size, const char *from)
{
    return strncat_s(to, size, from, _TRUNCATE - 1);
}

static __inline__ errno_t wcscpy_s(wchar_t *to, size_t size, const wchar_t *from)
{
    size_t length = from ? wcslen(from) : 0;
    if (!to || size == 0)
        return EINVAL;
    to[0] = 0;
    if (!from || length >= size)
        return from ? ERANGE : EINVAL;
    wmemcpy(to, from, length + 1);
    return 0;
}

static __inline__ errno_t memmove_s(void *to, size_t size, const void *from, size_t count)
{
    if (count == 0)
        return 0;
    if (!to || !from || count > size)
        return to && from ? ERANGE : EINVAL;
    memmove(to, from, count);
    return 0;
}

static __inline__ errno_t memcpy_s(void *to, size_t size, const void *from, size_t count)
{
    errno_t error = memmove_s(to, size, from, count);
    if (error && to)
        memset(to, 0, size);
    return error;
}

static __inline__ char *strtok_s(char *text, const char *separators, char **rest)
{
    char *end;
    if (!separators || !rest || (!text && !*rest))
        return NULL;
    text = text ? text : *rest;
    text += strspn(text, separators);
    end = text + strcspn(text, separators);
    *rest = *end ? end + 1 : end;
    *end = 0;
    return *text ? text : NULL;
}

/* Formatted texts. */
static __inline__ int vsprintf_s(char *to, size_t size, const char *format, va_list values)
{
    int length;
    if (!to || size == 0 || !format) {
        errno = EINVAL;
        return -1;
    }
    length = vsnprintf(to, size, format, values);
    if (length >= 0 && (size_t) length < size)
        return length;
    to[0] = 0;
    errno = ERANGE;
    return -1;
}

/* Cuts what is longer than the count, and then has no 0 at the end, as on Windows. */
static __inline__ int _vsnprintf(char *to, size_t count, const char *format, va_list values)
{
    va_list again;
    char *whole;
    int length;
    __builtin_va_copy(again, values);
    length = vsnprintf(NULL, 0, format, again);
    va_end(again);
    if (length < 0 || !to)
        return count ? -1 : length;
    if ((size_t) length < count)
        return vsnprintf(to, count, format, values);
    whole = (char *) malloc((size_t) length + 1);
    if (!whole)
        return -1;
    vsnprintf(whole, (size_t) length + 1, format, values);
    memcpy(to, whole, count);
    free(whole);
    return (size_t) length == count ? length : -1;
}

/* Cuts what is longer than the count. What fits the count and not the size is an error. */
static __inline__ int _vsnprintf_s(char *to, size_t size, size_t count, const char *format, va_list values)
{
    int length;
    if (count != _TRUNCATE && count >= size)
        return vsprintf_s(to, size, format, values);
    if (!to || size == 0 || !format) {
        errno = EINVAL;
        return -1;
    }
    count = count < size ? count : size - 1;
    length = vsnprintf(to, count + 1, format, values);
    return length >= 0 && (size_t) length <= count ? length : -1;
}

static __inline__ int sprintf_s(char *to, size_t size, const char *format, ...)
{
    int length;
    va_list values;
    va_start(values, format);
    length = vsprintf_s(to, size, format, values);
    va_end(values);
    return length;
}

static __inline__ int _snprintf(char *to, size_t count, const char *format, ...)
{
    int length;
    va_list values;
    va_start(values, format);
    length = _vsnprintf(to, count, format, values);
    va_end(values);
    return length;
}

static __inline__ int _snprintf_s(char *to, size_t size, size_t count, const char *format, ...)
{
    int length;
    va_list values;
    va_start(values, format);
    length = _vsnprintf_s(to, size, count, format, values);
    va_end(values);
    return length;
}

/* A line of the keyboard, without its end. */
static __inline__ char *gets_s(char *to, size_t size)
{
    size_t length = 0;
    int next;
    if (!to || size == 0)
        return NULL;
    while ((next = getchar()) != EOF && next != '\n')
        if (length < size)
            to[length++] = (char) next;
    if (length == size || (next == EOF && length == 0)) {
        to[0] = 0;
        return NULL;
    }
    to[length] = 0;
    return to;
}

/* Files. */
static __inline__ errno_t fopen_s(FILE **file, const char *name, const char *mode)
{
    if (!file)
        return EINVAL;
    *file = name && mode ? fopen(name, mode) : NULL;
    if (*file)
        return 0;
    return name && mode ? errno : EINVAL;
}

/* Time. */
static __inline__ errno_t localtime_s(struct tm *to, const time_t *time)
{
    return to && time && localtime_r(time, to) ? 0 : EINVAL;
}

static __inline__ errno_t gmtime_s(struct tm *to, const time_t *time)
{
    return to && time && gmtime_r(time, to) ? 0 : EINVAL;
}

static __inline__ errno_t asctime_s(char *to, size_t size, const struct tm *time)
{
    size_t length = to && time ? strftime(to, size, "%a %b %d %H:%M:%S %Y\n", time) : 0;
    if (length == 0 && to && size)
        to[0] = 0;
    return length ? 0 : EINVAL;
}

static __inline__ errno_t ctime_s(char *to, size_t size, const time_t *time)
{
    struct tm parts;
    return localtime_s(&parts, time) ? EINVAL : asctime_s(to, size, &parts);
}

static __inline__ errno_t ft_now(char *to, size_t size, const char *format)
{
    time_t now = time(NULL);
    struct tm parts;
    size_t length = 0;
    if (to && size && localtime_s(&parts, &now) == 0)
        length = strftime(to, size, format, &parts);
    if (length == 0 && to && size)
        to[0] = 0;
    return length ? 0 : ERANGE;
}

/* The date and the time of now, such as 03/24/12 and 17:05:00. */
static __inline__ errno_t _strdate_s(char *to, size_t size)
{
    return ft_now(to, size, "%m/%d/%y");
}

static __inline__ errno_t _strtime_s(char *to, size_t size)
{
    return ft_now(to, size, "%H:%M:%S");
}

static __inline__ char *_strdate(char *to)
{
    return _strdate_s(to, 9) ? NULL : to;
}

static __inline__ char *_strtime(char *to)
{
    return _strtime_s(to, 9) ? NULL : to;
}

/* Numbers as texts, with digits of this base from 2 to 36. Only with the base 10 a number has a sign. */
char *_itoa(int value, char *to, int base);
char *itoa(int value, char *to, int base);
char *_ltoa(long value, char *to, int base);
char *ltoa(long value, char *to, int base);
char *_ultoa(unsigned long value, char *to, int base);
char *ultoa(unsigned long value, char *to, int base);

static __inline__ errno_t _itoa_s(int value, char *to, size_t size, int base)
{
    char digits[34];
    return _itoa(value, digits, base) ? strcpy_s(to, size, digits) : EINVAL;
}

/* Compare texts with small and capital letters as the same. */
int _stricmp(const char *one, const char *other);
int stricmp(const char *one, const char *other);
int _strnicmp(const char *one, const char *other, size_t length);
int strnicmp(const char *one, const char *other, size_t length);
/* Make all letters small, or capital. */
char *_strlwr(char *text);
char *strlwr(char *text);
char *_strupr(char *text);
char *strupr(char *text);

#ifdef __cplusplus
}

/* The size of an array need not be given. */
template <size_t size> inline errno_t strcpy_s(char (&to)[size], const char *from)
{
    return strcpy_s(to, size, from);
}

template <size_t size> inline errno_t strncpy_s(char (&to)[size], const char *from, size_t count)
{
    return strncpy_s(to, size, from, count);
}

template <size_t size> inline errno_t strcat_s(char (&to)[size], const char *from)
{
    return strcat_s(to, size, from);
}

template <size_t size> inline errno_t strncat_s(char (&to)[size], const char *from, size_t count)
{
    return strncat_s(to, size, from, count);
}

template <size_t size> inline int vsprintf_s(char (&to)[size], const char *format, va_list values)
{
    return vsprintf_s(to, size, format, values);
}

template <size_t size> inline int sprintf_s(char (&to)[size], const char *format, ...)
{
    va_list values;
    va_start(values, format);
    int length = vsprintf_s(to, size, format, values);
    va_end(values);
    return length;
}

template <size_t size>
inline int _vsnprintf_s(char (&to)[size], size_t count, const char *format, va_list values)
{
    return _vsnprintf_s(to, size, count, format, values);
}

template <size_t size> inline int _snprintf_s(char (&to)[size], size_t count, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    int length = _vsnprintf_s(to, size, count, format, values);
    va_end(values);
    return length;
}

template <size_t size> inline char *gets_s(char (&to)[size])
{
    return gets_s(to, size);
}

template <size_t size> inline errno_t _itoa_s(int value, char (&to)[size], int base)
{
    return _itoa_s(value, to, size, base);
}

template <size_t size> inline errno_t asctime_s(char (&to)[size], const struct tm *time)
{
    return asctime_s(to, size, time);
}

template <size_t size> inline errno_t wcscpy_s(wchar_t (&to)[size], const wchar_t *from)
{
    return wcscpy_s(to, size, from);
}

template <size_t size> inline errno_t _strdate_s(char (&to)[size])
{
    return _strdate_s(to, size);
}

template <size_t size> inline errno_t _strtime_s(char (&to)[size])
{
    return _strtime_s(to, size);
}

template <size_t size> inline errno_t ctime_s(char (&to)[size], const time_t *time)
{
    return ctime_s(to, size, time);
}
#endif

#endif
