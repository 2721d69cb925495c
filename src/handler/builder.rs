//! How a handler is set up.

use std::ops::RangeInclusive;
use std::time::Duration;

use crate::client::{host_and_port, TimeLimits, LIMIT_RANGE, PORT};
use crate::error::Error;
use crate::exchange::{check_area_count, TransferMode};
use crate::handler::com_handler::TransferAreaComHandler;
use crate::handler::settings::Settings;

/// In ms. The controller closes the connection much sooner, and a transfer with a longer window seems to hang.
const WINDOW_RANGE: RangeInclusive<i64> = 0..=60_000;

/// Settings of a [`TransferAreaComHandler`], made by [`TransferAreaComHandler::builder`].
///
/// ```
/// use std::time::Duration;
/// use ft_transfer_area::prelude::*;
/// use ft_transfer_area::TransferMode;
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
    /// `None` for the main connection's port plus 1.
    camera_port: Option<u16>,
    /// `None` for the main connection's port plus 2.
    i2c_port: Option<u16>,
}

impl TransferAreaComHandler {
    /// Settings for a handler of the controller at `address`, a host's name or its numeric address:
    /// 192.168.7.2 for USB, 192.168.8.2 for Wi-Fi, 192.168.9.2 for Bluetooth, 127.0.0.1 on the
    /// controller itself. The port of the main connection may follow, if it is not [`PORT`](crate::PORT), 65000:
    /// `"192.168.7.2:4000"`, `"[::1]:4000"`. The camera's and I2C's are the next two ports unless they are set.
    ///
    /// The host `auto` means the only controller that [`find_controllers`](crate::find_controllers) finds.
    /// The search runs when a transfer begins, and takes up to 1.5 s more; a lost connection is re-established
    /// to the same controller. When several are found, the transfer does not begin, because a program for
    /// one machine must not move another.
    #[doc(alias = "ftIF2013TransferAreaComHandler")]
    #[doc(alias = "ftxOpenComDevice")]
    #[doc(alias = "ftxOpenComDeviceNr")]
    pub fn builder(address: impl ToString) -> TransferAreaComHandlerBuilder {
        TransferAreaComHandlerBuilder {
            settings: Settings::new(address.to_string()),
            camera_port: None,
            i2c_port: None,
        }
    }
}

impl TransferAreaComHandlerBuilder {
    /// The port of the camera's frames. Default the main connection's plus 1, 65001.
    pub fn camera_port(mut self, port: u16) -> Self {
        self.camera_port = Some(port);
        self
    }

    /// The port of I2C. Default the main connection's plus 2, 65002.
    ///
    /// A transfer connects to it when it begins, if it is 65002 or set here; another one is connected to by the first
    /// I2C request.
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

    /// How outputs and inputs are sent. Default [`TransferMode::Compressed`].
    #[doc(alias = "SetTransferMode")]
    pub fn mode(mut self, mode: TransferMode) -> Self {
        self.settings.mode = mode;
        self
    }

    /// How long connecting, a response, and sending may take, each 1 ms to an hour. Default 5 s, 2 s and 2 s.
    pub fn time_limits(mut self, limits: TimeLimits) -> Self {
        self.settings.limits = limits;
        self
    }

    /// How long after a response the next request is held back, so that it can contain the program's
    /// answer. Default 5 ms, at most a minute; zero sends immediately, and an answer goes out one request later.
    ///
    /// The controller sends a response 10 ms after its previous one, so a window well below that
    /// does not slow the cycle; a longer one does, and one of some seconds makes the
    /// controller close the connection. Threads in `wait_cycle` that are done sooner end it sooner.
    pub fn reaction_window(mut self, window: Duration) -> Self {
        self.settings.reaction_window = window;
        self
    }

