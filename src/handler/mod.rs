//! The transfer area kept in step with the controller by a background thread.

mod area;
mod builder;
mod camera;
mod events;
mod hook;
mod i2c;
mod mail;
mod shared;
mod statistics;
mod thread;
mod wait;

use std::net::IpAddr;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use log::info;

pub use area::{TransferArea, TransferAreaGuard};
pub use builder::TransferAreaComHandlerBuilder;
pub use events::{Event, EventKind, Events, Joystick};
pub use statistics::Statistics;

use crate::camera::CameraStream;
use crate::client::TxtClient;
use crate::error::Error;
use crate::exchange::Exchange;
use crate::firmware::FirmwareVersion;
use crate::wire::QueryStatusResponse;
use builder::Settings;
use mail::Stop;
use thread::Cycler;

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
/// - Ending or dropping the handler, an error, or a panic in a thread that uses the area end
///   with a last exchange that stops all motors, as far as the connection still allows. A
///   controller that it can't reach stops them because it has lost the connection. Thereafter
///   the areas' outputs are as that exchange sent them.
///
/// ```no_run
/// use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO};
/// use ft_transfer_area::TransferAreaComHandler;
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let mut handler = TransferAreaComHandler::builder("192.168.7.2").areas(2).build()?;
/// handler.lock()[LOCAL_IO].config.uni[1] = UniConfig::analog(InputMode::Ultrasonic);
/// handler.lock()[LOCAL_IO].state.config_id += 1;
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
    status: Option<QueryStatusResponse>,
    thread: Option<JoinHandle<()>>,
    /// The controller's address, from the last connection.
    address: Option<IpAddr>,
    /// The present or the last stream of the camera.
    camera: Option<CameraStream>,
    /// Whether the controller's camera server runs, as far as this transfer has started it.
    camera_server_started: bool,
}

impl TransferAreaComHandler {
    /// Settings for a handler of the controller at `host`, a name or a numeric address:
    /// 192.168.7.2 for USB, 192.168.8.2 for WLAN, 192.168.9.2 for Bluetooth, 127.0.0.1 on the
    /// controller itself.
    #[doc(alias = "ftIF2013TransferAreaComHandler")]
    #[doc(alias = "ftxOpenComDevice")]
    #[doc(alias = "ftxOpenComDeviceNr")]
    pub fn builder(host: impl Into<String>) -> TransferAreaComHandlerBuilder {
        TransferAreaComHandlerBuilder::new(host.into())
    }

    fn new(settings: Settings) -> Self {
        let area = TransferArea::new(settings.areas);
        Self {
            settings,
            area,
            status: None,
            thread: None,
            address: None,
            camera: None,
            camera_server_started: false,
        }
    }

    /// Connects, checks the firmware, begins online mode, hands over the configuration of all
    /// areas and starts the thread that exchanges.
    ///
    /// Blocks until the controller has answered all this, for each answer at most as long as the
    /// time limits allow. Timers and statistics begin anew.
    ///
    /// What the areas' last guard left goes out with the first exchange, motors' duties included;
    /// after an earlier transfer these are 0. The ids of commands go on from where they were, so a
    /// controller that has forgotten them resets counters and plays the sound once more that were
    /// asked for last.
    ///
    /// # Errors
    ///
    /// [`Error::AlreadyStarted`] while a transfer runs; [`Error::FirmwareTooOld`] below firmware
    /// 4.1.6; any error of connecting or talking to the controller. No thread and no connection
    /// are left then.
    #[doc(alias = "BeginTransfer")]
    #[doc(alias = "ftxStartTransferArea")]
    #[doc(alias = "StartTxtDownloadProg")]
    pub fn begin_transfer(&mut self) -> Result<(), Error> {
        if self.area.shared().is_running() {
            return Err(Error::AlreadyStarted);
        }
        self.join_threads();
        let result = self.try_begin();
        if let Err(error) = &result {
            self.area.shared().fail(error.clone());
        }
        result
    }

    fn try_begin(&mut self) -> Result<(), Error> {
        let Settings { host, port, limits, .. } = &self.settings;
        let mut client = TxtClient::connect(host, *port, *limits)?;
        self.address = client.address();
        let status = client.query_status()?;
        self.status = Some(status);
        let (found, required) = (status.version, FirmwareVersion::OLDEST_SUPPORTED);
        if found < required {
            return Err(Error::FirmwareTooOld { found, required });
        }
        info!("{} with firmware {found} at {host}:{port}", status.name());
        client.start_online()?;
        let mut exchange = Exchange::new(self.settings.mode, found);
        // Without the areas' lock, which a thread of the program may hold for long.
        let shared = Arc::clone(self.area.shared());
        let areas = shared.outgoing();
        let config_updates = client.update_configs(&mut exchange, &areas)?;
        shared.begin(config_updates);
        let cycler = Cycler::new(client, exchange, areas, shared, self.settings.reaction_window);
        let thread = std::thread::Builder::new()
            .name("transfer-area".to_owned())
            .spawn(move || cycler.run())
            .map_err(|error| Error::not_started(&error))?;
        self.thread = Some(thread);
        Ok(())
    }

