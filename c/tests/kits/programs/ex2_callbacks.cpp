// Compares two exchanges between which the program has gone on.
#include <cstdio>
#include "FtTxtLib.h"

using namespace fischertechnik::txt::remote::api;

int main()
{
    static FISH_X1_TRANSFER areas[1];
    static int handler;
    int reached = 0;
    std::shared_ptr<detail::Callbacks> callbacks = std::make_shared<detail::Callbacks>(1);
    callbacks->belong_to(reinterpret_cast<detail::Handler *>(&handler), areas);
    callbacks->set(callbacks->of(0).motor[M1],
                   detail::MotorReached([&](detail::Handler *, ShmIfId_TXT, Motor, uint16_t, uint16_t id) {
                       std::printf("reached by command %d\n", id);
                       ++reached;
                   }));
    callbacks->begin();
    areas[0].ftX1out.distance[0] = 100;
    areas[0].ftX1out.motor_ex_cmd_id[0] = 1;
    detail::Callbacks::cycle(callbacks.get(), nullptr, 0);
    // It is done, and before that is compared, the program has ended the mode, which is done with the next exchange.
    areas[0].ftX1in.motor_ex_cmd_id[0] = 1;
    areas[0].ftX1out.distance[0] = 0;
    areas[0].ftX1out.motor_ex_cmd_id[0] = 2;
    detail::Callbacks::cycle(callbacks.get(), nullptr, 0);
    areas[0].ftX1in.motor_ex_cmd_id[0] = 2;
    detail::Callbacks::cycle(callbacks.get(), nullptr, 0);
    return reached == 1 ? 0 : 1;
}
