/* The transfer area of a ROBO TX, as its firmware 1.30 has it.
 *
 * With 32-bit pointers `TA` has 1024 bytes and each field its old place. With 64-bit pointers the fields
 * behind the first pointer lie further back; names and types are the same. */
#ifndef FT_ROBO_TX_FW_H
#define FT_ROBO_TX_FW_H

#include "detail/area_common.h"
#include "detail/callback_data.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How many of each a controller has. */
#define N_CNT 4
#define N_PWM_CHAN 8
#define N_MOTOR 4
#define N_UNI 8

/* Lengths of texts, without the 0 at the end. */
#define DEV_NAME_LEN_MAX 16
#define BT_ADDR_STR_LEN 17

/* Indices of the areas: the controller itself, then its extensions. */
enum ta_id_e {
    TA_LOCAL = 0,
    TA_EXT_1 = 1,
    TA_EXT_2 = 2,
    TA_EXT_3 = 3,
    TA_EXT_4 = 4,
    TA_EXT_5 = 5,
    TA_EXT_6 = 6,
    TA_EXT_7 = 7,
    TA_EXT_8 = 8,
    TA_COUNT = 9
};

/* Extensions. */
#define N_EXT (TA_COUNT - 1)

/* TA_STATE.dev_mode */
enum dev_mode_e { DEV_MODE_LOCAL = 0, DEV_MODE_ONLINE = 1, DEV_MODE_INVALID = 2 };

/* TA_STATE.ext_dev_connect_state */
enum ext_dev_connect_state_e { EXT_DEV_OFFLINE = 0, EXT_DEV_ONLINE = 1, EXT_DEV_INVALID = 2 };

/* UNI_CONFIG.mode */
enum input_mode_e { MODE_U = 0, MODE_R = 1, MODE_ULTRASONIC = 3, MODE_INVALID = 4 };

/* PGM_INFO.state, TA_CONFIG.pgm_state_req */
enum pgm_state_e { PGM_STATE_INVALID = 0, PGM_STATE_RUN = 1, PGM_STATE_STOP = 2 };

struct ta_s;

/* Callbacks of downloaded programs, with the area of the controller that the program runs on. */
typedef void (*P_CB_FUNC)(struct ta_s *p_ta, BT_CB *p_data);
typedef void (*P_RECV_CB_FUNC)(struct ta_s *p_ta, BT_RECV_CB *p_data);
typedef void (*P_I2C_CB_FUNC)(struct ta_s *p_ta, I2C_CB *p_data);

/* The program in the controller's memory. */
typedef struct pgm_info_s {
    char *name;
    UINT8 state;
    char reserved[3];
} PGM_INFO;

/* A message in front of the display; a new id shows it. */
typedef struct display_msg_s {
    UINT8 id;
    char text[DISPL_MSG_LEN_MAX + 1];
} DISPLAY_MSG;

/* A picture of 128 x 64 points; a new id shows it. The program is master of the display by adding 1 to
   is_pgm_master_of_display, and gives it back by subtracting 1. */
typedef struct display_frame_s {
    UCHAR8 *frame;
    UINT16 id;
    BOOL16 is_pgm_master_of_display;
} DISPLAY_FRAME;

/* A version of four numbers. */
typedef union ft_ver_u {
    UINT32 abcd;
    struct {
        UCHAR8 a;
        UCHAR8 b;
        UCHAR8 c;
        UCHAR8 d;
    } part;
} FT_VER;

/* Versions of the controller's parts. */
typedef struct ft_version_s {
    FT_VER hardware;
    FT_VER firmware;
    FT_VER ta;
    char reserved[4];
} FT_VERSION;

/* What a controller tells about itself. */
typedef struct ta_info_s {
    char device_name[DEV_NAME_LEN_MAX + 1];
    char bt_addr[BT_ADDR_STR_LEN + 1];
    char reserved;
    UINT32 ta_array_start_addr;
    UINT32 pgm_area_start_addr;
    UINT32 pgm_area_size;
    FT_VERSION version;
} TA_INFO;

