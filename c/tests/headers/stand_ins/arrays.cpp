// The size of an array need not be given. Ends with the line that found a mistake, or with 0.
#include "stdafx.h"
#include <SDKDDKVer.h>
#include <tchar.h>
#include <algorithm>
#define EXPECT(condition) if (!(condition)) return __LINE__

static int formatted(char (&to)[6], const char *format, ...)
{
    va_list values;
    va_start(values, format);
    int length = vsprintf_s(to, format, values);
    va_end(values);
    return length;
}

static LONG count;
static long long_count;

static DWORD _stdcall counts(LPVOID)
{
    for (int round = 0; round < 1000; round++) {
        InterlockedIncrement(&count);
        InterlockedExchangeAdd(&long_count, -2);
    }
    return 0;
}

static int of_threads()
{
    HANDLE threads[2];
    for (HANDLE &thread : threads)
        thread = CreateThread(NULL, 0, counts, NULL, 0, NULL);
    EXPECT(WaitForMultipleObjects(2, threads, TRUE, INFINITE) == WAIT_OBJECT_0);
    EXPECT(count == 2000 && long_count == -4000);
    EXPECT(InterlockedDecrement(&count) == 1999 && InterlockedExchange(&count, 5) == 1999);
    EXPECT(InterlockedCompareExchange(&count, 7, 4) == 5 && count == 5);
    EXPECT(InterlockedCompareExchange(&count, 7, 5) == 5 && count == 7);
    return 0;
}

int _tmain(int argc, _TCHAR *argv[])
{
    char text[6];
    boolean done = argc == 1 && argv[0];
    EXPECT(strcpy_s(text, "12345") == 0 && strcpy_s(text, "123456") == ERANGE && text[0] == 0);
    EXPECT(strcpy_s(text, sizeof(text), "12") == 0 && strcat_s(text, "345") == 0 && strcat_s(text, "6") == ERANGE);
    EXPECT(strncpy_s(text, "123456", _TRUNCATE) == STRUNCATE && strcmp(text, "12345") == 0);
    EXPECT(sprintf_s(text, "%d", 12345) == 5 && sprintf_s(text, sizeof(text), "%d", 7) == 1);
    EXPECT(_stprintf_s(text, _T("%s"), _T("123456")) == -1 && text[0] == 0);
    EXPECT(formatted(text, "%s", "abc") == 3 && strcmp(text, "abc") == 0);
    EXPECT(_snprintf_s(text, _TRUNCATE, "%s", "123456") == -1 && strcmp(text, "12345") == 0);
    EXPECT(_snprintf_s(text, sizeof(text), 2, "%d", 123) == -1 && strcmp(text, "12") == 0);
    EXPECT(_itoa_s(-7, text, 10) == 0 && strcmp(text, "-7") == 0);
    // Its macros do not hide these.
    EXPECT(std::min(1, 2) == 1 && std::max(1, 2) == 2);
    int line = of_threads();
    return line ? line : !done;
}
