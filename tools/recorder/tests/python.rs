//! A recording, read by the package `mcap` for Python: all channels with their schemas, also of a file that is
//! cut off.
//!
//! It runs when `MCAP_PYTHON` names a Python with `tools/recorder/tests/requirements.txt` installed, as in
//! `.ci/run`, and otherwise prints that it does not run.

use std::fs;
use std::io::Write;
use std::process::Command;
use std::time::Duration;

use ft_transfer_area::{CameraFrame, TransferAreaComHandler};
use ft_transfer_area_recorder::{Options, Recorder};
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::Value;

#[cfg_attr(not(unix), ignore = "recordings are only read with Python on Unix")]
#[test]
fn pythons_mcap_reads_all_channels() {
    let Some(python) = std::env::var_os("MCAP_PYTHON").filter(|python| !python.is_empty()) else {
        // Not into the test's captured output, so that the note is always shown.
        let note =
            "SKIPPED: set MCAP_PYTHON to a Python with mcap for tools/recorder/tests/python.rs";
        writeln!(std::io::stderr(), "{note}").unwrap();
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (path, cut) = (folder.path().join("run.mcap"), folder.path().join("cut.mcap"));
    let mut number = 0;
    let txt =
        SimulatedTxt::builder().pace(Duration::ZERO).extensions(1).on_exchange(move |machine| {
            number += 1;
            machine.controllers[0].uni[0] = number;
        });
    let txt = txt.start().unwrap();
    let handler = TransferAreaComHandler::builder(txt.address()).areas(2).build();
    let handler = handler.unwrap();
    let options = Options::default().capacity(5_000);
    let recorder = Recorder::start(&handler, &path, options).unwrap();
    handler.begin_transfer().unwrap();
    (0..400).for_each(|_| drop(handler.areas().wait_cycle().unwrap()));
    handler.end_transfer().unwrap();
    let picture = include_bytes!("../../../tests/camera/clean_48x32_420.jpg");
    recorder.frames().record(&CameraFrame::new(picture.to_vec()));
    let cycles = recorder.finish().unwrap().cycles;
    let whole = fs::read(&path).unwrap();
    fs::write(&cut, &whole[..whole.len() - 1]).unwrap();

    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mcap_by_python.py");
    let output = Command::new(python).arg("-B").arg(script).args([&path, &cut]).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    let read: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(read["profile"], "ft-transfer-area");
    let inputs: Vec<u64> = (1..=cycles).collect();
    assert_eq!(read["inputs"], Value::from(inputs.clone()));
    assert_eq!(read["cut_off"], Value::from(inputs));
    for topic in ["/cycle", "/TXT/outputs", "/TXT/counters", "/E1/inputs", "/E1/outputs"] {
        assert_eq!(read["counts"][topic], cycles, "{topic}");
    }
    for topic in ["/TXT/configuration", "/E1/remotes", "/transfer", "/log", "/camera"] {
        assert!(read["counts"][topic].as_u64() >= Some(1), "{topic} in {}", read["counts"]);
    }
}
