/* Reads a device that is not there, fifty times. */
#include "ROBO_TX_PRG.h"

static int waits, count;

static void done(TA *p_ta, I2C_CB *p_data)
{
    waits = 0;
    count += p_data->status == I2C_READ_ERROR;
}

void PrgInit(TA *p_ta_array, int ta_count)
{
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    if (count == 50)
        return 0;
    if (!waits) {
        waits = 1;
        p_ta_array[TA_LOCAL].hook_table.I2cRead(0x19, 5, 0x05, done);
    }
    return 0x7FFF;
}
