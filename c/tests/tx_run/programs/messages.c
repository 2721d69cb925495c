/* Messages on the displays. */
#include "ROBO_TX_PRG.h"

static int tics;

void PrgInit(TA *p_ta_array, int ta_count)
{
    p_ta_array[TA_LOCAL].hook_table.DisplayMsg(&p_ta_array[TA_LOCAL], "first");
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];
    char text[200];

    if (p_ta->hook_table.IsDisplayBeingRefreshed(p_ta))
        return 0x7FFF;
    switch (tics++) {
    case 0:
        p_ta->hook_table.DisplayMsg(p_ta, "line\nnext line");
        return 0x7FFF;
    case 1:
        p_ta->hook_table.DisplayMsg(&p_ta_array[TA_EXT_2], "20 \xB0" "C");
        return 0x7FFF;
    case 2:
        p_ta->hook_table.DisplayMsg(p_ta, NULL);
        return 0x7FFF;
    case 3:
        p_ta->hook_table.memset(text, 'x', 150);
        text[150] = 0;
        p_ta->hook_table.DisplayMsg(p_ta, text);
        return 0x7FFF;
    case 4:
        p_ta->hook_table.strcpy(p_ta->display.display_msg.text, "by hand");
        p_ta->display.display_msg.id += 1;
        return 0x7FFF;
    }
    return 0;
}