    /// Stops all motors with a last exchange, ends online mode and closes the connection.
    ///
    /// Blocks until this is done, at most as long as the time limits allow. Ending what has ended
    /// well, or was never begun, does nothing.
    ///
    /// # Errors
    ///
    /// The error that ended the transfer, also when it ended before; until the next
    /// `begin_transfer`.
    #[doc(alias = "EndTransfer")]
    #[doc(alias = "ftxStopTransferArea")]
    #[doc(alias = "ftxCloseDevice")]
    #[doc(alias = "StopTxtDownloadProg")]
    pub fn end_transfer(&mut self) -> Result<(), Error> {
        self.area.shared().ask_to_stop(Stop::Asked);
        self.join_threads();
        self.error().map_or(Ok(()), Err)
    }

    fn join_threads(&mut self) {
        if let Some(thread) = self.thread.take() {
            // The thread catches its own panics, so there is nothing to learn here.
            let _ = thread.join();
        }
        if let Some(camera) = &mut self.camera {
            camera.join();
        }
        self.camera_server_started = false;
    }

    /// Whether a transfer is running: from `begin_transfer` on until it ends, by `end_transfer` or
    /// by an error, which [`error`](Self::error) tells then.
    #[doc(alias = "ftxIsTransferActiv")]
    #[doc(alias = "MotorIOLib_ThreadIsRunning")]
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.area.shared().is_running()
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
    /// [`Error::NotStarted`], or the error that ended the transfer.
    #[doc(alias = "PrgTic")]
    pub fn wait_cycle(&self) -> Result<TransferAreaGuard<'_>, Error> {
        self.area.wait_cycle()
    }

    /// Waits for the next response, but not longer than `limit`. See
    /// [`TransferArea::wait_cycle_for`].
    ///
    /// # Errors
    ///
    /// [`Error::WaitTimedOut`], [`Error::NotStarted`], or the error that ended the transfer.
    pub fn wait_cycle_for(&self, limit: Duration) -> Result<TransferAreaGuard<'_>, Error> {
        self.area.wait_cycle_for(limit)
    }

    /// Waits until the controller has the configuration that the areas hold now. See
    /// [`TransferArea::update_config`].
    ///
    /// # Errors
    ///
    /// [`Error::NotStarted`], or the error that ended the transfer.
    #[doc(alias = "UpdateConfig")]
    pub fn update_config(&self) -> Result<(), Error> {
        self.area.update_config()
    }

    /// A handle to the areas for another thread. Cheap to clone.
    pub fn transfer_area(&self) -> TransferArea {
        self.area.clone()
    }

    /// The firmware version of the controller that `begin_transfer` has last reached.
    #[doc(alias = "GetVersion")]
    #[doc(alias = "GetRoboTxFwStr")]
    #[doc(alias = "GetRoboTxFwVal")]
    pub fn version(&self) -> Option<FirmwareVersion> {
        self.status.map(|status| status.version)
    }

    /// The name of the controller that `begin_transfer` has last reached.
    #[doc(alias = "m_devicename")]
    #[doc(alias = "GetRoboTxDevName")]
    pub fn device_name(&self) -> Option<String> {
        self.status.map(|status| status.name())
    }

    /// Figures of the transfer that runs, or of the last one. See [`Statistics`].
    #[doc(alias = "GetTrapStatistic")]
    pub fn statistics(&self) -> Statistics {
        self.area.statistics()
    }

    /// The error that ended the last transfer, until the next `begin_transfer`.
    pub fn error(&self) -> Option<Error> {
        self.area.shared().error()
    }
}

/// Ends the transfer, with all motors stopped, and the channels of its events. Blocks as
/// [`TransferAreaComHandler::end_transfer`].
impl Drop for TransferAreaComHandler {
    fn drop(&mut self) {
        self.area.stop_on_panic();
        // An error is in the log already, and nobody can be told of it here.
        let _ = self.end_transfer();
        self.area.shared().end_listening();
        // It may own a handle to the areas that own it.
        self.clear_cycle_hook();
    }
}
