//! One open device.

use std::ffi::c_void;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, AtomicPtr, Ordering};
use std::sync::{Arc, Weak};

use ft_transfer_area::{FirmwareVersion, FoundController, Statistics, TransferMode};
use parking_lot::Mutex;

use super::callbacks::{Callbacks, Owner};
use super::changes::{self, Input};
use super::kinds::{Context, Event, InputNow, Told};
use crate::errors::{
    code_of, FTLIB_ERR_DEVICE_IS_OPEN, FTLIB_ERR_DEVICE_NOT_OPEN, FTLIB_ERR_SOME_DEVICES_ARE_OPEN,
    FTLIB_ERR_THREAD_NOT_RUNNING,
};
use crate::exit::{self, Transfer};
use crate::host;
use crate::i2c::{Done, I2cThread, Request};
use crate::memory::{AreaArray, Ta, AREAS};
use crate::mirror::{AreaEvent, DEV_MODE_ONLINE};
use crate::report;
use crate::session::{ProgramSession, SessionSettings};

/// A device between `ftxOpenComDevice` and `ftxCloseDevice`, and as long as a call uses it.
pub(super) struct Device {
    handle: usize,
    /// The host as it was given or configured.
    host: String,
    /// The number of the COM port as which the program has opened it.
    port: Option<u32>,
    controller: FoundController,
    session: ProgramSession<Ta>,
    i2c: Mutex<Option<I2cThread>>,
    callbacks: Arc<Callbacks>,
    /// What callbacks with a context get.
    context: AtomicPtr<c_void>,
    /// For each controller and kind of input the bits of those that report changes.
    masks: Mutex<[[u8; Input::ALL.len()]; AREAS]>,
    /// The statistics at the last `ResetTrapStatistic`.
    forgotten: Mutex<Statistics>,
    closed: AtomicBool,
}

impl Device {
    /// A device for a controller that has answered. Nothing is connected.
    pub(super) fn new(
        handle: usize,
        host: String,
        port: Option<u32>,
        controller: FoundController,
        callbacks: Arc<Callbacks>,
    ) -> Result<Arc<Self>, u32> {
        let settings = SessionSettings {
            host: controller.address.to_string(),
            dev_mode: DEV_MODE_ONLINE,
            areas: AREAS,
            mode: host::mode_for(TransferMode::Compressed),
        };
        let session = ProgramSession::new(&settings, None).map_err(|error| code_of(&error))?;
        session.introduce(&controller.name, controller.firmware);
        let device = Arc::new(Self {
            handle,
            host,
            port,
            controller,
            session,
            i2c: Mutex::default(),
            callbacks,
            context: AtomicPtr::new(null_mut()),
            masks: Mutex::default(),
            forgotten: Mutex::default(),
            closed: AtomicBool::new(false),
        });
        let own = Arc::downgrade(&device);
        let callbacks = Arc::clone(&device.callbacks);
        let listener = move |happened| tell(&own, &callbacks, happened);
        device.session.set_listener(Some(Box::new(listener)));
        Ok(device)
    }

    pub(super) fn handle(&self) -> usize {
        self.handle
    }

    /// Whether it is the device at this host.
    pub(super) fn is_at(&self, host: &str) -> bool {
        self.host.eq_ignore_ascii_case(host)
    }

    /// The code when it is to be opened again, as this COM port.
    pub(super) fn why_not_again(&self, port: Option<u32>) -> u32 {
        match (self.port, port) {
            (Some(open), Some(other)) if open != other => FTLIB_ERR_SOME_DEVICES_ARE_OPEN,
            _ => FTLIB_ERR_DEVICE_IS_OPEN,
        }
    }

    /// The one that has answered at the opening.
    pub(super) fn controller(&self) -> &FoundController {
        &self.controller
    }

    /// Of the controller that was connected last, which may be another one than at the opening.
    pub(super) fn name(&self) -> String {
        self.session.handler().device_name().unwrap_or_else(|| self.controller.name.clone())
    }

    /// As the name.
    pub(super) fn firmware(&self) -> FirmwareVersion {
        self.session.handler().version().unwrap_or(self.controller.firmware)
    }

    pub(super) fn array(&self) -> &AreaArray<Ta> {
        self.session.array()
    }

    pub(super) fn session(&self) -> &ProgramSession<Ta> {
        &self.session
    }

    /// Begins the transfer, and returns after the first response.
    pub(super) fn start(self: &Arc<Self>) -> Result<(), u32> {
        exit::watch(self);
        let started = self.session.start();
        if !self.is_open() {
            // Closed meanwhile, perhaps before the transfer began.
            let _ = self.session.stop();
            return Err(FTLIB_ERR_DEVICE_NOT_OPEN);
        }
        *self.forgotten.lock() = Statistics::default();
        started.map_err(|error| {
            if !report::is_told_by_code(&error) {
                report::failure(format_args!("{}: {error:#}", self.host));
            }
            code_of(&error)
        })
    }

    /// Ends the transfer, with all outputs off.
    pub(super) fn stop(&self) -> Result<(), u32> {
        let was_running = self.session.is_running();
        // How it ended is in the log, and there is nothing left that could go on.
        let _ = self.session.stop();
        if was_running {
            Ok(())
        } else {
            Err(FTLIB_ERR_THREAD_NOT_RUNNING)
        }
    }

