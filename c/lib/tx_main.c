/* The main function of programs with PrgInit and PrgTic. */
#include "ROBO_TX_PRG.h"

/* In the library ftMscLib. Returns the exit status: 0 when PrgTic has returned 0. */
int ft_tx_run(void (*init)(TA *, int), int (*tic)(TA *, int));

int main(void)
{
    return ft_tx_run(PrgInit, PrgTic);
}
