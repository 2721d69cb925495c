//! How a handler is set up.

use std::time::Duration;

use super::com_handler::TransferAreaComHandler;
use super::settings::Settings;
use crate::client::TimeLimits;
use crate::error::Error;
use crate::exchange::{check_area_count, TransferMode};

/// Settings of a [`TransferAreaComHandler`], made by [`TransferAreaComHandler::builder`].
///
/// ```
/// use std::time::Duration;
/// use ft_transfer_area::{TransferAreaComHandler, TransferMode};
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let handler = TransferAreaComHandler::builder("192.168.8.2")
///     .areas(2)
///     .mode(TransferMode::Compressed)
///     .reaction_window(Duration::from_millis(3))
///     .build()?;
/// # let _ = handler;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
#[must_use = "settings do nothing until build is called"]
pub struct TransferAreaComHandlerBuilder {
    settings: Settings,
    /// `None` for the port behind the main connection's.
    camera_port: Option<u16>,
    /// `None` for the second port behind the main connection's.
    i2c_port: Option<u16>,
}

impl TransferAreaComHandler {
    /// Settings for a handler of the controller at `host`, a name or a numeric address:
    /// 192.168.7.2 for USB, 192.168.8.2 for WLAN, 192.168.9.2 for Bluetooth, 127.0.0.1 on the
    /// controller itself.
    #[doc(alias = "ftIF2013TransferAreaComHandler")]
    #[doc(alias = "ftxOpenComDevice")]
    #[doc(alias = "ftxOpenComDeviceNr")]
    pub fn builder(host: impl Into<String>) -> TransferAreaComHandlerBuilder {
        TransferAreaComHandlerBuilder {
            settings: Settings::new(host.into()),
            camera_port: None,
            i2c_port: None,
        }
    }
}

impl TransferAreaComHandlerBuilder {
    /// The port of the main connection, 1..=65535. Default [`PORT`](crate::PORT), 65000. The camera's and I2C's lie
    /// behind it unless they are set, too.
    pub fn port(mut self, port: u16) -> Self {
        self.settings.port = port;
        self
    }

    /// The port of the camera's frames. Default the one behind the main connection's, 65001.
    pub fn camera_port(mut self, port: u16) -> Self {
        self.camera_port = Some(port);
        self
    }

    /// The port of I2C. Default the second one behind the main connection's, 65002.
    pub fn i2c_port(mut self, port: u16) -> Self {
        self.i2c_port = Some(port);
        self
    }

    /// How many areas there are: 1 for the master alone, 2 with one extension, up to 9.
    /// Default 1.
    #[doc(alias = "nAreas")]
    pub fn areas(mut self, areas: usize) -> Self {
        self.settings.areas = areas;
        self
    }

    /// How outputs and inputs travel. Default [`TransferMode::Compressed`].
    #[doc(alias = "SetTransferMode")]
    pub fn mode(mut self, mode: TransferMode) -> Self {
        self.settings.mode = mode;
        self
    }

    /// How long connecting, a response, and sending may take. Default 5 s, 2 s and 2 s.
    pub fn time_limits(mut self, limits: TimeLimits) -> Self {
        self.settings.limits = limits;
        self
    }

    /// How long after a response the next request is held back, so that the program can answer
    /// in it. Default 5 ms; zero sends at once, and an answer goes out a request later.
    ///
    /// The controller sends a response 10 ms after its previous one, so a window well below that
    /// costs no cycle rate; a longer one slows the cycle down, and one of some seconds makes the
    /// controller close the connection. Threads in `wait_cycle` that are done sooner end it sooner.
    pub fn reaction_window(mut self, window: Duration) -> Self {
        self.settings.reaction_window = window;
        self
    }

    /// How long a [cycle hook](TransferAreaComHandler::set_cycle_hook) may take. Default 500 ms. A hook
    /// that takes longer ends the transfer with all motors stopped and [`Error::HookHangs`]; so does one
    /// whose panic takes longer to print its backtrace.
    pub fn hook_limit(mut self, limit: Duration) -> Self {
        self.settings.hook_limit = limit;
        self
    }

    /// Stops all motors when the program shows no sign of life for so long. Off by default, because a
    /// program that sleeps while a motor runs is a good program, too.
    ///
    /// A sign of life of any thread counts: a guard that is dropped, so also one from a wait and one of a
    /// condition of [`wait_until`](crate::TransferArea::wait_until), a cycle hook that returns, or
    /// [`feed_watchdog`](crate::TransferArea::feed_watchdog). So it sees a program that hangs: in a loop
    /// without a guard, under a guard that it never drops, in a hook, waiting for a lock that nobody gives
    /// back, or because the thread that did the work is gone.
    ///
    /// With the next request, so within two cycles or as soon as the controller answers, all outputs of all
    /// controllers go to 0 and the extended motor mode is left, and they stay so until the program says that it is alive and goes on:
    /// the next wait or `feed_watchdog` returns [`Error::WatchdogExpired`], to each handle once, and from
    /// the first such error on what the program writes goes out again. Dropping a guard is not enough, so
    /// a program that polls calls `feed_watchdog` in its loop. What was written in between is thrown away.
    /// Listeners get [`Event::WatchdogExpired`](crate::Event::WatchdogExpired). The exchange goes on
    /// meanwhile.
    ///
    /// Allow for the longest pause of the program, and at least a few cycles of 10 ms; while a lost
    /// connection is made again, it waits.
    ///
    /// ```
    /// use std::time::Duration;
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::{Error, TransferAreaComHandler};
    ///
    /// fn control(host: &str) -> Result<(), Error> {
    ///     let builder = TransferAreaComHandler::builder(host);
    ///     let handler = builder.watchdog(Duration::from_millis(500)).build()?;
    ///     handler.begin_transfer()?;
    ///     loop {
    ///         match handler.wait_cycle() {
    ///             Ok(mut areas) => areas[LOCAL_IO].output.duty[0] = 512,
    ///             // All motors are stopped; this program goes on as if nothing had been.
    ///             Err(error @ Error::WatchdogExpired { .. }) => eprintln!("{error}"),
    ///             Err(error) => return Err(error),
    ///         }
    ///     }
    /// }
    /// ```
    pub fn watchdog(mut self, limit: Duration) -> Self {
        self.settings.watchdog = Some(limit);
        self
    }

