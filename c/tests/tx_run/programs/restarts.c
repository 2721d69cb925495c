/* A PC program: begins its transfer again and again, shows what is noted of it for tx_run, and is killed. */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <windows.h>
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"

/* How many files there are, and their bytes. */
#define COUNT "cd \"$FT_TXT_TRANSFERS\" && echo notes `ls | wc -l` `cat * | wc -c`"

int main(int argc, char *argv[])
{
    DWORD error = 0;
    HANDLE device;
    int i;

    ftxInitLib();
    device = ftxOpenComDevice("COM4", 38400, &error);
    for (i = 0; i < 30; i++) {
        if (i > 0 && ftxStopTransferArea(device) != FTLIB_ERR_SUCCESS)
            return 1;
        if (ftxStartTransferArea(device) != FTLIB_ERR_SUCCESS)
            return 2;
        if (system(COUNT) != 0)
            return 3;
    }
    SetOutMotorValues(device, 0, 0, 300, 0);
    return raise(SIGKILL);
}
