/*
 * One of two models that wait for each other: a belt that carries a disc there. The other one carries it back.
 * A program that was downloaded to a TXT. docs/two_models.md explains it.
 *
 *   I1  light barrier at the start of the belt, where the other model brings the disc
 *   I2  light barrier at the end of the belt
 *   M1  motor of the belt
 *
 *   tx_run examples/two_models/there.c --host 127.0.0.1:65000   (a simulated TXT)
 *   tx_run examples/two_models/there.c --host 192.168.7.2       (a TXT)
 */
#include <stdio.h>
#include <unistd.h>

#include "KeLibTxtDl.h"
#include "FtShmem.h"

#define TURNS 3

enum { DARK, LIGHT }; /* what a light barrier reports; it is dark where the disc is */

unsigned int DebugFlags;
FILE *DebugFile;

static FISH_X1_TRANSFER *area;

/* Returns false if the controller has gone. */
static bool wait_until(int input, int wanted)
{
    while (area->ftX1in.uni[input] != wanted) {
        if (!MotorIOLib_ThreadIsRunning())
            return false;
        usleep(2000);
    }
    return true;
}

static bool carry_disc(void)
{
    if (!wait_until(0, DARK)) /* the other model has brought the disc */
        return false;
    area->ftX1out.duty[0] = 512;
    if (!wait_until(1, DARK) || !wait_until(1, LIGHT)) /* it comes to the end, and leaves the belt */
        return false;
    area->ftX1out.duty[0] = 0;
    return true;
}

int main(void)
{
    int turn = 0;

    if (StartTxtDownloadProg() != KELIB_ERROR_NONE) {
        fprintf(stderr, "the controller does not answer\n");
        return 1;
    }
    area = &GetKeLibTransferAreaMainAddress()[0];
    for (int input = 0; input < 2; input++) {
        area->ftX1config.uni[input].mode = MODE_R;
        area->ftX1config.uni[input].digital = true;
    }
    area->ftX1state.config_id++;
    usleep(100000); /* until the inputs are reported in this way */

    while (turn < TURNS && carry_disc()) {
        printf("there: turn %d\n", ++turn);
        fflush(stdout);
    }
    StopTxtDownloadProg();
    return turn == TURNS ? 0 : 1;
}
