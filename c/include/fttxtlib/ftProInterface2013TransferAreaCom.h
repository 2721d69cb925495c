/* What FtTxtLib's handler derives from. Programs make a ftIF2013TransferAreaComHandlerEx2. */
#ifndef FT_FTTXTLIB_TRANSFER_AREA_COM_H
#define FT_FTTXTLIB_TRANSFER_AREA_COM_H

#ifdef _WIN32
#include <winsock2.h>
#include <windows.h>
#else
#include "../posix/winsock2.h"
#endif

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include "common.h"
#include "FtShmemTxt.h"

extern "C" {
struct ft_ex2;
/* Called after each exchange. 0 ends the transfer, and then the library writes the sentence. */
typedef int (*ft_ex2_cycle)(void *context, char *sentence, std::size_t size);
struct ft_ex2 *ft_ex2_new(int areas, const char *host, const char *port, ft_ex2_cycle cycle, void *context);
void ft_ex2_free(struct ft_ex2 *handler);
FISH_X1_TRANSFER *ft_ex2_areas(struct ft_ex2 *handler);
uint32_t ft_ex2_start(struct ft_ex2 *handler);
uint32_t ft_ex2_stop(struct ft_ex2 *handler);
int ft_ex2_is_active(struct ft_ex2 *handler);
void ft_ex2_set_mode(struct ft_ex2 *handler, int compressed);
uint32_t ft_ex2_version(struct ft_ex2 *handler);
int ft_ex2_start_i2c(struct ft_ex2 *handler);
int ft_ex2_stop_i2c(struct ft_ex2 *handler);
int ft_ex2_start_camera(struct ft_ex2 *handler, int width, int height, int framerate, int power_line);
void ft_ex2_stop_camera(struct ft_ex2 *handler);
int ft_ex2_frame(struct ft_ex2 *handler, unsigned char **buffer, size_t *size);
uint32_t ft_ex2_set_uni(struct ft_ex2 *handler, int area, int input, int mode, int digital);
uint32_t ft_ex2_set_counter(struct ft_ex2 *handler, int area, int counter, int mode);
uint32_t ft_ex2_set_motor(struct ft_ex2 *handler, int area, int motor, int status);
uint32_t ft_ex2_motor_values(struct ft_ex2 *handler, int area, int motor, int duty, int direction);
uint32_t ft_ex2_motor_power(struct ft_ex2 *handler, int area, int motor, int power);
uint32_t ft_ex2_motor_inverse(struct ft_ex2 *handler, int area, int motor);
uint32_t ft_ex2_set_pwm(struct ft_ex2 *handler, int area, int output, int duty);
uint32_t ft_ex2_start_motor_ex(struct ft_ex2 *handler, int area, int motor, int duty, int direction,
                               int slave1, int direction1, int slave2, int direction2, int slave3,
                               int direction3, int pulses);
uint32_t ft_ex2_stop_motor_ex(struct ft_ex2 *handler, int area, int motor);
uint32_t ft_ex2_stop_all_motor_ex(struct ft_ex2 *handler, int area);
uint32_t ft_ex2_reset_counter(struct ft_ex2 *handler, int area, int counter);
uint32_t ft_ex2_set_sound(struct ft_ex2 *handler, int area, uint16_t index, uint16_t repeat);
size_t ft_kit_line(const FISH_X1_TRANSFER *area, char *text, size_t size);
}

/* How much FtTxtLib writes into its log file. Here failures go to the standard error, and there is no file. */
enum LogLevel { LvLOGERR, LvWARNING, LvLOG, LvINFO, LvLOGPRINT, LvLOGFREE };

namespace fischertechnik {
namespace txt {
namespace remote {

class ftIF2013TransferAreaComHandler
{
public:
    /* Which exchange the next start uses; compressed without this call. The simple one is for the master
       alone. */
    void SetTransferMode(bool Compressed) { ft_ex2_set_mode(m_handler, Compressed ? 1 : 0); }

    /* The firmware's version, such as 0x04060600; 0 when the controller does not answer. */
    uint32_t GetVersion() { return ft_ex2_version(m_handler); }

    void PrintIO(ShmIfId_TXT master_ext)
    {
        char line[200];
        if (area(master_ext) != nullptr && ft_kit_line(area(master_ext), line, sizeof line) != 0) {
            std::puts(line);
            std::fflush(stdout);
        }
    }

    /* Prints a line for each remote: joysticks, buttons, DIP switches. */
    void PrintIR(ShmIfId_TXT master_ext)
    {
        volatile FISH_X1_TRANSFER *from = area(master_ext);
        for (int i = 0; from != nullptr && i <= IZ_IR_RECEIVER; ++i) {
            volatile KE_IR_INPUT_V01 &ir = from->sTxtInputs.sIrInput[i];
            std::printf("IR ID=%d remote=%d left=%d,%d right=%d,%d on=%d off=%d dip=%d,%d\n", (int)master_ext,
                        i, ir.i16JoyLeftX, ir.i16JoyLeftY, ir.i16JoyRightX, ir.i16JoyRightY, ir.u16ButtonOn,
                        ir.u16ButtonOff, ir.u16DipSwitch1, ir.u16DipSwitch2);
        }
        std::fflush(stdout);
    }

    /* The camera's port is the one after the controller's main port, whatever is given here. */
    bool StartCamera(int width = 320, int height = 240, int framerate = 15, int powerlinefreq = 50,
                     const char *port = "65001")
    {
        (void)port;
        return ft_ex2_start_camera(m_handler, width, height, framerate, powerlinefreq) != 0;
    }
    void StopCamera() { ft_ex2_stop_camera(m_handler); }

    /* Waits for the next frame. The buffer is the handler's, and valid until the next call. */
    bool GetCameraFrameJpeg(unsigned char **buffer, size_t *buffersize)
    {
        return ft_ex2_frame(m_handler, buffer, buffersize) != 0;
    }

protected:
    ftIF2013TransferAreaComHandler(int nAreas, const char *name, const char *port, ft_ex2_cycle cycle,
                                   void *context)
        : m_nAreas(nAreas), m_handler(ft_ex2_new(nAreas, name, port, cycle, context)),
          m_transferarea(ft_ex2_areas(m_handler))
    {
    }

    ~ftIF2013TransferAreaComHandler() { ft_ex2_free(m_handler); }

    ftIF2013TransferAreaComHandler(const ftIF2013TransferAreaComHandler &) = delete;
    ftIF2013TransferAreaComHandler &operator=(const ftIF2013TransferAreaComHandler &) = delete;

    /* An area of this handler; nullptr when there is no such one. */
    FISH_X1_TRANSFER *area(int id) const
    {
        return m_transferarea != nullptr && id >= 0 && id < m_nAreas ? &m_transferarea[id] : nullptr;
    }

    int m_nAreas;
    struct ft_ex2 *m_handler;
    FISH_X1_TRANSFER *m_transferarea;
};

class ftIF2013TransferAreaComHandlerEx1 : public ftIF2013TransferAreaComHandler
{
public:
    /* Connects to the controller's I2C port, while a transfer runs. */
    bool StartI2C() { return ft_ex2_start_i2c(m_handler) != 0; }
    bool StopI2C() { return ft_ex2_stop_i2c(m_handler) != 0; }

protected:
    using ftIF2013TransferAreaComHandler::ftIF2013TransferAreaComHandler;
    ~ftIF2013TransferAreaComHandlerEx1() {}
};

} // namespace remote
} // namespace txt
} // namespace fischertechnik

using namespace std;

#endif
