// M1 runs while I1 is pressed, on the master and on the first extension, for six seconds.
// A program with the class of the C-Programming Kit 4.1.6 and a loop of its own.
//
//   I1  button                     the same on the extension
//   M1  motor
//
//   cargo run --bin tx_run -- c/examples/kit_loop.cpp --world kit            (a simulated TXT)
//   cargo run --bin tx_run -- c/examples/kit_loop.cpp --host 192.168.7.2     (a TXT)
#include <stdio.h>

#include "ftProInterface2013TransferAreaCom.h"

#define AREAS  2
#define CYCLES 600 // of 10 ms

int main()
{
    FISH_X1_TRANSFER *areas = new FISH_X1_TRANSFER[IF08_MAX];
    ftIF2013TransferAreaComHandler *handler = new ftIF2013TransferAreaComHandler(areas, AREAS, "192.168.7.2");
    int cycle = 0;

    for (int i = 0; i < AREAS; i++) {
        areas[i].ftX1config.motor[0] = 1;
        areas[i].ftX1config.uni[0].mode = MODE_R;
        areas[i].ftX1config.uni[0].digital = 1;
    }
    if (handler->BeginTransfer()) {
        // Each call takes 10 ms: it sends the outputs, and brings the inputs.
        while (cycle < CYCLES && handler->DoTransferCompressed()) {
            for (int i = 0; i < AREAS; i++) {
                areas[i].ftX1out.duty[0] = areas[i].ftX1in.uni[0] ? 512 : 0;
            }
            cycle++;
        }
        handler->EndTransfer();
        printf("%d cycles, C1 has counted %d pulses\n", cycle, (int) areas[LOCAL_IO].ftX1in.counter[0]);
    } else {
        printf("the controller does not answer\n");
    }
    delete handler;
    delete[] areas;
    return cycle == CYCLES ? 0 : 1;
}
