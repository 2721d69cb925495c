//! The variant has the same functions.

use std::env;

use libloading::{library_filename, Library};

/// The functions of ftMscLib, one from each of its files, and those that all programs call.
const SOME: [&str; 14] = [
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
}
