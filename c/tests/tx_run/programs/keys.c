/* A PC program that asks for keys, and does not put the terminal's settings back: KILLED and LEFT end it by themselves,
   BEHIND ends it in the background, otherwise it ignores Ctrl-C. */
#include <signal.h>
#include <stdio.h>
#include <unistd.h>
#include <conio.h>
#include <windows.h>
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"

int main(int argc, char *argv[])
{
    signal(SIGINT, SIG_IGN);
    while (!_kbhit()) {
        puts("no key");
        fflush(stdout);
        Sleep(20);
    }
#ifdef KILLED
    raise(SIGKILL);
#endif
#ifdef BEHIND
    setpgid(0, 0);
    return 5;
#endif
#ifdef LEFT
    _exit(4);
#endif
    puts("goes on");
    fflush(stdout);
    for (;;)
        pause();
}