    /// Makes a lost connection again, and tries that for so long. Off by default: a lost connection ends
    /// the transfer.
    ///
    /// When something is wrong with the connection, the outputs in the areas go to 0, and all commands are
    /// forgotten: none that was under way ever reads as done. The program is told at once: waits return
    /// [`Error::ConnectionLost`], to each handle once, and listeners get
    /// [`Event::ConnectionLost`](crate::Event::ConnectionLost). A program that calls again works on: it
    /// waits until the connection stands, with the configuration of all areas, and its camera if that ran.
    /// Nothing that it wrote before the gap moves a motor then; what it has written since it knew of the gap
    /// goes out with the first request. A connection that fails once more at that request is another gap.
    ///
    /// When `limit` has passed without a connection, the transfer ends with
    /// [`Error::ReconnectFailed`]. It ends at once when the firmware is too old now. Each attempt takes at
    /// most the limit for connecting and those for its answers.
    ///
    /// ```
    /// use std::time::Duration;
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::{Error, TransferAreaComHandler};
    ///
    /// fn control(host: &str) -> Result<(), Error> {
    ///     let builder = TransferAreaComHandler::builder(host);
    ///     let handler = builder.reconnect(Duration::from_secs(60)).build()?;
    ///     handler.begin_transfer()?;
    ///     loop {
    ///         match handler.wait_cycle() {
    ///             Ok(mut areas) => areas[LOCAL_IO].output.duty[0] = 512,
    ///             // A machine with positions to keep would look for them anew here.
    ///             Err(error @ Error::ConnectionLost { .. }) => eprintln!("{error}"),
    ///             Err(error) => return Err(error),
    ///         }
    ///     }
    /// }
    /// ```
    pub fn reconnect(mut self, limit: Duration) -> Self {
        self.settings.reconnect = Some(limit);
        self
    }

    /// The handler with these settings. Connects to nothing yet.
    ///
    /// # Errors
    ///
    /// [`Error::AreaCount`] unless there are 1 to 9 areas; [`Error::OutOfRange`] for a port 0, and for one
    /// behind which there is no room for the camera's and I2C's, when these are not set.
    pub fn build(self) -> Result<TransferAreaComHandler, Error> {
        let Self { mut settings, camera_port, i2c_port } = self;
        check_area_count(settings.areas)?;
        let behind = match (camera_port, i2c_port) {
            (_, None) => 2,
            (None, Some(_)) => 1,
            (Some(_), Some(_)) => 0,
        };
        let most = u16::MAX - behind;
        Error::check_range("port", settings.port, 1..=most.into())?;
        settings.camera_port = camera_port.unwrap_or(settings.port.saturating_add(1));
        settings.i2c_port = i2c_port.unwrap_or(settings.port.saturating_add(2));
        Ok(TransferAreaComHandler::new(settings))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ports(
        build: impl Fn(TransferAreaComHandlerBuilder) -> TransferAreaComHandlerBuilder,
    ) -> Result<(u16, u16), Error> {
        let handler = build(TransferAreaComHandler::builder("127.0.0.1")).build()?;
        Ok((handler.settings().camera_port, handler.settings().i2c_port))
    }

    fn refused(given: u16, most: u16) -> Result<(u16, u16), Error> {
        Err(Error::OutOfRange { what: "port", given: given.into(), least: 1, most: most.into() })
    }

    #[test]
    fn the_other_ports_lie_behind_the_main_one_or_there_is_no_handler() {
        assert_eq!(ports(|builder| builder), Ok((65_001, 65_002)));
        assert_eq!(ports(|builder| builder.port(65_533)), Ok((65_534, 65_535)));
        for port in [65_534, 65_535, 0] {
            assert_eq!(ports(|builder| builder.port(port)), refused(port, 65_533));
        }
        assert_eq!(ports(|builder| builder.port(65_534).i2c_port(7)), Ok((65_535, 7)));
        assert_eq!(ports(|b| b.port(65_535).i2c_port(7)), refused(65_535, 65_534));
        assert_eq!(ports(|b| b.port(65_535).i2c_port(7).camera_port(8)), Ok((8, 7)));
    }
}
