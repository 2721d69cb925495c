/* A PC program of two processes, each with a controller: both turn M1 until I1 is pressed. The first one then ends as
   LEAVE says. */
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>
#include <windows.h>
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"

static void work(const char *port)
{
    DWORD error = 0;
    INT16 value = 0;
    BOOL32 overrun;
    HANDLE device;

    ftxInitLib();
    device = ftxOpenComDevice((char *)port, 38400, &error);
    if (device == NULL || ftxStartTransferArea(device) != FTLIB_ERR_SUCCESS)
        exit(1);
    SetOutMotorValues(device, 0, 0, 300, 0);
    while (value == 0) {
        Sleep(10);
        GetInIOValue(device, 0, 0, &value, &overrun);
    }
}

int main(void)
{
    if (fork() == 0) {
        work("COM4");
        LEAVE;
    }
    if (fork() == 0) {
        work("COM5");
        exit(0);
    }
    while (wait(NULL) > 0)
        ;
    return 0;
}
