// A program whose signal handlers call the library, wherever the program is then. It never sleeps. The argument says
// how SIGINT ends it.
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>

#ifdef PC
#include "windows.h"
#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"

static HANDLE device;

static bool start()
{
    char port[] = "COM4";
    DWORD error;
    ftxInitLib();
    device = ftxOpenComDevice(port, 38400, &error);
    return device && ftxStartTransferArea(device) == 0;
}

static void turn(int duty)
{
    INT16 count, level;
    SetOutMotorValues(device, TA_LOCAL, 0, duty, 0);
    GetInCounterValue(device, TA_LOCAL, 0, &count, &level);
}

static void stop()
{
    char text[100];
    GetRoboTxDevName(device, TA_LOCAL, text, sizeof text);
    ftxGetLibErrorString(0, 1, text, sizeof text);
    ftxStopTransferArea(device);
    ftxCloseDevice(device);
    ftxCloseLib();
}
#else
#include "KeLibTxtDl.h"
#include "FtShmem.h"

unsigned int DebugFlags;
FILE *DebugFile;

static bool start() { return StartTxtDownloadProg() == 0; }

static void turn(int duty)
{
    if (MotorIOLib_ThreadIsRunning()) {
        GetKeLibTransferAreaMainAddress()[0].ftX1out.duty[0] = duty;
    }
}

static void stop() { StopTxtDownloadProg(); }
#endif

static volatile sig_atomic_t handled, ended;
static bool exits, stops;

static void on_alarm(int)
{
    turn(0);
    handled = handled + 1;
}

static void on_end(int)
{
    if (stops) {
        turn(0);
        stop();
    }
    if (exits) {
        exit(3);
    }
    ended = 1;
}

int main(int, char **words)
{
    bool allocates = strstr(words[1], "while allocating");
    exits = strcmp(words[1], "stop") != 0;
    stops = strcmp(words[1], "exit while allocating") != 0;
    signal(SIGALRM, on_alarm);
    signal(SIGINT, on_end);
    if (!start()) {
        return 1;
    }
    if (!strcmp(words[1], "stop")) {
        itimerval often = {{0, 300}, {0, 300}};
        setitimer(ITIMER_REAL, &often, NULL);
        while (handled < 100) {
            turn(512);
        }
        itimerval never = {{0, 0}, {0, 0}};
        setitimer(ITIMER_REAL, &never, NULL);
    }
    turn(512);
    puts("turns");
    fflush(stdout);
    while (!ended) {
        if (allocates) {
            void *volatile some = malloc(5000);
            void *volatile more = malloc(3000);
            free(some);
            free(more);
        } else {
            turn(512);
        }
    }
    return 0;
}
