//! The handler of the kits 4.1.6 and 4.6.6: a connection, and exchanges in the thread that asks for them.
#![allow(unreachable_pub, reason = "the linker exports it")]

use std::fmt::Display;
use std::sync::Arc;
use std::time::Instant;

use ft_transfer_area::channel::Receiver;
use ft_transfer_area::transfer_area::{FishX1Transfer, Timer};
use ft_transfer_area::{
    CameraFrame, CameraStream, Error, Exchange, TimeLimits, TransferMode, TxtClient,
};
use parking_lot::Mutex;

use super::areas::ProgramAreas;
use crate::exit;
use crate::host;
use crate::jpeg::{self, Buffer};
use crate::memory::AreaArray;
use crate::mirror::{Mirror, DEV_MODE_ONLINE};
use crate::online::Online;
use crate::report;

const NO_TRANSFER: &str = "no transfer is running; call BeginTransfer first";

/// A handler. Frames of the camera may be waited for in another thread than the one that exchanges.
pub struct Kit {
    areas: ProgramAreas,
    host: String,
    /// Whether the host is the one of the environment, not that of the program.
    is_replaced: bool,
    transfer: Arc<Mutex<Transfer>>,
    camera: Mutex<Option<Camera>>,
    picture: Mutex<Buffer>,
    /// What was reported last, so that a loop that ignores errors does not fill the terminal.
    reported: Mutex<Option<Failure>>,
}

/// What went wrong, as a sentence.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct Failure(String);

impl<E: Display> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(format!("{error:#}"))
    }
}

/// A camera that was started, and the channel of its frames.
struct Camera {
    stream: CameraStream,
    frames: Receiver<CameraFrame>,
}

struct Transfer {
    array: Arc<AreaArray<FishX1Transfer>>,
    mirror: Mirror<FishX1Transfer>,
    link: Option<Link>,
}

/// A connection while it is online.
struct Link {
    client: TxtClient,
    simple: Exchange,
    compressed: Exchange,
    /// The areas as they go over the wire.
    areas: Vec<FishX1Transfer>,
    begun: Instant,
    /// `None` when the connection was lost.
    online: Option<Online>,
}

impl Kit {
    pub(super) fn new(areas: ProgramAreas, name: Option<&str>, port: Option<&str>) -> Self {
        areas.clear();
        let array = Arc::new(AreaArray::new());
        let mirror = Mirror::new(Arc::clone(&array), DEV_MODE_ONLINE);
        let replaced = host::from_environment();
        let is_replaced = replaced.is_some();
        let host = replaced.unwrap_or_else(|| host::of_kit(name, port));
        Self {
            areas,
            host,
            is_replaced,
            transfer: Arc::new(Mutex::new(Transfer { array, mirror, link: None })),
            camera: Mutex::new(None),
            picture: Mutex::new(Buffer::default()),
            reported: Mutex::new(None),
        }
    }

    /// Reports an error unless it is the one that was reported last. Whether all is well.
    pub(super) fn report(&self, result: Result<(), Failure>) -> bool {
        if result.is_err() && exit::check_goes_on().is_err() {
            // The program goes on for a moment while a signal ends its transfer: it has made no mistake.
            return false;
        }
        let mut reported = self.reported.lock();
        let error = result.err();
        if let Some(Failure(sentence)) = error.as_ref().filter(|_| *reported != error) {
            report::failure(format_args!("{}: {sentence}", self.host));
        }
        *reported = error;
        reported.is_none()
    }

    pub(super) fn version(&self) -> Result<u32, Failure> {
        let mut transfer = self.transfer.lock();
        let status = match &mut transfer.link {
            Some(link) => link.client.query_status()?,
            None => self.connect()?.query_status()?,
        };
        Ok(status.version.code())
    }

    fn connect(&self) -> Result<TxtClient, Failure> {
        exit::watch_signals();
        Ok(TxtClient::connect(&self.host, TimeLimits::default())?)
    }

    pub(super) fn begin(&self) -> Result<(), Failure> {
        self.end()?;
        exit::check_goes_on()?;
        let mut client = self.connect()?;
        let firmware = client.query_status()?.version;
        client.start_online()?;
        let online = Some(Online::begin(client.address(), &self.host));
        let mut link = Link {
            client,
            simple: Exchange::new(TransferMode::Simple, firmware),
            compressed: Exchange::new(TransferMode::Compressed, firmware),
            areas: vec![FishX1Transfer::default(); self.areas.count()],
            begun: Instant::now(),
            online,
        };
        exit::watch(&self.transfer);
        let mut transfer = self.transfer.lock();
        // From here on, an end of the program waits for the lock. It may have come before.
        if let Err(error) = exit::check_goes_on() {
            leave(Some(link), None);
            return Err(error.into());
        }
        let Transfer { array, mirror, link: place } = &mut *transfer;
        self.areas.copy_to(array);
        mirror.put_out_configs(&mut link.areas);
        // With all outputs 0: the response has the ids of the commands that the controller knows.
        if let Err(error) = exchange(&mut link.client, &mut link.compressed, &mut link.areas) {
            if exit::check_goes_on().is_err() {
                leave(Some(link), None);
            }
            return Err(error.into());
        }
        mirror.begin(&link.areas);
        *place = Some(link);
        Ok(())
    }

    pub(super) fn update_config(&self) -> Result<(), Failure> {
        let mut transfer = self.transfer.lock();
        let Transfer { array, mirror, link } = &mut *transfer;
        let link = link.as_mut().ok_or(NO_TRANSFER)?;
        self.areas.copy_to(array);
        mirror.put_out_configs(&mut link.areas);
        Ok(update_configs(&mut link.client, &mut link.compressed, &link.areas)?)
    }

