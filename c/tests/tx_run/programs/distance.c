/* M1 and M2 turn 100 pulses together, twice. */
#include "ROBO_TX_PRG.h"

static int running, done;

void PrgInit(TA *p_ta_array, int ta_count)
{
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    if (running) {
        if (!p_ta->input.motor_pos_reached[0] || !p_ta->input.motor_pos_reached[1])
            return 0x7FFF;
        running = 0;
        p_ta->output.duty[0] = p_ta->output.duty[2] = 0;
        if (p_ta->input.counter[0] != 100 || p_ta->input.counter[1] != 100)
            return 1;
        return ++done == 2 ? 0 : 0x7FFF;
    }
    running = 1;
    p_ta->input.motor_pos_reached[0] = p_ta->input.motor_pos_reached[1] = 0;
    p_ta->output.distance[0] = p_ta->output.distance[1] = 100;
    p_ta->output.master[1] = 1;
    p_ta->output.duty[0] = p_ta->output.duty[2] = 512;
    p_ta->output.motor_ex_cmd_id[0] += 1;
    p_ta->output.motor_ex_cmd_id[1] += 1;
    return 0x7FFF;
}
