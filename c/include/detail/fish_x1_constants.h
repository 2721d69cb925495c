/* Constants that all headers with FISH_X1_TRANSFER have in common. */
#ifndef FT_FISH_X1_CONSTANTS_H
#define FT_FISH_X1_CONSTANTS_H

/* Values of universal inputs: ohm with 5 kilohm at most, ohm with 15 kilohm at most, millivolt, centimetre.
   OVR is over range. */
#define R_MIN 10
#define R_MAX 4999
#define R_OVR 5000
#define R2_MIN 30
#define R2_MAX 14999
#define R2_OVR 15000
#define U_MIN 0
#define U_MAX 9999
#define U_OVR 10000
#define ULTRASONIC_MIN 2
#define ULTRASONIC_MAX 1023
#define ULTRASONIC_OVR 1024
#define NO_ULTRASONIC 4096

#define DUTY_MIN 0
#define DUTY_MAX 512

#define INVALID_VALUE -32768

#define SLAVE_OFFLINE 0
#define SLAVE_ONLINE 1

/* Lengths of texts, without the 0 at their end. */
#define HOSTNAME_LEN 16
#define BLUETOOTH_ADR_LEN 17
#define DISPL_MSG_LEN_MAX 98
#define VERSION_STRLEN 15

#define BT_CNT_MAX 8
#define BT_CHAN_IDX_MIN 1
#define BT_CHAN_IDX_MAX 8
#define BT_ADDR_LEN 6
#define BT_MSG_LEN 16

enum IFBusAdr {
    BUS_ADR_INVALID = 0,
    BUS_ADR_WILDCARD,
    BUS_ADR_MASTER,
    BUS_ADR_SLAVE1,
    BUS_ADR_SLAVE2,
    BUS_ADR_SLAVE3,
    BUS_ADR_SLAVE4,
    BUS_ADR_SLAVE5,
    BUS_ADR_SLAVE6,
    BUS_ADR_SLAVE7,
    BUS_ADR_SLAVE8
};

enum PgmState { PGM_STATE_INVALID = 0, PGM_STATE_RUN, PGM_STATE_STOP };

enum TimerUnit {
    TIMER_UNIT_INVALID = 0,
    TIMER_UNIT_SECONDS = 2,
    TIMER_UNIT_MILLISECONDS = 3,
    TIMER_UNIT_MICROSECONDS = 4
};

#endif
