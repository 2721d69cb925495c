/* Constants that all headers with FISH_X1_TRANSFER have in common. */
#ifndef FT_FISH_X1_CONSTANTS_H
#define FT_FISH_X1_CONSTANTS_H

/* Values of universal inputs: ohm with 15 kilohm at most. OVR is over range. */
#define R2_MIN 30
#define R2_MAX 14999
#define R2_OVR 15000

#define INVALID_VALUE -32768

#define SLAVE_OFFLINE 0
#define SLAVE_ONLINE 1

/* Lengths of texts, without the 0 at their end. */
#define HOSTNAME_LEN 16
#define BLUETOOTH_ADR_LEN 17
#define VERSION_STRLEN 15

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

#endif
