/* The library for PC programs. Controllers, inputs, outputs and counters are counted from 0. */
#ifndef FT_MSC_LIB_H
#define FT_MSC_LIB_H

#include "detail/ft_windows_types.h"
#ifndef _WIN32
#include "posix/ft_windows_c.h"
#endif

#include "ROBO_TX_FW.h"

/* C has no `bool` of its own before C23: it is `BOOL`, unless another header brings one. */
#ifndef __cplusplus
#if defined(__STDC_VERSION__) && __STDC_VERSION__ > 201710L
#include <stdbool.h>
#elif !defined(__bool_true_false_are_defined) && !defined(bool) && !defined(FT_BOOL_IS_ENUM) \
    && !defined(FT_BOOL_IS_INT)
typedef BOOL bool;
#define FT_BOOL_IS_INT
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Which ports are meant. */
enum PortSelect { ALL_PORTS = 0, USB_ONLY = 1, BT_ONLY = 2 };

/* TA_STATUS.status: no transfer, transfer, transfer that begins. */
#define TA_STATUS_STOP 0
#define TA_STATUS_RUN 1
#define TA_STATUS_SYNC 2

/* TA_STATUS.iostatus: what the last request was about. */
#define SE_REMIO_REQ 0
#define SE_CONFIG_REQ 1

/* What SetCBRoboExtState's callback is told about an extension. */
#define SLAVE_OFFLINE 0
#define SLAVE_ONLINE 1

/* The areas of a device: the controller itself and its extensions. */
typedef struct ta_array_s {
    TA ftxTransferArea[TA_COUNT];
} TA_ARRAY;

/* The library. Functions that write a text return its length. */
DWORD ftxGetLibVersion(void);
DWORD ftxGetLibVersionStr(LPSTR text, DWORD size);
DWORD ftxInitLib(void);
DWORD ftxCloseLib(void);
DWORD ftxIsLibInit(void);
DWORD ftxGetSerialNrStrg(HANDLE device, LPSTR text, DWORD size);
DWORD ftxGetFirmwareStrg(HANDLE device, LPSTR text, DWORD size);
DWORD ftxGetManufacturerStrg(HANDLE device, LPSTR text, DWORD size);
DWORD ftxGetShortNameStrg(HANDLE device, LPSTR text, DWORD size);
DWORD ftxGetLongNameStrg(HANDLE device, LPSTR text, DWORD size);
/* kind: 0 for the name of the constant, 1 for a sentence. */
DWORD ftxGetLibErrorString(DWORD error, DWORD kind, LPSTR text, DWORD size);

/* Opens and closes devices. The port is COM1 and so on, or a host with or without a port. */
HANDLE ftxOpenComDevice(char *port, DWORD baud, DWORD *error);
HANDLE ftxOpenComDeviceNr(DWORD number, DWORD baud, DWORD *error);
DWORD ftxCloseDevice(HANDLE device);
DWORD ftxCloseAllDevices(void);

/* The transfer of the areas. They stay where they are until the device is closed. */
DWORD ftxStartTransferArea(HANDLE device);
DWORD ftxStopTransferArea(HANDLE device);
DWORD ftxIsTransferActiv(HANDLE device);
volatile TA_ARRAY *GetTransferAreasArrayAddr(HANDLE device);
TA_STATUS *GetTransferAreaStatusAddr(HANDLE device, int controller);

/* Devices and ports. EnumComPorts counts from 0. */
DWORD ftxIsHandleValid(HANDLE device);
DWORD GetComStatus(HANDLE device);
DWORD GetAvailableComPorts(int selection);
DWORD EnumComPorts(DWORD index, LPSTR text, DWORD size);

/* Outputs. Directions are 0 for clockwise and 1 for the other one; with 0 pulses a motor turns without end. */
DWORD StartCounterReset(HANDLE device, int controller, int counter);
void SetCBCounterResetted(void (__stdcall *callback)(DWORD controller, DWORD counter));
DWORD SetOutMotorValues(HANDLE device, int controller, int motor, int duty_plus, int duty_minus);
DWORD SetOutPwmValues(HANDLE device, int controller, int channel, int duty);
DWORD StartMotorExCmd(HANDLE device, int controller, int motor, int duty, int direction, int slave,
                      int slave_direction, int pulses);
DWORD StopAllMotorExCmd(HANDLE device, int controller);
DWORD StopMotorExCmd(HANDLE device, int controller, int motor);
void SetCBMotorExReached(void (__stdcall *callback)(DWORD controller, DWORD motor));

/* The name of a controller, and messages on its display. */
DWORD SetRoboTxDevName(HANDLE device, int controller, LPSTR name);
DWORD SetRoboTxMessage(HANDLE device, int controller, LPCSTR message);

/* What is connected. */
DWORD SetFtUniConfig(HANDLE device, int controller, int input, int mode, bool digital);
DWORD SetFtCntConfig(HANDLE device, int controller, int counter, int mode);
DWORD SetFtMotorConfig(HANDLE device, int controller, int motor, bool is_motor);

