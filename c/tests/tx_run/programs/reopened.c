/* Opens its device three times, and each time waits until the transfer has ended. */
#include <windows.h>
#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"

int main(void)
{
    DWORD error = 0;
    int times;

    ftxInitLib();
    for (times = 1; times <= 3; times++) {
        HANDLE device = ftxOpenComDevice("COM4", 38400, &error);
        if (error != FTLIB_ERR_SUCCESS || ftxStartTransferArea(device) != FTLIB_ERR_SUCCESS)
            return 1;
        while (ftxIsTransferActiv(device) == FTLIB_ERR_THREAD_IS_RUNNING)
            Sleep(5);
        ftxStopTransferArea(device);
        ftxCloseDevice(device);
    }
    ftxCloseLib();
    return 0;
}
