// With each press of I1, M1 and M2 turn together for 120 pulses. It ends after two presses.
// A program with FtTxtLib's thread and callbacks.
//
//   I1      button
//   M1, M2  encoder motors, their encoders are on C1 and C2
//
//   cargo run --bin tx_run -- c/examples/kit_callbacks.cpp --world default       (a simulated TXT)
//   cargo run --bin tx_run -- c/examples/kit_callbacks.cpp --host 192.168.7.2    (a TXT)
#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "FtTxtLib.h"

const int PRESSES = 2;
const int PULSES = 120;

int main()
{
    ftIF2013TransferAreaComHandlerEx2 txt(1, "192.168.7.2");
    std::atomic<bool> pressed(false);
    std::atomic<int> reached(0), done[2] = {};

    if (txt.ftxStartTransferArea() != FTLIB_ERR_SUCCESS) {
        std::printf("the controller does not answer\n");
        return 1;
    }
    // The callbacks run in the library's thread: they note what has happened.
    txt.SetFtUniConfig(LOCAL_IO, I1, MODE_R, [&](auto, ShmIfId_TXT, Input, bool closed) {
        if (closed) {
            pressed = true;
        }
    });
    auto count = [&](auto, ShmIfId_TXT, Motor motor, uint16_t position, uint16_t) {
        done[static_cast<int>(motor)] = position;
        reached++;
    };
    txt.SetFtMotorConfig(LOCAL_IO, M1, true, count);
    txt.SetFtMotorConfig(LOCAL_IO, M2, true, count);

    for (int presses = 0; presses < PRESSES && txt.ftxIsTransferActiv();) {
        if (pressed.exchange(false)) {
            presses++;
            std::printf("press %d\n", presses);
            reached = 0;
            txt.StartMotorExCmd(LOCAL_IO, M1, 400, CW, M2, CW, PULSES);
            while (reached < 2 && txt.ftxIsTransferActiv()) {
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
            txt.StopAllMotorExCmd(LOCAL_IO);
            std::printf("M1 has done %d pulses\nM2 has done %d pulses\n", done[0].load(), done[1].load());
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    bool goes_on = txt.ftxIsTransferActiv();
    txt.ftxStopTransferArea();
    return goes_on ? 0 : 1;
}
