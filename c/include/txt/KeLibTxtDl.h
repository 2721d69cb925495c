/* The functions that a program for the TXT itself calls. The program runs on the PC, and its controller is
   the one that FT_TXT_HOST names: a host, a host and a port, or auto, which is also used without it. */
#ifndef FT_KELIBTXTDL_H
#define FT_KELIBTXTDL_H

#include <stdint.h>
#include <stdio.h>
#ifndef __cplusplus
#include <stdbool.h>
#endif

#include "../detail/kelib_errors.h"
#include "FtShmem.h"

#define I2C_SPEED_100_KHZ 0
#define I2C_SPEED_400_KHZ 1

/* These have C++ linkage in C++. Compilers for Windows mangle names in other ways, so they use C linkage. */
#if defined(__cplusplus) && defined(_WIN32)
extern "C" {
#endif

/* Connects to the controller and begins to exchange, about 100 times a second, in a thread. 0 also when it
   does so already. All areas are 0 then. */
uint32_t StartTxtDownloadProg(void);

/* Ends that with all motors off, and I2C, and takes the callback away. Always 1. */
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

/* The nine areas, which stay where they are, also before the start. */
FISH_X1_TRANSFER *GetKeLibTransferAreaMainAddress(void);

/* Makes I2C possible until StopTxtDownloadProg. */
uint32_t InitI2C(void);

/* Writes to an I2C device, then reads from it. The TXT sets the clock itself. */
uint32_t KeLibI2cTransfer(uint8_t device, uint16_t n_write, uint8_t *write, uint16_t n_read, uint8_t *read,
                          uint16_t clock_400khz);

#ifdef __cplusplus
}
#endif

#endif
