/* The transfer area and the constants of FtTxtLib. */
#ifndef FT_FTTXTLIB_FTSHMEMTXT_H
#define FT_FTTXTLIB_FTSHMEMTXT_H

#include <stdint.h>

#include "../detail/fish_x1.h"

namespace fischertechnik {
namespace txt {
namespace ids {

constexpr int FIRMWARE_VER = 0x4406;

constexpr uint8_t IZ_COUNTER = 4;
constexpr uint8_t IZ_PWM_CHAN = 8;
constexpr uint8_t IZ_MOTOR = 4;
constexpr uint8_t IZ_UNI_INPUT = 8;
constexpr uint8_t IZ_IR_RECEIVER = 4;

constexpr uint8_t I2C_SPEED_100_KHZ = 0;
constexpr uint8_t I2C_SPEED_400_KHZ = 1;

enum Motor : uint8_t { M1 = 0, M2, M3, M4, NoMotor = 15 };
enum Output : uint8_t { O1 = 0, O2, O3, O4, O5, O6, O7, O8, NoOutput = 15 };
enum Input : uint8_t { I1 = 0, I2, I3, I4, I5, I6, I7, I8, NoInput = 15 };
enum Counter : uint8_t { C1 = 0, C2, C3, C4, NoCounter = 15 };
enum Direction : int8_t { CCW = -1, Halt = 0, CW = 1, NoDirection = 15 };
enum InputMode { MODE_U = 0, MODE_R = 1, MODE_ULTRASONIC = 3, MODE_INVALID = 4 };

/* Infrared remotes by their DIP switches, and what is on one. */
enum IrDev : uint8_t { IR_ALL_DATA = 0, IR_OFF_OFF, IR_ON_OFF, IR_OFF_ON, IR_ON_ON };
enum IrDevGroup : uint8_t { JoystickLeft = 1, JoystickRight, Buttons, Switches };
enum IrAxisF : uint8_t { JoyLeftX = 10, JoyLeftY = 11, JoyRightX = 20, JoyRightY = 21 };
enum IrAxisP : uint8_t {
    JoyLeftXtoLeft = 12,
    JoyLeftXtoRight,
    JoyLeftYtoForward,
    JoyLeftYtoBackwards,
    JoyRightXtoLeft = 22,
    JoyRightXtoRight,
    JoyRightYtoForward,
    JoyRightYtoBackwards
};
enum IrButSwi : uint8_t { ButtonOn = 0, ButtonOff, DipSwitch1, DipSwitch2 };

enum FtErrors : unsigned int {
    FTLIB_ERR_SUCCESS = 0x00000000,
    FTLIB_ERR_NO_MEMORY = 0xE0000100,
    FTLIB_ERR_FAILED = 0xE0001000,
    FTLIB_ERR_TIMEOUT = 0xE000100C,
    FTLIB_ERR_INVALID_PARAM = 0xE0001018,
    FTLIB_ERR_SOME_DEVICES_ARE_OPEN = 0xE0001101,
    FTLIB_ERR_DEVICE_IS_OPEN = 0xE0001102,
    FTLIB_ERR_DEVICE_NOT_OPEN = 0xE0001103,
    FTLIB_ERR_NO_SUCH_DEVICE_INSTANCE = 0xE0001104,
    FTLIB_ERR_UNKNOWN_DEVICE_HANDLE = 0xE0001283,
    FTLIB_ERR_LIB_IS_INITIALIZED = 0xE0001286,
    FTLIB_ERR_LIB_IS_NOT_INITIALIZED = 0xE0001287,
    FTLIB_ERR_THREAD_NOT_STARTABLE = 0xE00012A0,
    FTLIB_ERR_THREAD_IS_RUNNING = 0xE00012A5,
    FTLIB_ERR_THREAD_NOT_RUNNING = 0xE00012A6,
    FTLIB_ERR_THREAD_SYNCHRONIZED = 0xE00012AF,
    FTLIB_ERR_TIMEOUT_TA = 0xE00012B0,
    FTLIB_ERR_CREATE_EVENT = 0xE00012B1,
    FTLIB_ERR_CREATE_MM_TIMER = 0xE00012B2,
    FTLIB_ERR_UPLOAD_FILE_NOT_OPEN = 0xE0001400,
    FTLIB_ERR_UPLOAD_FAILED = 0xE0001405,
    FTLIB_ERR_REM_CMD_FAILED = 0xE000140B,
    FTLIB_ERR_REM_CMD_NOT_SUPPORTED = 0xE000140C,
    FTLIB_ERR_ACCESS_DENIED = 0xE0001905,
    FTLIB_ERR_OPEN_COM = 0xE0001906,
    FTLIB_ERR_INIT_COM = 0xE0001908,
    FTLIB_ERR_INIT_COM_TIMEOUT = 0xE0001909,
    FTLIB_ERR_WRONG_HOSTNAME_LEN = 0xE0002000,
    FTLIB_BT_INVALID_CONIDX = 0xE0004000,
    FTLIB_BT_CON_NOT_EXISTS = 0xE0004001,
    FTLIB_BT_CON_ACTIVE = 0xE0004002,
    FTLIB_BT_CON_INACTIVE = 0xE0004003,
    FTLIB_BT_CON_WRONG_ADDR = 0xE0004004,
    FTLIB_BT_CON_WAIT_BUSY = 0xE0004005,
    FTLIB_I2C_INVALID_DEV_ADDR = 0xE0005000,
    FTLIB_I2C_C_INVALID_FLAGS_ADDRMODE = 0xE0005001,
    FTLIB_I2C_C_INVALID_FLAGS_DATAMODE = 0xE0005002,
    FTLIB_I2C_C_INVALID_FLAGS_ERRMODE = 0xE0005003,
    FTLIB_ERR_UNKNOWN = 0xEFFFFFFF
};

} // namespace ids
} // namespace txt
} // namespace fischertechnik

using namespace fischertechnik::txt::ids;

/* The areas: that of the controller itself, and that of its extension. */
enum ShmIfId_TXT { LOCAL_IO = 0, REMOTE_IO_1, SHM_IF_CNT };

#define SLAVE_CNT_MAX (SHM_IF_CNT - 1)
#define IF_TXT_MAX SHM_IF_CNT

#endif
