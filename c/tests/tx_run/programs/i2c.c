/* Writes and reads a device, asks one that is not there, and with wrong flags. */
#include "ROBO_TX_PRG.h"
#include "ftErrCode.h"

/* 8 bits of address, 16 bits of data with the high byte first. */
#define WIDE 0x09

static int step, inside, wrong;
static I2C_CB result;
static int called;

static void done(TA *p_ta, I2C_CB *p_data)
{
    wrong |= inside || p_ta->state.id != TA_LOCAL;
    result = *p_data;
    called += 1;
}

static UINT32 begin(TA *p_ta)
{
    TA_HOOK_TABLE *hook = &p_ta->hook_table;

    switch (step) {
    case 0:
        return hook->I2cRead(0x18, 5, WIDE, done);
    case 1:
        return hook->I2cWrite(0x18, 5, 0x5678, WIDE, done);
    case 2:
        return hook->I2cRead(0x18, 5, 0x0D, done);
    default:
        return hook->I2cRead(0x19, 5, WIDE, done);
    }
}

void PrgInit(TA *p_ta_array, int ta_count)
{
    TA *p_ta = &p_ta_array[TA_LOCAL];
    TA_HOOK_TABLE *hook = &p_ta->hook_table;

    wrong = hook->I2cRead(80, 5, WIDE, done) != FTLIB_I2C_INVALID_DEV_ADDR
            || hook->I2cRead(0x18, 5, 0x01, done) != FTLIB_I2C_C_INVALID_FLAGS_DATAMODE
            || hook->I2cWrite(0x18, 5, 1, 0x65, done) != FTLIB_I2C_C_INVALID_FLAGS_ERRMODE
            || begin(p_ta) != FTLIB_ERR_SUCCESS;
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    static const UINT16 value[4] = { 0x1234, 0, 0x7856, 0 };
    static const UINT16 status[4] = { I2C_SUCCESS, I2C_SUCCESS, I2C_SUCCESS, I2C_READ_ERROR };

    if (wrong)
        return 1;
    inside = 1;
    if (called > step) {
        if (result.status != status[step] || (value[step] && result.value != value[step]))
            return 10 + step;
        if (++step == 4)
            return 0;
        if (begin(&p_ta_array[TA_LOCAL]) != FTLIB_ERR_SUCCESS)
            return 2;
    }
    inside = 0;
    return 0x7FFF;
}
