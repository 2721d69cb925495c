//! The built libraries, loaded by their files as other languages do.

use std::env;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Machine, SimulatedTxt};
use libloading::library_filename;

use super::api::NAMES;
use super::bench::{stands, start};

/// The built library, beside this test.
fn library() -> PathBuf {
    let folder = env::current_exe().expect("this test has a file").with_file_name("");
    folder.join(library_filename("ftMscLib"))
}

#[test]
fn the_library_exports_all_110_functions() {
    // SAFETY: loading it runs nothing.
    let library =
        unsafe { libloading::Library::new(library()) }.expect("it was built with this test");
    // 82 of ftMscLib, and 28 of ftMscLibEx.
    assert_eq!(NAMES.len(), 110);
    for name in NAMES {
        // SAFETY: it is not called.
        let function = unsafe { library.get::<unsafe extern "C" fn()>(name.as_bytes()) };
        assert!(function.is_ok(), "{name} is not exported");
    }
}

/// A Python, unless there is none.
fn python() -> Option<Command> {
    let is_there = |name: &&str| {
        Command::new(name).arg("--version").output().is_ok_and(|it| it.status.success())
    };
    let name = ["python3", "python"].into_iter().find(is_there);
    if name.is_none() {
        eprintln!("SKIPPED: there is no Python, so programs in Python are not run");
    }
    name.map(Command::new)
}

#[cfg_attr(windows, ignore = "no Python is expected there")]
#[test]
fn the_sample_in_python_drives_a_motor_in_both_exchanges() {
    for mode in ["compressed", "simple"] {
        let Some(mut python) = python() else { return };
        let world: World = World::default();
        let txt = start(SimulatedTxt::builder().world(world));
        let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/python/motor_distance.py");
        let output = python
            .args([sample, "COM4"])
            .env("FTMSCLIB", library())
            .env("FT_TXT_MODE", mode)
            .env("FT_TXT_HOST", "127.0.0.1:1")
            .env("FT_TXT_PORTS", format!("COM4={}", txt.address()))
            .output()
            .expect("Python runs");
        let (text, errors) =
            (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{mode}: {text}{errors}");
        for part in ["COM4", "firmware V 04.07", "M1 has arrived", "all motors off"] {
            assert!(text.contains(part), "{mode}: no \"{part}\" in {text}{errors}");
        }
        stands(&txt);
        let pulses = txt.with_machine(|it| it.controllers[0].counter[0]);
        assert!(pulses >= 100, "{mode}: {pulses} pulses");
    }
}

/// Leaves M1 on, and is in no function of the library when it ends.
const LEFT_ON: &str = r#"
import ctypes, os, signal, sys, time
library = ctypes.CDLL(os.environ["FTMSCLIB"])
library.ftxOpenComDevice.restype = ctypes.c_void_p
library.ftxInitLib()
device = ctypes.c_void_p(library.ftxOpenComDevice(b"COM4", 38400, ctypes.byref(ctypes.c_uint32())))
library.ftxStartTransferArea(device)
library.SetOutMotorValues(device, 0, 0, 512, 0)
# The test may ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
time.sleep(60)
"#;

/// Python takes the signal, and ends itself by it with nothing else called: it has its own end.
#[cfg_attr(windows, ignore = "no Python is expected there")]
#[test]
fn ctrl_c_in_a_program_in_python_stops_the_motors() {
    let Some(mut python) = python() else { return };
    let txt = start(SimulatedTxt::builder());
    python.args(["-c", LEFT_ON]).env("FTMSCLIB", library()).stderr(Stdio::null());
    python.env("FT_TXT_PORTS", format!("COM4={}", txt.address()));
    let mut program = python.spawn().expect("Python runs");
    let is_on = |machine: &Machine| machine.controllers[0].outputs.duty[0] == 512;
    assert!(txt.wait_until(is_on, Duration::from_secs(30)));
    // It may not sleep yet.
    thread::sleep(Duration::from_millis(100));
    let kill = Command::new("kill").args(["-INT", &program.id().to_string()]).status();
    assert!(kill.expect("kill runs").success());
    assert!(!program.wait().expect("it ends").success());
    assert!(txt.wait_until(|machine| !machine.connected(), Duration::from_secs(30)));
    stands(&txt);
}
