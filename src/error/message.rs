//! The errors' messages: a sentence for a robot builder, with what to check.

use std::error::Error as _;
use std::fmt;

use super::Error;

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.sentence(f)?;
        match self.source() {
            Some(cause) if f.alternate() => write!(f, ": {cause:#}"),
            _ => Ok(()),
        }
    }
}

impl Error {
    /// Writes what happened and what to check, without what led to it.
    fn sentence(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AreaCount { given } => write!(
                f,
                "{given} transfer areas were asked for, but there are 1 (the master alone) to 9 \
                 (the master and 8 extensions)"
            ),
            Self::OutOfRange { what, given, least, most } => {
                write!(f, "the {what} is {given}, but has to be {least} to {most}")
            }
            Self::InvalidCall(refused) => write!(f, "{refused}"),
            Self::AlreadyStarted => write!(
                f,
                "the transfer is already running; call end_transfer before begin_transfer"
            ),
            Self::NotStarted => {
                write!(f, "no transfer is running; call begin_transfer first")
            }
            Self::NotOnline { command: "an I2C request" } => write!(
                f,
                "an I2C request needs a transfer that runs; call begin_transfer (TxtClient: start_online) first, \
                 or wait until a lost connection is re-established"
            ),
            Self::NotOnline { command } => {
                write!(f, "{command} needs the controller in online mode; call start_online first")
            }
            Self::WaitTimedOut { limit } => {
                write!(
                    f,
                    "what the program waited for did not happen within {limit:?}; the transfer goes on, \
                     so wait again or allow more time"
                )
            }
            Self::BadAddress { given } => write!(
                f,
                "{given:?} is not a controller's address; write just the host, such as 192.168.7.2, or \
                 a host and a port of 1 to 65535, such as 192.168.7.2:65000 or [::1]:65000"
            ),
            Self::NoController { tried } => {
                // The lines after the first one are for those who want to know more.
                f.write_str(
                    "no controller was found; switch the TXT on and connect it, or start a simulated one with \
                     `txt simulate`",
                )?;
                for address in tried {
                    write!(f, "\n  {address}")?;
                }
                f.write_str(
                    "\n  A TXT must have finished starting, its cable must be plugged in or the PC be in its Wi-Fi \
                     or paired by Bluetooth, and no other program may use it. For a TXT in another network, give \
                     its address.",
                )
            }
            Self::SeveralControllers { found, in_use } => {
                let which = match &in_use[..] {
                    [] => format!("there are several controllers: {}", list(found)),
                    _ => format!(
                        "there is {}, and perhaps another controller, which a program uses: {}",
                        list(found),
                        list(in_use)
                    ),
                };
                write!(
                    f,
                    "{which}; use the address of the one to control instead of \"auto\", so that the right machine \
                     moves"
                )
            }
            Self::HostNotFound { host, cause: _ } => write!(
                f,
                "there is no host {host:?}; check the spelling, or use the address: \
                 192.168.7.2 for USB, 192.168.8.2 for Wi-Fi, 192.168.9.2 for Bluetooth"
            ),
            Self::LookupTimedOut { host, limit } => write!(
                f,
                "the address of {host:?} was not found within {limit:?}; check the network and its \
                 name servers, or use the numeric address: 192.168.7.2 for USB, 192.168.8.2 for \
                 Wi-Fi, 192.168.9.2 for Bluetooth"
            ),
            Self::ConnectionRefused { address } if address.starts_with("127.0.0.1:") => write!(
                f,
                "nothing listens at {address}, which is this computer; the program `txt simulate` starts a \
                 simulated TXT here, and a real one has another address, such as 192.168.7.2 for USB"
            ),
            Self::ConnectionRefused { address } => write!(
                f,
                "nothing listens at {address}; check that this is the address of the TXT and that it \
                 has finished starting"
            ),
            Self::ConnectTimedOut { address, limit } => write!(
                f,
                "{address} did not answer within {limit:?}; check that the TXT is switched on and \
                 connected by USB, Wi-Fi or Bluetooth, or allow more time for connecting by time_limits"
            ),
            Self::ConnectFailed { address, cause: _ } => write!(
                f,
                "no connection to {address}; check that the TXT is switched on and \
                 connected by USB, Wi-Fi or Bluetooth"
            ),
            Self::NotTaken { command, limit } => write!(
                f,
                "the controller did not take {command} within {limit:?}; check the connection to the \
                 TXT, or allow more time for writing by time_limits"
            ),
            // Of the maker's firmware 4.7.0, measured under emulation, like the next special case.
            Self::NoAnswer { command: "QueryStatus", limit, received: 0 } => write!(
                f,
                "the controller did not answer QueryStatus within {limit:?} (0 bytes came); another \
                 program is probably online with the TXT, which answers one at a time: end that \
                 program, or check the connection to the TXT"
            ),
            Self::NoAnswer { command, limit, received } => write!(
                f,
                "the controller did not answer {command} within {limit:?} ({received} bytes came); \
                 check the connection to the TXT, or allow more time for reading by time_limits"
            ),
            Self::ConnectionClosed { command: "StartOnline", received: 0 } => write!(
                f,
                "the controller closed the connection instead of answering StartOnline (0 bytes \
                 came); if another program was online in the last 5 s, the TXT's firmware has ended \
                 and is back in some seconds: try again then, or check that the TXT is still on"
            ),
            Self::ConnectionClosed { command, received } => write!(
                f,
                "the controller closed the connection instead of answering {command} ({received} \
                 bytes came); check that the TXT is still on; its firmware may have ended, and is back in \
                 some seconds"
            ),
            Self::Io { command, cause: _ } => write!(
                f,
                "the connection broke during {command}; check that the TXT is still on \
                 and in reach"
            ),
            Self::WrongId { packet, expected, found } => write!(
                f,
                "expected {} {packet} (id {expected:#010x}), but a packet with id {found:#010x} \
                 came; check that the other side is a TXT",
                article(packet)
            ),
            Self::WrongSize { packet, expected, found } => write!(
                f,
                "{} {packet} has {expected} bytes, but {found} came; check that the other side is \
                 a TXT with a firmware this crate knows",
                article(packet)
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
                write!(f, "the camera is already started; call stop_camera first")
            }
            Self::FrameSize { announced, limit } => write!(
                f,
                "the camera announces a frame of {announced} bytes, but 1 to {limit} are \
                 plausible; check that the other side is a TXT, or allow larger frames by \
                 CameraOptions::max_frame_size"
            ),
            Self::BadPicture { reason } => {
                write!(f, "the camera's frame is not a usable picture: {reason}")
            }
            Self::I2cNoDevice { device } => write!(
                f,
                "no I2C device answers at the address {device:#04x}; check its cable and its power, \
                 and whether this is the 7-bit address"
            ),
            Self::ProgramPanicked => write!(
                f,
                "a thread of the program panicked while it used the transfer area; the motors \
                 were stopped if the connection still worked"
            ),
            Self::WatchdogExpired { limit } => write!(
                f,
                "the program showed no sign of life for {limit:?}, so the watchdog has set all outputs to \
                 0; find out where it hung, or allow more time by watchdog; to go on, set the outputs again"
            ),
            Self::ConnectionLost { cause: _ } => write!(
                f,
                "the connection to the controller was lost and is being re-established; motors may go on \
                 until then; all outputs in the areas are 0 and all commands forgotten, so set them again"
            ),
            Self::ReconnectFailed { limit, cause: _ } => write!(
                f,
                "the connection to the controller was lost and could not be re-established within {limit:?}, \
                 the limit that reconnect has set"
            ),
            Self::ThreadNotStarted { cause: _ } => write!(
                f,
                "the operating system could not start a thread; check how many threads this \
                 program has, and how many it may have"
            ),
            Self::ThreadPanicked { reason } => write!(
                f,
                "a thread of ft-transfer-area panicked ({reason}); this is a bug in that library, \
                 please report it"
            ),
        }
    }
}

