/* A PC program: turns M1, and is killed, with GONE only when the controller has gone. */
#include <signal.h>
#include <windows.h>
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"

int main(int argc, char *argv[])
{
    DWORD error = 0;
    HANDLE device;

    ftxInitLib();
    device = ftxOpenComDevice("COM4", 38400, &error);
    if (device == NULL || ftxStartTransferArea(device) != FTLIB_ERR_SUCCESS)
        return 1;
    SetOutMotorValues(device, 0, 0, 300, 0);
#ifdef GONE
    while (ftxIsTransferActiv(device) != FTLIB_ERR_THREAD_NOT_RUNNING)
        Sleep(2);
#else
    Sleep(300);
#endif
    return raise(SIGKILL);
}
