//! The variant has the functions of ftMscLib, and its own.

use std::env;

use libloading::{library_filename, Library};

/// The functions of ftMscLib, one from each of its files, and those that all programs call.
const SOME: [&str; 20] = [
    "ftxInitLib",
    "ftxCloseLib",
    "ftxOpenComDevice",
    "ftxStartTransferArea",
    "GetTransferAreasArrayAddr",
    "EnumComPorts",
    "StartMotorExCmd",
    "SetFtUniConfig",
    "GetInIOValue",
    "ftxI2cRead",
    "StartScanBtDevice",
    "GetRoboTxFwStr",
    "FtRemoteCmd",
    "SetMotorExConfig",
    "ftxStartTransferArea2",
    "SetCBUniChanged",
    "GetCBMaskCntInChanged",
    "SetCBButtonChanged",
    "StartMotorExCmd4",
    "ConnectBtAddress2",
];

#[test]
fn the_variant_exports_the_functions() {
    let folder = env::current_exe().expect("this test has a file").with_file_name("");
    // SAFETY: loading it runs nothing.
    let library = unsafe { Library::new(folder.join(library_filename("ftMscLibEx"))) };
    let library = library.expect("it was built with this test");
    for name in SOME {
        // SAFETY: it is not called.
        let function = unsafe { library.get::<unsafe extern "C" fn()>(name.as_bytes()) };
        assert!(function.is_ok(), "{name} is not exported");
    }
    // Programs ask for 1.5.13 or later.
    // SAFETY: it has this type.
    let version = unsafe { library.get::<unsafe extern "C" fn() -> u32>(b"ftxGetLibVersion") };
    // SAFETY: it only returns a number.
    assert_eq!(unsafe { version.expect("it is exported")() }, 0x0001_050E);
}
