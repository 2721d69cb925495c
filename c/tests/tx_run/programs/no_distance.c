/* M1 turns without a distance, is stopped, and then does one of 50 pulses, in the order of published programs. The flag
 * says that a target was reached, so only the distance may set it. */
#include "ROBO_TX_PRG.h"

static int step;

static void command(TA *p_ta, int duty, int distance)
{
    p_ta->output.duty[0] = duty;
    p_ta->output.distance[0] = distance;
    p_ta->output.motor_ex_cmd_id[0] += 1;
    step++;
}

void PrgInit(TA *p_ta_array, int ta_count)
{
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];

    switch (step) {
    case 0:
        command(p_ta, 512, 0);
        break;
    case 1:
        if (p_ta->input.motor_pos_reached[0])
            return 1;
        if (p_ta->input.counter[0] > 20) {
            p_ta->output.cnt_reset_cmd_id[0] += 1;
            command(p_ta, 0, 0);
        }
        break;
    case 2:
        /* It comes back with the command. */
        if (!p_ta->input.cnt_resetted[0])
            break;
        if (p_ta->input.motor_pos_reached[0])
            return 2;
        command(p_ta, 512, 50);
        break;
    default:
        if (p_ta->input.motor_pos_reached[0])
            return p_ta->input.counter[0] == 50 ? 0 : 3;
    }
    return 0x7FFF;
}
