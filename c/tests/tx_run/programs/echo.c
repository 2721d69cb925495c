/* O1 is what I1 is. */
#include "ROBO_TX_PRG.h"

void PrgInit(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    p_ta->config.motor[0] = FALSE;
    p_ta->config.uni[0].mode = MODE_U;
    p_ta->config.uni[0].digital = FALSE;
    p_ta->state.config_id += 1;
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    p_ta->output.duty[0] = p_ta->input.uni[0];
    return 0x7FFF;
}
