/* A PC program in C++ with ftMscLibEx: an object is called when I3, a sensor with a voltage, changes, and M1 turns
 * while it is on. */
#include <windows.h>

#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLibEx.h"
#include "ftErrCode.h"

class Button {
public:
    Button() : changes(0), pressed(false) {}

    static void __stdcall on_changed(DWORD controller, DWORD input, DWORD value, DWORD overrun, UINT8 mode,
                                     BOOL8 digital, void *context)
    {
        if (controller == TA_LOCAL && input == 2 && !overrun && mode == MODE_U && digital)
            static_cast<Button *>(context)->change(value != 0);
    }

    volatile int changes;
    volatile bool pressed;

private:
    void change(bool now)
    {
        pressed = now;
        changes = changes + 1;
    }
};

int main()
{
    DWORD error = 0;
    char port[] = "COM4";
    Button button;
    CB_LEVEL2 info;

    if (ftxGetLibVersion() < 0x1050D || ftxInitLib() != FTLIB_ERR_SUCCESS)
        return 1;
    HANDLE device = ftxOpenComDevice(port, 38400, &error);
    if (!device)
        return 2;
    info.ptrContext = &button;
    SetCBUniChanged(Button::on_changed);
    if (SetCBMaskUniChanged(device, TA_LOCAL, 1 << 2) || ftxStartTransferArea2(device, info))
        return 3;
    SetFtUniConfig(device, TA_LOCAL, 2, MODE_U, true);
    while (button.changes < 2) {
        SetOutMotorValues(device, TA_LOCAL, 0, button.pressed ? 512 : 0, 0);
        Sleep(1);
    }
    ftxCloseDevice(device);
    return ftxCloseLib() == FTLIB_ERR_SUCCESS ? 0 : 4;
}
