/* What programs use of windows.h, for other systems: time, events, threads, locks, libraries, the console, keys, files
   with settings. */
#ifndef FT_POSIX_WINDOWS_H
#define FT_POSIX_WINDOWS_H

#include <stdlib.h>
#include <string.h>

#include "../detail/ft_windows_types.h"
#include "ft_windows_c.h"
#include "mmsystem.h"
#include "wincon.h"
#include "winuser.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Texts of char, or of wchar_t when the program says so. */
#if defined(UNICODE) || defined(_UNICODE)
typedef WCHAR TCHAR;
#define TEXT(text) L##text
#define OutputDebugString OutputDebugStringW
#define CreateEvent CreateEventW
#define CreateMutex CreateMutexW
#define CreateSemaphore CreateSemaphoreW
#define LoadLibrary LoadLibraryW
#else
typedef char TCHAR;
#define TEXT(text) text
#define OutputDebugString OutputDebugStringA
#define CreateEvent CreateEventA
#define CreateMutex CreateMutexA
#define CreateSemaphore CreateSemaphoreA
#define LoadLibrary LoadLibraryA
#endif
typedef TCHAR *LPTSTR;
typedef const TCHAR *LPCTSTR;
typedef unsigned char boolean;

#ifndef __int64
#define __int64 long long
#endif

#ifndef __int32
#define __int32 int
#endif
#ifndef __int16
#define __int16 short
#endif
#ifndef __int8
#define __int8 char
#endif

#if !defined(NOMINMAX) && !defined(__cplusplus)
#ifndef max
#define max(one, other) (((one) > (other)) ? (one) : (other))
#endif
#ifndef min
#define min(one, other) (((one) < (other)) ? (one) : (other))
#endif
#endif

#define MAX_PATH 260
#define ARRAYSIZE(array) (sizeof(array) / sizeof((array)[0]))
#define UNREFERENCED_PARAMETER(name) ((void) (name))
#define INVALID_HANDLE_VALUE ((HANDLE) (LONG_PTR) -1)
#define ZeroMemory(to, size) memset((to), 0, (size))
#define CopyMemory(to, from, size) memcpy((to), (from), (size))
#define FillMemory(to, size, value) memset((to), (value), (size))
#define MAKEWORD(low, high) ((WORD) (((BYTE) (low)) | ((WORD) ((BYTE) (high))) << 8))
#define MAKELONG(low, high) ((LONG) (((WORD) (low)) | ((DWORD) ((WORD) (high))) << 16))
#define LOWORD(value) ((WORD) ((DWORD) (value) & 0xFFFF))
#define HIWORD(value) ((WORD) ((DWORD) (value) >> 16))
#define LOBYTE(value) ((BYTE) ((DWORD) (value) & 0xFF))
#define HIBYTE(value) ((BYTE) (((DWORD) (value) >> 8) & 0xFF))

/* Texts of char. */
#define lstrcpy strcpy
#define lstrcat strcat
#define lstrcmp strcmp
#define lstrcmpi _stricmp
#define lstrlen(text) ((int) strlen(text))
#define wsprintf sprintf
#define wvsprintf vsprintf

/* Time. GetTickCount counts milliseconds since some moment in the past. */
typedef union {
    struct {
        DWORD LowPart;
        LONG HighPart;
    } u;
    LONGLONG QuadPart;
} LARGE_INTEGER, *PLARGE_INTEGER;
void Sleep(DWORD milliseconds);
static __inline__ DWORD SleepEx(DWORD milliseconds, BOOL alertable)
{
    (void) alertable;
    Sleep(milliseconds);
    return 0;
}
DWORD GetTickCount(void);
ULONGLONG GetTickCount64(void);
BOOL QueryPerformanceCounter(LARGE_INTEGER *count);
BOOL QueryPerformanceFrequency(LARGE_INTEGER *per_second);
typedef struct {
    WORD wYear;
    WORD wMonth;
    /* 0 is Sunday. */
    WORD wDayOfWeek;
    WORD wDay;
    WORD wHour;
    WORD wMinute;
    WORD wSecond;
    WORD wMilliseconds;
} SYSTEMTIME, *PSYSTEMTIME, *LPSYSTEMTIME;
void GetLocalTime(LPSYSTEMTIME time);
void GetSystemTime(LPSYSTEMTIME time);

/* Ends the program as exit does, so its motors stop. */
static __inline__ void ExitProcess(UINT status)
{
    exit((int) status);
}

