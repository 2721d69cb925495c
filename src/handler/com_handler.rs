//! The handler: the transfer area kept in step with the controller by a background thread.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use parking_lot::{Mutex, MutexGuard};

use super::area::TransferArea;
use super::guard::TransferAreaGuard;
use super::handshake;
use super::settings::Settings;
use super::shared::{Controller, Shared};
use super::statistics::Statistics;
use super::thread::TransferThread;
use super::watchdog::Watchdog;
use crate::camera::CameraStream;
use crate::error::Error;
use crate::firmware::FirmwareVersion;

/// Keeps transfer areas in step with a controller: a port of the kit's
/// `ftIF2013TransferAreaComHandler`.
///
/// Between [`begin_transfer`](Self::begin_transfer) and [`end_transfer`](Self::end_transfer) a
/// background thread exchanges the areas' outputs for inputs as fast as the controller answers,
/// about 100 times a second. The program reads and writes the areas under a
/// [`lock`](Self::lock), or in step with the exchange by [`wait_cycle`](Self::wait_cycle). It can
/// also wait [for a condition](Self::wait_until), hear of [events](Self::events), and have a
/// [function called](Self::set_cycle_hook) in each cycle.
///
/// - What is written under one lock goes out in one request.
/// - Inputs of a response are answered in the very next request by a program that waits, and by
///   one that polls within the reaction window (5 ms unless set otherwise): for so long the
///   thread holds the next request back. When all that were waiting have dropped their guards,
///   the request leaves at once.
/// - When [`config_id`](crate::transfer_area::State::config_id) changes, the configuration goes
///   out before the next exchange.
/// - Only responses that are right in every respect reach the areas.
/// - Ending or dropping the handler, an error, or a panic in a thread that uses the area [where it can
///   be seen](TransferArea#when-a-thread-panics) end with a last exchange that stops all motors, as far
///   as the connection still allows. A controller that it can't reach stops them because it has lost the
///   connection. Thereafter the areas' outputs are as that exchange sent them.
/// - A [watchdog](crate::TransferAreaComHandlerBuilder::watchdog) stops the motors when the program hangs, and
///   a lost connection can be [made again](crate::TransferAreaComHandlerBuilder::reconnect), if the program
///   wants that.
///
/// ```no_run
/// use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO};
/// use ft_transfer_area::TransferAreaComHandler;
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let handler = TransferAreaComHandler::builder("192.168.7.2").areas(2).build()?;
/// handler.lock()[LOCAL_IO].config.uni[1] = UniConfig::analog(InputMode::Ultrasonic);
/// handler.lock()[LOCAL_IO].raise_config_id();
/// handler.begin_transfer()?;
/// while handler.lock()[LOCAL_IO].timer.timer_10ms < 1000 {
///     let mut areas = handler.wait_cycle()?;
///     let pressed = areas[LOCAL_IO].input.uni[0] != 0;
///     areas[LOCAL_IO].output.duty[0] = if pressed { 512 } else { 0 };
/// }
/// handler.end_transfer()?;
/// # Ok(())
/// # }
/// ```
#[doc(alias = "ftIF2013TransferAreaComHandler")]
#[doc(alias = "ftIF2013TransferAreaComHandlerEx")]
#[doc(alias = "ftIF2013TransferAreaComHandlerEx2")]
#[derive(Debug)]
pub struct TransferAreaComHandler {
    settings: Settings,
    area: TransferArea,
    /// With the number of its transfer.
    thread: Mutex<Option<(u64, JoinHandle<()>)>>,
    camera: Mutex<Camera>,
}

/// What the handler knows of its camera.
#[derive(Debug, Default)]
pub(super) struct Camera {
    /// The present or the last stream.
    pub(super) stream: Option<CameraStream>,
    /// Whether the controller's camera server runs, as far as this transfer has started it.
    pub(super) server_started: bool,
}

impl TransferAreaComHandler {
    pub(super) fn new(settings: Settings) -> Self {
        let shared = Shared::new(settings.areas, Watchdog::new(settings.watchdog));
        Self {
            settings,
            area: TransferArea::new(Arc::new(shared)),
            thread: Mutex::default(),
            camera: Mutex::default(),
        }
    }

    pub(super) fn settings(&self) -> &Settings {
        &self.settings
    }

    pub(super) fn area(&self) -> &TransferArea {
        &self.area
    }

