//! The camera's pictures. The newest one wins: a page that is slow misses some.

use std::sync::atomic::{AtomicBool, Ordering};
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
    /// While it is 0 there is no picture.
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

    /// Shows this one, unless the controller that has sent it is gone.
    pub(super) fn show(&self, frame: &CameraFrame, is_there: impl FnOnce() -> bool) {
        let mut state = self.lock();
        if !is_there() {
            return;
        }
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

    /// The next picture may be of another controller.
    pub(super) fn forget(&self) {
        let mut state = self.lock();
        state.frames = 0;
        self.picture.send_replace(Arc::from([]));
    }

    /// Another controller answers. What the one before has told of its camera is not told of this one.
    pub(super) fn replaced(&self) {
        self.lock().error = None;
    }

    /// No more pictures come on this connection.
    pub(super) fn end(&self) {
        self.lock().running = false;
        self.forget();
    }
}

/// A thread that starts and stops the camera, and takes its pictures.
pub(super) fn start(
    handler: Arc<TransferAreaComHandler>,
    camera: Arc<Camera>,
    button: Button,
    is_connected: Arc<AtomicBool>,
) -> Result<Sender<Order<CameraRequest>>, Error> {
    let (orders, receiver) = bounded(WAITING);
    spawn("camera", move || work(&handler, &camera, &button, &is_connected, &receiver))?;
    Ok(orders)
}

fn work(
    handler: &TransferAreaComHandler,
    camera: &Camera,
    button: &Button,
    is_connected: &AtomicBool,
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
                    camera.show(&frame, || is_connected.load(Ordering::Relaxed));
                    button.picture(&frame);
                }
                Err(_) => {
                    frames = never();
                    camera.end();
                    camera.lock().error = handler.camera_error().map(Problem::from);
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

#[cfg(test)]
mod tests {
    use ft_transfer_area_simulator::SimulatedTxt;

    use super::*;

    #[test]
    fn a_picture_that_comes_after_the_loss_of_its_controller_is_not_shown() {
        let txt = SimulatedTxt::builder().camera_start_up(Duration::ZERO).start().unwrap();
        let handler = TransferAreaComHandler::builder(txt.address()).build().unwrap();
        handler.begin_transfer().unwrap();
        let frame = handler.start_camera(options()).unwrap().recv().unwrap();
        handler.end_transfer().unwrap();
        let camera = Camera::default();
        camera.switched(true);
        camera.show(&frame, || true);
        assert!(camera.state().frames == 1 && !camera.pictures().borrow().is_empty());
        camera.forget();
        camera.show(&frame, || false);
        assert!(camera.state().frames == 0 && camera.pictures().borrow().is_empty());
    }
}