/* What a controller does at present. A program adds 1 to config_id when it has changed `config`. */
typedef struct ta_state_s {
    BOOL8 pgm_initialized;
    char reserved_1[7];
    BOOL8 dev_mode;
    UINT8 id;
    UINT8 info_id;
    UINT8 config_id;
    BOOL8 ext_dev_connect_state[N_EXT];
    BT_STATUS btstatus[BT_CNT_MAX];
    char reserved_2[8];
    PGM_INFO local_pgm;
} TA_STATE;

/* What is connected to a universal input. */
typedef struct uni_config_s {
    UINT8 mode;
    BOOL8 digital;
    char reserved[2];
} UNI_CONFIG;

/* Which edge a counter counts: 0 from 0 to 1, 1 from 1 to 0. */
typedef struct cnt_config_s {
    UINT8 mode;
    char reserved[3];
} CNT_CONFIG;

/* What is connected to a controller. `motor`: not 0 for a motor, 0 for two single outputs. */
typedef struct ta_config_s {
    UINT8 pgm_state_req;
    char reserved_1[3];
    BOOL8 motor[N_MOTOR];
    UNI_CONFIG uni[N_UNI];
    CNT_CONFIG cnt[N_CNT];
    char reserved_2[32];
} TA_CONFIG;

/* What a controller measures. The buttons tell for how many milliseconds they have been pressed. */
typedef struct ta_input_s {
    INT16 uni[N_UNI];
    INT16 cnt_in[N_CNT];
    INT16 counter[N_CNT];
    INT16 display_button_left;
    INT16 display_button_right;
    BOOL16 cnt_resetted[N_CNT];
    BOOL16 motor_pos_reached[N_MOTOR];
    char reserved[16];
} TA_INPUT;

/* What a controller is to do. A counter is reset by adding 1 to its command id, a motor takes up its
   distance by adding 1 to its command id. `master` is 1 more than the index of the motor to follow, or 0. */
typedef struct ta_output_s {
    UINT16 cnt_reset_cmd_id[N_CNT];
    UINT8 master[N_MOTOR];
    INT16 duty[N_PWM_CHAN];
    UINT16 distance[N_MOTOR];
    UINT16 motor_ex_cmd_id[N_MOTOR];
} TA_OUTPUT;

/* The display. */
typedef struct ta_display_s {
    DISPLAY_MSG display_msg;
    DISPLAY_FRAME display_frame;
} TA_DISPLAY;

/* For PC programs: whether the area is exchanged, TA_STATUS_STOP to TA_STATUS_SYNC. */
typedef struct ta_status_s {
    UINT8 status;
    UINT8 iostatus;
    UINT16 ComErr;
} TA_STATUS;

/* For PC programs: what the last exchange has changed, a bit for each input. */
typedef struct ta_change_s {
    char reserved_1[2];
    UINT8 ChangeStatus;
    UINT8 ChangeUni;
    UINT8 ChangeCntIn;
    UINT8 ChangeCounter;
    char reserved_2[2];
} TA_CHANGE;

/* Timers that count on by themselves. */
typedef struct ta_timer_s {
    UINT16 Timer1ms;
    UINT16 Timer10ms;
    UINT16 Timer100ms;
    UINT16 Timer1s;
    UINT16 Timer10s;
    UINT16 Timer1min;
} TA_TIMER;

/* Some systems have the C library's functions as macros too, which would take the names of the fields. */
#undef sprintf
#undef memcmp
#undef memcpy
#undef memmove
#undef memset
#undef strcat
#undef strncat
#undef strchr
#undef strrchr
#undef strcmp
#undef strncmp
#undef stricmp
#undef strnicmp
#undef strcpy
#undef strncpy
#undef strlen
#undef strstr
#undef strtok
#undef strupr
#undef strlwr
#undef atoi

