//! The kinds of callbacks that a program gives, and what they are told.

use std::ffi::{c_int, c_void};

/// The program's pointer that callbacks of ftMscLibEx get.
pub(super) type Context = *mut c_void;

/// The kinds of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// `SetCBCounterResetted`.
    CounterResetted,
    /// `SetCBMotorExReached`.
    MotorExReached,
    /// `SetCBRoboExtState`.
    RoboExtState,
    /// `SetCBCounterResetted2`.
    CounterResetted2,
    /// `SetCBMotorExReached2`.
    MotorExReached2,
    /// `SetCBRoboExtState2`.
    RoboExtState2,
    /// `SetCBUniChanged`.
    UniChanged,
    /// `SetCBCntInChanged`.
    CntInChanged,
    /// `SetCBCounterChanged`.
    CounterChanged,
}

impl Event {
    pub(super) const COUNT: usize = Self::CounterChanged as usize + 1;

    pub(super) fn is_change(self) -> bool {
        matches!(self, Self::UniChanged | Self::CntInChanged | Self::CounterChanged)
    }
}

pub(super) type EventCallback1 = unsafe extern "system-unwind" fn(u32, u32);
pub(super) type EventCallback2 = unsafe extern "system-unwind" fn(u32, u32, Context);
pub(super) type UniCallback = unsafe extern "system-unwind" fn(u32, u32, u32, u32, u8, u8, Context);
pub(super) type CntInCallback = unsafe extern "system-unwind" fn(u32, u32, c_int, Context);
pub(super) type CounterCallback = unsafe extern "system-unwind" fn(u32, u32, u32, i16, Context);

/// A callback of the program for one kind of event.
#[derive(Clone, Copy)]
pub(super) enum EventCallback {
    Alone(EventCallback1),
    WithContext(EventCallback2),
    Uni(UniCallback),
    CntIn(CntInCallback),
    Counter(CounterCallback),
}

/// What a callback is told.
#[derive(Clone, Copy)]
pub(super) struct Told {
    pub(super) controller: u32,
    /// Which counter, motor or input it is, or the state of an extension.
    pub(super) what: u32,
    /// Of an input that has changed.
    pub(super) input: InputNow,
}

/// The value of an input, and how it is measured.
#[derive(Clone, Copy, Default)]
pub(super) struct InputNow {
    pub(super) value: u32,
    pub(super) overrun: u32,
    pub(super) mode: u8,
    pub(super) digital: u8,
}

impl EventCallback {
    pub(super) fn call(self, told: Told, context: Context) {
        let Told { controller, what, input } = told;
        let InputNow { value, overrun, mode, digital } = input;
        // SAFETY: the program has set each as a function of its kind.
        unsafe {
            match self {
                Self::Alone(it) => it(controller, what),
                Self::WithContext(it) => it(controller, what, context),
                Self::Uni(it) => it(controller, what, value, overrun, mode, digital, context),
                Self::CntIn(it) => it(controller, what, value as c_int, context),
                Self::Counter(it) => it(controller, what, value, mode.into(), context),
            }
        }
    }
}

/// A callback of the program for the result of one request.
pub(super) enum ResultCallback<T> {
    Alone(unsafe extern "system-unwind" fn(*mut T)),
    WithContext(unsafe extern "system-unwind" fn(*mut T, Context)),
}

impl<T> ResultCallback<T> {
    /// The result is there during the call only.
    pub(super) fn call(self, mut result: T, context: Context) {
        // SAFETY: the program has given each as a function of its kind.
        unsafe {
            match self {
                Self::Alone(it) => it(&mut result),
                Self::WithContext(it) => it(&mut result, context),
            }
        }
    }
}
