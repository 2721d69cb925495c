// A program that turns M1 until I1 is pressed, and ends in the way that its argument says.
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include "conio.h"
#include "windows.h"
#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"

static HANDLE device;
static const char *how;

static bool is(const char *word) { return !strcmp(how, word); }

static bool start()
{
    DWORD error;
    char port[] = "COM4";
    ftxInitLib();
    if (!device) {
        device = ftxOpenComDevice(port, 38400, &error);
    }
    return device && ftxStartTransferArea(device) == 0;
}

static void turn(int duty) { SetOutMotorValues(device, TA_LOCAL, 0, duty, 0); }

static bool is_pressed()
{
    INT16 value = 0;
    BOOL32 overrun = 0;
    GetInIOValue(device, TA_LOCAL, 0, &value, &overrun);
    return value != 0;
}

static void say(const char *line)
{
    puts(line);
    fflush(stdout);
}

static void *sleep_without_end(void *)
{
    for (;;) {
        Sleep(100);
        pthread_testcancel();
    }
}

static void wait_until_pressed()
{
    while (!is_pressed()) {
        Sleep(2);
    }
}

/// Takes SIGINT from time to time, and ends then.
static int take_signals()
{
    sigset_t only;
    sigemptyset(&only);
    sigaddset(&only, SIGINT);
    sigset_t pending;
    do {
        usleep(300000);
        sigpending(&pending);
    } while (!sigismember(&pending, SIGINT));
    int taken;
    sigwait(&only, &taken);
    say("taken");
    wait_until_pressed();
    return 3;
}

/// Begins the transfer again when it has ended.
static void turn_again()
{
    while (!is_pressed()) {
        Sleep(2);
        if (ftxIsTransferActiv(device) != 0 && start()) {
            turn(512);
            say("turns again");
        }
    }
}

static int deep(int depth)
{
    volatile char room[1000];
    room[0] = (char)depth;
    return depth < 0 ? 0 : deep(depth / 2 + 1) + room[0];
}

static void __stdcall in_callback(DWORD, DWORD)
{
    if (is("a full stack in a callback")) {
        deep(1);
    }
    if (is("exit in a callback")) {
        exit(5);
    }
    pthread_exit(NULL);
}

static void nothing(int)
{
}

static void crash()
{
    if (is("timer")) {
        struct itimerval often = {{0, 100}, {0, 100}};

        signal(SIGALRM, nothing);
        setitimer(ITIMER_REAL, &often, NULL);
    }
    if (is("pointer") || is("timer")) {
        *(volatile int *)8 = 1;
    } else if (is("abort")) {
        abort();
    } else if (is("stack")) {
        deep(1);
    } else if (is("heap")) {
        char *volatile bytes = (char *)malloc(100);
        for (int at = -64; at < 200; at++) {
            bytes[at] = 'A';
        }
        for (int size = 0; size < 1000; size++) {
            free(malloc(size));
        }
        abort();
    }
}

/// Takes all memory that there is, as a program does that never frees any.
static void take_all_memory()
{
    rlimit limit;
    getrlimit(RLIMIT_AS, &limit);
    limit.rlim_cur = 0;
    setrlimit(RLIMIT_AS, &limit);
    while (malloc(1 << 16)) {
    }
    while (malloc(16)) {
    }
}

int main(int, char **words)
{
    how = words[1];
    if (is("closed")) {
        close(STDOUT_FILENO);
    }
    if (is("keys") || is("keys and takes")) {
        _kbhit();
    }
    if (is("takes") || is("keys and takes")) {
        sigset_t only;
        sigemptyset(&only);
        sigaddset(&only, SIGINT);
        sigprocmask(SIG_BLOCK, &only, NULL);
    }
    if (!start()) {
        return 1;
    }
    SetCBCounterResetted(in_callback);
    turn(512);
    say("turns");
    if (is("keys later")) {
        _kbhit();
        say("keys");
    }
    if (is("takes") || is("keys and takes")) {
        return take_signals();
    }
    if (is("again")) {
        turn_again();
        return 0;
    }
    if (is("cancel")) {
        pthread_t thread;
        pthread_create(&thread, NULL, sleep_without_end, NULL);
        usleep(50000);
        pthread_cancel(thread);
        pthread_join(thread, NULL);
        say("cancelled");
    }
    if (is("memory")) {
        while (!is_pressed()) {
            Sleep(2);
        }
        take_all_memory();
        say("none left");
        for (;;) {
            pause();
        }
    }
    if (strstr(how, "in a callback")) {
        wait_until_pressed();
        StartCounterReset(device, TA_LOCAL, 0);
        for (;;) {
            pause();
        }
    }
    while (!is_pressed()) {
        Sleep(2);
        if (is("closed")) {
            say("What a program prints is not for its controller.");
        }
    }
#ifdef __GLIBC__
    if (is("quick_exit")) {
        quick_exit(3);
    }
#endif
    crash();
    return 0;
}
