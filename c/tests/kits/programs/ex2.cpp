// A program of FtTxtLib. The first argument says what it does.
#include <iostream>
#include <chrono>
#include <atomic>
#include <cstring>
#ifndef _WIN32
#include <fcntl.h>
#include <unistd.h>
#endif
#include "FtTxtLib.h"

using namespace std;
using namespace std::placeholders;
using namespace fischertechnik::txt::ids;
using namespace fischertechnik::txt::remote::api;

ftIF2013TransferAreaComHandlerEx2 *ComHandler;
volatile FISH_X1_TRANSFER *TransArea;
atomic<bool> stopWhile(false);
atomic<int> ticks(0);

static void say(const string &line) { cout << line << endl; }
static void fill_errors()
{
#ifndef _WIN32
    int flags = fcntl(STDERR_FILENO, F_GETFL);
    fcntl(STDERR_FILENO, F_SETFL, flags | O_NONBLOCK);
    while (write(STDERR_FILENO, "x", 1) == 1) {}
    fcntl(STDERR_FILENO, F_SETFL, flags);
#endif
}
static void pause_ms(int ms) { this_thread::sleep_for(chrono::milliseconds(ms)); }

void MyUniInCallback(ftIF2013TransferAreaComHandlerEx2 *o, ShmIfId_TXT shmId, Input id, bool state)
{
    cout << "input " << shmId << ":" << (uint16_t)id << " " << state << endl;
    o->SetOutMotorValues(shmId, Motor::M4, state ? 100 : -100);
    if (id == Input::I8 && state) stopWhile = true;
}

class MyCallBacks
{
public:
    void MyUni(ftIF2013TransferAreaComHandlerEx2 *o, ShmIfId_TXT shmId, Input id, bool state)
    {
        MyUniInCallback(o, shmId, id, state);
    }
    void MyMotorReached(ftIF2013TransferAreaComHandlerEx2 *, ShmIfId_TXT, Motor id, uint16_t position,
                        uint16_t messageId)
    {
        cout << "reached " << (uint16_t)id << " " << (position >= 100) << " " << messageId << endl;
    }
    void MyReset(ftIF2013TransferAreaComHandlerEx2 *, ShmIfId_TXT, Counter id, uint16_t messageId)
    {
        cout << "reset " << (uint16_t)id << " " << messageId << endl;
    }
    void MyJoystick(ftIF2013TransferAreaComHandlerEx2 *o, ShmIfId_TXT, IrDev, IrDevGroup gr, int16_t x,
                    int16_t y)
    {
        o->SetOutMotorValues(ShmIfId_TXT::LOCAL_IO, gr == JoystickLeft ? M1 : M2, x * 10 + y);
    }
};

static int camera()
{
    unsigned char *buffer;
    size_t size, read;
    static unsigned char yuv[320 * 240 * 2];
    if (ComHandler->GetCameraFrameJpeg(&buffer, &size) || !ComHandler->StartCamera()) return 1;
    for (int i = 0; i < 3; i++) {
        if (!ComHandler->GetCameraFrameJpeg(&buffer, &size)
            || !ftProJpegDec(buffer, (int)size, yuv, sizeof yuv, &read)) return 2;
        say("frame");
        pause_ms(50);
    }
    ComHandler->StopCamera();
    return ComHandler->GetCameraFrameJpeg(&buffer, &size) ? 3 : 0;
}

