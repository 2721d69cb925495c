// A program with two controllers that begins the second transfer in a thread, with a motor that is on from before.
#include <pthread.h>
#include <stdio.h>
#include <unistd.h>

#include "windows.h"
#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"

static HANDLE late;

static void *begin(void *)
{
    ftxStartTransferArea(late);
    for (;;) {
        pause();
    }
}

int main(int, char **words)
{
    DWORD error;
    ftxInitLib();
    HANDLE first = ftxOpenComDevice(words[1], 38400, &error);
    late = ftxOpenComDevice(words[2], 38400, &error);
    SetOutMotorValues(late, TA_LOCAL, 0, 512, 0);
    if (ftxStartTransferArea(first) != 0) {
        return 1;
    }
    pthread_t thread;
    pthread_create(&thread, NULL, begin, NULL);
    puts("begins");
    fflush(stdout);
    for (;;) {
        pause();
    }
}
