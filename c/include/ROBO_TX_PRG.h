/* For programs that were downloaded to a ROBO TX: PrgInit and PrgTic, and what they need. */
#ifndef FT_ROBO_TX_PRG_H
#define FT_ROBO_TX_PRG_H

#include <math.h>
#include <stddef.h>

/* PrgTic is called once in this many milliseconds. */
#define CALL_CYCLE_MS 1

/* The version of the transfer area. */
#define TA_VERSION 0x08010101

/* Where the TX had the memory for a program; nothing is there today. */
#define PRG_MEM_START 0x30700000
#define PRG_MEM_SIZE 0x000D0000

/* With this number the code of a program began. */
#define PRG_MAGIC 0x336699AA

/* The most bytes of a frame for the display. */
#define MAX_FRAME_SIZE 1024

#ifndef MIN
#define MIN(a, b) (((a) <= (b)) ? (a) : (b))
#endif
#ifndef MAX
#define MAX(a, b) (((a) >= (b)) ? (a) : (b))
#endif

/* As plain numbers: programs that define these once more define them so. */
#undef TRUE
#define TRUE 1
#undef FALSE
#define FALSE 0

/* `bool` is an enumeration in C, unless the compiler or stdbool.h has its own. */
#ifndef __cplusplus
#if defined(__STDC_VERSION__) && __STDC_VERSION__ > 201710L
#include <stdbool.h>
#elif !defined(__bool_true_false_are_defined)
#if defined(bool) || defined(FT_BOOL_IS_INT)
#if !defined(false) && !defined(true)
enum { false = 0, true = 1 };
#endif
#elif !defined(false) && !defined(true)
typedef enum { false = 0, true = 1 } bool;
#define FT_BOOL_IS_ENUM
#else
typedef int bool;
#define FT_BOOL_IS_ENUM
#endif
#endif
#endif

#include "ROBO_TX_FW.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Commands to the Bluetooth module, for texts about them. */
enum bt_commands_e {
    CMD_NO_CMD = 0,
    CMD_CONNECT = 1,
    CMD_DISCONNECT = 2,
    CMD_START_LISTEN = 3,
    CMD_STOP_LISTEN = 4,
    CMD_START_RECEIVE = 5,
    CMD_STOP_RECEIVE = 6,
    CMD_SEND = 7
};

/* With this the code of a program began. Nothing reads it today; programs that bring their own dispatcher
   define one, with the address of a function as its entry, which fits into an `unsigned long`. */
struct prg_code_intro_s {
    unsigned long magic; /* PRG_MAGIC */
    FT_VER ta_version;   /* TA_VERSION */
    unsigned long entry;
};

/* The program has these two. PrgInit is called once, then PrgTic every millisecond until it returns
   something else than 0x7FFF: 0 when the program has ended well, or an error code. */
void PrgInit(TA *p_ta_array, int ta_count);
int PrgTic(TA *p_ta_array, int ta_count);

/* Programs that use Bluetooth bring these two in files of their own. */
extern UCHAR8 bt_address_table[BT_CNT_MAX][BT_ADDR_LEN];
BOOL32 BtDisplayCommandStatus(TA *p_ta, UCHAR8 *bt_address, UINT32 channel, enum bt_commands_e command,
                              CHAR8 command_status);

#ifdef __cplusplus
}
#endif

#endif