    pub(super) fn camera(&self) -> MutexGuard<'_, Camera> {
        self.camera.lock()
    }

    /// Connects, checks the firmware, begins online mode, hands over the configuration of all
    /// areas and starts the thread that exchanges.
    ///
    /// Blocks until the controller has answered all this, for each answer at most as long as the
    /// time limits allow. Timers and statistics begin anew.
    ///
    /// What the areas hold goes out with the first exchange, motors' duties included, if it was written
    /// before the first transfer or [after the end of the last one was
    /// known](TransferArea#when-outputs-count). A configuration always does. The ids of commands go on from
    /// where they were, so a controller that has forgotten them resets counters once more; commands that
    /// were under way at the end of a transfer never read as done.
    ///
    /// Any thread may call it, and a retry is as short as it reads, without a watchdog and without
    /// [`reconnect`](crate::TransferAreaComHandlerBuilder::reconnect), which does this by itself and more
    /// often than once:
    ///
    /// ```no_run
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::{Error, TransferAreaComHandler};
    ///
    /// fn control(handler: &TransferAreaComHandler) -> Result<(), Error> {
    ///     handler.begin_transfer()?;
    ///     loop {
    ///         match handler.wait_cycle() {
    ///             Ok(mut areas) => areas[LOCAL_IO].output.duty[0] = 512,
    ///             Err(_) => handler.begin_transfer()?,
    ///         }
    ///     }
    /// }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::AlreadyStarted`] while a transfer runs or begins; [`Error::FirmwareTooOld`] below firmware
    /// 4.1.6; [`Error::ProgramPanicked`] or [`Error::NotStarted`] when a panic or another thread's
    /// `end_transfer` came meanwhile; any error of connecting or talking to the controller. No thread and
    /// no connection are left then.
    #[doc(alias = "BeginTransfer")]
    #[doc(alias = "ftxStartTransferArea")]
    #[doc(alias = "StartTxtDownloadProg")]
    pub fn begin_transfer(&self) -> Result<(), Error> {
        let shared = self.area.shared();
        shared.begin()?;
        self.area.learn(|known| shared.know_all(known));
        let number = shared.number();
        self.join_threads(number);
        self.try_begin(number).inspect_err(|error| shared.fail(error.clone()))
    }

    fn try_begin(&self, number: u64) -> Result<(), Error> {
        let shared = self.area.shared();
        // Without the areas themselves, which a thread of the program may hold for long.
        let areas = shared.outgoing();
        let found = |controller| shared.set_controller(controller);
        let limit = self.settings.limits.connect;
        let (mut link, config_updates) = handshake::connect(&self.settings, limit, &areas, found)?;
        // What was written meanwhile.
        let areas = shared.outgoing();
        if let Err(stop) = shared.run(config_updates) {
            // Whatever comes of that, the connection is closed.
            let _ = link.client.stop_online();
            return stop.result().and(Err(Error::NotStarted));
        }
        let work = TransferThread::new(link, areas, Arc::clone(shared), self.settings.clone());
        let thread = std::thread::Builder::new()
            .name("transfer-area".to_owned())
            .spawn(move || work.run())
            .map_err(|error| {
                // It was running, so somebody may have written outputs.
                shared.leave(&mut []);
                Error::not_started(&error)
            })?;
        *self.thread.lock() = Some((number, thread));
        Ok(())
    }

    /// Stops all motors with a last exchange, ends online mode and closes the connection.
    ///
    /// Blocks until this is done, at most as long as the time limits and the [limit of the cycle
    /// hook](crate::TransferAreaComHandlerBuilder::hook_limit) allow; while a lost connection is made
    /// again, until the attempt that is under way has failed. Ending what has ended well, or was never
    /// begun, does nothing. From inside a cycle hook it does not block, and the transfer ends when that
    /// has returned.
    ///
    /// # Errors
    ///
    /// The error that ended the transfer, also when it ended before; until the next
    /// `begin_transfer`.
    #[doc(alias = "EndTransfer")]
    #[doc(alias = "ftxStopTransferArea")]
    #[doc(alias = "ftxCloseDevice")]
    #[doc(alias = "StopTxtDownloadProg")]
    pub fn end_transfer(&self) -> Result<(), Error> {
        let shared = self.area.shared();
        let number = shared.ask_to_end();
        // It can't wait for itself: the transfer ends when it has returned.
        if shared.hook_runs_here() {
            return Ok(());
        }
        shared.wait_until_begun(number);
        self.join_threads(number);
        self.area.error().map_or(Ok(()), Err)
    }

    /// Waits for the threads of transfers up to this number.
    fn join_threads(&self, number: u64) {
        // Held meanwhile, so that others who end the transfer wait for that, too.
        let mut thread = self.thread.lock();
        if let Some((_, thread)) = thread.take_if(|(of, _)| *of <= number) {
            // The thread catches its own panics, so there is nothing to learn here.
            let _ = thread.join();
        }
        if self.area.shared().number() > number {
            return;
        }
        let mut camera = self.camera();
        if let Some(stream) = &mut camera.stream {
            stream.join();
        }
        camera.server_started = false;
    }

    /// Whether a transfer is running. See [`TransferArea::is_running`].
    #[doc(alias = "ftxIsTransferActiv")]
    #[doc(alias = "MotorIOLib_ThreadIsRunning")]
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.area.is_running()
    }

    /// Locks the areas. See [`TransferArea::lock`].
    #[doc(alias = "GetTransferAreasArrayAddr")]
    #[doc(alias = "GetKeLibTransferAreaMainAddress")]
    pub fn lock(&self) -> TransferAreaGuard<'_> {
        self.area.lock()
    }

    /// Waits for the next response. See [`TransferArea::wait_cycle`].
    ///
    /// # Errors
    ///
    /// [`Error::NotStarted`], [`Error::ConnectionLost`], [`Error::WatchdogExpired`], or the error that
    /// ended the transfer.
    #[doc(alias = "PrgTic")]
    pub fn wait_cycle(&self) -> Result<TransferAreaGuard<'_>, Error> {
        self.area.wait_cycle()
    }

    /// Waits for the next response, but not longer than `limit`. See
    /// [`TransferArea::wait_cycle_for`].
    ///
    /// # Errors
    ///
    /// [`Error::WaitTimedOut`]; otherwise as [`wait_cycle`](Self::wait_cycle).
    pub fn wait_cycle_for(&self, limit: Duration) -> Result<TransferAreaGuard<'_>, Error> {
        self.area.wait_cycle_for(limit)
    }

    /// Waits until the controller has the configuration that the areas hold now. See
    /// [`TransferArea::update_config`].
    ///
    /// # Errors
    ///
    /// As [`wait_cycle`](Self::wait_cycle).
    #[doc(alias = "UpdateConfig")]
    pub fn update_config(&self) -> Result<(), Error> {
        self.area.update_config()
    }

    /// Tells the watchdog that the program is alive. See [`TransferArea::feed_watchdog`].
    ///
    /// # Errors
    ///
    /// [`Error::WatchdogExpired`], [`Error::ConnectionLost`], [`Error::NotStarted`], or the error that
    /// ended the transfer.
    pub fn feed_watchdog(&self) -> Result<(), Error> {
        self.area.feed_watchdog()
    }

    /// A handle to the areas for another thread. Cheap to clone.
    pub fn transfer_area(&self) -> TransferArea {
        self.area.clone()
    }

    /// The firmware version of the controller that was reached last.
    #[doc(alias = "GetVersion")]
    #[doc(alias = "GetRoboTxFwStr")]
    #[doc(alias = "GetRoboTxFwVal")]
    pub fn version(&self) -> Option<FirmwareVersion> {
        self.controller().map(|controller| controller.status.version)
    }

    /// The name of the controller that was reached last.
    #[doc(alias = "m_devicename")]
    #[doc(alias = "GetRoboTxDevName")]
    pub fn device_name(&self) -> Option<String> {
        self.controller().map(|controller| controller.status.name())
    }

    /// Figures of the transfer that runs, or of the last one. See [`Statistics`].
    #[doc(alias = "GetTrapStatistic")]
    pub fn statistics(&self) -> Statistics {
        self.area.statistics()
    }

    /// The error that ended the last transfer, until the next `begin_transfer`.
    pub fn error(&self) -> Option<Error> {
        self.area.error()
    }

    pub(super) fn controller(&self) -> Option<Controller> {
        self.area.shared().controller()
    }
}

/// Ends the transfer, with all motors stopped, and the channels of its events. Blocks as
/// [`TransferAreaComHandler::end_transfer`].
impl Drop for TransferAreaComHandler {
    fn drop(&mut self) {
        self.area.stop_on_panic();
        // An error is in the log already, and nobody can be told of it here.
        let _ = self.end_transfer();
        self.area.shared().listeners.end();
        // It may own a handle to the areas that own it.
        self.clear_cycle_hook();
    }
}
