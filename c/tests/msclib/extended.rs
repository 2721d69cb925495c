//! What ftMscLibEx has more than ftMscLib.

use std::ffi::{c_char, c_void};
use std::ptr::null_mut;

use parking_lot::Mutex;

use super::api::*;
use super::bench::*;

/// What the callbacks were called with; the last number is the context.
static CALLS: Mutex<Vec<(&str, Vec<usize>)>> = Mutex::new(Vec::new());

fn note(kind: &'static str, said: &[u32], context: Context) {
    let mut said: Vec<_> = said.iter().map(|number| *number as usize).collect();
    said.push(context as usize);
    CALLS.lock().push((kind, said));
}

fn calls(kind: &str) -> Vec<Vec<usize>> {
    let calls = CALLS.lock();
    calls.iter().filter(|(it, _)| *it == kind).map(|(_, said)| said.clone()).collect()
}

extern "system" fn uni(a: u32, b: u32, value: u32, over: u32, mode: u8, digital: u8, c: Context) {
    note("uni", &[a, b, value, over, mode.into(), digital.into()], c);
}

extern "system" fn cnt_in(area: u32, counter: u32, level: i32, context: Context) {
    note("cnt_in", &[area, counter, level as u32], context);
}

extern "system" fn count(area: u32, counter: u32, count: u32, mode: i16, context: Context) {
    note("count", &[area, counter, count, mode as u32], context);
}

extern "system" fn reset(area: u32, counter: u32, context: Context) {
    note("reset", &[area, counter], context);
}

extern "system" fn reset_alone(area: u32, counter: u32) {
    note("reset alone", &[area, counter], null_mut());
}

extern "system" fn reached(area: u32, motor: u32, context: Context) {
    note("reached", &[area, motor], context);
}

extern "system" fn extension(area: u32, state: u32, context: Context) {
    note("extension", &[area, state], context);
}

extern "system" fn pair(result: *mut Pair, context: Context) {
    // SAFETY: the library passes a result that is there during the call.
    let Pair { first, status } = unsafe { *result };
    note("result", &[first.into(), status.into()], context);
}

extern "system" fn received(result: *mut BtReceived, context: Context) {
    // SAFETY: as above.
    let [channel, status, ..] = unsafe { *result };
    note("result", &[channel.into(), status.into()], context);
}

extern "system" fn scanned(result: *mut BtScan, context: Context) {
    // SAFETY: as above.
    note("result", &[unsafe { *result }[0].into()], context);
}

extern "system" fn text(_: *mut c_char, _: u32, _: Context) {}

extern "system" fn button(_: u32, _: u32, _: u32, _: u16, _: Context) {
    note("button", &[], null_mut());
}

/// No pointer: the library only hands it on.
const CONTEXT: usize = 0x1234;

fn level_2() -> Level2 {
    let context = CONTEXT as *mut c_void;
    Level2 { context, bluetooth: true, i2c: true, reserved: [0; 2] }
}

/// Begins the transfer again, with the context.
fn begin_again(device: Device) {
    assert_eq!(ftxStartTransferArea2(device.0, level_2()), THREAD_IS_RUNNING);
    assert_eq!(ftxStopTransferArea(device.0), SUCCESS);
    assert_eq!(ftxStartTransferArea2(device.0, level_2()), SUCCESS);
    CALLS.lock().clear();
}

