//! What went wrong, for a page: a code that it can translate, and a sentence.

use ft_transfer_area::tx::InvalidCall;
use ft_transfer_area::Error;
use serde::Serialize;

use crate::commands::sentence;
use crate::print::beginning;

/// How many characters a sentence has at most: some have in them what a page has sent.
const TEXT: usize = 500;

/// The code of another controller in place of the one that was driven, whose motors may go on.
pub(super) const REPLACED: &str = "replaced";

/// Why something was not done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Problem {
    pub(crate) code: &'static str,
    pub(crate) text: String,
    /// The code of what led to it. The text names it already.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) cause: Option<&'static str>,
}

impl Problem {
    pub(crate) fn new(code: &'static str, text: impl Into<String>) -> Self {
        let text = beginning(&text.into(), TEXT).into_owned();
        Self { code, text, cause: None }
    }

    /// A message that can't be understood.
    pub(crate) fn bad_message(reason: impl std::fmt::Display) -> Self {
        Self::new("bad_message", format!("the message can't be understood: {reason}"))
    }

    /// A number that is not in its range.
    pub(crate) fn out_of_range(what: &str, given: i64, least: i64, most: i64) -> Self {
        let text = format!("the {what} is {given}, but has to be {least} to {most}");
        Self::new("out_of_range", text)
    }

    /// Whether the message itself is wrong: a page that sends such a thing does not know what it does.
    pub(crate) fn is_senseless(&self) -> bool {
        matches!(self.code, "bad_message" | "out_of_range" | "zero_pulses" | "motor_twice")
    }
}

impl From<Error> for Problem {
    fn from(error: Error) -> Self {
        let cause = match &error {
            Error::ConnectionLost { cause } | Error::ReconnectFailed { cause, .. } => {
                Some(code(cause))
            }
            _ => None,
        };
        Self { code: code(&error), text: sentence(&error), cause }
    }
}

impl From<InvalidCall> for Problem {
    fn from(refused: InvalidCall) -> Self {
        Error::from(refused).into()
    }
}

fn code(error: &Error) -> &'static str {
    match error {
        Error::OutOfRange { .. } | Error::InvalidCall(InvalidCall::OutOfRange { .. }) => {
            "out_of_range"
        }
        Error::InvalidCall(InvalidCall::NotAMotor { .. }) => "not_a_motor",
        Error::InvalidCall(InvalidCall::NotAnOutput { .. }) => "not_an_output",
        Error::InvalidCall(InvalidCall::ZeroPulses) => "zero_pulses",
        Error::InvalidCall(InvalidCall::MotorTwice { .. }) => "motor_twice",
        Error::BadAddress { .. } => "bad_address",
        Error::NoController { .. } => "no_controller",
        Error::SeveralControllers { .. } => "several_controllers",
        Error::HostNotFound { .. } | Error::LookupTimedOut { .. } => "host_not_found",
        Error::ConnectionRefused { .. } => "connection_refused",
        Error::ConnectTimedOut { .. } => "connect_timed_out",
        Error::ConnectFailed { .. } => "connect_failed",
        Error::ConnectionClosed { .. } => "connection_closed",
        Error::ConnectionLost { .. } | Error::ReconnectFailed { .. } => "connection_lost",
        Error::Io { .. } => "connection_broke",
        Error::WrongId { .. }
        | Error::WrongSize { .. }
        | Error::TooLarge { .. }
        | Error::DataEndsEarly { .. }
        | Error::WrongCrc { .. } => "bad_answer",
        Error::FrameSize { .. } | Error::BadPicture { .. } => "bad_picture",
        Error::NoAnswer { .. } | Error::NotTaken { .. } => "no_answer",
        Error::FirmwareTooOld { .. } => "firmware_too_old",
        Error::NotStarted => "not_connected",
        Error::WatchdogExpired { .. } => "watchdog",
        Error::CameraAlreadyStarted => "camera_on",
        Error::I2cNoDevice { .. } => "i2c_no_device",
        _ => "controller",
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    /// 256 answers wait for a page that is slow, and for each of 200 pages.
    #[test]
    fn a_sentence_is_short_whatever_the_page_has_sent() {
        let long = "ü".repeat(8000);
        let text = Problem::bad_message(format!("there is no {long:?}")).text;
        assert!(text.len() < 1100 && text.contains("there is no") && text.ends_with('…'), "{text}");
    }

    #[test]
    fn a_lost_connection_is_told_without_names_of_functions() {
        let command = "ExchangeDataCmpr";
        let cause = Error::NoAnswer { command, limit: Duration::from_secs(2), received: 0 };
        let problem = Problem::from(Error::ConnectionLost { cause: Box::new(cause) });
        assert_eq!((problem.code, problem.cause), ("connection_lost", Some("no_answer")));
        assert!(problem.text.contains("did not answer within 2s"), "{}", problem.text);
        assert!(!problem.text.contains("time_limits"), "{}", problem.text);
    }
}
