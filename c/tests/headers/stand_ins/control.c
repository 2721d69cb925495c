/* Handles Ctrl-C twice, then leaves it to the system. With an argument it ignores Ctrl-C, too. It closes all files that
   it has not opened. */
#include <stdio.h>
#include <unistd.h>
#include <windows.h>

static volatile LONG times;

static BOOL WINAPI first(DWORD event)
{
    printf("first %u\n", (unsigned) event);
    fflush(stdout);
    return FALSE;
}

static BOOL WINAPI second(DWORD event)
{
    printf("second %u\n", (unsigned) event);
    fflush(stdout);
    return event == CTRL_CLOSE_EVENT || InterlockedIncrement(&times) <= 2;
}

static BOOL WINAPI removed(DWORD event)
{
    printf("removed %u\n", (unsigned) event);
    return TRUE;
}

int main(int count, char **arguments)
{
    int file;

    if (SetConsoleCtrlHandler(removed, FALSE) || !SetConsoleCtrlHandler(first, TRUE)
        || !SetConsoleCtrlHandler(second, TRUE) || !SetConsoleCtrlHandler(removed, TRUE) || !SetConsoleCtrlHandler(removed, FALSE))
        return 1;
    if (count > 1)
        SetConsoleCtrlHandler(NULL, TRUE);
    for (file = 3; file < 64; file++)
        close(file);
    printf("begun %s\n", arguments[0] ? "" : "?");
    fflush(stdout);
    for (;;)
        Sleep(1000);
}
