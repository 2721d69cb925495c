/* Turns M1, and shows messages without end, or with PRINTS prints without end. It leaves its number in a file. */
#include <stdio.h>
#include <unistd.h>
#include "ROBO_TX_PRG.h"

void PrgInit(TA *p_ta_array, int ta_count)
{
    FILE *file = fopen("number", "w");

    fprintf(file, "%d\n", (int)getpid());
    fclose(file);
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];
    const char *text = "It turns and turns and turns and turns and turns and turns and turns and turns.";
    int i;

    p_ta->output.duty[0] = 512;
    for (i = 0; i < 20; i++)
#ifdef PRINTS
        puts(text);
#else
        p_ta->hook_table.DisplayMsg(p_ta, (char *)text);
#endif
    return 0x7FFF;
}
