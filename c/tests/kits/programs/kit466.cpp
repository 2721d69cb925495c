// A program of kit 4.6.6. The first argument says what it does.
#include <conio.h>
#include <chrono>
#include <time.h>
#include "../Common/ftProInterface2013TransferAreaCom.h"
#include "../Common/ftProInterface2013JpegDecode.h"

SOCKET unused = INVALID_SOCKET;
FISH_X1_TRANSFER *TransArea;

static void pause_ms(int ms) { this_thread::sleep_for(chrono::milliseconds(ms)); }

// Exchanges in the program's own loop.
static int loop(bool compressed)
{
    ftIF2013TransferAreaComHandler *com =
        new ftIF2013TransferAreaComHandler(TransArea, compressed ? IF_TXT_MAX : 1, "192.0.2.1", "65000");
    com->SetTransferMode(compressed);
    TransArea[ShmIfId_TXT::LOCAL_IO].ftX1config.uni[1].mode = MODE_U;
    TransArea[LOCAL_IO].ftX1config.uni[1].digital = false;
    if (com->DoTransfer() || !com->BeginTransfer()) return 1;
    cout << "begun" << endl;
    while (TransArea[LOCAL_IO].ftX1in.uni[7] == 0) {
        TransArea[LOCAL_IO].ftX1out.duty[0] = TransArea[LOCAL_IO].ftX1in.uni[0] ? 512 : 0;
        if (!com->DoTransfer()) return 2;
    }
    com->PrintIO(ShmIfId_TXT::LOCAL_IO);
    com->EndTransfer();
    delete com;
    return 0;
}

// A distance, as programs with the thread write it.
static void turn(int motor, int distance, bool id_first)
{
    FISH_X1_TRANSFER &area = TransArea[LOCAL_IO];
    area.ftX1in.motor_ex_reached[motor] = 0;
    if (id_first) area.ftX1out.motor_ex_cmd_id[motor]++;
    area.ftX1out.distance[motor] = distance;
    area.ftX1out.duty[2 * motor] = 512;
    if (!id_first) area.ftX1out.motor_ex_cmd_id[motor]++;
    while (!area.ftX1in.motor_ex_reached[motor]) pause_ms(4);
    area.ftX1out.duty[2 * motor] = 0;
}

static int commands(ftIF2013TransferAreaComHandlerEx *com)
{
    FISH_X1_TRANSFER &area = TransArea[LOCAL_IO];
    for (int i = 0; i < 6; i++) {
        // A flag of the round before that comes back would end this one at once; 20 pulses take 0.1 s. The flag
        // may come a moment before the id.
        const auto begin = chrono::steady_clock::now();
        turn(0, 20, i % 2 != 0);
        if (chrono::steady_clock::now() - begin < chrono::milliseconds(50)) return 10;
        area.ftX1in.cnt_resetted[1] = 0;
        area.ftX1out.cnt_reset_cmd_id[1]++;
        while (!area.ftX1in.cnt_resetted[1]) pause_ms(10);
    }
    cout << "commands" << endl;
    return com->TaComThreadIsRunning() ? 0 : 11;
}

static int camera(ftIF2013TransferAreaComHandlerEx *com)
{
    static UINT8 yuv[320 * 240 * 2];
    unsigned char *buffer;
    size_t size, read;
    if (!com->StartCamera(320, 240, 15, 50, "65001")) return 20;
    for (int i = 0; i < 3; i++) {
        if (!com->GetCameraFrameJpeg(&buffer, &size)
            || !ftProJpegDec(buffer, (int)size, yuv, sizeof yuv, &read)) return 21;
        cout << "frame" << endl;
    }
    com->StopCamera();
    return 0;
}

static int with_thread(const string &what)
{
    ftIF2013TransferAreaComHandlerEx *com = new ftIF2013TransferAreaComHandlerEx(TransArea, IF_TXT_MAX, "192.0.2.1");
    if (com->TaComThreadIsRunning() || com->TaComThreadStop() != 1) return 3;
    if (com->TaComThreadStart() != 0) {
        cerr << "not begun" << endl;
        delete com;
        return 7;
    }
    if (com->TaComThreadStart() != 1 || !com->TaComThreadIsRunning()) return 4;
    cout << "begun" << endl;
    int error = what == "commands" ? commands(com) : what == "camera" ? camera(com) : 0;
    if (error != 0) return error;
    while (TransArea[LOCAL_IO].ftX1in.uni[7] == 0 && com->TaComThreadIsRunning()) {
        TransArea[LOCAL_IO].ftX1out.duty[0] = TransArea[LOCAL_IO].ftX1in.uni[0] ? 512 : 0;
        TransArea[REMOTE_IO_1].ftX1out.duty[1] = TransArea[REMOTE_IO_1].ftX1in.uni[0] ? 256 : 0;
        if (TransArea[LOCAL_IO].ftX1in.uni[6] && TransArea[LOCAL_IO].ftX1config.motor[3]) {
            TransArea[LOCAL_IO].ftX1config.motor[3] = false;
            TransArea[LOCAL_IO].ftX1state.config_id++;
        }
        pause_ms(4);
    }
    cout << (com->TaComThreadIsRunning() ? "runs" : "ended") << endl;
    if (what == "again") {
        if (com->TaComThreadStop() != 0 || com->TaComThreadIsRunning() || com->TaComThreadStop() != 1) return 5;
        com->SetTransferMode(false);
        if (com->TaComThreadStart() != 0) return 6;
        cout << "again" << endl;
        while (TransArea[LOCAL_IO].ftX1in.uni[5] == 0) pause_ms(4);
    }
    if (what == "configure") {
        for (int i = 0; i < IF_TXT_MAX; i++) TransArea[i].ftX1state.config_id++;
        // One of them is on its way.
        pause_ms(1500);
        return 0;
    }
    // Without the end of the transfer: the destructor does that.
    if (what != "leave") delete com;
    return 0;
}

int main(int argc, char *argv[])
{
    string what = argc > 1 ? argv[1] : "";
    TransArea = new FISH_X1_TRANSFER[IF_TXT_MAX];
    if (what == "loop" || what == "simple") return loop(what == "loop");
    int error = with_thread(what);
    if (what != "leave") delete[] TransArea;
    return error;
}
