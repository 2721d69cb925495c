/* Turns M1 until I1 is pressed. */
#include "ROBO_TX_PRG.h"

void PrgInit(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    p_ta->config.motor[0] = TRUE;
    p_ta->config.uni[0].mode = MODE_R;
    p_ta->config.uni[0].digital = TRUE;
    p_ta->state.config_id += 1;
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    if (p_ta->input.uni[0])
        return 0;
    p_ta->output.duty[0] = 400;
    p_ta->output.duty[1] = 0;
    return 0x7FFF;
}
