//! Texts and numbers about the library and the controllers, and what a TXT online does not have.

use std::ptr::{null, null_mut};

use ft_transfer_area::FirmwareVersion;

use super::api::*;
use super::bench::*;

#[test]
fn the_library_and_its_errors_have_texts() {
    let _library = not_initialized();
    assert_eq!(ftxGetLibVersion(), 0x0001_050B);
    assert_eq!(
        text(ftxGetLibVersionStr as fn(_, _) -> _),
        ("01.05.11  (2012/02/19)".to_owned(), 22)
    );
    assert_eq!(ftxGetLibVersionEx(), 0x0001_050E);
    let text_of_ex = text(ftxGetLibVersionStrEx as fn(_, _) -> _);
    assert_eq!(text_of_ex, ("01.05.14  (2014/05/16)".to_owned(), 22));
    let error = |code, kind| text(|to, size| ftxGetLibErrorString(code, kind, to, size));
    assert_eq!(error(INVALID_PARAM, 0), ("FTLIB_ERR_INVALID_PARAM".to_owned(), 23));
    assert!(error(INVALID_PARAM, 1).0.contains("out of range"));
    assert_eq!((error(INVALID_PARAM, 2).1, error(12_345, 0).1), (0, 0));
    let mut short = [1; 4];
    assert_eq!(ftxGetLibErrorString(0, 1, short.as_mut_ptr(), 4), 3);
    assert_eq!(short.map(|c| c as u8), *b"No \0");
    assert_eq!(ftxGetLibErrorString(0, 1, null_mut(), 4), 0);
    assert_eq!(ftxGetLibErrorString(0, 1, short.as_mut_ptr(), 0), 0);
}

#[test]
fn a_new_transfer_tells_the_controller_that_has_it() {
    let _library = initialized();
    let builder = ft_transfer_area_simulator::SimulatedTxt::builder;
    let txt = start(builder().device_name("before"));
    let port = txt.port();
    let device = Device::open(&txt);
    device.start();
    assert_eq!(ftxStopTransferArea(device.0), SUCCESS);
    drop(txt);
    // Another one has its address.
    let _after =
        start(builder().device_name("after").firmware(FirmwareVersion::new(4, 6, 6)).port(port));
    device.start();
    let name = text(|to, size| GetRoboTxDevName(device.0, 0, to, size)).0;
    let firmware = text(|to, size| GetRoboTxFwStr(device.0, 0, to, size)).0;
    assert_eq!((&*name, &*firmware), ("after", "V 04.06"));
    assert_eq!(text(|to, size| ftxGetFirmwareStrg(device.0, to, size)).0, "V 04.06");
}

#[test]
fn a_controller_tells_its_name_and_firmware_before_its_transfer() {
    let _library = initialized();
    let builder = ft_transfer_area_simulator::SimulatedTxt::builder();
    let txt = start(builder.device_name("Sorting line 1"));
    let device = Device::open(&txt).0;
    let of_device = |get: fn(Handle, _, u32) -> u32| text(|to, size| get(device, to, size)).0;
    let of = |controller, get: fn(Handle, i32, _, u32) -> u32| {
        text(|to, size| get(device, controller, to, size))
    };
    assert_eq!(of(0, GetRoboTxDevName), ("Sorting line 1".to_owned(), 14));
    assert_eq!(of(0, GetRoboTxFwStr), ("V 04.07".to_owned(), 7));
    assert_eq!(of(0, GetRoboTxBtAddr), ("00:00:00:00:00:00".to_owned(), 17));
    assert_eq!(of(0, GetRoboTxDllStr), ("06".to_owned(), 2));
    assert_eq!(of_device(ftxGetFirmwareStrg), "V 04.07");
    assert_eq!(of_device(ftxGetShortNameStrg), "ROBO TX Controller");
    assert_eq!(of_device(ftxGetManufacturerStrg), "MSC Vertriebs GmbH");
    assert_eq!(of_device(ftxGetLongNameStrg), "ROBO TX Controller");
    let mut firmware = 0;
    assert_eq!((GetRoboTxFwVal(device, 0, &mut firmware), firmware), (SUCCESS, 0x0006_0407));
    assert_eq!(GetRoboTxInfo(device, 0), SUCCESS);
    // SAFETY: the device is open; a program reads its areas so.
    let info = unsafe { (&raw const (*Device(device).area(0)).info).read_volatile() };
    assert!(info.hostname.starts_with(b"Sorting line 1\0"));
    // firmware.part.a to part.d, for "V %d.%02d, DLL %d" of c, d and b.
    assert_eq!(info.version.firmware.to_ne_bytes(), [0, 6, 4, 7]);

    assert_eq!(of_device(ftxGetSerialNrStrg), "");
    for (controller, get) in [
        (0, GetRoboTxHwStr as fn(_, _, _, _) -> _),
        (0, GetRoboTxSerialStr),
        (1, GetRoboTxDevName),
        (1, GetRoboTxFwStr),
        (9, GetRoboTxFwStr),
        (-1, GetRoboTxDevName),
    ] {
        assert_eq!(of(controller, get), (String::new(), 0));
    }
    assert_eq!(GetRoboTxFwVal(device, 1, &mut firmware), FAILED);
    assert_eq!(GetRoboTxFwVal(device, 9, &mut firmware), INVALID_PARAM);
    assert_eq!(GetRoboTxFwVal(device, 0, null_mut()), INVALID_PARAM);
    let closed = null_mut();
    assert_eq!(text(|to, size| GetRoboTxDevName(closed, 0, to, size)), (String::new(), 0));
}

