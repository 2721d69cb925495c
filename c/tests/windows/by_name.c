/* A finished program for Windows that knows nothing of the library but its name: it loads it, looks for the functions
 * named in a file, and drives M1 with COM4. Compiled for 32 and 64 bits. */
#include <stdio.h>
#include <string.h>
#include <windows.h>

#include "ROBO_TX_FW.h"
#include "ftErrCode.h"
#include "ftMscLib.h"

#define PULSES 50
#define CALL(name) ((__typeof__(&name))GetProcAddress(library, #name))

static volatile LONG reached, reset;

static void __stdcall on_reached(DWORD controller, DWORD motor)
{
    InterlockedExchange(&reached, controller == 0 && motor == 0 ? 1 : -1);
}

static void __stdcall on_reset(DWORD controller, DWORD counter)
{
    InterlockedExchange(&reset, controller == 0 && counter == 2 ? 1 : -1);
}

static int wait_for(volatile LONG *what)
{
    int i;

    for (i = 0; i < 2000 && !*what; i++)
        Sleep(10);
    return *what == 1;
}

/* The names are those of a .def file: a line for each, with its number. */
static int has_all(HMODULE library, const char *names)
{
    char name[100];
    int number, count = 0;
    FILE *file = fopen(names, "r");
    char line[200];

    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        FARPROC function;
        if (sscanf(line, " %99s @%d", name, &number) != 2)
            continue;
        function = GetProcAddress(library, name);
        if (function == NULL || function != GetProcAddress(library, (LPCSTR)(UINT_PTR)number)) {
            printf("%s is not function %d of the library\n", name, number);
            return 0;
        }
        count++;
    }
    printf("%d functions, TA has %d bytes\n", count, (int)sizeof(TA));
    return count == 110;
}

int main(int argc, char *argv[])
{
    DWORD error = 0;
    HANDLE device;
    char text[100] = "";
    INT16 count = 0, level = 0;
    volatile TA_ARRAY *areas;
    HMODULE library = LoadLibraryA(argv[1]);

    setvbuf(stdout, NULL, _IONBF, 0);
    if (library == NULL) {
        printf("%s can't be loaded: error %d\n", argv[1], (int)GetLastError());
        return 1;
    }
    if (!has_all(library, argv[2]) || (sizeof(void *) == 4 && sizeof(TA) != 1024))
        return 2;
    if (CALL(ftxInitLib)() != FTLIB_ERR_SUCCESS || CALL(ftxInitLib)() != FTLIB_ERR_LIB_IS_INITIALIZED)
        return 3;
    device = CALL(ftxOpenComDevice)("COM4", 38400, &error);
    if (device == NULL) {
        CALL(ftxGetLibErrorString)(error, 1, text, sizeof text);
        printf("not opened: %s\n", text);
        return 4;
    }
    CALL(SetCBMotorExReached)(on_reached);
    CALL(SetCBCounterResetted)(on_reset);
    if (CALL(ftxStartTransferArea)(device) != FTLIB_ERR_SUCCESS)
        return 5;
    areas = CALL(GetTransferAreasArrayAddr)(device);
    if (areas == NULL || &areas->ftxTransferArea[8].status != CALL(GetTransferAreaStatusAddr)(device, 8))
        return 6;
    CALL(GetRoboTxDevName)(device, 0, text, sizeof text);
    printf("%s, areas of %d bytes\n", text, (int)((char *)&areas->ftxTransferArea[1] - (char *)areas));
    CALL(StartCounterReset)(device, 0, 2);
    CALL(StartMotorExCmd)(device, 0, 0, 512, 0, 4, 0, PULSES);
    if (!wait_for(&reached) || !wait_for(&reset))
        return 7;
    CALL(GetInCounterValue)(device, 0, 0, &count, &level);
    printf("%d pulses by the call, %d in the area\n", (int)count, (int)areas->ftxTransferArea[0].input.counter[0]);
    if (count < PULSES || CALL(StopMotorExCmd)(device, 0, 0) != FTLIB_ERR_SUCCESS)
        return 8;
    CALL(SetCBMotorExReached)(NULL);
    if (CALL(ftxStopTransferArea)(device) != FTLIB_ERR_SUCCESS || CALL(ftxCloseDevice)(device) != FTLIB_ERR_SUCCESS)
        return 9;
    if (CALL(ftxCloseLib)() != FTLIB_ERR_SUCCESS || !FreeLibrary(library))
        return 10;
    printf("well\n");
    return 0;
}
