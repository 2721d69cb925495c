//! Opening, closing, ports and handles.

use std::ptr::null_mut;
use std::time::Duration;

use super::api::*;
use super::bench::*;

#[test]
fn the_library_is_initialized_once_and_again_after_its_end() {
    let _library = not_initialized();
    for _ in 0..3 {
        assert_eq!(ftxIsLibInit(), LIB_IS_NOT_INITIALIZED);
        assert_eq!(
            (ftxCloseLib(), ftxCloseAllDevices()),
            (LIB_IS_NOT_INITIALIZED, LIB_IS_NOT_INITIALIZED)
        );
        assert_eq!((ftxInitLib(), ftxInitLib()), (SUCCESS, LIB_IS_INITIALIZED));
        assert_eq!(ftxIsLibInit(), LIB_IS_INITIALIZED);
        assert_eq!(ftxCloseLib(), SUCCESS);
    }
}

#[test]
fn a_device_is_opened_once_and_its_handle_tells_how_it_stands() {
    let library = initialized();
    let txt = txt();
    library.set("FT_TXT_PORTS", &format!("COM4={}", txt.address()));
    let (handle, error) = open("COM4");
    assert_eq!((handle.is_null(), error), (false, SUCCESS));
    // By its port, its number and its address.
    let mut error = 0;
    assert!(ftxOpenComDeviceNr(4, 0, &mut error).is_null());
    assert_eq!((error, open(&txt.address().to_string()).1), (DEVICE_IS_OPEN, DEVICE_IS_OPEN));
    let other_name = format!("localhost:{}", txt.port());
    assert_eq!(open(&other_name).1, DEVICE_IS_OPEN);

    assert_eq!((ftxIsHandleValid(handle), GetComStatus(handle)), (SUCCESS, SUCCESS));
    assert_eq!(ftxIsTransferActiv(handle), THREAD_NOT_RUNNING);
    assert_eq!(ftxStopTransferArea(handle), THREAD_NOT_RUNNING);
    assert_eq!(ftxStartTransferArea(handle), SUCCESS);
    assert_eq!(ftxStartTransferArea(handle), THREAD_IS_RUNNING);
    assert_eq!(ftxIsTransferActiv(handle), THREAD_IS_RUNNING);
    assert_eq!(Device(handle).status(0), 1);
    assert_eq!(ftxStopTransferArea(handle), SUCCESS);
    assert_eq!((ftxIsTransferActiv(handle), Device(handle).status(8)), (THREAD_NOT_RUNNING, 0));
    assert_eq!(ftxCloseDevice(handle), SUCCESS);

    for closed in [ftxIsHandleValid, GetComStatus, ftxCloseDevice, ftxStartTransferArea] {
        assert_eq!(closed(handle), DEVICE_NOT_OPEN);
        assert_eq!(closed(null_mut()), UNKNOWN_DEVICE_HANDLE);
        assert_eq!(closed(handle.wrapping_byte_add(1)), UNKNOWN_DEVICE_HANDLE);
        assert_eq!(closed(handle.wrapping_byte_add(4)), UNKNOWN_DEVICE_HANDLE);
    }
    assert!(GetTransferAreasArrayAddr(handle).is_null());
    assert!(GetTransferAreaStatusAddr(handle, 0).is_null());
    let (again, error) = open("COM4");
    assert_eq!(error, SUCCESS);
    assert_ne!(again, handle);
    assert_eq!(ftxCloseAllDevices(), SUCCESS);
    assert_eq!(ftxIsHandleValid(again), DEVICE_NOT_OPEN);
}

#[test]
fn another_port_of_an_open_controller_is_told_from_the_same_one() {
    let library = initialized();
    let txt = txt();
    library.set("FT_TXT_HOST", &txt.address().to_string());
    assert_eq!((open("COM4").1, open("COM4").1), (SUCCESS, DEVICE_IS_OPEN));
    assert_eq!(open("COM5").1, SOME_DEVICES_ARE_OPEN);
    // One that is the same controller by another address.
    library.set("FT_TXT_PORTS", &format!("COM6=localhost:{}", txt.port()));
    assert_eq!(open("COM6").1, SOME_DEVICES_ARE_OPEN);
}

#[test]
fn what_can_not_be_opened_is_an_error() {
    let library = initialized();
    let mut error = 0;
    assert!(ftxOpenComDevice(std::ptr::null(), 0, &mut error).is_null());
    assert_eq!(error, INVALID_PARAM);
    assert!(ftxOpenComDeviceNr(0, 0, &mut error).is_null());
    assert_eq!(error, INVALID_PARAM);
    assert!(ftxOpenComDeviceNr(77, 0, null_mut()).is_null(), "the error is not wanted");
    assert_eq!((open("COM77").1, open("127.0.0.1:1").1), (OPEN_COM, OPEN_COM));
    assert_eq!((open("").1, open(&"x".repeat(300)).1), (WRONG_HOSTNAME_LEN, WRONG_HOSTNAME_LEN));
    assert_eq!(open("txt:no port").1, OPEN_COM);
    library.set("FT_TXT_HOST", "127.0.0.1:1");
    assert_eq!(open("COM4").1, OPEN_COM);
    ftxCloseLib();
    assert_eq!(open("COM4").1, LIB_IS_NOT_INITIALIZED);
}

