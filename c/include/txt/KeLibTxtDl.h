/* The functions that a program for the TXT itself calls. The program runs on the PC, and its controller is
   the one that FT_TXT_HOST names: a host, a host and a port, or auto, which is also used without it. */
#ifndef FT_KELIBTXTDL_H
#define FT_KELIBTXTDL_H

#include <stdint.h>
#include <stdio.h>
#ifndef __cplusplus
#include <stdbool.h>
#endif

#include "FtShmem.h"

#define I2C_SPEED_100_KHZ 0
#define I2C_SPEED_400_KHZ 1

#define KELIB_ERROR_NONE 0x00000000L
#define KELIB_ERROR_UNDEFINED 0x00000001L
#define KELIB_ERROR_LIB_NOT_INIT 0x00000100L
#define KELIB_ERROR_ZERO_POINTER_VALUE 0x00001050L

#define KELIB_ERROR_I2C_OPEN_ERROR 0x00001701L
#define KELIB_ERROR_I2C_ADDR_ERROR 0x00001702L
#define KELIB_ERROR_I2C_READ_ERROR 0x00001703L
#define KELIB_ERROR_I2C_WRITE_ERROR 0x00001704L
#define KELIB_ERROR_I2C_WRITE_READ_ERROR 0x00001705L
#define KELIB_ERROR_I2C_SET_REG_ADR_ERROR 0x00001706L
#define KELIB_ERROR_I2C_WRONG_REG_SIZE_VAL 0x00001707L
#define KELIB_ERROR_I2C_WRONG_DATA_WIDTH 0x00001708L
#define KELIB_ERROR_I2C_SET_STOP_ERROR 0x00001709L
#define KELIB_ERROR_I2C_SET_SPEED_ERROR 0x0000170AL
#define KELIB_ERROR_I2C_WRONG_ERROR_MASK 0x0000170BL
#define KELIB_ERROR_I2C_SET_ADR_SIZE_10 0x0000170CL
#define KELIB_ERROR_I2C_SET_ADR_SIZE_7 0x0000170DL
#define KELIB_ERROR_I2C_NO_WRITE_NO_READ 0x0000170EL
#define KELIB_ERROR_I2C_COMMUNICATION 0x0000170FL

#define KELIB_IS_DLC_PROG 0x00001C01L
#define KELIB_IS_RPP_PROG 0x00001C02L
#define KELIB_ERROR_DLC_TXT_BUSY 0x00001C03L
#define KELIB_THREAD_NOT_STARTABLE 0x00001C04L

/* These have C++ linkage in C++. Compilers for Windows mangle names in other ways, so they use C linkage. */
#if defined(__cplusplus) && defined(_WIN32)
extern "C" {
#endif

/* Connects to the controller and begins to exchange, about 100 times a second, in a thread. */
uint32_t StartTxtDownloadProg(void);

/* Ends that with all motors off. The areas stay where they are. */
uint32_t StopTxtDownloadProg(void);

bool MotorIOLib_ThreadIsRunning(void);

/* Has this function called after each exchange, in the library's thread. What it writes into the areas goes
   out with the next one. When it returns false the motors stop, and the exchange ends. NULL takes it away. */
void SetTransferAreaCompleteCallback(bool (*callback)(FISH_X1_TRANSFER *areas, int count));

#if defined(__cplusplus) && defined(_WIN32)
}
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The nine areas; NULL before the start. */
FISH_X1_TRANSFER *GetKeLibTransferAreaMainAddress(void);

uint32_t InitI2C(void);

/* Writes to an I2C device, then reads from it. The TXT sets the clock itself. */
uint32_t KeLibI2cTransfer(uint8_t device, uint16_t n_write, uint8_t *write, uint16_t n_read, uint8_t *read,
                          uint16_t clock_400khz);

#ifdef __cplusplus
}
#endif

#endif
