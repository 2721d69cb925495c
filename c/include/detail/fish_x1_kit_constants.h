/* Constants that programs of kit 4.1.6 and programs for the TXT itself have in common. FtTxtLib has its own. */
#ifndef FT_FISH_X1_KIT_CONSTANTS_H
#define FT_FISH_X1_KIT_CONSTANTS_H

#define FIRMWARE_VER 0x011E

/* How many counters, outputs, motors, universal inputs and infrared remotes one controller has. */
#define IZ_COUNTER 4
#define IZ_PWM_CHAN 8
#define IZ_MOTOR 4
#define IZ_UNI_INPUT 8
#define IZ_IR_RECEIVER 4
#define NUM_OF_IR_RECEIVER 4

/* A controller and one extension. */
#define NUM_OF_TXT_MODULES 2

/* The areas: that of the controller itself, and those of its extensions. */
enum ShmIfId {
    LOCAL_IO = 0,
    REMOTE_IO_1,
    REMOTE_IO_2,
    REMOTE_IO_3,
    REMOTE_IO_4,
    REMOTE_IO_5,
    REMOTE_IO_6,
    REMOTE_IO_7,
    REMOTE_IO_8,
    SHM_IF_CNT
};

#define SLAVE_CNT_MAX (SHM_IF_CNT - 1)
#define IF08_MAX SHM_IF_CNT

/* What a universal input measures: volt, ohm, ohm up to 15 kilohm, distance. */
enum InputMode { MODE_U = 0, MODE_R, MODE_R2, MODE_ULTRASONIC, MODE_INVALID };

/* Indices in sIrInput: any remote, or one by its two DIP switches. */
#define IR_RECEIVER_IDX_ALL_DATA 0
#define IR_RECEIVER_IDX_OFF_OFF 1
#define IR_RECEIVER_IDX_ON_OFF 2
#define IR_RECEIVER_IDX_OFF_ON 3
#define IR_RECEIVER_IDX_ON_ON 4

#endif
