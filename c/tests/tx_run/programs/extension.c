/* Drives the first extension while it is there, and ends when it has gone. */
#include "ROBO_TX_PRG.h"

static int was_there;

void PrgInit(TA *p_ta_array, int ta_count)
{
    p_ta_array[TA_LOCAL].output.duty[7] = 512;
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    int state = p_ta_array[TA_LOCAL].state.ext_dev_connect_state[0];

    if (ta_count != TA_COUNT)
        return 1;
    if (state == EXT_DEV_ONLINE) {
        was_there = 1;
        p_ta_array[TA_EXT_1].output.duty[0] = 300;
    } else if (was_there)
        return 0;
    return 0x7FFF;
}
