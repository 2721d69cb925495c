//! The library's errors as sentences for people who do not program.

use ft_transfer_area::tx::InvalidCall;
use ft_transfer_area::Error;

/// What went wrong. The sentences of the library, except where they are for programmers.
pub(crate) fn sentence(error: &Error) -> String {
    match error {
        Error::InvalidCall(InvalidCall::ZeroPulses) => "a distance is 1 to 65535 pulses, not 0".to_owned(),
        Error::InvalidCall(InvalidCall::NotAMotor { motor }) => {
            let [first, second] = motor.outputs();
            format!("{motor} is set to the single outputs {first} and {second}; make it a motor")
        }
        Error::InvalidCall(InvalidCall::NotAnOutput { output }) => {
            format!("{output} belongs to {}; make that two single outputs", output.motor())
        }
        Error::ConnectTimedOut { address, limit } => format!(
            "{address} did not answer within {limit:?}; check that the TXT is switched on and \
             connected by USB, Wi-Fi or Bluetooth"
        ),
        Error::NoAnswer { limit, .. } => {
            format!("the controller did not answer within {limit:?}; check the connection to it")
        }
        Error::NotTaken { limit, .. } => {
            format!("the controller took no command within {limit:?}; check the connection to it")
        }
        Error::ConnectionLost { cause } => format!(
            "the connection is lost and is being re-established; motors may go on until then, and are \
             off afterwards; what went wrong: {}",
            sentence(cause)
        ),
        other => format!("{other:#}"),
    }
}
