/* Constants and structures that the headers of a ROBO TX and of a TXT have in common. */
#ifndef FT_AREA_COMMON_H
#define FT_AREA_COMMON_H

#include "ft_types.h"

/* Values of universal inputs: ohm with 5 kilohm at most, millivolt, centimetre. OVR is over range. */
#define R_MIN 10
#define R_MAX 4999
#define R_OVR 5000
#define U_MIN 0
#define U_MAX 9999
#define U_OVR 10000
#define ULTRASONIC_MIN 2
#define ULTRASONIC_MAX 1023
#define ULTRASONIC_OVR 1024
#define NO_ULTRASONIC 4096

/* Duties of the outputs. */
#define DUTY_MIN 0
#define DUTY_MAX 512

/* The length of a message on the display, without the 0 at its end. */
#define DISPL_MSG_LEN_MAX 98

/* Bluetooth: channels, counted from 1, and lengths of an address and of a message. */
#define BT_CNT_MAX 8
#define BT_CHAN_IDX_MIN 1
#define BT_CHAN_IDX_MAX 8
#define BT_ADDR_LEN 6
#define BT_MSG_LEN 16

enum TimerUnit {
    TIMER_UNIT_INVALID = 0,
    TIMER_UNIT_SECONDS = 2,
    TIMER_UNIT_MILLISECONDS = 3,
    TIMER_UNIT_MICROSECONDS = 4
};

/* A Bluetooth channel. */
typedef struct btstatus_s {
    UINT16 conn_state;
    BOOL16 is_listen;
    BOOL16 is_receive;
    UINT16 link_quality;
} BT_STATUS;

#endif