    /// Has an I2C request carried out; `done` is called in a thread that is not the callbacks'.
    pub(super) fn i2c(self: &Arc<Self>, request: Request, done: Done) -> Result<(), u32> {
        let mut i2c = self.i2c.lock();
        // Under the lock, so nothing starts after it was closed.
        if !self.is_open() {
            return Err(FTLIB_ERR_DEVICE_NOT_OPEN);
        }
        let thread = match &mut *i2c {
            Some(thread) => thread,
            none => {
                let device = Arc::downgrade(self);
                let gone = || ft_transfer_area::Error::NotStarted;
                let connect = move || device.upgrade().ok_or_else(gone)?.session.handler().i2c();
                none.insert(I2cThread::start(&self.host, connect)?)
            }
        };
        let (device, transfer) = (Arc::downgrade(self), self.session.transfer());
        // Before the first one there was no other controller.
        let is_of = move |now: u32| transfer == 0 || now == transfer;
        let is_valid = move || device.upgrade().is_some_and(|it| is_of(it.session.transfer()));
        thread.request(request, Box::new(is_valid), done)
    }

    /// What callbacks with a context get from now on.
    pub(super) fn set_context(&self, context: Context) {
        self.context.store(context, Ordering::Release);
    }

    /// Chooses the inputs that report changes.
    pub(super) fn set_mask(&self, area: usize, input: Input, mask: u32) {
        self.masks.lock()[area][input as usize] = mask as u8 & input.all_bits();
    }

    /// The inputs that report changes.
    pub(super) fn mask(&self, area: usize, input: Input) -> u8 {
        self.masks.lock()[area][input as usize]
    }

    /// Calls the program back from the callbacks' thread, unless the device is closed before.
    pub(super) fn call_back(self: &Arc<Self>, call: impl FnOnce(Context) + Send + 'static) {
        self.callbacks.once(self.as_owner(), call);
    }

    /// What calls back, for threads that must not keep the device open.
    pub(super) fn callbacks(&self) -> Arc<Callbacks> {
        Arc::clone(&self.callbacks)
    }

    /// The statistics of the transfer since its begin, and what of it was reset.
    pub(super) fn statistics(&self) -> (Statistics, Statistics) {
        (self.session.handler().areas().statistics(), *self.forgotten.lock())
    }

    pub(super) fn reset_statistics(&self) {
        *self.forgotten.lock() = self.session.handler().areas().statistics();
    }

    /// Ends the transfer, with all outputs off, and all else that belongs to the device. Returns whether it
    /// was this call that closed it; otherwise another thread does the same.
    pub(super) fn close(&self) -> bool {
        let was_open = !self.closed.swap(true, Ordering::AcqRel);
        // A transfer that could not be ended well is in the log; the connection is closed anyway.
        let _ = self.session.stop();
        let i2c = self.i2c.lock().take();
        drop(i2c);
        was_open
    }

    /// Waits until no callback for the closed device is running, but not for the one in which this is called,
    /// and not forever.
    pub(super) fn settle(self: &Arc<Self>) {
        self.callbacks.settle_owner(&self.as_owner());
    }

    /// What callbacks belong to. It does not keep the device.
    pub(super) fn as_owner(self: &Arc<Self>) -> Weak<dyn Owner> {
        Arc::<Self>::downgrade(self)
    }
}

impl Transfer for Device {
    fn end(&self) {
        self.session.end();
    }

    fn ask(&self) {
        self.session.ask();
    }
}

impl Owner for Device {
    fn is_open(&self) -> bool {
        !self.closed.load(Ordering::Acquire)
    }

    fn transfer(&self) -> u32 {
        self.session.transfer()
    }

    fn now(&self, event: Event, told: Told) -> Option<Told> {
        match event {
            Event::CounterResetted
            | Event::CounterResetted2
            | Event::MotorExReached
            | Event::MotorExReached2 => None,
            Event::RoboExtState | Event::RoboExtState2 => {
                let alive = self.array().load(self.array().places(0).extensions);
                let alive = alive.get((told.controller as usize).checked_sub(1)?)?;
                Some(Told { what: (*alive != 0).into(), ..told })
            }
            Event::UniChanged | Event::CntInChanged | Event::CounterChanged => {
                changes::now(self, event, told)
            }
        }
    }

    fn context(&self) -> Context {
        self.context.load(Ordering::Acquire)
    }
}

/// Tells the program what a response brought.
fn tell(device: &Weak<Device>, callbacks: &Callbacks, happened: AreaEvent) {
    let (events, area, what) = match happened {
        AreaEvent::CounterReset { area, counter } => {
            ([Event::CounterResetted, Event::CounterResetted2], area, counter as u32)
        }
        AreaEvent::MotorReached { area, motor } => {
            ([Event::MotorExReached, Event::MotorExReached2], area, motor as u32)
        }
        AreaEvent::Extension { area, online } => {
            ([Event::RoboExtState, Event::RoboExtState2], area, online.into())
        }
        AreaEvent::Inputs { area, change } => {
            return changes::tell(device, callbacks, area, &change);
        }
    };
    let told = Told { controller: area as u32, what, input: InputNow::default() };
    for event in events {
        callbacks.event(device.clone(), event, told);
    }
}