/// The article before a packet's name.
fn article(packet: &str) -> &'static str {
    if packet.starts_with(['A', 'E', 'I', 'O', 'U', 'a', 'e', 'i', 'o', 'u']) {
        "an"
    } else {
        "a"
    }
}

/// The items, separated by commas.
fn list(items: &[impl ToString]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::CommandId;

    #[test]
    fn debug_shows_the_sentence_and_what_led_to_it() {
        let range = Error::OutOfRange { what: "duty", given: 513, least: -512, most: 512 };
        assert_eq!(format!("{range:?}"), "the duty is 513, but has to be -512 to 512");
        let lost = Error::ConnectionLost { cause: Box::new(range) };
        assert_eq!(format!("{lost:?}"), format!("{lost:#}"));
    }

    #[test]
    fn the_first_two_commands_name_their_usual_reason() {
        let limit = std::time::Duration::from_secs(2);
        let silent = |command| Error::NoAnswer { command, limit, received: 0 }.to_string();
        let closed = |command| Error::ConnectionClosed { command, received: 0 }.to_string();
        let [query, start, stop] =
            [CommandId::QueryStatus, CommandId::StartOnline, CommandId::StopOnline]
                .map(CommandId::name);
        assert!(silent(query).contains("another program is probably online"));
        assert!(!silent(stop).contains("another program"));
        assert!(closed(start).contains("try again then"));
        assert!(!closed(stop).contains("try again"));
    }

    #[test]
    fn on_this_computer_the_simulated_txt_may_be_missing() {
        let refused = |address: &str| Error::ConnectionRefused { address: address.to_owned() };
        assert!(refused("127.0.0.1:65000").to_string().contains("txt simulate"));
        assert!(!refused("192.168.7.2:65000").to_string().contains("txt simulate"));
    }

    #[test]
    fn packets_have_their_article() {
        for (packet, start) in [
            ("ExchangeDataCmpr response", "expected an ExchangeDataCmpr response ("),
            ("QueryStatus response", "expected a QueryStatus response ("),
        ] {
            let id = Error::WrongId { packet, expected: 1, found: 2 };
            assert!(id.to_string().starts_with(start), "{id}");
        }
        let size = Error::WrongSize { packet: "UpdateConfig", expected: 2, found: 1 };
        assert!(size.to_string().starts_with("an UpdateConfig has 2 bytes"), "{size}");
    }
}
