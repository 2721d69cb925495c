/* A finished program for Windows that is linked to ftMscLibEx, with COM5 in the world default: changes of chosen inputs,
 * a motor that follows another one and a value of an I2C device, each by a callback with the context. Compiled for 32
 * and 64 bits: a parameter in the wrong place gives a wrong value. */
#include <stdio.h>
#include <windows.h>

#include "ROBO_TX_FW.h"
#include "ftErrCode.h"
#include "ftMscLibEx.h"

#define PULSES 60

/* The context. */
struct seen {
    volatile LONG inputs, count, motors, value, wrong;
};

/* I1, a button. */
static void __stdcall on_input(DWORD controller, DWORD input, DWORD value, DWORD overrun, UINT8 mode, BOOL8 digital,
                               void *context)
{
    struct seen *seen = context;
    if (controller != 0 || input != 0 || value > 1 || overrun != 0 || mode != MODE_R || digital != TRUE)
        seen->wrong = 1;
    InterlockedIncrement(&seen->inputs);
}

/* C1, and not C2, which counts as well. */
static void __stdcall on_count(DWORD controller, DWORD counter, DWORD count, INT16 mode, void *context)
{
    struct seen *seen = context;
    if (controller != 0 || counter != 0 || ((LONG)count <= seen->count && count != 0) || mode != 1)
        seen->wrong = 2;
    InterlockedExchange(&seen->count, (LONG)count);
}

static void __stdcall on_reached(DWORD controller, DWORD motor, void *context)
{
    struct seen *seen = context;
    if (controller != 0 || motor > 1)
        seen->wrong = 3;
    InterlockedExchangeAdd(&seen->motors, 1 << motor);
}

static void __stdcall on_read(I2C_CB *result, void *context)
{
    struct seen *seen = context;
    InterlockedExchange(&seen->value, result->status == I2C_SUCCESS ? result->value : -1);
}

static int wait_for(volatile LONG *what, LONG least)
{
    int i;

    for (i = 0; i < 3000 && *what < least; i++)
        Sleep(10);
    return *what >= least;
}

int main(void)
{
    static struct seen seen;
    CB_LEVEL2 level = {&seen, TRUE, TRUE, 0, 0};
    DWORD error = 0, uni = 0, counter = 0;
    HANDLE device;

    if (ftxGetLibVersion() != 0x1050E || ftxInitLib() != FTLIB_ERR_SUCCESS)
        return 1;
    device = ftxOpenComDevice("COM5", 38400, &error);
    if (device == NULL)
        return 2;
    SetCBUniChanged(on_input);
    SetCBCounterChanged(on_count);
    SetCBMotorExReached2(on_reached);
    if (ftxStartTransferArea2(device, level) != FTLIB_ERR_SUCCESS)
        return 3;
    SetFtUniConfig(device, 0, 0, MODE_R, TRUE);
    SetFtCntConfig(device, 0, 0, 1);
    if (SetCBMaskUniChanged(device, 0, 1) || SetCBMaskCounterChanged(device, 0, 1))
        return 4;
    if (GetCBMaskUniChanged(device, 0, &uni) || GetCBMaskCounterChanged(device, 0, &counter) || uni != 1 || counter != 1)
        return 5;
    if (StartMotorExCmd4(device, 0, 0, 512, 0, 1, 0, -1, 0, 255, 0, PULSES) != FTLIB_ERR_SUCCESS)
        return 6;
    if (ftxI2cRead2(device, 0x18, 0, 5, on_read) != FTLIB_ERR_SUCCESS)
        return 7;
    if (!wait_for(&seen.motors, 3) || !wait_for(&seen.inputs, 2) || !wait_for(&seen.value, 1))
        return 8;
    printf("%d changes of I1, C1 at %d, I2C %d, wrong %d\n", (int)seen.inputs, (int)seen.count, (int)seen.value,
           (int)seen.wrong);
    if (seen.motors != 3 || seen.count < PULSES || seen.value != 0xFA || seen.wrong)
        return 9;
    if (ftxStopTransferArea(device) || ftxCloseDevice(device) || ftxCloseLib())
        return 10;
    printf("well\n");
    return 0;
}
