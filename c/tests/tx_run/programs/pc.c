/* A PC program: turns M1 until I1 is pressed, and ends without a call for it. With DEAF it ignores Ctrl-C, and with
   DEFAULT it has no chance to stop the motor. With WAITS its end never comes, because a function of atexit waits, by a
   return from main, and with EXIT by a call. With FORK and DAEMON another process goes on when the first one has ended
   by `_exit`: one that only waits, and one that drives. With EXEC the first one becomes another program before it ends.
   With RENAMED and REMOVED the program's file has another name or none before the one that waits is made; with THREAD a
   thread waits there, and main has ended. With CHAIN it is a new one every 20 ms. With CONTROL it has a function for
   Ctrl-C that handles the first one. With KILLED it kills itself. With COMMAND it runs that for a long time. With HELPER
   a process that it has made before ignores SIGTERM, with LEAVE it kills itself when I1 is pressed. With
   STUBBORN it ignores Ctrl-Z. With CLOSES it closes all its files after a first transfer. With AGAIN it begins a
   transfer that has ended again. */
#ifdef THREAD
#include <pthread.h>
#endif
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <windows.h>
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"

static void wait_for_ever(void)
{
    for (;;)
        pause();
}

#ifdef THREAD
static void *wait_in_thread(void *unused)
{
    wait_for_ever();
    return unused;
}
#endif

#ifdef CONTROL
static BOOL WINAPI on_control(DWORD event)
{
    static int times;
    puts("asked");
    fflush(stdout);
    return event == CTRL_C_EVENT && ++times == 1;
}
#endif

int main(int argc, char *argv[])
{
    DWORD error = 0;
    HANDLE device;
    INT16 value = 0;
    BOOL32 overrun = 0;
#if defined(RENAMED) || defined(REMOVED)
    char file[1000] = "", other[1010];
#endif
#if defined(CHAIN) || defined(CLOSES)
    int i;
#endif

#ifdef DEAF
    signal(SIGINT, SIG_IGN);
#endif
#ifdef STUBBORN
    signal(SIGTSTP, SIG_IGN);
#endif
#ifdef CONTROL
    SetConsoleCtrlHandler(on_control, TRUE);
#endif
#ifdef DAEMON
    if (fork() != 0) {
        sleep(1);
        _exit(4);
    }
#endif
#ifdef HELPER
    if (fork() == 0) {
        FILE *number = fopen(getenv("HELPER"), "w");
        fprintf(number, "%d\n", (int)getpid());
        fclose(number);
        signal(SIGTERM, SIG_IGN);
        wait_for_ever();
    }
#endif
    ftxInitLib();
#ifdef CLOSES
    device = ftxOpenComDevice("COM4", 38400, &error);
    ftxStartTransferArea(device);
    ftxCloseDevice(device);
    for (i = 3; i < 1000; i++)
        close(i);
#endif
    device = ftxOpenComDevice("COM4", 38400, &error);
    if (device == NULL || ftxStartTransferArea(device) != FTLIB_ERR_SUCCESS)
        return 1;
    SetOutMotorValues(device, 0, 0, 300, 0);
#ifdef KILLED
    Sleep(100);
    kill(getpid(), SIGKILL);
#endif
#ifdef COMMAND
    printf("status %d\n", system("echo >\"$RUNS\"; exec sleep 20 >/dev/null 2>&1"));
#endif
#ifdef DEFAULT
    signal(SIGINT, SIG_DFL);
#endif
#ifdef RENAMED
    file[readlink("/proc/self/exe", file, sizeof file - 1)] = 0;
    rename(file, strcat(strcpy(other, file), ".old"));
#endif
#ifdef REMOVED
    file[readlink("/proc/self/exe", file, sizeof file - 1)] = 0;
    unlink(file);
#endif
#ifdef CHAIN
    if (fork() == 0)
        for (i = 0; i < 500; i++) {
            usleep(20000);
            if (fork() != 0)
                _exit(0);
        }
    Sleep(100);
    _exit(4);
#endif
#ifdef FORK
    if (fork() == 0) {
#ifdef THREAD
        pthread_t thread;
        pthread_create(&thread, NULL, wait_in_thread, NULL);
        pthread_exit(NULL);
#endif
        wait_for_ever();
    }
    Sleep(100);
#ifdef EXEC
    execlp("sh", "sh", "-c", "sleep 1; exit 4", NULL);
#endif
    _exit(4);
#endif
    while (value == 0) {
        GetInIOValue(device, 0, 0, &value, &overrun);
#ifdef AGAIN
        if (ftxStartTransferArea(device) == FTLIB_ERR_SUCCESS)
            SetOutMotorValues(device, 0, 0, 300, 0);
#endif
        Sleep(2);
    }
#ifdef LEAVE
    kill(getpid(), SIGKILL);
#endif
#ifdef WAITS
    atexit(wait_for_ever);
#endif
#ifdef EXIT
    exit(3);
#endif
    return 3;
}
