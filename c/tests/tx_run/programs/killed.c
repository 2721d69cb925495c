/* A PC program: turns M1, and is killed, with GONE only when the controller has gone; with BECOMES it then becomes another
   program. With BEFORE and AFTER it removes the folder of its notes before or after the transfer begins, with HOST it
   sets another controller, with CLEARED it clears its environment. */
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>
#include <windows.h>
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"

extern char **environ;

static void remove_notes(void)
{
    if (system("rm -r \"$FT_TXT_TRANSFERS\"") != 0)
        exit(2);
}

int main(int argc, char *argv[])
{
    DWORD error = 0;
    HANDLE device;

#ifdef HOST
    setenv("FT_TXT_HOST", HOST, 1);
#endif
#ifdef CLEARED
    environ = NULL;
#endif
    ftxInitLib();
#ifdef BEFORE
    remove_notes();
#endif
    device = ftxOpenComDevice("COM4", 38400, &error);
    if (device == NULL || ftxStartTransferArea(device) != FTLIB_ERR_SUCCESS)
        return 1;
    SetOutMotorValues(device, 0, 0, 300, 0);
#ifdef AFTER
    Sleep(300);
    remove_notes();
#endif
#ifdef GONE
    while (ftxIsTransferActiv(device) != FTLIB_ERR_THREAD_NOT_RUNNING)
        Sleep(2);
#else
    Sleep(300);
#endif
#ifdef BECOMES
    execlp("sleep", "sleep", "1000", (char *)0);
#endif
    return raise(SIGKILL);
}
