/* A PC program whose functions have names of the C library's: nobody else calls them. It turns M1 until I1 is pressed. */
#include <stdio.h>
#include <windows.h>
#include "ftMscLib.h"
#include "ftErrCode.h"

static HANDLE device;
static int calls;

int connect(void)
{
    DWORD error = 0;
    calls++;
    ftxInitLib();
    device = ftxOpenComDevice("COM4", 38400, &error);
    return device != NULL && ftxStartTransferArea(device) == FTLIB_ERR_SUCCESS;
}

void write(int output, int duty)
{
    calls++;
    SetOutMotorValues(device, 0, output, duty, 0);
}

INT16 read(int input)
{
    INT16 value = 0;
    BOOL32 overrun = 0;
    calls++;
    GetInIOValue(device, 0, input, &value, &overrun);
    return value;
}

void poll(void)
{
    while (read(0) == 0)
        Sleep(2);
}

/* The lift and the gate. */
void raise(void) { calls++; }
void close(void) { calls++; }
void send(void) { calls++; }
void recv(void) { calls++; }
int getrandom(void) { return ++calls; }

void shutdown(void)
{
    ftxStopTransferArea(device);
    ftxCloseDevice(device);
    ftxCloseLib();
}

int main(void)
{
    int reads;

    if (!connect())
        return 1;
    write(0, 300);
    calls = 0;
    poll();
    reads = calls;
    raise();
    close();
    shutdown();
    printf("%d further calls\n", calls - reads);
    return 0;
}
