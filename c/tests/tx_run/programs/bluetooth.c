/* Each Bluetooth command is answered by its callback, between two tics. */
#include "ROBO_TX_PRG.h"

static int called, inside, wrong, tics;

static void done(TA *p_ta, BT_CB *p_data)
{
    wrong |= inside || p_data->status != BT_SWITCHED_OFF || p_data->chan_idx != called + 1;
    called += 1;
}

static void received(TA *p_ta, BT_RECV_CB *p_data)
{
    wrong |= inside || p_data->status != BT_SWITCHED_OFF || p_data->msg_len || p_data->chan_idx != called + 1;
    called += 1;
}

void PrgInit(TA *p_ta_array, int ta_count)
{
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA_HOOK_TABLE *hook = &p_ta_array[TA_LOCAL].hook_table;
    UCHAR8 address[BT_ADDR_LEN] = { 0 };

    inside = 1;
    if (!tics++) {
        hook->BtConnect(1, address, done);
        hook->BtDisconnect(2, done);
        hook->BtSend(3, 5, address, done);
        hook->BtStartReceive(4, received);
        hook->BtStopReceive(5, received);
        hook->BtStartListen(6, address, done);
        hook->BtStopListen(7, done);
        hook->BtStopListen(8, NULL);
        hook->BtSend(8, 5, NULL, NULL);
    } else if (called != 7 || wrong)
        return 1;
    inside = 0;
    return tics < 5 ? 0x7FFF : 0;
}
