/* FISH_X1_TRANSFER, the transfer area of one controller: 1024 bytes, laid out as on the TXT. Addresses in
   the controller's memory are numbers of 32 bits, that of a program's name is its four bytes. */
#ifndef FT_FISH_X1_H
#define FT_FISH_X1_H

#include "area_common.h"
#include "fish_x1_constants.h"

typedef char CCHAR8;

/* Names and versions. */
typedef union version_u {
    UINT32 abcd;
    struct {
        UCHAR8 a;
        UCHAR8 b;
        UCHAR8 c;
        UCHAR8 d;
    } part;
} FT_VERSION;

typedef struct shm_if_version_s {
    FT_VERSION hardware;
    FT_VERSION firmware;
    FT_VERSION shm_if;
    FT_VERSION fish_x1;
} FTX1_SHMVER;

typedef struct ftX1info_s {
    char hostname[HOSTNAME_LEN + 1];
    char btaddr[BLUETOOTH_ADR_LEN + 1];
    char dummy;
    UINT32 SharedMemoryStart;
    UINT32 AppAreaStart;
    UINT32 AppAreaSize;
    FTX1_SHMVER version;
} FTX1_SHMIFINFO;

/* State of the interface. Raise config_id by one after a change in ftX1config. */
typedef struct pgm_info_s {
    char name[4];
    UINT8 state;
    char dummy[3];
} PGM_INFO;

typedef struct ftX1state_s {
    BOOL8 init;
    BOOL8 config;
    char dummy[2];
    UINT32 trace;
    BOOL8 io_mode;
    UINT8 id;
    UINT8 info_id;
    UINT8 config_id;
    BOOL8 io_slave_alive[8];
    BT_STATUS btstatus[BT_CNT_MAX];
    PGM_INFO master_pgm;
    PGM_INFO local_pgm;
} FTX1_STATE;

/* What is plugged in. motor: 1 a motor, 0 two single outputs. cnt: 1 normal, 0 inverted. */
typedef struct uni_inp_config {
    UINT8 mode;
    BOOL8 digital;
    char dummy[2];
} UNI_CONFIG;

typedef struct cnt_inp_config {
    UINT8 mode;
    char dummy[3];
} CNT_CONFIG;

typedef struct ftX1config {
    UINT8 pgm_state_req;
    BOOL8 old_FtTransfer;
    char dummy[2];
    BOOL8 motor[4];
    UNI_CONFIG uni[8];
    CNT_CONFIG cnt[4];
    INT16 motor_config[4][4];
} FTX1_CONFIG;

/* Inputs. cnt_resetted and motor_ex_reached become 1 when a command is done; the ids are those of the last
   commands that are done. */
typedef struct ftX1input {
    INT16 uni[8];
    INT16 cnt_in[4];
    INT16 counter[4];
    INT16 display_button_left;
    INT16 display_button_right;
    BOOL16 cnt_resetted[4];
    BOOL16 motor_ex_reached[4];
    UINT16 cnt_reset_cmd_id[4];
    UINT16 motor_ex_cmd_id[4];
} FTX1_INPUT;

/* Outputs. master counts motors from 1. Raise an id by one to give a command. */
typedef struct ftX1output {
    UINT16 cnt_reset_cmd_id[4];
    UINT8 master[4];
    INT16 duty[8];
    UINT16 distance[4];
    UINT16 motor_ex_cmd_id[4];
} FTX1_OUTPUT;

/* The display of a ROBO TX, which a TXT online does not have. */
typedef struct display_msg_s {
    UINT8 id;
    char text[DISPL_MSG_LEN_MAX + 1];
} FTX1_MSG;

typedef struct shm_if_msgrec_s {
    FTX1_MSG display_msg;
} FTX1_MSGREC;

typedef struct display_frame_s {
    UINT32 frame;
    UINT16 id;
    BOOL16 is_pgm_master_of_display;
} FTX1_FRAME;

typedef struct _ftX1display {
    FTX1_MSG display_msg;
    FTX1_FRAME display_frame;
} FTX1_DISPLAY;

/* State of the transfer, what has changed, and the time since it began. */
typedef struct _transfer_status {
    UINT8 status;
    UINT8 iostatus;
    UINT16 ComErr;
} TRANSFER_STATUS;

typedef struct _change_state {
    UINT16 UpdInterface;
    UINT8 ChangeStatus;
    UINT8 ChangeUni;
    UINT8 ChangeCntIn;
    UINT8 ChangeCounter;
    UINT8 ChangeTimer;
    UINT8 reserved;
} CHANGE_STATE;

