/* Changes the configuration later than in PrgInit, and waits for a value of the new kind. */
#include "ROBO_TX_PRG.h"

static int tics;

void PrgInit(TA *p_ta_array, int ta_count)
{
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    if (++tics == 20) {
        p_ta->config.motor[2] = FALSE;
        p_ta->config.uni[1].mode = MODE_U;
        p_ta->config.uni[1].digital = FALSE;
        p_ta->config.cnt[2].mode = 1; /* inverted, a 0 on a TXT */;
        p_ta->state.config_id += 1;
    }
    return tics > 20 && p_ta->input.uni[1] == 4711 ? 0 : 0x7FFF;
}
