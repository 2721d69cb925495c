/* Turns M1 until I1 is pressed, and then ends in one of many ways. */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#include "ROBO_TX_PRG.h"

static volatile int zero;

#ifdef AFTER_CRASH
__attribute__((destructor)) static void after(void)
{
    *(volatile int *)8 = 1;
}
#endif
#ifdef AFTER_HANG
__attribute__((destructor)) static void after(void)
{
    for (;;)
        ;
}
#endif

static void crash(TA *p_ta, BT_CB *p_data)
{
    *(volatile int *)8 = 1;
}

static int deep(int depth)
{
    volatile char room[1000];

    room[0] = (char)depth;
    return deep(depth + 1) + room[0];
}

void PrgInit(TA *p_ta_array, int ta_count)
{
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    p_ta->output.duty[0] = 512;
    if (!p_ta->input.uni[0])
        return 0x7FFF;
#ifdef CODE
    return CODE;
#endif
#if defined(AFTER_CRASH) || defined(AFTER_HANG)
    return 0;
#endif
#ifdef LEAVE
    LEAVE;
#endif
#ifdef POINTER
    *(volatile int *)8 = 1;
#endif
#ifdef DIVISION
    zero = 5 / zero;
#endif
#ifdef ABORT
    abort();
#endif
#ifdef TRAP
    raise(TRAP);
#endif
#ifdef EXIT
    exit(0);
#endif
#ifdef STACK
    return deep(1);
#endif
#ifdef HANG
    if (getenv("HANGS"))
        fclose(fopen(getenv("HANGS"), "w"));
    for (;;)
        ;
#endif
#ifdef ALLOWED
    while (p_ta->hook_table.IsRunAllowed())
        ;
#endif
#ifdef CALLBACK
    p_ta->hook_table.BtDisconnect(1, crash);
#endif
#ifdef HEAP
    {
        char *bytes = malloc(100);
        int i;
        for (i = -64; i < 200; i++)
            bytes[i] = 0x41;
        for (i = 0; i < 1000; i++)
            free(malloc(i));
        abort();
    }
#endif
    return 0x7FFF;
}
