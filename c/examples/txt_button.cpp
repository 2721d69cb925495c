// M1 runs while I1 is pressed. It ends after three presses.
// A program that was downloaded to a TXT, with a main and a callback.
//
//   I1  button
//   M1  motor
//
//   cargo run --bin tx_run -- c/examples/txt_button.cpp --world default       (a simulated TXT)
//   cargo run --bin tx_run -- c/examples/txt_button.cpp --host 192.168.7.2    (a TXT)
#include <stdio.h>
#include <unistd.h>

#include "KeLibTxtDl.h"
#include "FtShmem.h"

#define PRESSES 3

unsigned int DebugFlags;
FILE *DebugFile;

// Called after each exchange, in the library's thread. The outputs are in the next request.
static bool answer(FISH_X1_TRANSFER *areas, int count)
{
    FISH_X1_TRANSFER *area = &areas[LOCAL_IO];

    area->ftX1out.duty[0] = area->ftX1in.uni[0] ? 512 : 0;
    return true;
}

int main()
{
    if (StartTxtDownloadProg() != KELIB_ERROR_NONE) {
        fprintf(stderr, "the controller does not answer\n");
        return 1;
    }
    FISH_X1_TRANSFER *area = &GetKeLibTransferAreaMainAddress()[LOCAL_IO];

    area->ftX1config.motor[0] = true;
    area->ftX1config.uni[0].mode = MODE_R;
    area->ftX1config.uni[0].digital = true;
    area->ftX1state.config_id++;
    // Until then the input has the voltage from before.
    usleep(50000);
    SetTransferAreaCompleteCallback(answer);

    int presses = 0;
    bool before = true;
    while (presses < PRESSES && MotorIOLib_ThreadIsRunning()) {
        bool pressed = area->ftX1in.uni[0] != 0;
        if (pressed && !before) {
            printf("press %d\n", ++presses);
            fflush(stdout);
        }
        before = pressed;
        usleep(2000);
    }
    SetTransferAreaCompleteCallback(NULL);
    StopTxtDownloadProg();
    return presses == PRESSES ? 0 : 1;
}