#[test]
fn ports_are_listed_with_the_configured_ones() {
    let library = initialized();
    let txts = [txt(), txt()];
    library.set("FT_TXT_HOST", &txts[0].address().to_string());
    library.set("FT_TXT_PORTS", "COM1=127.0.0.1:1, COM7=192.168.9.2");
    let port = |index| text(|to, size| EnumComPorts(index, to, size));
    assert_eq!(GetAvailableComPorts(0), 3);
    assert_eq!(port(0), ("COM1 (127.0.0.1:1)".to_owned(), 0));
    assert_eq!(port(1), (format!("COM2 ({})", txts[0].address()), 1));
    assert_eq!(port(2), ("COM7 (192.168.9.2)".to_owned(), 2));
    assert_eq!(port(3), (String::new(), INVALID_PARAM));
    assert_eq!((GetAvailableComPorts(1), GetAvailableComPorts(2)), (2, 1));
    assert_eq!(port(0), ("COM7 (192.168.9.2)".to_owned(), 0));
    assert_eq!((GetAvailableComPorts(3), GetAvailableComPorts(-1)), (0, 0));
    assert_eq!(EnumComPorts(0, null_mut(), 9), INVALID_PARAM);
    let mut short = [1; 5];
    assert_eq!(EnumComPorts(0, short.as_mut_ptr(), 0), INVALID_PARAM);
    assert_eq!((EnumComPorts(0, short.as_mut_ptr(), 5), short.map(|c| c as u8)), (0, *b"COM7\0"));
    // A listed text opens its port, as does any other number by the host for all.
    assert_eq!(open(&format!("COM2 ({})", txts[0].address())).1, SUCCESS);
    library.set("FT_TXT_HOST", &txts[1].address().to_string());
    assert_eq!(open("COM12").1, SUCCESS);
}

#[test]
fn the_list_of_ports_is_there_soon_without_a_controller() {
    let _library = initialized();
    let begin = std::time::Instant::now();
    GetAvailableComPorts(0);
    // The search has a limit of a second; this is to notice one without a limit.
    assert!(begin.elapsed() < Duration::from_secs(10));
}

#[test]
fn several_devices_run_side_by_side() {
    let _library = initialized();
    let txts = [txt(), txt(), txt()];
    let devices = txts.each_ref().map(Device::open);
    for (device, duty) in devices.iter().zip(1..) {
        device.start();
        assert_eq!(SetOutPwmValues(device.0, 0, 2, 100 * duty), SUCCESS);
    }
    for (txt, duty) in txts.iter().zip(1..) {
        machine(txt, "its own duty", |it| it.controllers[0].outputs.duty[2] == 100 * duty);
    }
    assert_eq!(ftxCloseDevice(devices[1].0), SUCCESS);
    stands(&txts[1]);
    assert_eq!(ftxIsTransferActiv(devices[0].0), THREAD_IS_RUNNING);
    assert_eq!(ftxCloseLib(), SUCCESS);
    txts.iter().for_each(stands);
}

#[test]
fn a_controller_that_goes_away_ends_the_transfer_and_it_can_begin_again() {
    let _library = initialized();
    let txt = txt();
    let device = Device::open(&txt);
    device.start();
    assert_eq!(SetOutMotorValues(device.0, 0, 0, 512, 0), SUCCESS);
    machine(&txt, "the motor", |it| it.controllers[0].outputs.duty[0] == 512);
    let address = txt.address();
    drop(txt);
    wait("the end", || ftxIsTransferActiv(device.0) == THREAD_NOT_RUNNING);
    assert_eq!((device.status(0), *device.output(0).duty), (0, [0; 8]));
    assert_eq!(ftxStopTransferArea(device.0), THREAD_NOT_RUNNING);
    assert_eq!(ftxStartTransferArea(device.0), OPEN_COM);
    assert_eq!((device.status(0), ftxIsHandleValid(device.0)), (0, SUCCESS));
    let builder = ft_transfer_area_simulator::SimulatedTxt::builder();
    let txt = start(builder.port(address.port()));
    device.start();
    assert_eq!(SetOutMotorValues(device.0, 0, 0, 300, 0), SUCCESS);
    machine(&txt, "the motor", |it| it.controllers[0].outputs.duty[0] == 300);
}
