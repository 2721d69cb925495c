//! What a program is doing when something else happens to it.

use std::ops::ControlFlow;
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TransferAreaComHandler, TransferAreas};

use super::controller::DUTY;
use super::logger::Blocked;
use super::wire::small_pictures;
use crate::proxy::Proxy;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beside {
    /// Each call sleeps for this time, until the hook is notified of an interruption.
    SleepingHook(Duration),
    HangingHook,
    HeldGuard,
    WaitingThreads,
    /// The same while a guard is held; they begin to wait after this time.
    WaitingForGuard(Duration),
    /// The controller takes a long time to answer the command of another thread.
    CameraCommand,
    BlockedLogger,
}

/// The threads that do it.
pub(crate) struct Companion {
    /// Without it they end.
    let_go: Option<Sender<()>>,
    threads: Vec<JoinHandle<()>>,
    logger: Option<Blocked>,
    /// The errors that the hook gets.
    pub(crate) reported: Option<Receiver<Error>>,
}

impl Beside {
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::SleepingHook(_) => "while a hook sleeps",
            Self::HangingHook => "while a hook hangs",
            Self::HeldGuard => "while a guard is held",
            Self::WaitingThreads => "with eight waiting threads",
            Self::WaitingForGuard(_) => "with eight waiting threads, while a guard is held",
            Self::CameraCommand => "while another thread is in `start_camera`",
            Self::BlockedLogger => "while the logger blocks",
        }
    }

    pub(crate) fn is_hook(self) -> bool {
        matches!(self, Self::SleepingHook(_) | Self::HangingHook)
    }

    /// Whether another thread gets no guard meanwhile.
    pub(crate) fn has_areas(self) -> bool {
        self.is_hook() || matches!(self, Self::HeldGuard | Self::WaitingForGuard(_))
    }

    /// How many threads wait for responses. One does in any case, so that the others are seen by it.
    pub(crate) fn waiting(self) -> usize {
        match self {
            Self::WaitingThreads | Self::WaitingForGuard(_) => 8,
            _ => 1,
        }
    }

    /// Begins it, and returns when it has begun.
    pub(crate) fn begin(self, handler: &Arc<TransferAreaComHandler>, proxy: &Proxy) -> Companion {
        let (let_go, gate) = mpsc::channel();
        let mut threads = Vec::new();
        let (mut logger, mut reported) = (None, None);
        match self {
            Self::SleepingHook(time) => {
                reported = Some(set_hook(handler, move || thread::sleep(time)))
            }
            Self::HangingHook => reported = Some(set_hook(handler, move || _ = gate.recv())),
            Self::HeldGuard | Self::WaitingForGuard(_) => {
                threads.push(hold(handler.areas().clone(), gate));
            }
            Self::WaitingThreads => {}
            Self::CameraCommand => {
                let handler = Arc::clone(handler);
                threads.push(thread::spawn(move || drop(handler.start_camera(small_pictures()))));
                proxy.wait_struck();
            }
            Self::BlockedLogger => {
                let blocked = Blocked::begin();
                // The library warns of a duty that is out of range.
                handler.areas().lock()[LOCAL_IO].output.duty[1] = i16::MAX;
                blocked.wait();
                logger = Some(blocked);
            }
        }
        if let Self::WaitingForGuard(time) = self {
            thread::sleep(time);
        }
        Companion { let_go: Some(let_go), threads, logger, reported }
    }
}

impl Companion {
    /// Lets everything go on that hangs or blocks, and waits for the threads.
    pub(crate) fn let_go(&mut self) {
        self.let_go = None;
        self.logger = None;
        self.threads.drain(..).for_each(|thread| thread.join().unwrap());
    }
}

/// Sets a hook that writes a duty and is `busy` in each call, until it is notified of an interruption. Returns when it
/// is busy.
fn set_hook(handler: &TransferAreaComHandler, busy: impl Fn() + Send + 'static) -> Receiver<Error> {
    let (begun, has_begun) = mpsc::channel();
    let (telling, reported) = mpsc::channel();
    let mut is_told = false;
    let set = handler.set_cycle_hook(move |areas| {
        match areas {
            Ok(areas) if !is_told => {
                areas[LOCAL_IO].output.duty[0] = DUTY;
                let _ = begun.send(());
                busy();
            }
            Ok(_) => {}
            Err(error) => {
                is_told = true;
                let _ = telling.send(error);
            }
        }
        ControlFlow::Continue(())
    });
    set.unwrap();
    has_begun.recv().unwrap();
    reported
}

/// A thread that holds a guard with a duty in it until its gate is open.
fn hold(area: TransferAreas, gate: Receiver<()>) -> JoinHandle<()> {
    let (locked, is_locked) = mpsc::channel();
    let holder = thread::spawn(move || {
        let mut guard = area.lock();
        guard[LOCAL_IO].output.duty[0] = DUTY;
        locked.send(()).unwrap();
        let _ = gate.recv();
    });
    is_locked.recv().unwrap();
    holder
}

/// Threads that wait for each response.
pub(crate) struct Waiting {
    areas: Vec<TransferAreas>,
    threads: Vec<JoinHandle<Error>>,
    hearing: Sender<Error>,
    heard: Receiver<Error>,
}

impl Waiting {
    /// Their handles, which are to be notified of all that happens from now on.
    pub(crate) fn new(handler: &TransferAreaComHandler, count: usize) -> Self {
        let areas = (0..count).map(|_| handler.areas().clone()).collect();
        let (hearing, heard) = mpsc::channel();
        Self { areas, threads: Vec::new(), hearing, heard }
    }

    /// Begins to wait. Does nothing when they do.
    pub(crate) fn begin(&mut self) {
        for area in self.areas.drain(..) {
            // They come at different moments of a cycle.
            thread::sleep(Duration::from_millis(2));
            let hearing = self.hearing.clone();
            self.threads.push(thread::spawn(move || loop {
                match area.wait_cycle() {
                    Ok(_) => {}
                    Err(error @ (Error::ConnectionLost { .. } | Error::WatchdogExpired { .. })) => {
                        hearing.send(error).unwrap()
                    }
                    Err(error) => return error,
                }
            }));
        }
    }

    /// Waits until each has been notified of this interruption.
    pub(crate) fn wait_until_told(&self, interruption: &Error, limit: Duration) {
        for _ in &self.threads {
            assert_eq!(self.heard.recv_timeout(limit).as_ref(), Ok(interruption));
        }
    }

    /// Waits until each has been notified of the end, and of nothing else.
    pub(crate) fn wait_until_ended(self, end: &Error) {
        for thread in self.threads {
            assert_eq!(thread.join().unwrap(), *end);
        }
        assert_eq!(self.heard.try_iter().next(), None, "each is notified once");
    }
}
