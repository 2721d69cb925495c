//! The handler: a background thread exchanges the transfer area with the controller.

use std::net::SocketAddr;
use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};
use std::sync::Arc;
use std::time::Duration;

use crate::camera::CameraStream;
use crate::error::Error;
use crate::firmware::FirmwareVersion;
use crate::handler::parts::phase::Stop;
use crate::handler::program::area::TransferAreas;
use crate::handler::settings::Settings;
use crate::handler::shared::Shared;
use crate::handler::state::Controller;
use crate::handler::sync::{spawn, Mutex};
use crate::handler::transfer::handshake;
use crate::handler::transfer::thread::{ThreadSlot, TransferThread};
use crate::i2c::I2cClient;
use crate::notices;

/// How long the end of a transfer waits for the logger, so that a program that ends then has its last lines.
const FLUSH: Duration = Duration::from_millis(100);

/// Exchanges transfer areas with a controller in the background: a port of the kit's
/// `ftIF2013TransferAreaComHandler`.
///
/// Between [`begin_transfer`](Self::begin_transfer) and [`end_transfer`](Self::end_transfer) a
/// background thread exchanges the areas' outputs for inputs as fast as the controller answers,
/// about 100 times a second. The program reads and writes the areas under a
/// [`lock`](TransferAreas::lock), or once per response by [`wait_cycle`](TransferAreas::wait_cycle). It can
/// also wait [for a condition](TransferAreas::wait_until), receive [events](TransferAreas::events), and have a
/// [function called](Self::set_cycle_hook) in each cycle.
///
/// - What is written under one lock goes out in one request.
/// - A program that waits answers a response in the very next request. So does a program that polls, if
///   it answers within the reaction window (5 ms by default), for which the thread holds the next request
///   back. When all threads that waited have dropped their guards, the request goes out immediately.
/// - When [`config_id`](crate::transfer_area::State::config_id) changes, the configuration goes
///   out before the next exchange.
/// - Only responses without any error reach the areas.
/// - A last exchange stops all motors when the transfer is ended, the handler is dropped, an error occurs, or
///   a thread that uses the area panics [where it can be seen](TransferAreas#when-a-thread-panics). If the
///   connection does not work any more, they may go on until the next transfer begins: the maker's firmware
///   4.7.0 does not stop them (measured under emulation), and whether its I/O board does is not known.
///   Afterwards the areas' outputs are as in that exchange.
/// - [`std::process::exit`] drops nothing, so it sends no last exchange, and motors may go on. End the transfer
///   before it, or return an [`ExitCode`](std::process::ExitCode) from `main`.
/// - If the program wants it, a [watchdog](crate::TransferAreaComHandlerBuilder::watchdog) stops the motors
///   when the program hangs, and a lost connection is
///   [re-established](crate::TransferAreaComHandlerBuilder::reconnect).
///
/// ```no_run
/// use ft_transfer_area::prelude::*;
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let handler = TransferAreaComHandler::builder("192.168.7.2").areas(2).build()?;
/// let areas = handler.areas();
/// areas.lock()[LOCAL_IO].config.uni[I2] = UniConfig::analog(InputMode::Ultrasonic);
/// areas.lock()[LOCAL_IO].raise_config_id();
/// handler.begin_transfer()?;
/// while areas.lock()[LOCAL_IO].timer.timer_10ms < 1000 {
///     let mut now = areas.wait_cycle()?;
///     let pressed = now[LOCAL_IO].input.uni[I1] != 0;
///     now[LOCAL_IO].output.duty[O1] = if pressed { 512 } else { 0 };
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
    area: TransferAreas,
    thread: ThreadSlot,
    /// Locked for as long as a command for the camera takes, also across a gap.
    pub(crate) camera: Mutex<Option<CameraStream>>,
}

impl TransferAreaComHandler {
    pub(crate) fn new(settings: Settings) -> Self {
        // In lock-step a program that computes stops the time.
        let watchdog = settings.watchdog.filter(|_| !settings.lock_step);
        let shared = Shared::new(settings.areas, watchdog, settings.lock_step);
        Self {
            settings,
            area: TransferAreas::new(Arc::new(shared)),
            thread: ThreadSlot::default(),
            camera: Mutex::default(),
        }
    }

