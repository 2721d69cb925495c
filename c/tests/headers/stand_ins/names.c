/* Names that console programs use beside the larger parts of windows.h. Ends with the line that found a mistake, or
   with 0. It is started in a folder of its own. */
#include <windows.h>
#include <conio.h>
#include <crtdbg.h>
#include <direct.h>
#include <io.h>
#include <share.h>
#include <strsafe.h>
#define EXPECT(condition) if (!(condition)) return __LINE__

static int numbers(void)
{
    int values[5] = { 0 };
    unsigned __int32 wide = 3;
    UNREFERENCED_PARAMETER(values);
    EXPECT(min(3, 5) == 3 && max(3, 5) == 5 && __min(3, 5) == 3 && __max(3, 5) == 5);
    EXPECT(ARRAYSIZE(values) == 5 && wide == 3 && sizeof(unsigned __int16) == 2);
    EXPECT(MAKEWORD(0x34, 0x12) == 0x1234 && MAKELONG(0x5678, 0x1234) == 0x12345678);
    EXPECT(HIWORD(MAKELONG(1, 0xFFFF)) == 0xFFFF && toupper('a') == 'A');
    return 0;
}

static int texts(void)
{
    char text[12], *made = NULL;
    wchar_t wide[3];
    lstrcpy(text, "ab");
    lstrcat(text, "cd");
    EXPECT(lstrlen(text) == 4 && lstrcmpi(text, "ABCD") == 0);
    EXPECT(wsprintf(text, "%d mm", 5) == 4 && strcmp(text, "5 mm") == 0);
    EXPECT(wcscpy_s(wide, 3, L"ab") == 0 && wcscpy_s(wide, 3, L"abc") == ERANGE && wide[0] == 0);
    EXPECT(_strdate_s(text, 9) == 0 && strlen(text) == 8 && text[2] == '/');
    EXPECT(_strtime_s(text, sizeof(text)) == 0 && strlen(text) == 8 && text[2] == ':');
    EXPECT(_strtime_s(text, 8) == ERANGE && text[0] == 0 && _strdate(text) == text);
    EXPECT(StringCchCopy(text, 4, "abc") == S_OK && FAILED(StringCchCat(text, 4, "d")) && strcmp(text, "abc") == 0);
    EXPECT(SUCCEEDED(StringCchPrintf(text, 12, "%d", 7)) && FAILED(StringCchPrintf(text, 2, "%d", 17)));
    SetLastError(5);
    EXPECT(GetLastError() == 5);
    EXPECT(FormatMessage(FORMAT_MESSAGE_FROM_SYSTEM, NULL, 5, 0, text, sizeof(text), NULL) == 10);
    EXPECT(FormatMessage(FORMAT_MESSAGE_FROM_SYSTEM, NULL, 5, 0, text, 10, NULL) == 0);
    EXPECT(FormatMessage(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_ALLOCATE_BUFFER, NULL, 5,
                         MAKELANGID(LANG_NEUTRAL, SUBLANG_DEFAULT), (LPSTR) &made, 0, NULL) == 10);
    EXPECT(strcmp(made, "Error 5.\r\n") == 0 && LocalFree(made) == NULL);
    return 0;
}

static int folders(void)
{
    char begun[MAX_PATH], now[MAX_PATH], path[MAX_PATH];
    FILE *file;
    EXPECT(GetCurrentDirectory(MAX_PATH, begun) == strlen(begun) && begun[0] == '/');
    EXPECT(GetCurrentDirectory(2, now) == strlen(begun) + 1);
    EXPECT(_access("gate", 0) == -1 && _mkdir("gate") == 0 && _access("gate", 0) == 0 && _mkdir("gate") == -1);
    EXPECT(SetCurrentDirectory("gate") && !SetCurrentDirectory("none") && !SetCurrentDirectory(NULL));
    EXPECT(_getcwd(now, MAX_PATH) == now && strncmp(begun, now, strlen(begun)) == 0 && strlen(now) > strlen(begun));
    file = _fsopen("one.txt", "w", _SH_DENYWR);
    EXPECT(file && fclose(file) == 0 && _access("one.txt", 6) == 0);
    EXPECT(_unlink("one.txt") == 0 && _unlink("one.txt") == -1 && _chdir("..") == 0 && _rmdir("gate") == 0);
    EXPECT(GetModuleFileName(NULL, path, MAX_PATH) == strlen(path) && strncmp(path, begun, strlen(begun)) == 0);
    EXPECT(strrchr(path, '/') == path + strlen(begun) && GetModuleFileName(NULL, path, 2) == 0);
    return 0;
}

static int objects(void)
{
    LONG before = 7;
    HANDLE places = CreateSemaphore(NULL, 1, 2, TEXT("places"));
    EXPECT(places && !CreateSemaphore(NULL, 3, 2, NULL) && !CreateSemaphore(NULL, 0, 0, NULL));
    EXPECT(WaitForSingleObject(places, 0) == WAIT_OBJECT_0 && WaitForSingleObject(places, 0) == WAIT_TIMEOUT);
    EXPECT(ReleaseSemaphore(places, 2, &before) && before == 0);
    EXPECT(!ReleaseSemaphore(places, 1, NULL) && !ReleaseSemaphore(places, 0, NULL));
    EXPECT(WaitForSingleObject(places, 0) == WAIT_OBJECT_0 && WaitForSingleObject(places, 0) == WAIT_OBJECT_0);
    EXPECT(WaitForSingleObject(places, 1) == WAIT_TIMEOUT && CloseHandle(places));
    EXPECT(SleepEx(1, FALSE) == 0 && SwitchToThread());
    EXPECT(SetThreadPriority(GetCurrentThread(), THREAD_PRIORITY_HIGHEST));
    EXPECT(SetPriorityClass(GetCurrentProcess(), HIGH_PRIORITY_CLASS));
    return 0;
}

/* The input is "nx", and the end. */
static int messages(void)
{
    DWORD keys = 0;
    EXPECT(MessageBox(NULL, "Is it there?", "Gate", MB_YESNO | MB_ICONQUESTION) == IDNO);
    EXPECT(GetNumberOfConsoleInputEvents(GetStdHandle(STD_INPUT_HANDLE), &keys) && keys == 1);
    EXPECT(_getch() == 'x' && MessageBox(NULL, "Go on?", "Gate", MB_OKCANCEL) == IDCANCEL);
    EXPECT(MessageBox(NULL, "The end", "Gate", MB_OK) == IDOK);
    return 0;
}

int main(void)
{
    int (*const parts[])(void) = { numbers, texts, folders, objects, messages };
    size_t part;
    _CrtSetDbgFlag(_CRTDBG_ALLOC_MEM_DF | _CRTDBG_LEAK_CHECK_DF);
    for (part = 0; part < ARRAYSIZE(parts); part++) {
        int line = parts[part]();
        EXPECT(_flushall() == 0);
        if (line)
            return line;
    }
    _ASSERTE(part == 0);
    return 0;
}
