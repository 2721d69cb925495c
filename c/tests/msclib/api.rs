//! The library's functions as its header declares them.

use std::ffi::{c_char, c_int, c_ulong, c_void};

// Links the library.
use ftMscLib as _;

pub(crate) type Handle = *mut c_void;
pub(crate) type EventCallback = Option<extern "system" fn(u32, u32)>;
/// A callback for a result.
pub(crate) type ResultCallback<T> = Option<extern "system" fn(*mut T)>;

/// What the program gives `ftxStartTransferArea2`.
pub(crate) type Context = *mut c_void;
pub(crate) type EventCallback2 = Option<extern "system" fn(u32, u32, Context)>;
pub(crate) type ResultCallback2<T> = Option<extern "system" fn(*mut T, Context)>;
pub(crate) type TextCallback2 = Option<extern "system" fn(*mut c_char, u32, Context)>;
pub(crate) type UniCallback = Option<extern "system" fn(u32, u32, u32, u32, u8, u8, Context)>;
pub(crate) type CntInCallback = Option<extern "system" fn(u32, u32, c_int, Context)>;
pub(crate) type CounterCallback = Option<extern "system" fn(u32, u32, u32, i16, Context)>;
pub(crate) type ButtonCallback = Option<extern "system" fn(u32, u32, u32, u16, Context)>;

/// `CB_LEVEL2`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Level2 {
    pub(crate) context: Context,
    pub(crate) bluetooth: bool,
    pub(crate) i2c: bool,
    pub(crate) reserved: [u32; 2],
}

/// `BT_CB` (channel, status) and `I2C_CB` (value, status).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Pair {
    pub(crate) first: u16,
    pub(crate) status: u16,
}

/// `BT_STATUS`, `BT_RECV_CB` and `BT_SCAN_STATUS`, as 16-bit words.
pub(crate) type BtStatus = [u16; 4];
pub(crate) type BtReceived = [u16; 11];
pub(crate) type BtScan = [u16; 15];

pub(crate) const SUCCESS: u32 = 0;
pub(crate) const FAILED: u32 = 0xE000_1000;
pub(crate) const INVALID_PARAM: u32 = 0xE000_1018;
pub(crate) const SOME_DEVICES_ARE_OPEN: u32 = 0xE000_1101;
pub(crate) const DEVICE_IS_OPEN: u32 = 0xE000_1102;
pub(crate) const DEVICE_NOT_OPEN: u32 = 0xE000_1103;
pub(crate) const UNKNOWN_DEVICE_HANDLE: u32 = 0xE000_1283;
pub(crate) const LIB_IS_INITIALIZED: u32 = 0xE000_1286;
pub(crate) const LIB_IS_NOT_INITIALIZED: u32 = 0xE000_1287;
pub(crate) const THREAD_IS_RUNNING: u32 = 0xE000_12A5;
pub(crate) const THREAD_NOT_RUNNING: u32 = 0xE000_12A6;
pub(crate) const UPLOAD_FAILED: u32 = 0xE000_1405;
pub(crate) const REM_CMD_NOT_SUPPORTED: u32 = 0xE000_140C;
pub(crate) const OPEN_COM: u32 = 0xE000_1906;
pub(crate) const WRONG_HOSTNAME_LEN: u32 = 0xE000_2000;
pub(crate) const INVALID_CONIDX: u32 = 0xE000_4000;

/// Declares the functions, wraps them for the tests and lists their names.
macro_rules! functions {
    ($(fn $name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)?;)+) => {
        mod exported {
            use super::*;
            extern "C" {
                $(pub(super) fn $name($($argument: $type),*) $(-> $result)?;)+
            }
        }
        $(#[allow(clippy::too_many_arguments, reason = "so many the function has")]
        pub(crate) fn $name($($argument: $type),*) $(-> $result)? {
            // SAFETY: the tests pass null, or what the header asks for.
            unsafe { exported::$name($($argument),*) }
        })+
        pub(crate) const NAMES: &[&str] = &[$(stringify!($name)),+];
    };
}