    pub(crate) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Connects, checks the firmware, begins online mode, hands over the configuration of all
    /// areas and starts the thread that exchanges.
    ///
    /// Blocks until the controller has answered all this, for each response at most as long as the
    /// time limits allow. If the controller closes the connection at StartOnline, this is tried again within the limit
    /// for connecting: the maker's firmware 4.7.0 (measured under emulation) ends when another program was online in
    /// the last 5 s and did not use I2C rightly, and is back after 2 s. Timers and statistics start again from 0.
    ///
    /// The areas go out with the first exchange. Outputs, also the motors' duties, count if they were
    /// written before the first transfer or [after the end of the last one was
    /// known](TransferAreas#when-outputs-count). A configuration always counts. The ids of commands continue,
    /// so a controller that has forgotten them resets counters once more; commands that were not finished at
    /// the end of a transfer are never reported as done.
    ///
    /// Any thread may call it. This program, without a watchdog and without
    /// [`reconnect`](crate::TransferAreaComHandlerBuilder::reconnect), begins again after an error, with one
    /// attempt. `reconnect` does that by itself, with more attempts:
    ///
    /// ```no_run
    /// use ft_transfer_area::prelude::*;
    ///
    /// fn control(handler: &TransferAreaComHandler) -> Result<(), Error> {
    ///     let areas = handler.areas();
    ///     handler.begin_transfer()?;
    ///     loop {
    ///         match areas.wait_cycle() {
    ///             Ok(mut now) => now[LOCAL_IO].output.duty[O1] = 512,
    ///             Err(_) => handler.begin_transfer()?,
    ///         }
    ///     }
    /// }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::AlreadyStarted`] while a transfer runs or begins; [`Error::FirmwareTooOld`] below firmware
    /// 4.1.6; [`Error::ProgramPanicked`] or [`Error::NotStarted`] after a panic or another thread's
    /// `end_transfer` meanwhile; any error of connecting or talking to the controller. After an error no
    /// thread and no connection of this transfer are left.
    #[doc(alias = "BeginTransfer")]
    #[doc(alias = "ftxStartTransferArea")]
    #[doc(alias = "StartTxtDownloadProg")]
    pub fn begin_transfer(&self) -> Result<(), Error> {
        let shared = self.area.shared();
        let number = {
            let mut state = shared.state();
            state.transfer.begin()?;
            self.area.learn(|known| state.learn_all(known));
            state.transfer.number()
        };
        match catch_unwind(AssertUnwindSafe(|| self.try_begin(number))) {
            Ok(result) => result.inspect_err(|error| shared.fail(error.clone())),
            Err(panic) => {
                // Otherwise the transfer would be beginning forever.
                shared.fail(Error::ProgramPanicked);
                resume_unwind(panic)
            }
        }
    }

    fn try_begin(&self, number: u64) -> Result<(), Error> {
        self.join_threads(number);
        let shared = self.area.shared();
        // A lost connection is re-established to the same controller, even if there are others by then.
        let settings = self.settings.with_found_host()?;
        let (link, config_updates) = handshake::begin(&settings, shared)?;
        // Not the areas themselves, which a thread of the program may hold for long.
        let areas = shared.outgoing();
        self.thread.start(number, || {
            if let Err(stop) = shared.run(config_updates) {
                // A motor may be on since the transfer before.
                let left = link.leave(areas.len());
                return stop.result().and(left).and(Err(Error::NotStarted));
            }
            let of_thread = Arc::clone(shared);
            let work = move || TransferThread::new(link, areas, &of_thread, settings).run();
            spawn("ft/transfer", work).map_err(|error| {
                // It was running, so the program may have written outputs.
                shared.leave(&mut []);
                Error::not_started(error)
            })
        })
    }

