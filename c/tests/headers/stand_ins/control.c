/* Handles Ctrl-C twice, then leaves it to the system. With the argument ignore it ignores Ctrl-C, too, and with wait it
   does not return from its function. It closes all files that it has not opened. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <windows.h>

static volatile LONG times;
static int waits;

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
    while (waits)
        Sleep(1000);
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
    waits = count > 1 && !strcmp(arguments[1], "wait");
    if (count > 1 && !waits)
        SetConsoleCtrlHandler(NULL, TRUE);
    for (file = 3; file < 64; file++)
        close(file);
    printf("begun %s\n", arguments[0] ? "" : "?");
    fflush(stdout);
    for (;;)
        Sleep(1000);
}
