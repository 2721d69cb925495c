/* ftMscLibEx, the variant of ftMscLib for PC programs: all of ftMscLib, callbacks with a pointer of the program's
   (the context), callbacks for changes of inputs, and up to three motors that follow one. */
#ifndef FT_MSC_LIB_EX_H
#define FT_MSC_LIB_EX_H

#include "ftMscLib.h"

/* What ftxStartTransferArea2 is given. The two switches mean nothing here: each function says itself whether its
   callback gets the context. */
typedef struct _cb_level2 {
    void *ptrContext;
#ifdef __cplusplus
    bool CbLevelCppBT;
    bool CbLevelCppI2C;
#else
    BOOL8 CbLevelCppBT;
    BOOL8 CbLevelCppI2C;
#endif
    DWORD reserved1;
    DWORD reserved2;
#ifdef __cplusplus
    _cb_level2() { reset(); }
    void reset()
    {
        ptrContext = 0;
        CbLevelCppBT = CbLevelCppI2C = false;
        reserved1 = reserved2 = 0;
    }
#endif
} CB_LEVEL2;

#ifdef __cplusplus
extern "C" {
#endif

/* Callbacks for the result of a request. */
typedef void __stdcall tCBBtApi2(void *, void *context);
typedef void __stdcall tCBBtScan2(BT_SCAN_STATUS *, void *context);
typedef void __stdcall tCBBtStat2(BT_CB *, void *context);
typedef void __stdcall tCBBtMsg2(BT_RECV_CB *, void *context);
typedef void __stdcall tCBI2cStat2(I2C_CB *, void *context);
typedef tCBBtApi2 *CBBTAPI2;
typedef tCBBtScan2 *CBBTSCAN2;
typedef tCBBtStat2 *CBBTSTAT2;
typedef tCBBtMsg2 *CBBTMSG2;
typedef tCBI2cStat2 *CBI2CSTAT2;

/* The version of ftMscLibEx, which programs compare. Both libraries have all functions, and a program that is linked to
   ftMscLib finds it under these names. */
DWORD ftxGetLibVersionEx(void);
DWORD ftxGetLibVersionStrEx(LPSTR text, DWORD size);
#define ftxGetLibVersion ftxGetLibVersionEx
#define ftxGetLibVersionStr ftxGetLibVersionStrEx

/* The transfer, with the context that all callbacks below get. */
DWORD ftxStartTransferArea2(HANDLE device, CB_LEVEL2 info);

/* The callbacks of ftMscLib with a context. */
void SetCBCounterResetted2(void (__stdcall *callback)(DWORD controller, DWORD counter, void *context));
void SetCBMotorExReached2(void (__stdcall *callback)(DWORD controller, DWORD motor, void *context));
void SetCBRoboExtState2(void (__stdcall *callback)(DWORD controller, DWORD state, void *context));
DWORD FtRemoteCmd2(HANDLE device, char *command,
                   void (__stdcall *callback)(LPSTR text, DWORD size, void *context));

/* Called when an input has changed that is in the mask of its controller: bit 0 is I1 or C1. All masks are 0 when a
   device is opened. */
void SetCBUniChanged(void (__stdcall *callback)(DWORD controller, DWORD input, DWORD value, DWORD overrun, UINT8 mode,
                                                BOOL8 digital, void *context));
DWORD SetCBMaskUniChanged(HANDLE device, int controller, DWORD mask);
DWORD GetCBMaskUniChanged(HANDLE device, int controller, DWORD *mask);
void SetCBCntInChanged(void (__stdcall *callback)(DWORD controller, DWORD counter, BOOL level, void *context));
DWORD SetCBMaskCntInChanged(HANDLE device, int controller, DWORD mask);
DWORD GetCBMaskCntInChanged(HANDLE device, int controller, DWORD *mask);
void SetCBCounterChanged(void (__stdcall *callback)(DWORD controller, DWORD counter, DWORD count, INT16 mode,
                                                    void *context));
DWORD SetCBMaskCounterChanged(HANDLE device, int controller, DWORD mask);
DWORD GetCBMaskCounterChanged(HANDLE device, int controller, DWORD *mask);
void SetCBButtonChanged(void (__stdcall *callback)(DWORD controller, DWORD button, DWORD duration, BOOL16 pressed,
                                                   void *context));

/* A motor with up to three that follow it. There is no such one where its index is the motor's own or out of range, as
   -1 and 255. */
DWORD StartMotorExCmd4(HANDLE device, int controller, int motor, int duty, int direction, int slave_1,
                       int slave_direction_1, int slave_2, int slave_direction_2, int slave_3, int slave_direction_3,
                       int pulses);

/* Bluetooth and I2C with a context. */
DWORD StartScanBtDevice2(HANDLE device, CBBTSCAN2 callback);
DWORD ConnectBtAddress2(HANDLE device, DWORD channel, BYTE *address, CBBTSTAT2 callback);
DWORD BtListenConOn2(HANDLE device, DWORD channel, BYTE *address, CBBTSTAT2 callback);
DWORD BtListenConOff2(HANDLE device, DWORD channel, CBBTSTAT2 callback);
DWORD DisconnectBt2(HANDLE device, DWORD channel, CBBTSTAT2 callback);
DWORD SendBtMessage2(HANDLE device, DWORD channel, DWORD size, LPSTR message, CBBTSTAT2 callback);
DWORD BtReadMsgOn2(HANDLE device, DWORD channel, CBBTMSG2 callback);
DWORD BtReadMsgOff2(HANDLE device, DWORD channel, CBBTSTAT2 callback);
DWORD ftxI2cRead2(HANDLE device, BYTE address, DWORD offset, BYTE protocol, CBI2CSTAT2 callback);
DWORD ftxI2cWrite2(HANDLE device, BYTE address, DWORD offset, WORD data, BYTE protocol, CBI2CSTAT2 callback);

#ifdef __cplusplus
}
#endif

#endif
