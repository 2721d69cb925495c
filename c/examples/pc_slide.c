/*
 * A slide: M1 moves it to its end switch and 600 pulses back.
 * A program for a PC with the library ftMscLib. The port COM4 in it is any controller that you name outside of it.
 *
 *   M1  encoder motor, forward moves the slide to I2; its encoder is on C1
 *   I2  switch, pressed at the end
 *
 *   cargo run --bin tx_run -- c/examples/pc_slide.c --world slide         (a simulated TXT)
 *   cargo run --bin tx_run -- c/examples/pc_slide.c --host 192.168.7.2    (a TXT)
 */
#include <stdio.h>
#include <windows.h>

#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"

#define MOTOR   0   /* M1 */
#define COUNTER 0   /* C1 */
#define END     1   /* I2 */
#define NOBODY  4   /* no motor is synchronised with M1 */
#define PULSES  600
#define LIMIT   2000 /* times 10 ms */

static volatile int there;

/* Called from the library's thread. */
static void __stdcall reached(DWORD controller, DWORD motor)
{
    if (controller == TA_LOCAL && motor == MOTOR) {
        there = 1;
    }
}

/* Prints what an error code means. */
static int failed(const char *what, DWORD code)
{
    char text[100] = "";

    if (code == FTLIB_ERR_SUCCESS) {
        return 0;
    }
    ftxGetLibErrorString(code, 1, text, sizeof text);
    printf("%s: %s (0x%08lX)\n", what, text, (unsigned long) code);
    return 1;
}

static int to_the_end(HANDLE device)
{
    INT16 pressed = 0;
    BOOL32 overrun = FALSE;
    DWORD error = FTLIB_ERR_SUCCESS;
    int i;

    SetFtUniConfig(device, TA_LOCAL, END, MODE_R, TRUE);
    SetOutMotorValues(device, TA_LOCAL, MOTOR, DUTY_MAX, 0);
    for (i = 0; i < LIMIT && !pressed && error == FTLIB_ERR_SUCCESS; i++) {
        Sleep(10);
        error = GetInIOValue(device, TA_LOCAL, END, &pressed, &overrun);
    }
    SetOutMotorValues(device, TA_LOCAL, MOTOR, 0, 0);
    return failed("GetInIOValue", error) || !pressed;
}

static int back(HANDLE device)
{
    INT16 count = 0, level = 0;
    int i;

    there = 0;
    StartMotorExCmd(device, TA_LOCAL, MOTOR, DUTY_MAX, 1, NOBODY, 0, PULSES);
    for (i = 0; i < LIMIT && !there; i++) {
        Sleep(10);
    }
    GetInCounterValue(device, TA_LOCAL, COUNTER, &count, &level);
    StopMotorExCmd(device, TA_LOCAL, MOTOR);
    printf("%d pulses back\n", (int) count);
    return !there;
}

int main(void)
{
    DWORD error = 0;
    HANDLE device;
    int result = 1;

    if (failed("ftxInitLib", ftxInitLib())) {
        return 1;
    }
    SetCBMotorExReached(reached);
    device = ftxOpenComDevice("COM4", 38400, &error);
    if (device != NULL) {
        if (!failed("ftxStartTransferArea", ftxStartTransferArea(device))) {
            char name[DEV_NAME_LEN_MAX + 1] = "";

            GetRoboTxDevName(device, TA_LOCAL, name, sizeof name);
            printf("connected to %s\n", name);
            result = to_the_end(device) || back(device);
            ftxStopTransferArea(device);
        }
        ftxCloseDevice(device);
    } else {
        failed("ftxOpenComDevice", error);
    }
    ftxCloseLib();
    return result;
}
