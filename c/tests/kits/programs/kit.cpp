// A program of kit 4.1.6. The first argument says what it does.
#include <cstring>
#include <iostream>

#include "../Common/ftProInterface2013TransferAreaCom.h"
#include "../Common/ftProInterface2013JpegDecode.h"

using namespace std;

FISH_X1_TRANSFER *TransArea;
ftIF2013TransferAreaComHandler *ComHandler;

static int camera()
{
    if (!ComHandler->StartCamera(320, 240, 30, 50)) {
        return 1;
    }
    unsigned char *yuv = new unsigned char[320 * 240 * 2];
    for (int i = 0; i < 3; i++) {
        unsigned char *buffer;
        size_t size, read = 0;
        if (!ComHandler->GetCameraFrameJpeg(&buffer, &size)
            || !ftProJpegDec(buffer, (int)size, yuv, 320 * 240 * 2, &read)) {
            return 2;
        }
        // As the kit's sample does, whether the end marker is there or not.
        size = read;
        buffer[size++] = 0xFF;
        buffer[size++] = 0xD9;
        cout << (buffer[0] == 0xFF && buffer[1] == 0xD8 && size > 100) << endl;
        cout << hex << ComHandler->GetVersion() << dec << endl;
    }
    delete[] yuv;
    ComHandler->StopCamera();
    return ComHandler->DoTransferCompressed() ? 0 : 3;
}

// A distance with two motors together, and a counter that is set back.
static int commands()
{
    TransArea[0].ftX1out.duty[0] = TransArea[0].ftX1out.duty[2] = 512;
    TransArea[0].ftX1out.distance[0] = TransArea[0].ftX1out.distance[1] = 50;
    TransArea[0].ftX1out.master[1] = 1;
    TransArea[0].ftX1out.motor_ex_cmd_id[0]++;
    TransArea[0].ftX1out.motor_ex_cmd_id[1]++;
    int cycles = 0;
    do {
        if (!ComHandler->DoTransferCompressed()) {
            return 1;
        }
        cycles++;
    } while (!TransArea[0].ftX1in.motor_ex_reached[0] || !TransArea[0].ftX1in.motor_ex_reached[1]);
    cout << (cycles > 5) << " " << (TransArea[0].ftX1in.counter[0] >= 50) << endl;
    TransArea[0].ftX1in.cnt_resetted[0] = 0;
    TransArea[0].ftX1out.cnt_reset_cmd_id[0]++;
    while (!TransArea[0].ftX1in.cnt_resetted[0]) {
        if (!ComHandler->DoTransferCompressed()) {
            return 1;
        }
    }
    cout << TransArea[0].ftX1in.counter[0] << endl;
    return 0;
}

int main(int argc, char *argv[])
{
    const char *what = argc > 1 ? argv[1] : "";
    TransArea = new FISH_X1_TRANSFER[IF08_MAX];
    memset(TransArea, 0x55, IF08_MAX * sizeof(FISH_X1_TRANSFER));
    ComHandler = new ftIF2013TransferAreaComHandler(TransArea, IF08_MAX, "192.0.2.1", "65000");
    TransArea[0].ftX1config.uni[1].mode = MODE_ULTRASONIC;
    TransArea[0].ftX1config.uni[1].digital = 0;
    TransArea[0].ftX1state.config_id++;
    if (ComHandler->DoTransferCompressed() || ComHandler->UpdateConfig()) {
        return 9;
    }
    if (!ComHandler->BeginTransfer()) {
        cout << "not begun" << endl;
        delete ComHandler;
        delete[] TransArea;
        return 7;
    }
    cout << "begun" << endl;
    int error = 0;
    if (strcmp(what, "camera") == 0) {
        error = camera();
    } else if (strcmp(what, "commands") == 0) {
        error = commands();
    } else {
        bool simple = strcmp(what, "simple") == 0;
        int loops = 0;
        while (TransArea[0].ftX1in.uni[7] == 0) {
            TransArea[0].ftX1out.duty[0] = TransArea[0].ftX1in.uni[0] ? 512 : 0;
            TransArea[1].ftX1out.duty[0] = TransArea[1].ftX1in.uni[0] ? 512 : 0;
            if (!(simple ? ComHandler->DoTransferSimple() : ComHandler->DoTransferCompressed())) {
                cout << "lost" << endl;
                error = ComHandler->BeginTransfer() ? 0 : 5;
                break;
            }
            loops++;
        }
        if (strcmp(what, "config") == 0) {
            TransArea[0].ftX1config.motor[3] = 0;
            error = ComHandler->UpdateConfig() ? 0 : 6;
        }
        // The TXT sets the pace.
        cout << (TransArea[0].IFTimer.Timer1ms + 100 >= loops * 8) << endl;
    }
    ComHandler->PrintIO(0);
    ComHandler->PrintIO(1);
    ComHandler->PrintIO(9);
    if (strcmp(what, "leave") == 0) {
        return 0;
    }
    ComHandler->EndTransfer();
    delete ComHandler;
    delete[] TransArea;
    return error;
}
