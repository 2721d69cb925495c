// A C++ program with functions that C sources call, with names of the C library's. It turns M1 until I1 is pressed.
#include <windows.h>
#include "ftMscLib.h"
#include "ftErrCode.h"

static HANDLE device;
static int calls;

extern "C" {

void connect(void)
{
    DWORD error = 0;
    calls++;
    ftxInitLib();
    device = ftxOpenComDevice("COM4", 38400, &error);
    ftxStartTransferArea(device);
}

void send(int duty)
{
    calls++;
    SetOutMotorValues(device, 0, 0, duty, 0);
}

void recv(INT16 *value)
{
    BOOL32 overrun = 0;
    calls++;
    GetInIOValue(device, 0, 0, value, &overrun);
}

void shutdown(void)
{
    calls++;
    ftxStopTransferArea(device);
    ftxCloseDevice(device);
    ftxCloseLib();
}

}

int main()
{
    INT16 value = 0;
    int reads = 0;

    connect();
    send(300);
    for (; value == 0; reads++) {
        recv(&value);
        Sleep(2);
    }
    shutdown();
    return calls - reads - 3;
}
