/* Opens its device three times, and each time writes to an I2C device that is not there. */
#include <windows.h>
#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"

static volatile int done;

static void __stdcall count(I2C_CB *answer)
{
    done += answer->status == I2C_WRITE_ERROR;
}

int main(void)
{
    DWORD error = 0;
    int times;

    ftxInitLib();
    for (times = 1; times <= 3; times++) {
        HANDLE device = ftxOpenComDevice("COM4", 38400, &error);
        if (error != FTLIB_ERR_SUCCESS || ftxStartTransferArea(device) != FTLIB_ERR_SUCCESS)
            return 1;
        ftxI2cWrite(device, 0x18, 1, 1, 0x05, count);
        while (done < times)
            Sleep(5);
        ftxStopTransferArea(device);
        ftxCloseDevice(device);
    }
    ftxCloseLib();
    return 0;
}