#[test]
fn changes_of_chosen_inputs_are_told_with_the_context() {
    let library = initialized();
    SetCBUniChanged(Some(uni));
    SetCBCntInChanged(Some(cnt_in));
    SetCBCounterChanged(Some(count));
    SetCBButtonChanged(Some(button));
    library.in_both_exchanges(|txt, device| {
        begin_again(device);
        assert_eq!(SetFtUniConfig(device.0, 0, 2, 1, false), SUCCESS);
        assert_eq!(SetCBMaskUniChanged(device.0, 0, 0b100), SUCCESS);
        let set = |values: [i16; 8]| txt.with_machine(|it| it.controllers[0].uni = values);
        set([0, 0, 4999, 5, 0, 0, 0, 0]);
        wait("I3", || calls("uni").len() == 1);
        set([0, 0, 5000, 5, 0, 0, 0, 0]);
        wait("I3 over range", || calls("uni").len() == 2);
        // Now I4 only, which is a switch as it was not configured.
        assert_eq!(SetCBMaskUniChanged(device.0, 0, 0b1000), SUCCESS);
        set([9, 9, 9, 1, 9, 9, 9, 9]);
        wait("I4", || calls("uni").len() == 3);
        assert_eq!(
            calls("uni")[..2],
            [[0, 2, 4999, 0, 1, 0], [0, 2, 5000, 1, 1, 0]]
                .map(|it| { [&it[..], &[CONTEXT]].concat() })
        );
        assert_eq!((calls("uni")[2][..3].to_vec(), calls("uni")[2][6]), (vec![0, 3, 1], CONTEXT));

        assert_eq!(SetCBMaskCntInChanged(device.0, 0, 0b10), SUCCESS);
        assert_eq!(SetCBMaskCounterChanged(device.0, 0, 0b10), SUCCESS);
        assert_eq!(StartMotorExCmd(device.0, 0, 0, 512, 0, 1, 0, 20), SUCCESS);
        wait("the motors", || device.input(0).motor_ex_reached[..2] == [1, 1]);
        let end = device.input(0).counter[1] as usize;
        wait("C2", || calls("count").last().is_some_and(|it| it[2] == end));
        assert!(calls("count").iter().all(|it| (it[1], it[4]) == (1, CONTEXT)));
        assert!(calls("count").windows(2).all(|two| two[0][2] < two[1][2]));
        let levels = calls("cnt_in");
        assert!(!levels.is_empty() && levels.iter().all(|it| (it[1], it[3]) == (1, CONTEXT)));
        assert!(levels.windows(2).all(|two| two[0][2] != two[1][2]));
        assert_eq!(calls("button"), Vec::<Vec<usize>>::new());
    });
}

#[test]
fn masks_belong_to_a_controller_of_a_device() {
    let _library = initialized();
    let txt = txt();
    let it = Device::open(&txt).0;
    type Set = fn(Handle, i32, u32) -> u32;
    type Get = fn(Handle, i32, *mut u32) -> u32;
    let all: [(Set, Get, u32); 3] = [
        (SetCBMaskUniChanged, GetCBMaskUniChanged, 0xFF),
        (SetCBMaskCntInChanged, GetCBMaskCntInChanged, 0xF),
        (SetCBMaskCounterChanged, GetCBMaskCounterChanged, 0xF),
    ];
    for (set, get, bits) in all {
        let read = |controller| {
            let mut mask = 77;
            assert_eq!(get(it, controller, &mut mask), SUCCESS);
            mask
        };
        assert_eq!((read(0), read(8)), (0, 0));
        assert_eq!(set(it, 8, u32::MAX), SUCCESS);
        assert_eq!((read(0), read(8)), (0, bits));
        assert_eq!([set(it, 9, 1), set(it, -1, 1), get(it, 0, null_mut())], [INVALID_PARAM; 3]);
        assert_eq!(set(null_mut(), 0, 1), UNKNOWN_DEVICE_HANDLE);
    }
    assert_eq!(ftxStartTransferArea2(null_mut(), level_2()), UNKNOWN_DEVICE_HANDLE);
}

