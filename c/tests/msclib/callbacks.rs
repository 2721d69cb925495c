//! Callbacks: once per event, in the library's thread, and whatever they do.

use parking_lot::{Condvar, Mutex};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, ThreadId};

use ft_transfer_area_simulator::SimulatedTxt;

use super::api::*;
use super::bench::*;

/// What the callbacks were called with: 'c', 'm' or 'e', controller, and counter, motor or state.
static CALLS: Mutex<Vec<(char, u32, u32)>> = Mutex::new(Vec::new());
static THREADS: Mutex<Vec<ThreadId>> = Mutex::new(Vec::new());

fn note(kind: char, controller: u32, what: u32) {
    CALLS.lock().push((kind, controller, what));
    THREADS.lock().push(thread::current().id());
}

extern "system" fn counter(controller: u32, counter: u32) {
    note('c', controller, counter);
}

extern "system" fn motor(controller: u32, motor: u32) {
    note('m', controller, motor);
}

extern "system" fn extension(controller: u32, state: u32) {
    note('e', controller, state);
}

fn calls() -> Vec<(char, u32, u32)> {
    CALLS.lock().clone()
}

fn forget() {
    CALLS.lock().clear();
    THREADS.lock().clear();
}

fn set_all() {
    SetCBCounterResetted(Some(counter));
    SetCBMotorExReached(Some(motor));
    SetCBRoboExtState(Some(extension));
}

#[test]
fn each_event_is_told_once_in_a_thread_of_the_library() {
    let library = initialized();
    set_all();
    library.in_both_exchanges(|_, device| {
        forget();
        assert_eq!(StartCounterReset(device.0, 0, 3), SUCCESS);
        wait("the counter", || calls() == [('c', 0, 3)]);
        assert_eq!(StartMotorExCmd(device.0, 0, 1, 512, 0, 2, 0, 20), SUCCESS);
        wait("the motors", || calls().len() == 3);
        let mut motors = calls().split_off(1);
        motors.sort_unstable();
        assert_eq!(motors, [('m', 0, 1), ('m', 0, 2)]);
        let threads = THREADS.lock().clone();
        assert!(threads.iter().all(|thread| *thread == threads[0]));
        assert_ne!(threads[0], thread::current().id());
        // A motor that is stopped, or turns without end, has reached nothing.
        forget();
        assert_eq!(StopAllMotorExCmd(device.0, 0), SUCCESS);
        assert_eq!(StartMotorExCmd(device.0, 0, 0, 512, 0, 0, 0, 0), SUCCESS);
        wait("pulses", || device.input(0).counter[0] > 20);
        // Nor is a callback called that was removed.
        SetCBCounterResetted(None);
        assert_eq!(StartCounterReset(device.0, 0, 3), SUCCESS);
        wait("the reset", || device.input(0).cnt_resetted[3] == 1);
        device.pass();
        SetCBCounterResetted(Some(counter));
        assert_eq!(StartCounterReset(device.0, 0, 2), SUCCESS);
        wait("the counter", || !calls().is_empty());
        assert_eq!(calls(), [('c', 0, 2)]);
    });
}

/// A published program waits for this after each stop. Its recordings with the original library and a ROBO TX have it
/// after 45 to 92 ms.
#[test]
fn a_distance_that_is_stopped_before_its_end_is_told() {
    let library = initialized();
    set_all();
    library.in_both_exchanges(|txt, device| {
        assert_eq!(StartMotorExCmd(device.0, 0, 1, 512, 0, 0, 0, 60_000), SUCCESS);
        machine(txt, "the motor", |it| it.controllers[0].outputs.duty[2] == 512);
        wait("pulses", || device.input(0).counter[1] > 5);
        forget();
        // Twice is still one stop.
        assert_eq!(StopMotorExCmd(device.0, 0, 1), SUCCESS);
        assert_eq!(StopMotorExCmd(device.0, 0, 1), SUCCESS);
        wait("the motor that was stopped", || calls() == [('m', 0, 1)]);
        // It has not reached its target.
        assert_eq!(device.input(0).motor_ex_reached[1], 0);
        // The one that follows it stands as well, and one that stands already has nothing to tell.
        assert_eq!(StopAllMotorExCmd(device.0, 0), SUCCESS);
        wait("the follower", || calls() == [('m', 0, 1), ('m', 0, 0)]);
        // A distance in place of another one is no stop, and neither is turning without end.
        for pulses in [60_000, 0] {
            assert_eq!(StartMotorExCmd(device.0, 0, 1, 512, 0, -1, 0, 60_000), SUCCESS);
            wait("pulses", || device.input(0).counter[1] > 5);
            assert_eq!(StartMotorExCmd(device.0, 0, 1, 400, 0, -1, 0, pulses), SUCCESS);
            machine(txt, "the motor", |it| it.controllers[0].outputs.duty[2] == 400);
        }
        device.pass();
        assert_eq!(calls().len(), 2);
    });
}

