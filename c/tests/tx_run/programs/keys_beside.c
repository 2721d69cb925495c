/* One thread asks again and again whether a key waits, while main reads lines. Then a message is shown. */
#include <stdio.h>
#include <unistd.h>
#include <windows.h>
#include <conio.h>
#include "ftMscLib.h"

static DWORD WINAPI control(LPVOID unused)
{
    char line[32];
    DWORD last = GetTickCount();
    int ticks = 0;

    (void)unused;
    while (ticks < 100) {
        _kbhit();
        if (GetTickCount() - last < 20)
            continue;
        last = GetTickCount();
        write(2, line, snprintf(line, sizeof line, "tick %d.\n", ++ticks));
    }
    MessageBox(0, "All are counted", "Ticks", MB_OK);
    return 0;
}

int main(void)
{
    HANDLE thread = CreateThread(0, 0, control, 0, 0, 0);

    while (getchar() != EOF && WaitForSingleObject(thread, 0) != WAIT_OBJECT_0)
        ;
    return 0;
}