    /// Makes the machine's time move only while the program waits for it. Tests on a simulated TXT are then
    /// fast and have the same result in each run, also on a busy PC and in a debugger. Off by default.
    ///
    /// The next request goes out when a thread asks for the next response, no thread is still answering the
    /// last one, and no guard is held. It contains all that was written before. This is so for the first
    /// request of a transfer, too. A thread asks by `wait_cycle`, `wait_until` and the other waits, by
    /// `update_config`, and by receiving from [`Events`](crate::Events) while there are none. A thread that
    /// only locks, sleeps or computes does not move the time: the machine pauses meanwhile.
    ///
    /// Each response takes 10 ms of the machine's time. All times that a program sees are in this time, not
    /// the system clock's: time limits of waits and of `recv_timeout`, the areas' timers,
    /// [`arrived`](crate::TransferAreaGuard::arrived), [`Statistics`](crate::Statistics). A wait whose limit
    /// ends before the next response still asks for that response, so that the time moves, and leaves it to
    /// the next wait. So if only one thread waits, it and its cycle hook see the same values in each run.
    /// With several threads, each response goes to those that wait when it comes in, and which these are
    /// depends on the operating system.
    ///
    /// The reaction window and the watchdog are off. The limits of the connection and for
    /// reconnecting use the system clock, and `end_transfer`, errors and panics end a transfer immediately,
    /// so nothing waits forever in lock-step either.
    ///
    /// A controller closes a connection without requests after some seconds, so the simulated TXT has to be
    /// in lock-step, too:
    ///
    /// ```
    /// use std::time::Duration;
    ///
    /// use ft_transfer_area_simulator::SimulatedTxt;
    /// use ft_transfer_area::prelude::*;
    ///
    /// /// Turns M1 for 100 ms; returns how many pulses C1 has counted.
    /// fn turn(areas: &TransferAreas) -> Result<i16, Error> {
    ///     let begin = areas.lock().arrived();
    ///     loop {
    ///         let mut now = areas.wait_cycle()?;
    ///         if now.arrived() - begin > Duration::from_millis(100) {
    ///             return Ok(now[LOCAL_IO].input.counter[C1]);
    ///         }
    ///         now[LOCAL_IO].output.duty[O1] = 512;
    ///     }
    /// }
    ///
    /// fn test_run() -> Result<i16, Box<dyn std::error::Error>> {
    ///     let txt = SimulatedTxt::builder().lock_step().start()?;
    ///     let builder = TransferAreaComHandler::builder(txt.address());
    ///     let handler = builder.lock_step().build()?;
    ///     handler.begin_transfer()?;
    ///     let pulses = turn(handler.areas())?;
    ///     handler.end_transfer()?;
    ///     Ok(pulses)
    /// }
    ///
    /// let pulses = test_run().unwrap();
    /// assert!(pulses > 0);
    /// assert_eq!(test_run().unwrap(), pulses);
    /// ```
    pub fn lock_step(mut self) -> Self {
        self.settings.lock_step = true;
        self
    }

    /// Leaves it to the controller when silence is done. The maker's firmware 4.7.0 (measured under emulation) never
    /// says that while nothing plays.
    #[doc(hidden)]
    pub fn silence_as_reported(mut self) -> Self {
        self.settings.silence_is_done = false;
        self
    }

    /// Stops all motors when the program shows no sign of life for `limit`, 1 ms to an hour. Off by default,
    /// because a correct program may sleep while a motor runs.
    ///
    /// A sign of life of any thread counts: a guard that is dropped, also one from a wait or from a check of
    /// the condition of [`wait_until`](crate::TransferAreas::wait_until), or that of a cycle hook that returns,
    /// and [`feed_watchdog`](crate::TransferAreas::feed_watchdog). A response that comes in late counts for the
    /// threads that have waited for it, but not while another thread has the areas. So the watchdog detects a
    /// program that hangs: in a loop without a guard, with a guard that it never drops, in a hook, waiting for
    /// a lock that no thread unlocks, or because the thread that did the work has ended.
    ///
    /// When it expires, the next request sets the outputs of all areas to 0 and ends the extended motor
    /// mode: within two cycles, or as soon as the controller answers. The outputs stay 0 until the program
    /// knows: the next wait or `feed_watchdog` returns [`Error::WatchdogExpired`], once to each handle. From
    /// the first such error on, what the program writes goes out again; what was written in between is
    /// discarded. Dropping a guard is not enough, so a program that polls calls `feed_watchdog` in its
    /// loop. Listeners get [`Event::WatchdogExpired`](crate::Event::WatchdogExpired). The exchange goes on
    /// meanwhile.
    ///
    /// A panic whose message nobody reads is such a hang, too: the thread prints it before it unwinds, and a full pipe or
    /// a paused terminal holds it up there. Nothing but the watchdog stops the motors then.
    ///
    /// Choose a limit above the longest pause of the program, and above a few cycles of 10 ms. The watchdog
    /// pauses while a lost connection is being re-established.
    ///
    /// ```
    /// use std::time::Duration;
    /// use ft_transfer_area::prelude::*;
    ///
    /// fn control(host: &str) -> Result<(), Error> {
    ///     let builder = TransferAreaComHandler::builder(host);
    ///     let handler = builder.watchdog(Duration::from_millis(500)).build()?;
    ///     let areas = handler.areas();
    ///     handler.begin_transfer()?;
    ///     loop {
    ///         match areas.wait_cycle() {
    ///             Ok(mut now) => now[LOCAL_IO].output.duty[O1] = 512,
    ///             // All motors are stopped; this program just goes on.
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