#[test]
fn extensions_that_come_and_go_are_told() {
    let _library = initialized();
    let txt = start(ft_transfer_area_simulator::SimulatedTxt::builder().extensions(2));
    txt.with_machine(|it| it.alive[1] = false);
    forget();
    set_all();
    let device = Device::open(&txt);
    device.start();
    wait("the first", || calls() == [('e', 1, 1)]);
    txt.with_machine(|it| it.alive[1] = true);
    wait("the second", || calls() == [('e', 1, 1), ('e', 2, 1)]);
    txt.with_machine(|it| it.alive[0] = false);
    wait("the end of the first", || calls().last() == Some(&('e', 1, 0)));
    assert_eq!(calls().len(), 3);
}

/// The device that a callback works with.
static DEVICE: Mutex<Option<Device>> = Mutex::new(None);
static RESULT: Mutex<Option<u32>> = Mutex::new(None);

fn device() -> Device {
    DEVICE.lock().unwrap()
}

/// Has this callback called for the device, which is left to it, and returns what it has noted.
fn result_of(callback: extern "system" fn(u32, u32), it: Device) -> u32 {
    *DEVICE.lock() = Some(it);
    *RESULT.lock() = None;
    SetCBCounterResetted(Some(callback));
    it.start();
    assert_eq!(SetOutMotorValues(it.0, 0, 3, 512, 0), SUCCESS);
    assert_eq!(StartCounterReset(it.0, 0, 0), SUCCESS);
    wait("the callback", || RESULT.lock().is_some());
    RESULT.lock().unwrap()
}

extern "system" fn drives(_: u32, _: u32) {
    let handle = device().0;
    SetCBCounterResetted(None);
    *RESULT.lock() = Some(SetOutMotorValues(handle, 0, 1, 0, 77));
}

extern "system" fn stops(_: u32, _: u32) {
    *RESULT.lock() = Some(ftxStopTransferArea(device().0));
}

extern "system" fn closes(_: u32, _: u32) {
    *RESULT.lock() = Some(ftxCloseDevice(device().0));
}

extern "system" fn closes_all(_: u32, _: u32) {
    *RESULT.lock() = Some(ftxCloseAllDevices());
}

extern "system" fn ends(_: u32, _: u32) {
    *RESULT.lock() = Some(ftxCloseLib());
}

#[test]
fn a_callback_may_call_the_library_and_close_its_device() {
    let library = initialized();
    let driven = txt();
    assert_eq!(result_of(drives, Device::open(&driven)), SUCCESS);
    machine(&driven, "its motor", |it| it.controllers[0].outputs.duty[3] == 77);
    for (callback, is_open) in [(stops as _, true), (closes as _, false), (closes_all as _, false)]
    {
        let txt = txt();
        let device = Device::open(&txt);
        assert_eq!(result_of(callback, device), SUCCESS);
        stands(&txt);
        let state = ftxIsHandleValid(device.0);
        assert_eq!(state, if is_open { SUCCESS } else { DEVICE_NOT_OPEN });
        ftxCloseDevice(device.0);
    }
    let txt = txt();
    let device = Device::open(&txt);
    assert_eq!(result_of(ends, device), SUCCESS);
    stands(&txt);
    assert_eq!(ftxIsLibInit(), LIB_IS_NOT_INITIALIZED);
    assert_eq!(ftxInitLib(), SUCCESS);
    assert_eq!(ftxIsHandleValid(device.0), DEVICE_NOT_OPEN);
    drop(library);
}

static RUNNING: AtomicBool = AtomicBool::new(false);

extern "system" fn takes_a_while(_: u32, _: u32) {
    RUNNING.store(true, Ordering::SeqCst);
    thread::sleep(std::time::Duration::from_millis(200));
    RUNNING.store(false, Ordering::SeqCst);
}

#[test]
fn a_callback_is_not_running_after_it_was_taken_away_or_its_device_closed() {
    let _library = initialized();
    let txt = txt();
    let device = Device::open(&txt);
    device.start();
    let run = || {
        SetCBCounterResetted(Some(takes_a_while));
        assert_eq!(StartCounterReset(device.0, 0, 0), SUCCESS);
        wait("the callback", || RUNNING.load(Ordering::SeqCst));
    };
    run();
    SetCBCounterResetted(None);
    assert!(!RUNNING.load(Ordering::SeqCst));
    run();
    assert_eq!(ftxCloseDevice(device.0), SUCCESS);
    assert!(!RUNNING.load(Ordering::SeqCst));
}

