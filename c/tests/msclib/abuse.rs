//! Wrong indices and handles, and threads that close what others use.

use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use super::api::*;
use super::bench::*;

#[test]
fn indices_and_values_out_of_range_change_nothing() {
    let _library = initialized();
    let txt = txt();
    let it = Device::open(&txt);
    let before = it.output(0);
    let h = it.0;
    let (mut a, mut b, mut c) = (0, 0, 0);
    for wrong in [-1, 9, i32::MAX, i32::MIN] {
        for result in [
            StartCounterReset(h, wrong, 0),
            StartCounterReset(h, 0, wrong),
            SetOutMotorValues(h, wrong, 0, 0, 0),
            SetOutMotorValues(h, 0, wrong, 0, 0),
            SetOutPwmValues(h, wrong, 0, 0),
            SetOutPwmValues(h, 0, wrong, 0),
            StartMotorExCmd(h, wrong, 0, 1, 0, 0, 0, 1),
            StartMotorExCmd(h, 0, wrong, 1, 0, 0, 0, 1),
            StartMotorExCmd(h, 0, 0, 1, wrong, 0, 0, 1),
            StartMotorExCmd(h, 0, 0, 1, 0, 1, wrong, 1),
            StopAllMotorExCmd(h, wrong),
            StopMotorExCmd(h, 0, wrong),
            SetFtUniConfig(h, wrong, 0, 0, true),
            SetFtUniConfig(h, 0, wrong, 0, true),
            SetFtUniConfig(h, 0, 0, wrong, true),
            SetFtCntConfig(h, 0, wrong, 0),
            SetFtCntConfig(h, 0, 0, wrong),
            SetFtMotorConfig(h, 0, wrong, true),
            GetInIOValue(h, wrong, 0, &mut a, &mut c),
            GetInIOValue(h, 0, wrong, &mut a, &mut c),
            GetInCounterValue(h, 0, wrong, &mut a, &mut b),
            GetInDisplayButtonValue(h, wrong, &mut a, &mut b),
            GetRoboTxInfo(h, wrong),
        ] {
            assert_eq!(result, INVALID_PARAM);
        }
        assert!(GetTransferAreaStatusAddr(h, wrong).is_null());
    }
    for wrong in [-1, i32::MIN] {
        assert_eq!(SetOutMotorValues(h, 0, 0, wrong, 0), INVALID_PARAM);
        assert_eq!(SetOutMotorValues(h, 0, 0, 512, wrong), INVALID_PARAM);
        assert_eq!(SetOutPwmValues(h, 0, 0, wrong), INVALID_PARAM);
        assert_eq!(StartMotorExCmd(h, 0, 0, wrong, 0, 0, 0, 1), INVALID_PARAM);
    }
    assert_eq!(StartMotorExCmd(h, 0, 0, 1, 0, 0, 0, -1), INVALID_PARAM);
    assert_eq!(StartMotorExCmd(h, 0, 0, 1, 0, 0, 0, 65_536), INVALID_PARAM);
    assert_eq!(it.output(0), before);
}

/// Calls of all kinds for a handle, whose answers must be among those that are allowed.
fn work(device: Device, is_over: &AtomicBool) {
    let allowed = [SUCCESS, DEVICE_NOT_OPEN, LIB_IS_NOT_INITIALIZED, THREAD_NOT_RUNNING];
    let (mut value, mut overrun) = (0, 0);
    let mut rounds = 0_i32;
    while !is_over.load(Ordering::Relaxed) {
        rounds = rounds.wrapping_add(1);
        let h = device.handle();
        for result in [
            SetOutMotorValues(h, 0, 0, 100 + rounds % 100, 0),
            StartCounterReset(h, 0, 0),
            GetInIOValue(h, 0, 0, &mut value, &mut overrun),
            SetFtUniConfig(h, 0, 0, 1, true),
            GetRoboTxMasterState(h),
            ftxIsHandleValid(h),
        ] {
            assert!(allowed.contains(&result), "{result:#010x}");
        }
        text(|to, size| GetRoboTxDevName(h, 0, to, size));
    }
}

#[test]
fn a_device_is_closed_while_threads_use_it() {
    let _library = initialized();
    for end in [|device: Device| ftxCloseDevice(device.0), |_| ftxCloseLib()] {
        let txt = txt();
        let device = Device::open(&txt);
        device.start();
        let is_over = AtomicBool::new(false);
        thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| work(device, &is_over));
            }
            machine(&txt, "the motor", |it| it.controllers[0].outputs.duty[0] >= 100);
            assert_eq!(end(device), SUCCESS);
            stands(&txt);
            is_over.store(true, Ordering::Relaxed);
        });
        stands(&txt);
        ftxInitLib();
    }
}

#[test]
fn starting_stopping_and_closing_in_many_threads_leaves_the_motors_off() {
    let _library = initialized();
    for _ in 0..5 {
        let txt = txt();
        let device = Device::open(&txt);
        thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(
                    move || while ftxStartTransferArea(device.handle()) != DEVICE_NOT_OPEN {},
                );
                scope.spawn(
                    move || while ftxStopTransferArea(device.handle()) != DEVICE_NOT_OPEN {},
                );
            }
            machine(&txt, "some exchanges", |it| it.exchanges() > 5);
            let closed: Vec<_> =
                [0; 3].map(|_| scope.spawn(move || ftxCloseDevice(device.handle()))).into();
            let closed = closed.into_iter().map(|thread| thread.join().unwrap());
            let (well, not_open): (Vec<_>, Vec<_>) = closed.partition(|code| *code == SUCCESS);
            assert_eq!((well.len(), not_open), (1, vec![DEVICE_NOT_OPEN; 2]));
        });
        stands(&txt);
    }
}

#[test]
fn closing_ends_a_start_that_waits_for_an_answer() {
    use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};
    let _library = initialized();
    let txt = start(SimulatedTxt::builder().fault(Fault::at_exchange(0, FaultKind::Silence)));
    let device = Device::open(&txt);
    thread::scope(|scope| {
        let started = scope.spawn(move || ftxStartTransferArea(device.handle()));
        wait("the start", || device.status(0) == 2);
        assert_eq!(ftxIsTransferActiv(device.0), 0xE000_12AF);
        assert_eq!(ftxCloseDevice(device.0), SUCCESS);
        assert_eq!(started.join().unwrap(), DEVICE_NOT_OPEN);
    });
    stands(&txt);
}

#[test]
fn a_host_is_opened_by_one_of_many_threads() {
    let _library = initialized();
    let txt = txt();
    let address = txt.address().to_string();
    let opened: Vec<u32> = thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(|| open(&address).1)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(opened.iter().filter(|code| **code == SUCCESS).count(), 1);
    assert!(opened.iter().all(|code| [SUCCESS, DEVICE_IS_OPEN].contains(code)), "{opened:x?}");
}

#[test]
fn null_handles_are_unknown() {
    let _library = initialized();
    let h = null_mut();
    assert_eq!(SetOutMotorValues(h, 0, 0, 0, 0), UNKNOWN_DEVICE_HANDLE);
    assert_eq!(StartMotorExCmd(h, 0, 0, 0, 0, 0, 0, 0), UNKNOWN_DEVICE_HANDLE);
    assert_eq!(ftxI2cRead(h, 1, 1, 5, None), UNKNOWN_DEVICE_HANDLE);
    assert_eq!(StartScanBtDevice(h, None), UNKNOWN_DEVICE_HANDLE);
    assert!(GetTransferAreasArrayAddr(h).is_null());
    ResetTrapStatistic(h);
}
