/* A PC program: turns M1, and prints without end. It leaves its number in a file. */
#include <stdio.h>
#include <unistd.h>
#include <windows.h>
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"

int main(void)
{
    DWORD error = 0;
    HANDLE device;
    FILE *file = fopen("number", "w");

    fprintf(file, "%d\n", (int)getpid());
    fclose(file);
    ftxInitLib();
    device = ftxOpenComDevice("COM4", 38400, &error);
    if (device == NULL || ftxStartTransferArea(device))
        return 1;
    SetOutMotorValues(device, 0, 0, 512, 0);
    for (;;)
        puts("It turns and turns and turns and turns and turns and turns and turns and turns and turns.");
}