    pub(super) fn transfer(&self, mode: TransferMode) -> Result<(), Failure> {
        let mut transfer = self.transfer.lock();
        let Transfer { array, mirror, link } = &mut *transfer;
        let link = link.as_mut().ok_or(NO_TRANSFER)?;
        self.areas.copy_to(array);
        mirror.put_out(&mut link.areas);
        let by = match mode {
            TransferMode::Simple => &mut link.simple,
            _ => &mut link.compressed,
        };
        if let Err(error) = exchange(&mut link.client, by, &mut link.areas) {
            exit::check_goes_on()?;
            link.online = None;
            return Err(error.into());
        }
        self.areas.copy_newest_to(array);
        let mut timer = Timer::default();
        timer.set_elapsed(link.begun.elapsed());
        self.areas.with_flags(array, || {
            mirror.take_in(&link.areas, |_| {});
            self.areas.copy_values_from(array, timer);
        });
        self.areas.copy_ids_from(array);
        Ok(())
    }

    /// Ends the transfer, if there is one, with its motors stopped.
    pub(super) fn end(&self) -> Result<(), Failure> {
        // Under the lock: what ends the process meanwhile waits for it.
        let mut transfer = self.transfer.lock();
        leave(transfer.link.take(), self.camera.lock().take());
        Ok(())
    }

    /// `settings`: width, height, frames per second, frequency of the mains.
    pub(super) fn start_camera(
        &self,
        settings: [i32; 4],
        port: Option<&str>,
    ) -> Result<(), Failure> {
        let options = jpeg::camera_options(settings)?;
        self.stop_camera()?;
        let mut transfer = self.transfer.lock();
        let link = transfer.link.as_mut().ok_or(NO_TRANSFER)?;
        let given = port.and_then(|port| port.trim().parse().ok());
        let port = given.filter(|_| !self.is_replaced);
        let port = port.unwrap_or_else(|| host::camera_port(&self.host));
        let (stream, frames) = link.client.start_camera(port, options)?;
        *self.camera.lock() = Some(Camera { stream, frames });
        Ok(())
    }

    pub(super) fn stop_camera(&self) -> Result<(), Failure> {
        let Some(camera) = self.camera.lock().take() else { return Ok(()) };
        drop(camera);
        match &mut self.transfer.lock().link {
            Some(link) => Ok(link.client.stop_camera_online()?),
            None => Ok(()),
        }
    }

    /// Where the next frame is, and its size.
    pub(super) fn frame(&self) -> Result<(*mut u8, usize), Failure> {
        let frames = self.camera.lock().as_ref().map(|camera| camera.frames.clone());
        let frames = frames.ok_or("the camera was not started")?;
        // A program may stop the camera meanwhile.
        let filled = self.picture.lock().next(&self.host, &frames);
        filled.ok_or_else(|| {
            match self.camera.lock().as_ref().map(|camera| camera.stream.error()) {
                Some(Some(error)) => format!("the camera has ended: {error:#}").into(),
                Some(None) => "no frame of the camera came in".into(),
                None => "the camera has ended: it was stopped".into(),
            }
        })
    }
}

/// Hands over the configurations that have changed. Before each one it looks whether the program ends: its end waits for
/// the answer that is under way, and not for all.
fn update_configs(
    client: &mut TxtClient,
    by: &mut Exchange,
    areas: &[FishX1Transfer],
) -> Result<(), Error> {
    loop {
        exit::check_goes_on()?;
        let Some(update) = by.next_update_config(areas) else { return Ok(()) };
        client.update_config(&update)?;
    }
}

/// The same, then an exchange.
fn exchange(
    client: &mut TxtClient,
    by: &mut Exchange,
    areas: &mut [FishX1Transfer],
) -> Result<(), Error> {
    update_configs(client, by, areas)?;
    client.do_transfer(by, areas)
}

impl Link {
    /// Stops the motors, then the camera, and ends online mode. The firmware of a TXT leaves outputs as they are at
    /// StopOnline and at a close, so an exchange with all duties 0 comes first.
    fn leave(&mut self, camera: Option<Camera>) -> Result<(), Error> {
        self.areas.iter_mut().for_each(|area| *area.output.duty = [0; 8]);
        self.compressed.end_sounds();
        // A configuration that has changed is of no use any more.
        while self.compressed.next_update_config(&self.areas).is_some() {}
        self.client.do_transfer(&mut self.compressed, &mut self.areas)?;
        if let Some(online) = self.online.take() {
            online.end();
        }
        if let Some(camera) = camera {
            drop(camera);
            self.client.stop_camera_online()?;
        }
        self.client.stop_online()
    }
}

/// Leaves a connection, which may be lost already.
fn leave(link: Option<Link>, camera: Option<Camera>) {
    let Some(mut link) = link else { return };
    if let Err(error) = link.leave(camera) {
        log::debug!("while a transfer is ended: {error:#}");
    }
}

impl exit::Transfer for Mutex<Transfer> {
    fn end(&self) {
        // The program may end in the middle of an exchange.
        let Some(mut transfer) = self.try_lock_for(exit::ANSWER_LIMIT) else { return };
        // Under the lock: a program that learns of the end at once may end the process before the last exchange.
        leave(transfer.link.take(), None);
    }
}

impl Drop for Kit {
    fn drop(&mut self) {
        // It reports nothing.
        let _ = self.end();
    }
}
