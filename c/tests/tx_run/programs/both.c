/* A PC program with two controllers: turns M1 of both until I1 of the first is pressed, and stops one after the other. */
#include <windows.h>
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"

static HANDLE turn(const char *port)
{
    DWORD error = 0;
    HANDLE device = ftxOpenComDevice((char *)port, 38400, &error);

    if (device != NULL && ftxStartTransferArea(device) == FTLIB_ERR_SUCCESS)
        SetOutMotorValues(device, 0, 0, 300, 0);
    return device;
}

int main(void)
{
    INT16 value = 0;
    BOOL32 overrun;
    HANDLE first, second;

    ftxInitLib();
    first = turn("COM4");
    second = turn("COM5");
    while (value == 0) {
        Sleep(10);
        GetInIOValue(first, 0, 0, &value, &overrun);
    }
    ftxStopTransferArea(first);
    ftxStopTransferArea(second);
    return 0;
}
