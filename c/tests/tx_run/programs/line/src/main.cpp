#include <stdio.h>

#include "KeLibTxtDl.h"
#include "FtShmem.h"
#include "line/axis.h"
#include "line/lamp.h"

unsigned int DebugFlags;
FILE *DebugFile;

static_assert(sizeof(uint32_t) == 4 && sizeof(BOOL32) == 4 && sizeof(FISH_X1_TRANSFER) == 1024, "today's integers");

/* With an argument it only says what it is made of, without a controller. */
int main(int argc, char **)
{
    if (argc > 1) {
        printf("lamp %d\n", lamp_duty(1));
        return 0;
    }
    if (StartTxtDownloadProg() != KELIB_ERROR_NONE) return 1;
    FISH_X1_TRANSFER *area = GetKeLibTransferAreaMainAddress();
    area->ftX1config.motor[3] = 0;
    area->ftX1out.duty[7] = lamp_duty(1);
    line::Axis one("one", area, 0, 0, 40), two("two", area, 1, 1, 60);
    one.start();
    two.start();
    one.wait();
    two.wait();
    if (!MotorIOLib_ThreadIsRunning()) return 2;
    printf("%s %s done\n", one.name, two.name);
    StopTxtDownloadProg();
    return 0;
}