/* Events, locks and threads, for this process alone: their names are ignored. */
#define INFINITE 0xFFFFFFFFU
#define WAIT_OBJECT_0 0U
#define WAIT_ABANDONED 0x80U
#define WAIT_ABANDONED_0 0x80U
#define WAIT_TIMEOUT 258U
#define WAIT_FAILED 0xFFFFFFFFU
#define STILL_ACTIVE 259U
typedef struct {
    DWORD nLength;
    LPVOID lpSecurityDescriptor;
    BOOL bInheritHandle;
} SECURITY_ATTRIBUTES, *LPSECURITY_ATTRIBUTES;
typedef DWORD (__stdcall *LPTHREAD_START_ROUTINE)(LPVOID argument);
HANDLE CreateEventA(LPSECURITY_ATTRIBUTES security, BOOL manual, BOOL set, LPCSTR name);
HANDLE CreateEventW(LPSECURITY_ATTRIBUTES security, BOOL manual, BOOL set, LPCWSTR name);
BOOL SetEvent(HANDLE event);
BOOL ResetEvent(HANDLE event);
HANDLE CreateMutexA(LPSECURITY_ATTRIBUTES security, BOOL owned, LPCSTR name);
HANDLE CreateMutexW(LPSECURITY_ATTRIBUTES security, BOOL owned, LPCWSTR name);
BOOL ReleaseMutex(HANDLE mutex);
HANDLE CreateThread(LPSECURITY_ATTRIBUTES security, SIZE_T stack, LPTHREAD_START_ROUTINE start,
                    LPVOID argument, DWORD flags, DWORD *id);
BOOL GetExitCodeThread(HANDLE thread, DWORD *code);
DWORD GetCurrentThreadId(void);
HANDLE CreateSemaphoreA(LPSECURITY_ATTRIBUTES security, LONG count, LONG most, LPCSTR name);
HANDLE CreateSemaphoreW(LPSECURITY_ATTRIBUTES security, LONG count, LONG most, LPCWSTR name);
BOOL ReleaseSemaphore(HANDLE semaphore, LONG by, LONG *before);
DWORD WaitForSingleObject(HANDLE object, DWORD milliseconds);
DWORD WaitForMultipleObjects(DWORD count, const HANDLE *objects, BOOL all, DWORD milliseconds);
BOOL CloseHandle(HANDLE object);

/* All threads have the same priority here. */
#define THREAD_PRIORITY_LOWEST (-2)
#define THREAD_PRIORITY_BELOW_NORMAL (-1)
#define THREAD_PRIORITY_NORMAL 0
#define THREAD_PRIORITY_ABOVE_NORMAL 1
#define THREAD_PRIORITY_HIGHEST 2
#define THREAD_PRIORITY_TIME_CRITICAL 15
#define NORMAL_PRIORITY_CLASS 0x20
#define HIGH_PRIORITY_CLASS 0x80
#define REALTIME_PRIORITY_CLASS 0x100
#define GetCurrentThread() ((HANDLE) (LONG_PTR) -2)
#define GetCurrentProcess() ((HANDLE) (LONG_PTR) -1)
static __inline__ BOOL SetThreadPriority(HANDLE thread, int priority)
{
    (void) thread, (void) priority;
    return TRUE;
}
static __inline__ BOOL SetPriorityClass(HANDLE process, DWORD priority)
{
    (void) process, (void) priority;
    return TRUE;
}
static __inline__ BOOL SwitchToThread(void)
{
    Sleep(0);
    return TRUE;
}

/* Locks that a thread may take several times. */
typedef struct {
    HANDLE mutex;
} CRITICAL_SECTION, *LPCRITICAL_SECTION;
void InitializeCriticalSection(LPCRITICAL_SECTION section);
void EnterCriticalSection(LPCRITICAL_SECTION section);
BOOL TryEnterCriticalSection(LPCRITICAL_SECTION section);
void LeaveCriticalSection(LPCRITICAL_SECTION section);
void DeleteCriticalSection(LPCRITICAL_SECTION section);

/* The processors. Each is reported as a core of its own. Of the kinds of information there are those about cores
   and groups; for another one the list is empty. */
