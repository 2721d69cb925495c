/* Counts the tics in two seconds, and prints how many they are in one. */
#include <stdio.h>
#include <string.h>
#include "ROBO_TX_PRG.h"

static int initialized, tics, inside;
static UINT32 begin;
static UINT16 timer;

void PrgInit(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    initialized = !p_ta->state.pgm_initialized && ta_count == TA_COUNT;
    timer = p_ta->timer.Timer1ms;
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];
    UINT32 now = p_ta->hook_table.GetSystemTime(TIMER_UNIT_MILLISECONDS);

    if (!initialized || !p_ta->state.pgm_initialized || ta_count != TA_COUNT || inside++)
        return 1;
    if (p_ta->state.dev_mode != DEV_MODE_LOCAL || p_ta->state.id != TA_LOCAL)
        return 2;
    if (strcmp(p_ta->info.device_name, "TX-2009") || p_ta->info.version.ta.abcd != TA_VERSION)
        return 3;
    if (p_ta->state.local_pgm.state != PGM_STATE_RUN || strcmp(p_ta->state.local_pgm.name, "tics"))
        return 4;
    if (p_ta_array[TA_EXT_8].state.id != TA_EXT_8 || !p_ta_array[TA_EXT_8].hook_table.atoi)
        return 5;
    inside = 0;
    if (!tics++)
        begin = now;
    if (now - begin < 2000)
        return 0x7FFF;
    if ((UINT16)(p_ta->timer.Timer1ms - timer) < 1900)
        return 6;
    printf("%g\n", (tics - 1) * 1000.0 / (now - begin));
    return 0;
}
