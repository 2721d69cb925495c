//! I2C and Bluetooth: answers by callbacks.

use parking_lot::Mutex;
use std::ptr::null_mut;

use ft_transfer_area_simulator::SimulatedTxt;

use super::api::*;
use super::bench::*;

static RESULTS: Mutex<Vec<Pair>> = Mutex::new(Vec::new());

extern "system" fn remember(result: *mut Pair) {
    // SAFETY: the library passes a result that is there during the call.
    RESULTS.lock().push(unsafe { *result });
}

/// The next result.
fn result() -> (u16, u16) {
    wait("the result", || !RESULTS.lock().is_empty());
    let Pair { first, status } = RESULTS.lock().remove(0);
    (first, status)
}

#[test]
fn registers_are_written_and_read() {
    let library = initialized();
    library.in_both_exchanges(|txt, device| {
        txt.with_machine(|it| it.i2c_device(0x18)[7] = 3);
        assert_eq!(ftxI2cRead(device.0, 0x18, 7, 0b01_01, Some(remember)), SUCCESS);
        assert_eq!(result(), (3, 0));
        assert_eq!(ftxI2cWrite(device.0, 0x18, 7, 0x1234, 0b10_01, Some(remember)), SUCCESS);
        assert_eq!(result(), (0x1234, 0));
        assert_eq!(ftxI2cWrite(device.0, 0x18, 9, 5, 0b01_01, None), SUCCESS);
        assert_eq!(ftxI2cRead(device.0, 0x18, 8, 0b11_01, Some(remember)), SUCCESS);
        assert_eq!(result(), (0x0534, 0));
        assert_eq!(ftxI2cRead(device.0, 0x19, 8, 0b01_01, Some(remember)), SUCCESS);
        assert_eq!(result(), (0, 1));
        assert_eq!(ftxI2cWrite(device.0, 0x19, 8, 1, 0b01_01, Some(remember)), SUCCESS);
        assert_eq!(result(), (0, 2));
        assert_eq!(ftxI2cRead(device.0, 0x18, 8, 0b01_01, None), INVALID_PARAM);
        assert_eq!(ftxI2cRead(device.0, 80, 8, 0b01_01, Some(remember)), 0xE000_5000);
        assert_eq!(ftxI2cRead(device.0, 0x18, 256, 0b01_01, Some(remember)), 0xE000_5001);
        assert_eq!(ftxI2cRead(device.0, 0x18, 8, 0b00_01, Some(remember)), 0xE000_5002);
        assert_eq!(ftxI2cWrite(device.0, 0x18, 8, 1, 0x65, Some(remember)), 0xE000_5003);
        // A request that never works is given up when the device is closed.
        let for_ever = 0b10 << 5 | 0b01_01;
        assert_eq!(ftxI2cRead(device.0, 0x19, 8, for_ever, Some(remember)), SUCCESS);
    });
    assert_eq!(RESULTS.lock().len(), 0);
}

#[test]
fn a_request_of_an_earlier_transfer_is_not_carried_out_in_the_next_one() {
    let _library = initialized();
    // The system gives these ports to nobody.
    let at = |port| SimulatedTxt::builder().port(port).start().ok();
    let txt = (31_000..).step_by(3).find_map(at).unwrap();
    let device = Device::open(&txt);
    device.start();
    let for_ever = 0b10 << 5 | 0b01_01;
    assert_eq!(ftxI2cWrite(device.0, 0x24, 63, 7, for_ever, Some(remember)), SUCCESS);
    assert_eq!(ftxI2cWrite(device.0, 0x24, 63, 8, 0b01_01, Some(remember)), SUCCESS);
    assert_eq!(ftxStopTransferArea(device.0), SUCCESS);
    // Another controller at the same address.
    let port = txt.port();
    drop(txt);
    let mut next = None;
    wait("the ports are free", || {
        next = at(port);
        next.is_some()
    });
    let txt = next.unwrap();
    txt.with_machine(|it| it.i2c_device(0x24)[63] = 3);
    device.start();
    assert_eq!([result(), result()], [(0, 2), (0, 2)]);
    assert_eq!(ftxI2cRead(device.0, 0x24, 63, 0b01_01, Some(remember)), SUCCESS);
    assert_eq!(result(), (3, 0));
}

static BLUETOOTH: Mutex<Vec<Vec<u16>>> = Mutex::new(Vec::new());

extern "system" fn pair(result: *mut Pair) {
    // SAFETY: the library passes a result that is there during the call.
    let Pair { first, status } = unsafe { *result };
    BLUETOOTH.lock().push(vec![first, status]);
}

extern "system" fn received(result: *mut BtReceived) {
    // SAFETY: the library passes a result that is there during the call.
    BLUETOOTH.lock().push(unsafe { *result }[..3].to_vec());
}

extern "system" fn scanned(result: *mut BtScan) {
    // SAFETY: the library passes a result that is there during the call.
    BLUETOOTH.lock().push(unsafe { *result }[..1].to_vec());
}

#[test]
fn bluetooth_answers_that_it_is_off() {
    let _library = initialized();
    let txt = txt();
    let it = Device::open(&txt).0;
    let mut address = [1; 6];
    let (address, message) = (address.as_mut_ptr(), c"hello".as_ptr().cast_mut());
    for asked in [
        ConnectBtAddress(it, 1, address, Some(pair)),
        DisconnectBt(it, 2, Some(pair)),
        SendBtMessage(it, 3, 5, message, Some(pair)),
        BtListenConOn(it, 4, address, Some(pair)),
        BtListenConOff(it, 5, Some(pair)),
        BtReadMsgOn(it, 6, Some(received)),
        BtReadMsgOff(it, 8, Some(pair)),
        StartScanBtDevice(it, Some(scanned)),
        CancelScanBtDevice(it),
    ] {
        assert_eq!(asked, SUCCESS);
    }
    wait("all answers", || BLUETOOTH.lock().len() == 8);
    let answers = std::mem::take(&mut *BLUETOOTH.lock());
    let off = |channel| vec![channel, 3];
    let expected = [off(1), off(2), off(3), off(4), off(5), vec![6, 3, 0], off(8), vec![0]];
    assert_eq!(answers, expected);

    for wrong in [0, 9, u32::MAX] {
        assert_eq!(DisconnectBt(it, wrong, Some(pair)), INVALID_CONIDX);
        assert_eq!(BtReadMsgOn(it, wrong, Some(received)), INVALID_CONIDX);
    }
    assert_eq!(DisconnectBt(it, 1, None), INVALID_PARAM);
    assert_eq!(StartScanBtDevice(it, None), INVALID_PARAM);
    assert_eq!(ConnectBtAddress(it, 1, null_mut(), Some(pair)), INVALID_PARAM);
    assert_eq!(SendBtMessage(it, 1, 17, message, Some(pair)), INVALID_PARAM);
    let mut status = [9; 4];
    assert_eq!((GetRoboTxBtStatus(it, &mut status), status), (SUCCESS, [0; 4]));
    assert_eq!(GetRoboTxBtStatus(it, null_mut()), INVALID_PARAM);
    let mut status = [9; 4];
    StatusBtConnection(1, &mut status);
    StatusBtConnection(1, null_mut());
    assert_eq!(status, [0; 4]);
}
