/* What a ROBO TX, and headers of the TXT after it, tell callbacks about Bluetooth and I2C. */
#ifndef FT_CALLBACK_DATA_H
#define FT_CALLBACK_DATA_H

#include "area_common.h"

/* BT_STATUS.conn_state */
enum BtConnState {
    BT_STATE_IDLE = 0,
    BT_STATE_CONN_ONGOING = 1,
    BT_STATE_CONNECTED = 2,
    BT_STATE_DISC_ONGOING = 3
};

/* BT_SCAN_STATUS.status */
enum BtInquiryScanStatus {
    BT_INQUIRY_SCAN_NOT_POSSIBLE = 0,
    BT_INQUIRY_SCAN_START = 1,
    BT_INQUIRY_SCAN_RESULT = 2,
    BT_INQUIRY_SCAN_BUSY = 3,
    BT_INQUIRY_SCAN_TIMEOUT = 4,
    BT_INQUIRY_SCAN_END = 5
};

/* BT_CB.status, BT_RECV_CB.status */
enum CB_BtStatus {
    BT_SUCCESS = 0,
    BT_CON_EXIST = 1,
    BT_CON_SETUP = 2,
    BT_SWITCHED_OFF = 3,
    BT_ALL_CHAN_BUSY = 4,
    BT_NOT_ROBOTX = 5,
    BT_CON_TIMEOUT = 6,
    BT_CON_INVALID = 7,
    BT_CON_RELEASE = 8,
    BT_LISTEN_ACTIVE = 9,
    BT_RECEIVE_ACTIVE = 10,
    BT_CON_INDICATION = 11,
    BT_DISCON_INDICATION = 12,
    BT_MSG_INDICATION = 13,
    BT_CHANNEL_BUSY = 14,
    BT_BTADDR_BUSY = 15,
    BT_NO_LISTEN_ACTIVE = 16
};

/* I2C_CB.status */
enum CB_I2cStatus { I2C_SUCCESS = 0, I2C_READ_ERROR = 1, I2C_WRITE_ERROR = 2 };

/* What a search for Bluetooth devices finds. */
typedef struct bt_scan_status_s {
    UINT16 status;
    UCHAR8 bt_addr[BT_ADDR_LEN];
    char dummy_1[2];
    char bt_name[17];
    char dummy_2[3];
} BT_SCAN_STATUS;

/* What callbacks are told about a Bluetooth channel. */
typedef struct bt_cb_s {
    UINT16 chan_idx;
    UINT16 status;
} BT_CB;

/* The same with a message. */
typedef struct bt_receive_cb_s {
    UINT16 chan_idx;
    UINT16 status;
    UINT16 msg_len;
    UCHAR8 msg[BT_MSG_LEN];
} BT_RECV_CB;

/* What callbacks are told about an I2C transfer. */
typedef struct i2c_cb_s {
    UINT16 value;
    UINT16 status;
} I2C_CB;

#endif