    /// Stops all motors with a last exchange, ends online mode and closes the connection.
    ///
    /// Blocks until this is done, at most as long as the time limits allow. While a lost connection is
    /// re-established, the current attempt only stops the motors; if it fails within 1 s, one more does, which takes at
    /// most 2 s to connect. A logger that blocks holds it for 0.1 s at most.
    /// It waits for no other thread of the program, so it also works under a guard and in a cycle hook. Does
    /// nothing when the transfer has already ended without an error, or never began.
    ///
    /// # Errors
    ///
    /// The error that ended the transfer, also when it had ended before this call; until the next
    /// `begin_transfer`. While a lost connection is re-established, that of the last attempt: motors may go on.
    #[doc(alias = "EndTransfer")]
    #[doc(alias = "ftxStopTransferArea")]
    #[doc(alias = "ftxCloseDevice")]
    #[doc(alias = "StopTxtDownloadProg")]
    pub fn end_transfer(&self) -> Result<(), Error> {
        let shared = self.area.shared();
        let number = shared.ask_to_stop(Stop::Asked);
        shared.wait_until_begun(number);
        self.join_threads(number);
        notices::flush(FLUSH);
        self.area.error().map_or(Ok(()), Err)
    }

    /// Waits for the threads of transfers up to this number.
    fn join_threads(&self, number: u64) {
        self.thread.join(number);
        // The stream of the next transfer is not this one's, and a command for it may hold it for long.
        let is_over = || self.area.shared().state().transfer.number() > number;
        if is_over() {
            return;
        }
        let mut stream = self.camera.lock();
        if is_over() {
            return;
        }
        if let Some(stream) = &mut *stream {
            stream.stop();
        }
    }

    /// The areas, which this handler exchanges. A clone is a handle for another thread.
    #[doc(alias = "GetTransferAreasArrayAddr")]
    pub fn areas(&self) -> &TransferAreas {
        &self.area
    }

    /// The firmware version of the controller that was last connected.
    #[doc(alias = "GetVersion")]
    #[doc(alias = "GetRoboTxFwStr")]
    #[doc(alias = "GetRoboTxFwVal")]
    pub fn version(&self) -> Option<FirmwareVersion> {
        self.controller().map(|controller| controller.status.version)
    }

    /// The name of the controller that was last connected.
    #[doc(alias = "m_devicename")]
    #[doc(alias = "GetRoboTxDevName")]
    pub fn device_name(&self) -> Option<String> {
        self.controller().map(|controller| controller.status.name())
    }

    /// The address of the controller that was last connected, with its main port: where it still is when the name by which
    /// it was found is not known any more, or names another one. `None` before the first connection.
    pub fn address(&self) -> Option<SocketAddr> {
        self.controller()?.address
    }

    pub(crate) fn controller(&self) -> Option<Controller> {
        self.area.shared().state().controller.clone()
    }
}

/// Ends the transfer, with all motors stopped, and closes the channels of its events. Blocks as
/// [`TransferAreaComHandler::end_transfer`] does, and then while the cycle hook runs, for half a second at most.
impl Drop for TransferAreaComHandler {
    fn drop(&mut self) {
        self.area.stop_on_panic();
        // An error is in the log already, and can't be returned here.
        let _ = self.end_transfer();
        self.area.shared().listeners.lock().end();
        self.clear_cycle_hook();
    }
}

impl TransferAreaComHandler {
    /// The I2C devices at the controller, with the handler's time limits.
    ///
    /// All clients share the transfer's I2C connection, see [`I2cClient`]. If there is none yet, this makes it, and
    /// blocks up to the limit for connecting. It does not disturb the transfer. A client may be kept for the next
    /// transfer.
    ///
    /// # Errors
    ///
    /// [`Error::NotOnline`] without a transfer, and while a lost connection is re-established;
    /// [`Error::ConnectionRefused`] by a controller without I2C, or one that has closed the transfer's connection;
    /// [`Error::ConnectTimedOut`] or [`Error::ConnectFailed`].
    #[doc(alias = "InitI2C")]
    #[doc(alias = "StartI2C")]
    pub fn i2c(&self) -> Result<I2cClient, Error> {
        let line = &self.area.shared().i2c;
        line.connect()?;
        Ok(I2cClient::over(line.clone()))
    }
}