functions! {
    fn ftxGetLibVersion() -> u32;
    fn ftxGetLibVersionStr(a: *mut c_char, b: u32) -> u32;
    fn ftxInitLib() -> u32;
    fn ftxCloseLib() -> u32;
    fn ftxIsLibInit() -> u32;
    fn ftxGetSerialNrStrg(a: Handle, b: *mut c_char, c: u32) -> u32;
    fn ftxGetFirmwareStrg(a: Handle, b: *mut c_char, c: u32) -> u32;
    fn ftxGetManufacturerStrg(a: Handle, b: *mut c_char, c: u32) -> u32;
    fn ftxGetShortNameStrg(a: Handle, b: *mut c_char, c: u32) -> u32;
    fn ftxGetLongNameStrg(a: Handle, b: *mut c_char, c: u32) -> u32;
    fn ftxGetLibErrorString(a: u32, b: u32, c: *mut c_char, d: u32) -> u32;
    fn ftxOpenComDevice(a: *const c_char, b: u32, c: *mut u32) -> Handle;
    fn ftxOpenComDeviceNr(a: u32, b: u32, c: *mut u32) -> Handle;
    fn ftxCloseDevice(a: Handle) -> u32;
    fn ftxCloseAllDevices() -> u32;
    fn ftxStartTransferArea(a: Handle) -> u32;
    fn ftxStopTransferArea(a: Handle) -> u32;
    fn ftxIsTransferActiv(a: Handle) -> u32;
    fn GetTransferAreasArrayAddr(a: Handle) -> *mut c_void;
    fn GetTransferAreaStatusAddr(a: Handle, b: c_int) -> *mut u8;
    fn ftxIsHandleValid(a: Handle) -> u32;
    fn GetComStatus(a: Handle) -> u32;
    fn GetAvailableComPorts(a: c_int) -> u32;
    fn EnumComPorts(a: u32, b: *mut c_char, c: u32) -> u32;
    fn StartCounterReset(a: Handle, b: c_int, c: c_int) -> u32;
    fn SetCBCounterResetted(a: EventCallback);
    fn SetOutMotorValues(a: Handle, b: c_int, c: c_int, d: c_int, e: c_int) -> u32;
    fn SetOutPwmValues(a: Handle, b: c_int, c: c_int, d: c_int) -> u32;
    fn StartMotorExCmd(a: Handle, b: c_int, c: c_int, d: c_int, e: c_int, f: c_int, g: c_int, h: c_int) -> u32;
    fn StopAllMotorExCmd(a: Handle, b: c_int) -> u32;
    fn StopMotorExCmd(a: Handle, b: c_int, c: c_int) -> u32;
    fn SetCBMotorExReached(a: EventCallback);
    fn SetRoboTxDevName(a: Handle, b: c_int, c: *mut c_char) -> u32;
    fn SetRoboTxMessage(a: Handle, b: c_int, c: *const c_char) -> u32;
    fn SetFtUniConfig(a: Handle, b: c_int, c: c_int, d: c_int, e: bool) -> u32;
    fn SetFtCntConfig(a: Handle, b: c_int, c: c_int, d: c_int) -> u32;
    fn SetFtMotorConfig(a: Handle, b: c_int, c: c_int, d: bool) -> u32;
    fn GetInIOValue(a: Handle, b: c_int, c: c_int, d: *mut i16, e: *mut u32) -> u32;
    fn GetInCounterValue(a: Handle, b: c_int, c: c_int, d: *mut i16, e: *mut i16) -> u32;
    fn GetInDisplayButtonValue(a: Handle, b: c_int, c: *mut i16, d: *mut i16) -> u32;
    fn FtRemoteCmd(a: Handle, b: *mut c_char, c: ResultCallback<c_char>) -> u32;
    fn FtFileUpload(a: Handle, b: *mut c_char, c: u32, d: EventCallback) -> u32;
    fn FtRamFileUpload(a: Handle, b: u32, c: *const c_void, d: u32, e: *const c_char, f: EventCallback) -> u32;
    fn RTxCleanDisk(a: Handle, b: u32) -> u32;
    fn FtProgramRun(a: Handle, b: c_int) -> u32;
    fn FtProgramStop(a: Handle, b: c_int) -> u32;
    fn GetRoboTxInfo(a: Handle, b: c_int) -> u32;
    fn GetRoboTxMasterState(a: Handle) -> u32;
    fn GetRoboTxSlaveState(a: Handle, b: *mut u8) -> u32;
    fn GetRoboTxSlaveAlive(a: Handle, b: c_int, c: *mut c_int) -> u32;
    fn GetRoboTxBtStatus(a: Handle, b: *mut BtStatus) -> u32;
    fn GetRoboTxDevName(a: Handle, b: c_int, c: *mut c_char, d: u32) -> u32;
    fn GetRoboTxBtAddr(a: Handle, b: c_int, c: *mut c_char, d: u32) -> u32;
    fn GetRoboTxFwStr(a: Handle, b: c_int, c: *mut c_char, d: u32) -> u32;
    fn GetRoboTxFwVal(a: Handle, b: c_int, c: *mut u32) -> u32;
    fn GetRoboTxHwStr(a: Handle, b: c_int, c: *mut c_char, d: u32) -> u32;
    fn GetRoboTxMemLayout(a: Handle, b: c_int, c: *mut c_ulong, d: *mut c_ulong, e: *mut c_ulong) -> u32;
    fn GetRoboTxSerialStr(a: Handle, b: c_int, c: *mut c_char, d: u32) -> u32;
    fn GetRoboTxDllStr(a: Handle, b: c_int, c: *mut c_char, d: u32) -> u32;
    fn SetCBRoboExtState(a: EventCallback);
    fn GetSessionId() -> u32;
    fn GetTrapStatistic(a: Handle, b: *mut u32, c: *mut u32, d: *mut u32, e: *mut u32, f: *mut u32, g: *mut u32) -> u32;
    fn ResetTrapStatistic(a: Handle);
    fn RoboTxFwUpdate(a: Handle, b: *const c_char, c: EventCallback) -> u32;
    fn StartScanBtDevice(a: Handle, b: ResultCallback<BtScan>) -> u32;
    fn CancelScanBtDevice(a: Handle) -> u32;
    fn ConnectBtAddress(a: Handle, b: u32, c: *mut u8, d: ResultCallback<Pair>) -> u32;
    fn DisconnectBt(a: Handle, b: u32, c: ResultCallback<Pair>) -> u32;
    fn SendBtMessage(a: Handle, b: u32, c: u32, d: *mut c_char, e: ResultCallback<Pair>) -> u32;
    fn BtListenConOn(a: Handle, b: u32, c: *mut u8, d: ResultCallback<Pair>) -> u32;
    fn BtListenConOff(a: Handle, b: u32, c: ResultCallback<Pair>) -> u32;
    fn BtReadMsgOn(a: Handle, b: u32, c: ResultCallback<BtReceived>) -> u32;
    fn BtReadMsgOff(a: Handle, b: u32, c: ResultCallback<Pair>) -> u32;
    fn StatusBtConnection(a: u32, b: *mut BtStatus);
    fn ftxI2cRead(a: Handle, b: u8, c: u32, d: u8, e: ResultCallback<Pair>) -> u32;
    fn ftxI2cWrite(a: Handle, b: u8, c: u32, d: u16, e: u8, f: ResultCallback<Pair>) -> u32;
    fn SetOutCounterReset(a: Handle, b: c_int, c: c_int) -> u32;
    fn SetMotorExConfig(a: Handle, b: c_int, c: c_int, d: c_int, e: c_int, f: c_int, g: c_int, h: c_int) -> u32;
    fn ResetMotorExConfig(a: Handle, b: c_int, c: c_int) -> u32;
    fn StopMotorExConfig(a: Handle, b: c_int, c: c_int) -> u32;
    fn GetFtX1TransferStatusAddr(a: Handle, b: c_int) -> *mut u8;
    fn GetIF08TransferAddress(a: Handle) -> *mut c_void;
    fn ftxGetLibVersionEx() -> u32;
    fn ftxGetLibVersionStrEx(a: *mut c_char, b: u32) -> u32;
    fn ftxStartTransferArea2(a: Handle, b: Level2) -> u32;
    fn SetCBCounterResetted2(a: EventCallback2);
    fn SetCBMotorExReached2(a: EventCallback2);
    fn SetCBRoboExtState2(a: EventCallback2);
    fn FtRemoteCmd2(a: Handle, b: *mut c_char, c: TextCallback2) -> u32;
    fn SetCBUniChanged(a: UniCallback);
    fn SetCBMaskUniChanged(a: Handle, b: c_int, c: u32) -> u32;
    fn GetCBMaskUniChanged(a: Handle, b: c_int, c: *mut u32) -> u32;
    fn SetCBCntInChanged(a: CntInCallback);
    fn SetCBMaskCntInChanged(a: Handle, b: c_int, c: u32) -> u32;
    fn GetCBMaskCntInChanged(a: Handle, b: c_int, c: *mut u32) -> u32;
    fn SetCBCounterChanged(a: CounterCallback);
    fn SetCBMaskCounterChanged(a: Handle, b: c_int, c: u32) -> u32;
    fn GetCBMaskCounterChanged(a: Handle, b: c_int, c: *mut u32) -> u32;
    fn SetCBButtonChanged(a: ButtonCallback);
    fn StartMotorExCmd4(a: Handle, b: c_int, c: c_int, d: c_int, e: c_int, f: c_int, g: c_int, h: c_int, i: c_int, j: c_int, k: c_int, l: c_int) -> u32;
    fn StartScanBtDevice2(a: Handle, b: ResultCallback2<BtScan>) -> u32;
    fn ConnectBtAddress2(a: Handle, b: u32, c: *mut u8, d: ResultCallback2<Pair>) -> u32;
    fn BtListenConOn2(a: Handle, b: u32, c: *mut u8, d: ResultCallback2<Pair>) -> u32;
    fn BtListenConOff2(a: Handle, b: u32, c: ResultCallback2<Pair>) -> u32;
    fn DisconnectBt2(a: Handle, b: u32, c: ResultCallback2<Pair>) -> u32;
    fn SendBtMessage2(a: Handle, b: u32, c: u32, d: *mut c_char, e: ResultCallback2<Pair>) -> u32;
    fn BtReadMsgOn2(a: Handle, b: u32, c: ResultCallback2<BtReceived>) -> u32;
    fn BtReadMsgOff2(a: Handle, b: u32, c: ResultCallback2<Pair>) -> u32;
    fn ftxI2cRead2(a: Handle, b: u8, c: u32, d: u8, e: ResultCallback2<Pair>) -> u32;
    fn ftxI2cWrite2(a: Handle, b: u8, c: u32, d: u16, e: u8, f: ResultCallback2<Pair>) -> u32;
}