#define ERROR_SUCCESS 0U
#define ERROR_INVALID_PARAMETER 87U
#define ERROR_INSUFFICIENT_BUFFER 122U
typedef struct {
    WORD wProcessorArchitecture;
    WORD wReserved;
    DWORD dwPageSize;
    LPVOID lpMinimumApplicationAddress;
    LPVOID lpMaximumApplicationAddress;
    DWORD_PTR dwActiveProcessorMask;
    DWORD dwNumberOfProcessors;
    DWORD dwProcessorType;
    DWORD dwAllocationGranularity;
    WORD wProcessorLevel;
    WORD wProcessorRevision;
} SYSTEM_INFO, *LPSYSTEM_INFO;
typedef ULONG_PTR KAFFINITY;
typedef struct {
    KAFFINITY Mask;
    WORD Group;
    WORD Reserved[3];
} GROUP_AFFINITY, *PGROUP_AFFINITY;
typedef enum {
    RelationProcessorCore,
    RelationNumaNode,
    RelationCache,
    RelationProcessorPackage,
    RelationGroup,
    RelationAll = 0xFFFF
} LOGICAL_PROCESSOR_RELATIONSHIP;
typedef struct {
    BYTE Flags;
    BYTE EfficiencyClass;
    BYTE Reserved[20];
    WORD GroupCount;
    GROUP_AFFINITY GroupMask[1];
} PROCESSOR_RELATIONSHIP, *PPROCESSOR_RELATIONSHIP;
typedef struct {
    BYTE MaximumProcessorCount;
    BYTE ActiveProcessorCount;
    BYTE Reserved[38];
    KAFFINITY ActiveProcessorMask;
} PROCESSOR_GROUP_INFO, *PPROCESSOR_GROUP_INFO;
typedef struct {
    WORD MaximumGroupCount;
    WORD ActiveGroupCount;
    BYTE Reserved[20];
    PROCESSOR_GROUP_INFO GroupInfo[1];
} GROUP_RELATIONSHIP, *PGROUP_RELATIONSHIP;
typedef struct {
    LOGICAL_PROCESSOR_RELATIONSHIP Relationship;
    DWORD Size;
    __extension__ union {
        PROCESSOR_RELATIONSHIP Processor;
        GROUP_RELATIONSHIP Group;
    };
} SYSTEM_LOGICAL_PROCESSOR_INFORMATION_EX, *PSYSTEM_LOGICAL_PROCESSOR_INFORMATION_EX;
void GetSystemInfo(LPSYSTEM_INFO info);
BOOL GetLogicalProcessorInformationEx(LOGICAL_PROCESSOR_RELATIONSHIP kind,
                                      PSYSTEM_LOGICAL_PROCESSOR_INFORMATION_EX buffer, DWORD *length);
/* Why the last call above has failed in this thread, or what the program has set. */
DWORD GetLastError(void);
void SetLastError(DWORD error);

/* The text of an error is its number. */
#define FORMAT_MESSAGE_ALLOCATE_BUFFER 0x100U
#define FORMAT_MESSAGE_IGNORE_INSERTS 0x200U
#define FORMAT_MESSAGE_FROM_SYSTEM 0x1000U
#define LANG_NEUTRAL 0
#define SUBLANG_DEFAULT 1
#define MAKELANGID(language, variant) ((WORD) ((variant) << 10 | (language)))
static __inline__ DWORD FormatMessageA(DWORD flags, const void *source, DWORD error, DWORD language, LPSTR to,
                                       DWORD size, va_list *values)
{
    char text[24];
    DWORD length = (DWORD) sprintf(text, "Error %u.\r\n", error);
    char *made = (char *) ((flags & FORMAT_MESSAGE_ALLOCATE_BUFFER) ? malloc(length + 1U) : to);
    (void) source, (void) language, (void) values;
    if (!(flags & FORMAT_MESSAGE_FROM_SYSTEM) || !made || (made == to && size <= length))
        return 0;
    if (made != to)
        *(char **) to = made;
    strcpy(made, text);
    return length;
}
#define FormatMessage FormatMessageA
#define LocalFree(memory) (free(memory), (HANDLE) NULL)

/* Folders. The program itself is one in the folder that was the current one when it began. */
DWORD GetCurrentDirectoryA(DWORD size, LPSTR to);
BOOL SetCurrentDirectoryA(LPCSTR folder);
DWORD GetModuleFileNameA(HMODULE library, LPSTR to, DWORD size);
#define GetCurrentDirectory GetCurrentDirectoryA
#define SetCurrentDirectory SetCurrentDirectoryA
#define GetModuleFileName GetModuleFileNameA