/* Inputs. */
DWORD GetInIOValue(HANDLE device, int controller, int input, INT16 *value, BOOL32 *overrun);
DWORD GetInCounterValue(HANDLE device, int controller, int counter, INT16 *count, INT16 *level);
DWORD GetInDisplayButtonValue(HANDLE device, int controller, INT16 *left_ms, INT16 *right_ms);

/* Files and remote commands. */
DWORD FtRemoteCmd(HANDLE device, char *command, void (__stdcall *callback)(LPSTR text, DWORD size));
DWORD FtFileUpload(HANDLE device, char *file, DWORD destination, void (__stdcall *callback)(DWORD status));
DWORD FtRamFileUpload(HANDLE device, DWORD destination, const void *bytes, DWORD size, LPCSTR name,
                      void (__stdcall *callback)(DWORD status));
DWORD RTxCleanDisk(HANDLE device, DWORD disk);

/* Programs in the controller's memory. */
DWORD FtProgramRun(HANDLE device, int controller);
DWORD FtProgramStop(HANDLE device, int controller);

/* Extensions. */
DWORD GetRoboTxInfo(HANDLE device, int controller);
DWORD GetRoboTxMasterState(HANDLE device);
DWORD GetRoboTxSlaveState(HANDLE device, BYTE *states);
DWORD GetRoboTxSlaveAlive(HANDLE device, int slave, BOOL *alive);
DWORD GetRoboTxBtStatus(HANDLE device, BT_STATUS *status);

/* What a controller tells about itself. */
DWORD GetRoboTxDevName(HANDLE device, int controller, LPSTR text, DWORD size);
DWORD GetRoboTxBtAddr(HANDLE device, int controller, LPSTR text, DWORD size);
DWORD GetRoboTxFwStr(HANDLE device, int controller, LPSTR text, DWORD size);
DWORD GetRoboTxFwVal(HANDLE device, int controller, DWORD *version);
DWORD GetRoboTxHwStr(HANDLE device, int controller, LPSTR text, DWORD size);
DWORD GetRoboTxMemLayout(HANDLE device, int controller, PULONG ta_array_start, PULONG pgm_area_start,
                         PULONG pgm_area_size);
DWORD GetRoboTxSerialStr(HANDLE device, int controller, LPSTR text, DWORD size);
DWORD GetRoboTxDllStr(HANDLE device, int controller, LPSTR text, DWORD size);

/* Called when an extension comes or goes. */
void SetCBRoboExtState(void (__stdcall *callback)(DWORD controller, DWORD state));

/* The transfer in figures. */
DWORD GetSessionId(void);
DWORD GetTrapStatistic(HANDLE device, DWORD *, DWORD *, DWORD *, DWORD *, DWORD *, DWORD *);
void ResetTrapStatistic(HANDLE device);

/* A new firmware for the controller. */
DWORD RoboTxFwUpdate(HANDLE device, LPCSTR file, void (__stdcall *callback)(DWORD status, LPSTR text));

/* Bluetooth between controllers. Channels are counted from 1. */
DWORD StartScanBtDevice(HANDLE device, void (__stdcall *callback)(BT_SCAN_STATUS *));
DWORD CancelScanBtDevice(HANDLE device);
DWORD ConnectBtAddress(HANDLE device, DWORD channel, BYTE *address, void (__stdcall *callback)(BT_CB *));
DWORD DisconnectBt(HANDLE device, DWORD channel, void (__stdcall *callback)(BT_CB *));
DWORD SendBtMessage(HANDLE device, DWORD channel, DWORD size, LPSTR message,
                    void (__stdcall *callback)(BT_CB *));
DWORD BtListenConOn(HANDLE device, DWORD channel, BYTE *address, void (__stdcall *callback)(BT_CB *));
DWORD BtListenConOff(HANDLE device, DWORD channel, void (__stdcall *callback)(BT_CB *));
DWORD BtReadMsgOn(HANDLE device, DWORD channel, void (__stdcall *callback)(BT_RECV_CB *));
DWORD BtReadMsgOff(HANDLE device, DWORD channel, void (__stdcall *callback)(BT_CB *));
void StatusBtConnection(DWORD channel, BT_STATUS *status);

/* I2C: returns whether the transfer begins; its result is reported by callback. */
DWORD ftxI2cRead(HANDLE device, BYTE address, DWORD offset, BYTE protocol, void (__stdcall *callback)(I2C_CB *));
DWORD ftxI2cWrite(HANDLE device, BYTE address, DWORD offset, WORD data, BYTE protocol,
                  void (__stdcall *callback)(I2C_CB *));

/* Names of the first library, of 2009: StartCounterReset, StartMotorExCmd, StopMotorExCmd (two names),
   GetTransferAreaStatusAddr and GetTransferAreasArrayAddr. */
DWORD SetOutCounterReset(HANDLE device, int controller, int counter);
DWORD SetMotorExConfig(HANDLE device, int controller, int motor, int duty, int direction, int slave,
                       int slave_direction, int pulses);
DWORD ResetMotorExConfig(HANDLE device, int controller, int motor);
DWORD StopMotorExConfig(HANDLE device, int controller, int motor);
TA_STATUS *GetFtX1TransferStatusAddr(HANDLE device, int controller);
volatile TA_ARRAY *GetIF08TransferAddress(HANDLE device);

#ifdef __cplusplus
}
#endif

#endif