static int calls()
{
    int value;
    INT16 input;
    bool over;
    MyCallBacks mc;
    ComHandler->SetFtMotorConfig(LOCAL_IO, M1, true, bind(&MyCallBacks::MyMotorReached, &mc, _1, _2, _3, _4, _5));
    ComHandler->SetFtCntConfig(LOCAL_IO, C3, true, nullptr, bind(&MyCallBacks::MyReset, &mc, _1, _2, _3, _4));
    if (ComHandler->StartMotorExCmd(LOCAL_IO, M1, 400, CW, M2, CCW, 100) != FTLIB_ERR_SUCCESS
        || ComHandler->IsMotorExReady(LOCAL_IO, M1)) return 1;
    while (!(ComHandler->IsMotorExReady(LOCAL_IO, M1) && ComHandler->IsMotorExReady(LOCAL_IO, M2))) pause_ms(5);
    if (TransArea[0].ftX1in.motor_ex_reached[0] != 1) return 2;
    ComHandler->StopMotorExCmd(LOCAL_IO, M1);
    ComHandler->StopMotorExCmd(LOCAL_IO, M2);
    while (!ComHandler->IsMotorExReady(LOCAL_IO, M2)) pause_ms(5);
    if (ComHandler->GetInCntCount(LOCAL_IO, C1) < 100) return 3;
    // By the area's fields, as in programs without the calls: a flag that is set back stays so until it is done.
    TransArea[0].ftX1in.motor_ex_reached[1] = 0;
    pause_ms(30);
    if (TransArea[0].ftX1in.motor_ex_reached[1] != 0) return 10;
    TransArea[0].ftX1out.duty[2] = 512;
    TransArea[0].ftX1out.distance[1] = 60;
    TransArea[0].ftX1out.motor_ex_cmd_id[1]++;
    while (TransArea[0].ftX1in.motor_ex_reached[1] != 1) pause_ms(1);
    if (ComHandler->GetInCntCount(LOCAL_IO, C2) < 60) return 11;
    // A call sets the flag back itself.
    if (ComHandler->StartMotorExCmd(LOCAL_IO, M2, 400, CW, 60000) != FTLIB_ERR_SUCCESS
        || TransArea[0].ftX1in.motor_ex_reached[1] != 0) return 12;
    ComHandler->StopAllMotorExCmd(LOCAL_IO);
    ComHandler->StartCounterReset(LOCAL_IO, C3);
    while (!ComHandler->IsCntResetReady(LOCAL_IO, C3)) pause_ms(5);
    ComHandler->SetSound(LOCAL_IO, 1, 1);
    while (!ComHandler->IsSoundReady(LOCAL_IO)) pause_ms(5);
    ComHandler->SetFtMotorConfig(LOCAL_IO, M3, false);
    ComHandler->SetOutPwmValues(LOCAL_IO, O5, 300);
    if (ComHandler->GetOutPwmValues(LOCAL_IO, O5, value) != FTLIB_ERR_SUCCESS || value != 300) return 4;
    ComHandler->SetOutMotorValues(LOCAL_IO, M1, -200);
    ComHandler->SetOutMotorInverse(LOCAL_IO, M1);
    if (ComHandler->GetOutMotorValues(LOCAL_IO, M1, value) != FTLIB_ERR_SUCCESS || value != 200) return 5;
    if (ComHandler->SetOutMotorValues(LOCAL_IO, M1, 513) != FTLIB_ERR_INVALID_PARAM
        || ComHandler->SetOutMotorValues(REMOTE_IO_1, M1, 1) == FTLIB_ERR_SUCCESS
        || ComHandler->SetOutMotorValues(LOCAL_IO, NoMotor, 1) != FTLIB_ERR_INVALID_PARAM
        || ComHandler->SetFtUniConfig(LOCAL_IO, I1, MODE_ULTRASONIC) != FTLIB_ERR_INVALID_PARAM
        || ComHandler->GetInIOValue(LOCAL_IO, NoInput, input, over) != FTLIB_ERR_INVALID_PARAM
        || ComHandler->GetInIOValueAnalogue(LOCAL_IO, NoInput) != INVALID_VALUE) return 6;
    ComHandler->SetFtUniConfig(LOCAL_IO, I7, MODE_ULTRASONIC, false);
    do {
        pause_ms(5);
        if (ComHandler->GetInIOValue(LOCAL_IO, I7, input, over) != FTLIB_ERR_SUCCESS) return 7;
    } while (input != 4096 || !over);
    if (!ComHandler->StartI2C() || !ComHandler->StopI2C() || ComHandler->StopI2C()) return 8;
    if (ComHandler->ftxStartTransferArea() != FTLIB_ERR_THREAD_IS_RUNNING) return 9;
    say("calls");
    return 0;
}

