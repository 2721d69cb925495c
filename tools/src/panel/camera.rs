//! The camera's pictures. The newest one wins: a page that is slow misses some.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crossbeam_channel::{bounded, never, select, Receiver, Sender};
use ft_transfer_area::{CameraFrame, Error, TransferAreaComHandler};
use serde::Serialize;
use tokio::sync::watch;

use super::common::spawn;
use super::order::Order;
use super::problem::Problem;
use super::request::CameraRequest;
use crate::camera::options;
use crate::recording::on_demand::Button;

/// How many orders may wait.
const WAITING: usize = 4;
/// How long the next picture may take.
const FRAME_LIMIT: Duration = Duration::from_secs(3);

/// What the camera's thread publishes for all others.
#[derive(Debug)]
pub(crate) struct Camera {
    state: Mutex<CameraState>,
    picture: watch::Sender<Arc<[u8]>>,
}

#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct CameraState {
    running: bool,
    frames: u64,
    error: Option<Problem>,
}

impl Default for Camera {
    fn default() -> Self {
        let picture = watch::Sender::new(Arc::from([]));
        Self { state: Mutex::default(), picture }
    }
}

impl Camera {
    pub(crate) fn state(&self) -> CameraState {
        self.lock().clone()
    }

    /// The newest picture as a JPEG file; empty before the first one.
    pub(crate) fn pictures(&self) -> watch::Receiver<Arc<[u8]>> {
        self.picture.subscribe()
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, CameraState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn show(&self, frame: &CameraFrame) {
        let mut state = self.lock();
        state.running = true;
        state.frames += 1;
        match frame.jpeg() {
            Ok(jpeg) => {
                state.error = None;
                self.picture.send_replace(Arc::from(&*jpeg));
            }
            Err(error) => state.error = Some(error.into()),
        }
    }

    /// It was switched on or off: there is no picture yet, and none of before.
    pub(super) fn switched(&self, running: bool) {
        *self.lock() = CameraState { running, ..CameraState::default() };
        self.picture.send_replace(Arc::from([]));
    }

    /// No more pictures come on this connection.
    pub(super) fn end(&self) {
        self.lock().running = false;
    }
}

/// A thread that starts and stops the camera, and takes its pictures.
pub(super) fn start(
    handler: Arc<TransferAreaComHandler>,
    camera: Arc<Camera>,
    button: Button,
) -> Result<Sender<Order<CameraRequest>>, Error> {
    let (orders, receiver) = bounded(WAITING);
    spawn("camera", move || work(&handler, &camera, &button, &receiver))?;
    Ok(orders)
}

fn work(
    handler: &TransferAreaComHandler,
    camera: &Camera,
    button: &Button,
    orders: &Receiver<Order<CameraRequest>>,
) {
    let mut frames = never();
    loop {
        select! {
            recv(orders) -> order => match order {
                Ok(Order { request, reply, .. }) => {
                    match switch(handler, &request) {
                        Ok(stream) => {
                            camera.switched(request.on);
                            frames = stream;
                            reply.send(Ok(None));
                        }
                        Err(error) => reply.send(Err(error.into())),
                    }
                }
                Err(_) => return,
            },
            recv(frames) -> frame => match frame {
                Ok(frame) => {
                    camera.show(&frame);
                    button.picture(&frame);
                }
                Err(_) => {
                    frames = never();
                    let mut state = camera.lock();
                    state.running = false;
                    state.error = handler.camera_error().map(Problem::from);
                }
            },
        }
    }
}

fn switch(
    handler: &TransferAreaComHandler,
    request: &CameraRequest,
) -> Result<Receiver<CameraFrame>, Error> {
    if !request.on {
        handler.stop_camera()?;
        return Ok(never());
    }
    let options = options();
    let (width, height) =
        (request.width.unwrap_or(options.width), request.height.unwrap_or(options.height));
    let framerate = request.fps.unwrap_or(options.framerate);
    let options = options.size(width, height).framerate(framerate);
    handler.start_camera(options.frame_limit(FRAME_LIMIT))
}
