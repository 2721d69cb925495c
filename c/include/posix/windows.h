/* What programs use of windows.h, for other systems: time, events, threads, locks, libraries. */
#ifndef FT_POSIX_WINDOWS_H
#define FT_POSIX_WINDOWS_H

#include <string.h>

#include "../ft_windows_types.h"

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
#define LoadLibrary LoadLibraryW
#else
typedef char TCHAR;
#define TEXT(text) text
#define OutputDebugString OutputDebugStringA
#define CreateEvent CreateEventA
#define CreateMutex CreateMutexA
#define LoadLibrary LoadLibraryA
#endif
typedef TCHAR *LPTSTR;
typedef const TCHAR *LPCTSTR;
typedef unsigned char boolean;

#ifndef __int64
#define __int64 long long
#endif

#define MAX_PATH 260
#define INVALID_HANDLE_VALUE ((HANDLE) (LONG_PTR) -1)
#define ZeroMemory(to, size) memset((to), 0, (size))
#define CopyMemory(to, from, size) memcpy((to), (from), (size))
#define LOWORD(value) ((WORD) ((DWORD) (value) & 0xFFFF))
#define HIWORD(value) ((WORD) ((DWORD) (value) >> 16))
#define LOBYTE(value) ((BYTE) ((DWORD) (value) & 0xFF))
#define HIBYTE(value) ((BYTE) (((DWORD) (value) >> 8) & 0xFF))

/* Time. GetTickCount counts milliseconds since some moment in the past. */
typedef union {
    struct {
        DWORD LowPart;
        LONG HighPart;
    } u;
    LONGLONG QuadPart;
} LARGE_INTEGER, *PLARGE_INTEGER;
void Sleep(DWORD milliseconds);
DWORD GetTickCount(void);
ULONGLONG GetTickCount64(void);
BOOL QueryPerformanceCounter(LARGE_INTEGER *count);
BOOL QueryPerformanceFrequency(LARGE_INTEGER *per_second);

/* Events, locks and threads, for this process alone: their names are ignored. */
#define INFINITE 0xFFFFFFFFU
#define WAIT_OBJECT_0 0U
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
DWORD WaitForSingleObject(HANDLE object, DWORD milliseconds);
DWORD WaitForMultipleObjects(DWORD count, const HANDLE *objects, BOOL all, DWORD milliseconds);
BOOL CloseHandle(HANDLE object);

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
/* Why the last call above has failed in this thread. */
DWORD GetLastError(void);

/* Dynamic libraries. The name ftMscLib.dll, in any spelling and with any folder, is this library. */
typedef int (__stdcall *FARPROC)(void);
HMODULE LoadLibraryA(LPCSTR name);
HMODULE LoadLibraryW(LPCWSTR name);
FARPROC GetProcAddress(HMODULE library, LPCSTR name);
BOOL FreeLibrary(HMODULE library);

/* Writes to the error output. */
void OutputDebugStringA(LPCSTR text);
void OutputDebugStringW(LPCWSTR text);

/* The C library of Windows has these in string.h and stdlib.h. */
int _stricmp(const char *one, const char *other);
int stricmp(const char *one, const char *other);
int _strnicmp(const char *one, const char *other, size_t length);
int strnicmp(const char *one, const char *other, size_t length);

#ifdef __cplusplus
}
#endif

#endif