#[test]
fn the_callbacks_of_ftmsclib_also_come_with_the_context() {
    let _library = initialized();
    let txt = start(ft_transfer_area_simulator::SimulatedTxt::builder().extensions(1));
    let device = Device::open(&txt);
    SetCBCounterResetted(Some(reset_alone));
    SetCBCounterResetted2(Some(reset));
    SetCBMotorExReached2(Some(reached));
    SetCBRoboExtState2(Some(extension));
    CALLS.lock().clear();
    assert_eq!(ftxStartTransferArea2(device.0, level_2()), SUCCESS);
    wait("the extension", || calls("extension") == [[1, 1, CONTEXT]]);
    assert_eq!(StartCounterReset(device.0, 0, 3), SUCCESS);
    wait("the reset", || calls("reset") == [[0, 3, CONTEXT]]);
    assert_eq!(calls("reset alone"), [[0, 3, 0]]);
    assert_eq!(StartMotorExCmd(device.0, 0, 2, 512, 0, -1, 0, 10), SUCCESS);
    wait("the motor", || calls("reached") == [[0, 2, CONTEXT]]);
}

#[test]
fn up_to_three_motors_follow_one() {
    let library = initialized();
    library.in_both_exchanges(|_, device| {
        let h = device.0;
        assert_eq!(StartMotorExCmd4(h, 0, 1, 600, 0, 0, 1, 255, 7, 3, 0, 40), SUCCESS);
        let output = device.output(0);
        assert_eq!(*output.duty, [0, 512, 512, 0, 0, 0, 512, 0]);
        assert_eq!((*output.distance, *output.master), ([40, 40, 0, 40], [2, 0, 0, 2]));
        wait("the motors", || device.input(0).motor_ex_reached == [1, 1, 0, 1]);
        assert_eq!(StartMotorExCmd4(h, 0, 0, 1, 0, 1, 0, 1, 1, -1, 0, 40), INVALID_PARAM);
        assert_eq!(StartMotorExCmd4(h, 0, 0, 1, 0, 1, 0, 2, 2, 3, 0, 40), INVALID_PARAM);
        assert_eq!(device.output(0), output);
    });
}

#[test]
fn requests_call_back_with_the_context() {
    let _library = initialized();
    let txt = txt();
    let device = Device::open(&txt);
    let it = device.0;
    CALLS.lock().clear();
    assert_eq!(ftxStartTransferArea2(it, level_2()), SUCCESS);
    let (mut address, message) = ([1; 6], c"hello".as_ptr().cast_mut());
    let address = address.as_mut_ptr();
    for asked in [
        ConnectBtAddress2(it, 1, address, Some(pair)),
        DisconnectBt2(it, 2, Some(pair)),
        SendBtMessage2(it, 3, 5, message, Some(pair)),
        BtListenConOn2(it, 4, address, Some(pair)),
        BtListenConOff2(it, 5, Some(pair)),
        BtReadMsgOn2(it, 6, Some(received)),
        BtReadMsgOff2(it, 8, Some(pair)),
        StartScanBtDevice2(it, Some(scanned)),
    ] {
        assert_eq!(asked, SUCCESS);
    }
    wait("all answers", || calls("result").len() == 8);
    let mut expected: Vec<_> = [1, 2, 3, 4, 5, 6, 8].map(|it| vec![it, 3, CONTEXT]).into();
    expected.push(vec![0, CONTEXT]);
    assert_eq!(calls("result"), expected);
    assert_eq!(SendBtMessage2(it, 1, 17, message, Some(pair)), INVALID_PARAM);
    assert_eq!(FtRemoteCmd2(it, message, Some(text)), REM_CMD_NOT_SUPPORTED);

    CALLS.lock().clear();
    txt.with_machine(|it| it.i2c_device(0x18)[7] = 3);
    assert_eq!(ftxI2cWrite2(it, 0x18, 7, 0x1234, 0b10_01, Some(pair)), SUCCESS);
    wait("what was written", || calls("result") == [[0x1234, 0, CONTEXT]]);
    assert_eq!(ftxI2cRead2(it, 0x18, 7, 0b01_01, Some(pair)), SUCCESS);
    wait("what was read", || calls("result").get(1).is_some_and(|it| *it == [0x12, 0, CONTEXT]));
    assert_eq!(ftxI2cRead2(it, 0x18, 7, 0b01_01, None), INVALID_PARAM);
}
