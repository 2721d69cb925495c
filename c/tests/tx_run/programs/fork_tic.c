/* Makes a process of itself in PrgTic, and prints how that has ended. */
#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>
#include "ROBO_TX_PRG.h"

void PrgInit(TA *p_ta_array, int ta_count)
{
    (void)p_ta_array, (void)ta_count;
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    int status = 0;
    pid_t child = fork();

    (void)p_ta_array, (void)ta_count;
    if (child != 0) {
        waitpid(child, &status, 0);
        printf("ended with %d\n", WEXITSTATUS(status));
        return 0;
    }
    return 0x7FFF;
}