int main(int argc, char *argv[])
{
    string what = argc > 1 ? argv[1] : "";
    MyCallBacks *mc = new MyCallBacks();
    ComHandler = new ftIF2013TransferAreaComHandlerEx2(what == "calls" ? 1 : IF_TXT_MAX, "192.0.2.1", "65000", ".\\",
                                                       LogLevel::LvLOGERR);
    TransArea = ComHandler->GetTransferAreasArrayAddr();
    ComHandler->SetTransferMode(what != "simple");
    // All the ways to give a callback.
    ComHandler->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, I1, InputMode::MODE_R, &MyUniInCallback);
    ComHandler->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, I2, MODE_R, MyUniInCallback);
    ComHandler->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, I3, MODE_R, bind(&MyUniInCallback, _1, _2, _3, _4));
    ComHandler->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, I8, MODE_R, bind(&MyCallBacks::MyUni, mc, _1, _2, _3, _4));
    ComHandler->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, I4, MODE_R,
                               [](ftIF2013TransferAreaComHandlerEx2 *, ShmIfId_TXT, Input, bool state) -> void {
                                   cout << "lambda " << state << endl;
                               });
    ComHandler->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, I5, MODE_R, true);
    ComHandler->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, I6, MODE_U, nullptr);
    ComHandler->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, I6, MODE_U);
    ComHandler->SetFtTaCompleted([](ftIF2013TransferAreaComHandlerEx2 *) { ticks++; });
    ComHandler->SetFtCbJoyStick(ShmIfId_TXT::LOCAL_IO, IR_OFF_ON, bind(&MyCallBacks::MyJoystick, mc, _1, _2, _3, _4, _5, _6),
                                bind(&MyCallBacks::MyJoystick, mc, _1, _2, _3, _4, _5, _6));
    if (what == "throw unread") fill_errors();
    if (what.compare(0, 5, "throw") == 0)
        ComHandler->SetFtTaCompleted([](ftIF2013TransferAreaComHandlerEx2 *o) {
            if (o->GetInIOValueBinary(LOCAL_IO, I5)) throw runtime_error("as a test");
        });
    static atomic<bool> hasBlocked(false);
    if (what == "block")
        ComHandler->SetFtTaCompleted([](ftIF2013TransferAreaComHandlerEx2 *o) {
            ticks++;
            if (o->GetInIOValueBinary(LOCAL_IO, I5) && !hasBlocked.exchange(true)) pause_ms(1200);
        });
    if (what == "delete")
        ComHandler->SetFtTaCompleted([](ftIF2013TransferAreaComHandlerEx2 *o) {
            if (!o->GetInIOValueBinary(LOCAL_IO, I5)) return;
            delete o;
            stopWhile = true;
        });
    FtErrors error = ComHandler->ftxStartTransferArea();
    if ((!error) == FtErrors::FTLIB_ERR_SUCCESS) {
        // Programs test it in this way, which is true when it is well.
    }
    if (error != FTLIB_ERR_SUCCESS) {
        cout << hex << error << dec << endl;
        ComHandler->PrintIO(LOCAL_IO);
        delete ComHandler;
        return 7;
    }
    say("started");
    if (what == "calls" || what == "camera") {
        int failed = what == "calls" ? calls() : camera();
        if (failed != 0) return failed;
    }
    if (what == "picture") {
        unsigned char *buffer;
        size_t size;
        if (!ComHandler->StartCamera()) return 12;
        if (!ComHandler->GetCameraFrameJpeg(&buffer, &size)) return 15;
        while (ComHandler->ftxIsTransferActiv()) pause_ms(5);
        if (ComHandler->ftxStartTransferArea() != FTLIB_ERR_SUCCESS) return 13;
        if (ComHandler->GetCameraFrameJpeg(&buffer, &size)) return 14;
        delete ComHandler;
        return 0;
    }
    if (what == "leave") {
        ComHandler->SetOutMotorValues(LOCAL_IO, M1, 512, CW);
        ComHandler->SetOutMotorValues(REMOTE_IO_1, M1, 256, CCW);
        while (!ComHandler->GetInIOValueBinary(LOCAL_IO, I5)) pause_ms(5);
        return 0;
    }
    if (what == "block") ComHandler->SetOutMotorValues(LOCAL_IO, M1, 300);
    if (what == "delete") {
        while (!stopWhile) pause_ms(5);
        return 0;
    }
    while (!stopWhile && ComHandler->ftxIsTransferActiv()) pause_ms(5);
    say(ComHandler->ftxIsTransferActiv() ? "active" : "ended");
    if (what == "stay") pause_ms(60000);
    ComHandler->PrintIO(LOCAL_IO);
    ComHandler->PrintIR(LOCAL_IO);
    if (ComHandler->IsSlaveActive() != (what == "slave" ? 1 : 0)) return 8;
    ComHandler->ftxStopTransferArea();
    if (ComHandler->ftxStopTransferArea() != FTLIB_ERR_THREAD_NOT_RUNNING) return 9;
    if (what == "again") {
        ComHandler->SetTransferMode(false);
        stopWhile = false;
        if (ComHandler->ftxStartTransferArea() != FTLIB_ERR_SUCCESS) return 10;
        say("again");
        while (!stopWhile) pause_ms(5);
    }
    delete ComHandler;
    if (ticks == 0 && what.compare(0, 5, "throw") != 0) return 11;
    return 0;
}