static STUCK: AtomicUsize = AtomicUsize::new(0);
static LET_GO: (Mutex<bool>, Condvar) = (Mutex::new(false), Condvar::new());

/// Does not return before the test lets it.
extern "system" fn hangs(_: u32, _: u32) {
    STUCK.fetch_add(1, Ordering::SeqCst);
    let mut let_go = LET_GO.0.lock();
    while !*let_go {
        LET_GO.1.wait(&mut let_go);
    }
    drop(let_go);
    STUCK.fetch_sub(1, Ordering::SeqCst);
}

fn let_go(now: bool) {
    *LET_GO.0.lock() = now;
    LET_GO.1.notify_all();
}

#[test]
fn what_has_happened_in_an_earlier_transfer_is_not_told_in_the_next_one() {
    let _library = initialized();
    let_go(false);
    let txt = txt();
    let device = Device::open(&txt);
    device.start();
    forget();
    set_all();
    SetCBCounterResetted(Some(hangs));
    assert_eq!(StartCounterReset(device.0, 0, 0), SUCCESS);
    wait("the callback", || STUCK.load(Ordering::SeqCst) == 1);
    assert_eq!(StartMotorExCmd(device.0, 0, 1, 512, 0, 4, 0, 20), SUCCESS);
    wait("the motor", || device.input(0).motor_ex_reached[1] == 1);
    device.pass();
    assert_eq!(ftxStopTransferArea(device.0), SUCCESS);
    device.start();
    SetCBCounterResetted(None);
    SetCBCounterResetted(Some(counter));
    assert_eq!(StartCounterReset(device.0, 0, 2), SUCCESS);
    let_go(true);
    wait("the counter", || !calls().is_empty());
    assert_eq!(calls(), [('c', 0, 2)]);
}

#[test]
fn what_has_changed_in_an_earlier_transfer_is_told_as_it_is_in_the_next_one() {
    let _library = initialized();
    let_go(false);
    let txt = start(SimulatedTxt::builder().extensions(2));
    txt.with_machine(|it| it.alive[1] = false);
    let device = Device::open(&txt);
    forget();
    set_all();
    SetCBCounterResetted(Some(hangs));
    device.start();
    wait("the first extension", || calls() == [('e', 1, 1)]);
    assert_eq!(StartCounterReset(device.0, 0, 0), SUCCESS);
    wait("the callback", || STUCK.load(Ordering::SeqCst) == 1);
    txt.with_machine(|it| it.alive[1] = true);
    let mut alive = 0;
    wait("it is there", || GetRoboTxSlaveAlive(device.0, 2, &mut alive) == SUCCESS && alive == 1);
    device.pass();
    assert_eq!(ftxStopTransferArea(device.0), SUCCESS);
    device.start();
    let_go(true);
    wait("the second extension", || calls() == [('e', 1, 1), ('e', 2, 1)]);
}

#[test]
fn a_callback_that_does_not_return_stops_nothing_else() {
    let _library = initialized();
    let_go(false);
    let txt = txt();
    let device = Device::open(&txt);
    device.start();
    SetCBCounterResetted(Some(hangs));
    assert_eq!(StartCounterReset(device.0, 0, 0), SUCCESS);
    wait("the callback", || STUCK.load(Ordering::SeqCst) == 1);
    // The exchange goes on, and calls work.
    assert_eq!(SetOutMotorValues(device.0, 0, 0, 99, 0), SUCCESS);
    machine(&txt, "the motor", |it| it.controllers[0].outputs.duty[0] == 99);
    assert_eq!(StartCounterReset(device.0, 0, 1), SUCCESS);
    wait("the reset", || device.input(0).cnt_resetted[1] == 1);
    // Each of these waits for it a while.
    SetCBCounterResetted(None);
    assert_eq!(ftxCloseDevice(device.0), SUCCESS);
    stands(&txt);
    assert_eq!(ftxCloseLib(), SUCCESS);
    assert_eq!((STUCK.load(Ordering::SeqCst), ftxInitLib()), (1, SUCCESS));
    // The next callbacks have a thread of their own.
    let device = Device::open(&txt);
    device.start();
    forget();
    set_all();
    assert_eq!(StartCounterReset(device.0, 0, 2), SUCCESS);
    wait("the counter", || calls() == [('c', 0, 2)]);
    let_go(true);
    wait("its return", || STUCK.load(Ordering::SeqCst) == 0);
}
