// A program that gives the library a place for a text that is not its own. Its handler for that asks for the same text
// before it stops the motors.
#include <signal.h>
#include <unistd.h>

#include "windows.h"
#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"

static HANDLE device;

static void on_crash(int)
{
    char text[40];
    EnumComPorts(0, text, sizeof text);
    ftxStopTransferArea(device);
    ftxCloseDevice(device);
    _exit(3);
}

int main()
{
    char port[] = "COM4";
    DWORD error;
    signal(SIGSEGV, on_crash);
    ftxInitLib();
    device = ftxOpenComDevice(port, 38400, &error);
    if (!device || ftxStartTransferArea(device) != 0) {
        return 1;
    }
    SetOutMotorValues(device, TA_LOCAL, 0, 512, 0);
    EnumComPorts(0, (char *)8, 40);
    return 2;
}