/* The functions that a downloaded program finds on the controller. */
typedef struct ta_hook_table_s {
    /* The program must end as soon as this is 0. */
    BOOL32 (*IsRunAllowed)(void);
    /* The time since the controller was switched on. */
    UINT32 (*GetSystemTime)(enum TimerUnit unit);
    /* Shows a message on the controller's display; NULL takes all messages away. */
    void (*DisplayMsg)(struct ta_s *p_ta, char *p_msg);
    /* Not 0 while the display still takes up what is new. */
    BOOL32 (*IsDisplayBeingRefreshed)(struct ta_s *p_ta);

    /* Bluetooth; what comes of it is reported by callback, unless that is NULL. */
    void (*BtConnect)(UINT32 channel, UCHAR8 *btaddr, P_CB_FUNC p_cb_func);
    void (*BtDisconnect)(UINT32 channel, P_CB_FUNC p_cb_func);
    void (*BtSend)(UINT32 channel, UINT32 len, UCHAR8 *p_msg, P_CB_FUNC p_cb_func);
    void (*BtStartReceive)(UINT32 channel, P_RECV_CB_FUNC p_cb_func);
    void (*BtStopReceive)(UINT32 channel, P_RECV_CB_FUNC p_cb_func);
    void (*BtStartListen)(UINT32 channel, UCHAR8 *btaddr, P_CB_FUNC p_cb_func);
    void (*BtStopListen)(UINT32 channel, P_CB_FUNC p_cb_func);
    /* Writes an address as xx:xx:xx:xx:xx:xx and returns `str`. */
    char *(*BtAddrToStr)(UCHAR8 *btaddr, char *str);

    /* I2C: returns whether the transfer begins; its result is reported by callback. */
    UINT32 (*I2cRead)(UCHAR8 devaddr, UINT32 offset, UCHAR8 protocol, P_I2C_CB_FUNC p_cb_func);
    UINT32 (*I2cWrite)(UCHAR8 devaddr, UINT32 offset, UINT16 data, UCHAR8 protocol,
                       P_I2C_CB_FUNC p_cb_func);

    /* As in the C library; stricmp and strnicmp take upper and lower case as the same. */
    INT32 (*sprintf)(char *s, const char *format, ...);
    INT32 (*memcmp)(const void *s1, const void *s2, UINT32 n);
    void *(*memcpy)(void *s1, const void *s2, UINT32 n);
    void *(*memmove)(void *s1, const void *s2, UINT32 n);
    void *(*memset)(void *s, INT32 c, UINT32 n);
    char *(*strcat)(char *s1, const char *s2);
    char *(*strncat)(char *s1, const char *s2, UINT32 n);
    char *(*strchr)(const char *s, INT32 c);
    char *(*strrchr)(const char *s, INT32 c);
    INT32 (*strcmp)(const char *s1, const char *s2);
    INT32 (*strncmp)(const char *s1, const char *s2, UINT32 n);
    INT32 (*stricmp)(const char *s1, const char *s2);
    INT32 (*strnicmp)(const char *s1, const char *s2, UINT32 n);
    char *(*strcpy)(char *s1, const char *s2);
    char *(*strncpy)(char *s1, const char *s2, UINT32 n);
    UINT32 (*strlen)(const char *s);
    char *(*strstr)(const char *s1, const char *s2);
    char *(*strtok)(char *s1, const char *s2);
    char *(*strupr)(char *s);
    char *(*strlwr)(char *s);
    INT32 (*atoi)(const char *nptr);

    /* Of later firmware: the address of the Bluetooth device that was registered with the controller. */
    void (*GetExtBtDevAddr)(UCHAR8 *btaddr);
} TA_HOOK_TABLE;

/* The transfer area of one controller. */
typedef struct ta_s {
    TA_INFO info;
    TA_STATE state;
    TA_CONFIG config;
    TA_INPUT input;
    TA_OUTPUT output;
    TA_DISPLAY display;
    TA_STATUS status;
    TA_CHANGE change;
    TA_TIMER timer;
    char reserved_1[28];
    TA_HOOK_TABLE hook_table;
    char reserved_2[356];
} TA;

#ifdef __cplusplus
}
#endif

#endif
