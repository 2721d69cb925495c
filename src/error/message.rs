//! What an error says: a sentence for a robot builder, with what to check.

use std::fmt;

use super::Error;

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AreaCount { given } => write!(
                f,
                "{given} transfer areas were asked for, but there are 1 (the master alone) to 9 \
                 (the master and 8 extensions)"
            ),
            Self::OutOfRange { what, given, least, most } => {
                write!(f, "the {what} is {given}, but has to be {least} to {most}")
            }
            Self::NotAMotor { motor } => {
                let [first, second] = motor.outputs();
                write!(
                    f,
                    "{motor} is configured as the single outputs {first} and {second}; make it a motor \
                     by set_ft_motor_config, or use set_out_pwm_values"
                )
            }
            Self::NotAnOutput { output } => write!(
                f,
                "{output} belongs to {}, which is configured as a motor; make it two single outputs \
                 by set_ft_motor_config, or use set_out_motor_values",
                output.motor()
            ),
            Self::MotorTwice { motor } => write!(
                f,
                "{motor} is named twice in one motor command; master and slaves have to be \
                 different motors"
            ),
            Self::NotDigital { input } => write!(
                f,
                "{input} is configured to report its measured value; make it digital by \
                 set_ft_uni_config, or use get_in_io_value_analogue"
            ),
            Self::NotAnalog { input } => write!(
                f,
                "{input} is configured as digital; make it report its measured value by \
                 set_ft_uni_config, or use get_in_io_value_binary"
            ),
            Self::AlreadyStarted => write!(
                f,
                "the transfer is running already; call end_transfer before begin_transfer"
            ),
            Self::NotStarted => {
                write!(f, "no transfer is running; call begin_transfer first")
            }
            Self::NotOnline { command } => {
                write!(f, "{command} needs the controller in online mode; call start_online first")
            }
            Self::WaitTimedOut { limit } => {
                write!(
                    f,
                    "what was waited for did not come about within {limit:?}; the transfer goes on, so \
                     wait again or allow more time"
                )
            }
            Self::HostNotFound { host, reason } => write!(
                f,
                "there is no host {host:?} ({reason}); check the spelling, or use the address: \
                 192.168.7.2 for USB, 192.168.8.2 for WLAN, 192.168.9.2 for Bluetooth"
            ),
            Self::LookupTimedOut { host, limit } => write!(
                f,
                "the address of {host:?} was not found within {limit:?}; check the network and its \
                 name servers, or use the numeric address: 192.168.7.2 for USB, 192.168.8.2 for \
                 WLAN, 192.168.9.2 for Bluetooth"
            ),
            Self::ConnectionRefused { address } => write!(
                f,
                "nothing listens at {address}; check that this is the address of the TXT and that it \
                 has finished starting"
            ),
            Self::ConnectTimedOut { address, limit } => write!(
                f,
                "{address} did not answer within {limit:?}; check that the TXT is switched on and \
                 connected by USB, WLAN or Bluetooth"
            ),
            Self::ConnectFailed { address, reason } => write!(
                f,
                "no connection to {address} ({reason}); check that the TXT is switched on and \
                 connected by USB, WLAN or Bluetooth"
            ),
            Self::NotTaken { command, limit } => write!(
                f,
                "the controller did not take {command} within {limit:?}; check the connection to the \
                 TXT, or allow a longer time for writing"
            ),
            Self::NoAnswer { command, limit, received } => write!(
                f,
                "the controller did not answer {command} within {limit:?} ({received} bytes came); \
                 check the connection to the TXT, or allow a longer time for reading"
            ),
            Self::ConnectionClosed { command, received } => write!(
                f,
                "the controller closed the connection instead of answering {command} ({received} \
                 bytes came); check that the TXT is still on and no other program uses it"
            ),
            Self::Io { command, reason, .. } => write!(
                f,
                "the connection broke during {command} ({reason}); check that the TXT is still on \
                 and in reach"
            ),
            Self::WrongId { packet, expected, found } => write!(
                f,
                "expected a {packet} (id {expected:#010x}), but a packet with id {found:#010x} \
                 came; check that the other side is a TXT"
            ),
            Self::WrongSize { packet, expected, found } => write!(
                f,
                "a {packet} has {expected} bytes, but {found} came; check that the other side is \
                 a TXT with a firmware this crate knows"
            ),
            Self::TooLarge { packet, announced, limit } => write!(
                f,
                "the {packet} announces {announced} bytes of data, but at most {limit} are \
                 plausible; check that the other side is a TXT"
            ),
            Self::DataEndsEarly { expected, found } => write!(
                f,
                "the compressed data of the exchange ends after {found} of {expected} words; check \
                 that the controller's firmware is one that this crate knows, and begin again"
            ),
            Self::WrongCrc { announced, computed } => write!(
                f,
                "the exchange's checksum is {computed:#010x} instead of the announced \
                 {announced:#010x}; check that the controller's firmware is one that this crate \
                 knows, and begin again"
            ),
            Self::FirmwareTooOld { found, required } => write!(
                f,
                "the controller has firmware {found}, but at least {required} is needed; update \
                 it with ROBOPro or from an SD card"
            ),
            Self::CameraAlreadyStarted => {
                write!(f, "the camera is started already; call stop_camera first")
            }
            Self::FrameSize { announced, limit } => write!(
                f,
                "the camera announces a frame of {announced} bytes, but 1 to {limit} are \
                 plausible; check that the other side is a TXT, or allow larger frames"
            ),
            Self::BadPicture { reason } => {
                write!(f, "the camera's frame is no usable picture: {reason}")
            }
            Self::I2cNoDevice { device } => write!(
                f,
                "no I2C device answers at the address {device:#04x}; check its cable and its power, \
                 and whether the address is the one of 7 bits"
            ),
            Self::ProgramPanicked => write!(
                f,
                "a thread of the program panicked while it used the transfer area; the motors \
                 were stopped"
            ),
            Self::HookHangs { limit } => write!(
                f,
                "the cycle hook did not return within {limit:?}; the motors were stopped, and the hook is \
                 not called again; make it quick, and let it wait for nothing"
            ),
            Self::WatchdogExpired { limit } => write!(
                f,
                "the program showed no sign of life for {limit:?}, so the watchdog has set all outputs to \
                 0; find out what it waited for, or allow more time; to go on, set the outputs anew"
            ),
            Self::ConnectionLost { cause } => write!(
                f,
                "the connection to the controller was lost and is being made again; all outputs are 0 and \
                 all commands forgotten, so set them anew; what went wrong: {cause}"
            ),
            Self::ReconnectFailed { limit, cause } => write!(
                f,
                "the connection to the controller was lost and could not be made again within {limit:?}; \
                 what went wrong at last: {cause}"
            ),
            Self::Thread { reason } => {
                write!(f, "a thread for the transfer, the camera or a host name failed: {reason}")
            }
            Self::World { line: 0, reason } => {
                write!(f, "the simulated world can't be used: {reason}")
            }
            Self::World { line, reason } => {
                write!(f, "line {line} of the simulated world is wrong: {reason}")
            }
            Self::SimulatorFailed { reason } => write!(
                f,
                "the simulated TXT could not be started ({reason}); check that no other program \
                 uses its port"
            ),
        }
    }
}