typedef struct _rp_timer {
    UINT16 Timer1ms;
    UINT16 Timer10ms;
    UINT16 Timer100ms;
    UINT16 Timer1s;
    UINT16 Timer10s;
    UINT16 Timer1min;
} RP_TIMER;

/* Parts that only a program of the controller itself used. All hooks are 0. */
typedef struct _motor {
    INT16 duty[8];
    INT16 debug[4];
} MOTOR;

typedef struct _input_sim {
    INT16 simButtons[2];
} INPUT_SIM;

typedef struct _hook_table {
    UINT32 IsRunAllowed;
    UINT32 GetSystemTime;
    UINT32 DisplayMsg;
    UINT32 IsDisplayBeingRefreshed;
    UINT32 BtConnect;
    UINT32 BtDisconnect;
    UINT32 BtSend;
    UINT32 BtStartReceive;
    UINT32 BtStopReceive;
    UINT32 BtStartListen;
    UINT32 BtStopListen;
    UINT32 BtAddrToStr;
    UINT32 I2cRead;
    UINT32 I2cWrite;
    UINT32 sprintf;
    UINT32 memcmp;
    UINT32 memcpy;
    UINT32 memmove;
    UINT32 memset;
    UINT32 strcat;
    UINT32 strncat;
    UINT32 strchr;
    UINT32 strrchr;
    UINT32 strcmp;
    UINT32 strncmp;
    UINT32 stricmp;
    UINT32 strnicmp;
    UINT32 strcpy;
    UINT32 strncpy;
    UINT32 strlen;
    UINT32 strstr;
    UINT32 strtok;
    UINT32 strupr;
    UINT32 strlwr;
    UINT32 atoi;
} HOOK_TABLE;

/* What a TXT has and a ROBO TX has not: infrared remotes, sounds, microphone. */
typedef struct _IR_DATA {
    INT16 i16JoyLeftX;
    UINT16 u16JoyLeftXtoLeft;
    UINT16 u16JoyLeftXtoRight;
    INT16 i16JoyLeftY;
    UINT16 u16JoyLeftYtoForward;
    UINT16 u16JoyLeftYtoBackwards;
    INT16 i16JoyRightX;
    UINT16 u16JoyRightXtoLeft;
    UINT16 u16JoyRightXtoRight;
    INT16 i16JoyRightY;
    UINT16 u16JoyRightYtoForward;
    UINT16 u16JoyRightYtoBackwards;
    UINT16 u16ButtonOn;
    UINT16 u16ButtonOff;
    UINT16 u16DipSwitch1;
    UINT16 u16DipSwitch2;
} KE_IR_INPUT_V01;

typedef struct _TXT_SPECIAL_INPUTS {
    UINT16 u16TxtPower;
    UINT16 u16TxtTemp;
    UINT16 u16TxtRef;
    UINT16 u16TxtVB;
    KE_IR_INPUT_V01 sIrInput[5];
    UINT16 u16SoundCmdId;
    UINT16 u16Sec;
    UINT16 u16Min;
    UINT16 u16Hour24;
    UINT16 u16Hour12;
    UINT16 u16PmFlag;
    UINT16 u16MDay;
    UINT16 u16Month;
    UINT16 u16Year;
    UINT16 u16WDay;
} TXT_SPECIAL_INPUTS;

typedef struct _TXT_SPECIAL_OUTPUTS {
    UINT16 u16SoundCmdId;
    UINT16 u16SoundIndex;
    UINT16 u16SoundRepeat;
    UINT8 u8LEDColorR;
    UINT8 u8LEDColorG;
    UINT8 u8LEDColorB;
    UINT8 dummy;
} TXT_SPECIAL_OUTPUTS;

typedef struct _TXT_SPECIAL_INPUTS_2 {
    UINT16 u16MicLin;
    UINT16 u16MicLog;
} TXT_SPECIAL_INPUTS_2;

/* What is left of the 1024 bytes. */
#define RESERVE_SIZE 158

typedef struct shm_if_s {
    FTX1_SHMIFINFO ftX1info;
    FTX1_STATE ftX1state;
    FTX1_CONFIG ftX1config;
    FTX1_INPUT ftX1in;
    FTX1_OUTPUT ftX1out;
    FTX1_DISPLAY ftX1display;
    TRANSFER_STATUS IFStatus;
    CHANGE_STATE IFChange;
    RP_TIMER IFTimer;
    MOTOR IFMotor;
    INPUT_SIM IFInputSim;
    HOOK_TABLE IFHookTable;
    TXT_SPECIAL_INPUTS sTxtInputs;
    TXT_SPECIAL_OUTPUTS sTxtOutputs;
    TXT_SPECIAL_INPUTS_2 sTxtInputs2;
    char reserved[RESERVE_SIZE];
} FISH_X1_TRANSFER;

#endif
