/* The types of windows.h that the interface of ftMscLib is written in, for other systems. */
#ifndef FT_WINDOWS_TYPES_H
#define FT_WINDOWS_TYPES_H

#include <stddef.h>
#include <stdint.h>

#include "ft_types.h"

#ifdef _WIN32
#include <windows.h>
#else

#ifndef TRUE
#define TRUE 1
#endif
#ifndef FALSE
#define FALSE 0
#endif
#ifndef CONST
#define CONST const
#endif
#ifndef VOID
#define VOID void
#endif
#ifndef WINAPI
#define WINAPI __stdcall
#endif
#ifndef CALLBACK
#define CALLBACK __stdcall
#endif
#ifndef APIENTRY
#define APIENTRY __stdcall
#endif

/* As wide as on Windows, so DWORD and LONG have 32 bits everywhere. */
typedef int BOOL, *PBOOL, *LPBOOL;
typedef char CHAR, *PCHAR, *LPSTR, *PSTR;
typedef const char *LPCSTR, *PCSTR;
typedef wchar_t WCHAR, *PWCHAR, *LPWSTR, *PWSTR;
typedef const wchar_t *LPCWSTR, *PCWSTR;
typedef unsigned char UCHAR, *PUCHAR, BYTE, *PBYTE, *LPBYTE, BOOLEAN;
typedef short SHORT, *PSHORT;
typedef unsigned short USHORT, *PUSHORT, WORD, *PWORD, *LPWORD;
typedef int INT, *PINT, *LPINT, LONG, *PLONG, *LPLONG, HRESULT;
typedef unsigned int UINT, *PUINT, ULONG, *PULONG, DWORD, *PDWORD, *LPDWORD;
typedef float FLOAT;
typedef void *PVOID, *LPVOID, *HANDLE, **PHANDLE, **LPHANDLE;
typedef const void *LPCVOID;
typedef int64_t LONGLONG, INT64;
typedef uint64_t ULONGLONG, DWORDLONG, UINT64, DWORD64;
typedef ptrdiff_t INT_PTR, LONG_PTR, LPARAM, LRESULT, SSIZE_T;
typedef size_t UINT_PTR, ULONG_PTR, DWORD_PTR, WPARAM, SIZE_T;
typedef HANDLE HINSTANCE, HMODULE, HWND;

#endif

#endif
