//! The error codes of the C libraries.

use ft_transfer_area::tx::InvalidCall;
use ft_transfer_area::Error;

/// A code with its name and its sentence.
pub(crate) struct Code {
    pub(crate) value: u32,
    pub(crate) name: &'static str,
    pub(crate) text: &'static str,
}

macro_rules! codes {
    ($($name:ident = $value:literal, $text:literal;)+) => {
        $(
            #[doc = $text]
            #[allow(dead_code, reason = "the table has all that programs know")]
            pub(crate) const $name: u32 = $value;
        )+
        /// All codes.
        pub(crate) const CODES: &[Code] =
            &[$(Code { value: $value, name: stringify!($name), text: $text }),+];
    };
}

codes!(
    FTLIB_ERR_SUCCESS = 0x0000_0000, "No error";
    FTLIB_ERR_NO_MEMORY = 0xE000_0100, "Not enough memory";
    FTLIB_ERR_FAILED = 0xE000_1000, "It has failed";
    FTLIB_ERR_TIMEOUT = 0xE000_100C, "No answer in time";
    FTLIB_ERR_INVALID_PARAM = 0xE000_1018, "An argument is out of range";
    FTLIB_ERR_SOME_DEVICES_ARE_OPEN = 0xE000_1101, "Other devices are open";
    FTLIB_ERR_DEVICE_IS_OPEN = 0xE000_1102, "The device is open already";
    FTLIB_ERR_DEVICE_NOT_OPEN = 0xE000_1103, "The device is not open";
    FTLIB_ERR_NO_SUCH_DEVICE_INSTANCE = 0xE000_1104, "There is no such device";
    FTLIB_ERR_UNKNOWN_DEVICE_HANDLE = 0xE000_1283, "The handle is none of an open device";
    FTLIB_ERR_LIB_IS_INITIALIZED = 0xE000_1286, "The library is initialized";
    FTLIB_ERR_LIB_IS_NOT_INITIALIZED = 0xE000_1287, "The library is not initialized";
    FTLIB_ERR_THREAD_NOT_STARTABLE = 0xE000_12A0, "The transfer could not be started";
    FTLIB_ERR_THREAD_IS_RUNNING = 0xE000_12A5, "The transfer is running";
    FTLIB_ERR_THREAD_NOT_RUNNING = 0xE000_12A6, "The transfer is not running";
    FTLIB_ERR_THREAD_SYNCHRONIZED = 0xE000_12AF, "The transfer is being synchronized";
    FTLIB_ERR_TIMEOUT_TA = 0xE000_12B0, "The transfer area was not exchanged in time";
    FTLIB_ERR_CREATE_EVENT = 0xE000_12B1, "An event could not be created";
    FTLIB_ERR_CREATE_MM_TIMER = 0xE000_12B2, "A timer could not be created";
    FTLIB_ERR_UPLOAD_FILE_NOT_OPEN = 0xE000_1400, "The file could not be opened";
    FTLIB_ERR_UPLOAD_FAILED = 0xE000_1405, "The upload has failed";
    FTLIB_ERR_REM_CMD_FAILED = 0xE000_140B, "The remote command has failed";
    FTLIB_ERR_REM_CMD_NOT_SUPPORTED = 0xE000_140C, "Remote commands are not supported";
    FTLIB_ERR_ACCESS_DENIED = 0xE000_1905, "Access denied";
    FTLIB_ERR_OPEN_COM = 0xE000_1906, "The port could not be opened";
    FTLIB_ERR_INIT_COM = 0xE000_1908, "The port could not be set up";
    FTLIB_ERR_INIT_COM_TIMEOUT = 0xE000_1909, "The port was not set up in time";
    FTLIB_ERR_WRONG_HOSTNAME_LEN = 0xE000_2000, "The name is too long or empty";
    FTLIB_BT_INVALID_CONIDX = 0xE000_4000, "There is no such Bluetooth channel";
    FTLIB_BT_CON_NOT_EXISTS = 0xE000_4001, "There is no Bluetooth connection";
    FTLIB_BT_CON_ACTIVE = 0xE000_4002, "The Bluetooth connection is active";
    FTLIB_BT_CON_INACTIVE = 0xE000_4003, "The Bluetooth connection is not active";
    FTLIB_BT_CON_WRONG_ADDR = 0xE000_4004, "The Bluetooth address is wrong";
    FTLIB_BT_CON_WAIT_BUSY = 0xE000_4005, "The Bluetooth channel is busy";
    FTLIB_I2C_INVALID_DEV_ADDR = 0xE000_5000, "The I2C address is not allowed";
    FTLIB_I2C_C_INVALID_FLAGS_ADDRMODE = 0xE000_5001, "The I2C flags have a wrong address mode";
    FTLIB_I2C_C_INVALID_FLAGS_DATAMODE = 0xE000_5002, "The I2C flags have a wrong data mode";
    FTLIB_I2C_C_INVALID_FLAGS_ERRMODE = 0xE000_5003, "The I2C flags have a wrong error mode";
    FTLIB_ERR_UNKNOWN = 0xEFFF_FFFF, "Unknown error";
);

/// The code that says an error of the Rust library best.
pub(crate) fn code_of(error: &Error) -> u32 {
    match error {
        Error::OutOfRange { .. }
        | Error::BadAddress { .. }
        | Error::InvalidCall(
            InvalidCall::OutOfRange { .. }
            | InvalidCall::MotorTwice { .. }
            | InvalidCall::ZeroPulses,
        ) => FTLIB_ERR_INVALID_PARAM,
        Error::AlreadyStarted => FTLIB_ERR_THREAD_IS_RUNNING,
        Error::NotStarted => FTLIB_ERR_THREAD_NOT_RUNNING,
        Error::NoAnswer { .. } | Error::NotTaken { .. } | Error::WaitTimedOut { .. } => {
            FTLIB_ERR_TIMEOUT_TA
        }
        Error::ConnectTimedOut { .. } | Error::LookupTimedOut { .. } => FTLIB_ERR_INIT_COM_TIMEOUT,
        Error::ConnectFailed { .. }
        | Error::ConnectionRefused { .. }
        | Error::HostNotFound { .. }
        | Error::NoController { .. }
        | Error::SeveralControllers { .. } => FTLIB_ERR_OPEN_COM,
        Error::ThreadNotStarted { .. } => FTLIB_ERR_THREAD_NOT_STARTABLE,
        _ => FTLIB_ERR_FAILED,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_codes_are_the_same() {
        for (index, code) in CODES.iter().enumerate() {
            assert!(CODES[..index].iter().all(|other| other.value != code.value), "{}", code.name);
        }
    }
}