/* Dynamic libraries. The name ftMscLib.dll, in any spelling and with any folder, is this library. */
typedef int (__stdcall *FARPROC)(void);
HMODULE LoadLibraryA(LPCSTR name);
HMODULE LoadLibraryW(LPCWSTR name);
FARPROC GetProcAddress(HMODULE library, LPCSTR name);
BOOL FreeLibrary(HMODULE library);

/* Writes to the error output. */
void OutputDebugStringA(LPCSTR text);
void OutputDebugStringW(LPCWSTR text);

/* Settings in a file with lines of key=value below [section], up to 1 MB. A name without a folder is in the current
   folder. Without a section its names are given, each with a 0, and another one at the end; without a key those of a
   section. Writing no value removes the key, and no key the section. */
DWORD GetPrivateProfileStringA(LPCSTR section, LPCSTR key, LPCSTR otherwise, LPSTR to, DWORD size, LPCSTR file);
UINT GetPrivateProfileIntA(LPCSTR section, LPCSTR key, INT otherwise, LPCSTR file);
BOOL WritePrivateProfileStringA(LPCSTR section, LPCSTR key, LPCSTR value, LPCSTR file);
#define GetPrivateProfileString GetPrivateProfileStringA
#define GetPrivateProfileInt GetPrivateProfileIntA
#define WritePrivateProfileString WritePrivateProfileStringA

#ifdef __cplusplus
}
#endif

#ifdef __cplusplus
/* No macros, because these hide those of the standard library, which are taken where both fit. */
#if !defined(NOMINMAX) && !defined(min) && !defined(max)
#if __cplusplus >= 201103L
#define FT_CONSTEXPR constexpr
#else
#define FT_CONSTEXPR
#endif
#define FT_COMMON(A, B) __decltype(true ? (A) *(A *) 0 : (B) *(B *) 0)
template <class A, class B> inline FT_CONSTEXPR FT_COMMON(A, B) max(A one, B other)
{
    return one > other ? one : other;
}
template <class A, class B> inline FT_CONSTEXPR FT_COMMON(A, B) min(A one, B other)
{
    return one < other ? one : other;
}
#undef FT_CONSTEXPR
#undef FT_COMMON
#endif
#endif

/* Numbers that several threads change. They may be LONG or long. */
#ifdef __cplusplus
#define FT_CHANGE(name, change) \
    template <class T> inline T name(T volatile *number) { return change; }
#define FT_CHANGE_BY(name, change) \
    template <class T, class U> inline T name(T volatile *number, U by) { return change; }
FT_CHANGE(InterlockedIncrement, __sync_add_and_fetch(number, (T) 1))
FT_CHANGE(InterlockedDecrement, __sync_sub_and_fetch(number, (T) 1))
FT_CHANGE_BY(InterlockedExchange, __atomic_exchange_n(number, (T) by, __ATOMIC_SEQ_CST))
FT_CHANGE_BY(InterlockedExchangeAdd, __sync_fetch_and_add(number, (T) by))
FT_CHANGE_BY(InterlockedAnd, __sync_fetch_and_and(number, (T) by))
FT_CHANGE_BY(InterlockedOr, __sync_fetch_and_or(number, (T) by))
FT_CHANGE_BY(InterlockedXor, __sync_fetch_and_xor(number, (T) by))
template <class T, class U, class V>
inline T InterlockedCompareExchange(T volatile *number, U value, V expected)
{
    return __sync_val_compare_and_swap(number, (T) expected, (T) value);
}
#undef FT_CHANGE
#undef FT_CHANGE_BY
#else
#define InterlockedIncrement(number) __sync_add_and_fetch((number), 1)
#define InterlockedDecrement(number) __sync_sub_and_fetch((number), 1)
#define InterlockedExchange(number, value) __atomic_exchange_n((number), (value), __ATOMIC_SEQ_CST)
#define InterlockedExchangeAdd(number, by) __sync_fetch_and_add((number), (by))
#define InterlockedAnd(number, by) __sync_fetch_and_and((number), (by))
#define InterlockedOr(number, by) __sync_fetch_and_or((number), (by))
#define InterlockedXor(number, by) __sync_fetch_and_xor((number), (by))
#define InterlockedCompareExchange(number, value, expected) \
    __sync_val_compare_and_swap((number), (expected), (value))
#endif

#endif