#[test]
fn transfers_are_counted() {
    let _library = initialized();
    let txt = txt();
    let device = Device::open(&txt);
    assert_eq!(GetRoboTxMasterState(device.0), THREAD_NOT_RUNNING);
    let before = GetSessionId();
    device.start();
    assert_eq!((GetRoboTxMasterState(device.0), GetSessionId()), (SUCCESS, before + 1));
    let statistic = || {
        let mut it = [0; 6];
        let [a, b, c, d, e, f] = &mut it;
        assert_eq!(GetTrapStatistic(device.0, a, b, c, d, e, f), SUCCESS);
        it
    };
    wait("ten exchanges", || statistic()[0] >= 10);
    let [.., shortest, longest] = statistic();
    ResetTrapStatistic(device.0);
    let [exchanges, configurations, _, _, shortest_now, longest_now] = statistic();
    assert!(exchanges < 10);
    assert_eq!(configurations, 0);
    // The times are those of the whole transfer.
    assert!(shortest_now <= shortest && longest_now >= longest);
    assert!(statistic()[4] <= statistic()[5]);
    let null = null_mut();
    assert_eq!(GetTrapStatistic(device.0, null, null, null, null, null, null), INVALID_PARAM);
}

#[test]
fn what_a_txt_online_has_not_got_is_an_error() {
    let _library = initialized();
    let txt = txt();
    let it = Device::open(&txt).0;
    let text = c"a text";
    let (read, write) = (text.as_ptr(), text.as_ptr().cast_mut());
    assert_eq!(SetRoboTxDevName(it, 0, write), FAILED);
    assert_eq!(SetRoboTxDevName(it, 0, null_mut()), INVALID_PARAM);
    assert_eq!((SetRoboTxMessage(it, 0, read), SetRoboTxMessage(it, 0, null())), (FAILED, FAILED));
    assert_eq!(SetRoboTxMessage(it, 9, read), INVALID_PARAM);
    assert_eq!(FtRemoteCmd(it, write, None), REM_CMD_NOT_SUPPORTED);
    assert_eq!(FtFileUpload(it, write, 0, None), UPLOAD_FAILED);
    assert_eq!(FtRamFileUpload(it, 0, read.cast(), 6, read, None), UPLOAD_FAILED);
    assert_eq!(FtRamFileUpload(it, 0, null(), 6, read, None), INVALID_PARAM);
    assert_eq!(
        (RTxCleanDisk(it, 0), FtProgramRun(it, 0), FtProgramStop(it, 0)),
        (FAILED, FAILED, FAILED)
    );
    assert_eq!(RoboTxFwUpdate(it, read, None), FAILED);
    let mut layout = [7; 3];
    let [a, b, c] = &mut layout;
    assert_eq!(GetRoboTxMemLayout(it, 0, a, b, c), FAILED);
    assert_eq!(GetRoboTxMemLayout(it, 0, a, null_mut(), c), INVALID_PARAM);
    assert_eq!(layout, [7; 3]);
    assert_eq!(FtRemoteCmd(null_mut(), write, None), UNKNOWN_DEVICE_HANDLE);
}