    /// Re-establishes a lost connection, and tries that for up to `limit`. Off by default: a lost connection
    /// ends the transfer.
    ///
    /// When the connection fails, the outputs in the areas go to 0, and all commands are forgotten: one that
    /// was not finished is never reported as done. The program learns of it immediately: waits return
    /// [`Error::ConnectionLost`], once to each handle, and listeners get
    /// [`Event::ConnectionLost`](crate::Event::ConnectionLost). A program that calls a wait again goes on:
    /// the call waits until there is a connection, with the configuration of all areas, and with the camera
    /// if it was running. What the program wrote before the gap moves no motor then; what it has written
    /// since it knew of the gap goes out with the first request. If the connection fails again at that
    /// request, this is another gap.
    ///
    /// When `limit` has passed without a connection, the transfer ends with
    /// [`Error::ReconnectFailed`]. With [`Duration::MAX`] it tries forever, with zero only once. It ends
    /// immediately if the firmware is now too old. Each attempt takes at most the limit for connecting plus those
    /// for the responses.
    ///
    /// ```
    /// use std::time::Duration;
    /// use ft_transfer_area::prelude::*;
    ///
    /// fn control(host: &str) -> Result<(), Error> {
    ///     let builder = TransferAreaComHandler::builder(host);
    ///     let handler = builder.reconnect(Duration::from_secs(60)).build()?;
    ///     let areas = handler.areas();
    ///     handler.begin_transfer()?;
    ///     loop {
    ///         match areas.wait_cycle() {
    ///             Ok(mut now) => now[LOCAL_IO].output.duty[O1] = 512,
    ///             // A machine that needs its positions would find them again here.
    ///             Err(error @ Error::ConnectionLost { .. }) => eprintln!("{error:#}"),
    ///             Err(error) => return Err(error),
    ///         }
    ///     }
    /// }
    /// ```
    pub fn reconnect(mut self, limit: Duration) -> Self {
        self.settings.reconnect = Some(limit);
        self
    }

    /// The handler with these settings. Does not connect yet.
    ///
    /// # Errors
    ///
    /// [`Error::AreaCount`] unless there are 1 to 9 areas; [`Error::BadAddress`] for a host that is empty, or
    /// whose port is not a number from 1 to 65535; [`Error::OutOfRange`] for a port that is
    /// too high for the camera's and I2C's to follow it, when these are not set, and for a time that is out
    /// of its range.
    pub fn build(self) -> Result<TransferAreaComHandler, Error> {
        let Self { mut settings, camera_port, i2c_port } = self;
        check_area_count(settings.areas)?;
        check_times(&settings)?;
        let (host, port) = host_and_port(&settings.host, PORT)?;
        (settings.host, settings.port) = (host.to_owned(), port);
        let behind = match (camera_port, i2c_port) {
            (_, None) => 2,
            (None, Some(_)) => 1,
            (Some(_), Some(_)) => 0,
        };
        let most = u16::MAX - behind;
        Error::check_range("port", settings.port, 1..=most.into())?;
        settings.camera_port = camera_port.unwrap_or(settings.port.saturating_add(1));
        settings.i2c_port = i2c_port.unwrap_or(settings.port.saturating_add(2));
        settings.i2c_port_is_known = i2c_port.is_some() || settings.port == PORT;
        Ok(TransferAreaComHandler::new(settings))
    }
}

fn check_times(settings: &Settings) -> Result<(), Error> {
    settings.limits.check()?;
    Error::check_millis("reaction window in ms", settings.reaction_window, WINDOW_RANGE)?;
    if let Some(limit) = settings.watchdog {
        // With 0 every program would be late.
        Error::check_millis("watchdog limit in ms", limit, LIMIT_RANGE)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ports(
        address: &str,
        set: impl Fn(TransferAreaComHandlerBuilder) -> TransferAreaComHandlerBuilder,
    ) -> Result<(u16, u16), Error> {
        let handler = set(TransferAreaComHandler::builder(address)).build()?;
        Ok((handler.settings().camera_port, handler.settings().i2c_port))
    }

    fn refused(given: u16, most: u16) -> Result<(u16, u16), Error> {
        Err(Error::OutOfRange { what: "port", given: given.into(), least: 1, most: most.into() })
    }

    #[test]
    fn the_other_ports_follow_the_main_one_or_there_is_no_handler() {
        assert_eq!(ports("txt", |builder| builder), Ok((65_001, 65_002)));
        assert_eq!(ports("txt:65533", |builder| builder), Ok((65_534, 65_535)));
        for port in [65_534, 65_535] {
            let address = format!("txt:{port}");
            assert_eq!(ports(&address, |builder| builder), refused(port, 65_533));
        }
        assert_eq!(ports("txt:65534", |builder| builder.i2c_port(7)), Ok((65_535, 7)));
        assert_eq!(ports("txt:65535", |b| b.i2c_port(7)), refused(65_535, 65_534));
        assert_eq!(ports("txt:65535", |b| b.i2c_port(7).camera_port(8)), Ok((8, 7)));
    }

    #[test]
    fn a_port_after_the_host_is_the_main_one_and_the_others_follow_it() {
        for (given, host) in [("txt:4000", "txt"), ("[::1]:4000", "::1")] {
            let handler = TransferAreaComHandler::builder(given).build().unwrap();
            let Settings { host: found, port, camera_port, i2c_port, .. } = handler.settings();
            assert_eq!((&**found, *port, *camera_port, *i2c_port), (host, 4000, 4001, 4002));
        }
        let error = TransferAreaComHandler::builder("txt:4o00").build().unwrap_err();
        assert_eq!(error, Error::BadAddress { given: "txt:4o00".to_owned() });
    }
}
