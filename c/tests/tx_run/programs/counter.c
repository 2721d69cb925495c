/* Resets C2 and waits for the flag. */
#include "ROBO_TX_PRG.h"

static int started;

void PrgInit(TA *p_ta_array, int ta_count)
{
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    if (!started) {
        if (p_ta->input.counter[1] != 8)
            return 0x7FFF;
        started = 1;
        p_ta->input.cnt_resetted[1] = 0;
        p_ta->output.cnt_reset_cmd_id[1] += 1;
        return 0x7FFF;
    }
    if (p_ta->input.cnt_resetted[1] != 1)
        return 0x7FFF;
    if (p_ta->input.cnt_resetted[0] != 0)
        return 2;
    return p_ta->input.counter[1] == 0 && p_ta->input.counter[0] == 7 ? 0 : 1;
}
