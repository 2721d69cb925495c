//! What the lines of JSON say.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::process::Stdio;
use std::thread;

use ft_transfer_area::transfer_area::{Config, InputMode, UniConfig, LOCAL_IO};
use ft_transfer_area::tx::{Input, Motor};
use ft_transfer_area::wire::{CmprHeader, CommandId};
use ft_transfer_area_recorder::{FailureKind, Transfer};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};
use serde_json::{json, Value};

use super::away::{at_free_ports, started};
use super::clients::transfers;
use super::support::{command, listening, KitClient, Watch};
use super::LIMIT;
use crate::names;
use crate::panel::page::is_running;
use crate::panel::recording::InFile;
use crate::recording::{run, txt};
use crate::running::Running;

#[test]
fn each_change_is_a_line_with_the_names_of_the_page() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let names = ["--names", &names::file(folder.path())];
    let watch = Watch::with_lines_and(txt.address(), &names);
    let handler = watch.handler().build().unwrap();
    handler.areas().lock()[LOCAL_IO].set_ft_uni_config(Input::I2, InputMode::Voltage, false);
    handler.begin_transfer().unwrap();
    let line = watch.line_where(|line| line["what"] == "controller");
    assert_eq!((&line["name"], &line["firmware"]), (&json!("TX2013"), &json!("4.7.0")));
    let line = watch.line_where(|line| line["command"] == "UpdateConfig");
    assert_eq!(line["what"], "command");
    // The first cycle has a line for each terminal.
    let line = watch.line_where(|line| line["input"] == "I2");
    assert_eq!(
        (&line["controller"], &line["cycle"], &line["mode"]),
        (&json!("TXT"), &json!(1), &json!("voltage"))
    );
    txt.with_machine(|machine| machine.controllers[0].uni[1] = 4711);
    let line = watch.line_where(|line| line["input"] == "I2");
    assert_eq!((&line["value"], &line["unit"]), (&json!(4711), &json!("mV")));
    assert_eq!(line["name"], "barrier, at the gate");
    handler.areas().lock()[LOCAL_IO].output.duty[2] = 77;
    let motor = Motor::M2.to_string();
    let line = watch.line_where(|line| line["motor"] == motor.as_str() && line["duty"][0] == 77);
    assert_eq!((&line["kind"], &line["ready"]), (&json!("motor"), &json!(true)));
    assert_eq!(line.get("name"), None);
    handler.end_transfer().unwrap();
    let line = watch.line_where(|line| line["what"] == "offline");
    assert_eq!(line["by_program"], true);
    watch.line_where(|line| line["what"] == "closed" && line["connection"] == "main");
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn only_a_configuration_that_the_controller_takes_is_shown() {
    let txt = SimulatedTxt::builder().extensions(1).start().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let arguments = ["--json", "--no-page", "--record", path.to_str().unwrap()];
    let watch = Running::start(command(txt.address(), &arguments).stderr(Stdio::piped()));
    let port = listening(&watch.line());
    let mut program = KitClient::without_configuration(([127, 0, 0, 1], port).into());
    // The controller has the one of a program before.
    program.exchange([0; 8]);
    let [mv, ohm, cm] = [InputMode::Voltage, InputMode::Resistance, InputMode::Ultrasonic]
        .map(|mode| Config { uni: [UniConfig::analog(mode); 8].into(), ..Config::default() });
    let configurations = [
        // After StartOnline the id is 0.
        (0, 0, mv),
        (1, 0, ohm),
        (1, 0, cm),
        (257, 0, cm),
        // Ignored, too, but nobody misses them: it has the first one, and there is no extension for the second.
        (1, 0, ohm),
        (0, 3, mv),
        (256, 1, mv),
        (2, 0, cm),
    ];
    for (config_id, extension, config) in configurations {
        program.configure(config_id, extension, config);
        program.exchange_all(&[[0; 8]; 2]);
    }
    program.end();
    watch.signal("INT");
    let output = watch.end();
    let [lines, errors] = [&output.stdout, &output.stderr].map(|out| String::from_utf8_lossy(out));
    assert!(output.status.success(), "{errors}");
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let ignored = lines.iter().filter(|line| line["what"] == "ignored");
    let ignored: Vec<_> = ignored.map(|line| &line["controller"]).collect();
    assert_eq!(ignored, ["TXT", "TXT", "TXT", "E1"]);
    assert_eq!(errors.matches("UpdateConfig with an unchanged id").count(), 1, "{errors}");
    let modes = |controller: &str| {
        let of = |line: &&Value| line["controller"] == controller && line["input"] == "I1";
        let mut modes: Vec<_> = lines.iter().filter(of).map(|line| line["mode"].clone()).collect();
        modes.dedup();
        modes
    };
    assert_eq!(modes("TXT"), ["", "resistance", "ultrasonic"]);
    assert_eq!(modes("E1"), [""]);
    let counters = lines.iter().find(|line| line["counter"] == "C1").unwrap();
    assert_eq!(counters["mode"], "");

    let cycles = InFile::read(&path).cycles;
    let mut modes: Vec<_> = cycles.iter().map(|cycle| cycle.areas[0].config.uni[0]).collect();
    modes.dedup();
    let expected = [None, Some(InputMode::Resistance), Some(InputMode::Ultrasonic)];
    assert_eq!(modes.iter().map(UniConfig::input_mode).collect::<Vec<_>>(), expected);
    assert_eq!(cycles.last().unwrap().areas[1].config.uni[0].input_mode(), None);
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn what_another_connection_says_is_told_as_its_own() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let path = folder.path().join("run.mcap");
    let watch = Watch::start(txt.address(), &["--record", path.to_str().unwrap()]);
    let mut page = watch.page();
    let mut program = KitClient::online(([127, 0, 0, 1], watch.port).into());
    program.exchange([1; 8]);
    // In part known, and wrong.
    let mut other = watch.connect();
    let mut nonsense = Vec::new();
    CmprHeader { extra_size: 1, ..CmprHeader::default() }.emit_command(&mut nonsense);
    other.write_all(&[&nonsense[..], &[0; 9]].concat()).unwrap();
    drop(other);
    for duty in 2..50 {
        program.exchange([duty; 8]);
    }
    page.state(0, |state| {
        assert!(state["link"]["error"].is_null(), "{state}");
        state["areas"][0]["motors"][0]["duty"][0] == 49
    });
    program.end();
    page.state(0, |state| state["link"]["phase"] == "idle");
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
    let transfers = transfers(&path);
    assert!(matches!(&transfers[..], [Transfer::Began { .. }, Transfer::Ended]), "{transfers:?}");
}

#[test]
fn what_is_not_understood_ends_with_its_connection() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let watch = Watch::start(txt.address(), &[]);
    let mut page = watch.page();
    let mut wrong = watch.connect();
    let waits = watch.connect();
    let mut nonsense = Vec::new();
    CmprHeader { extra_size: 1, ..CmprHeader::default() }.emit_command(&mut nonsense);
    wrong.write_all(&[&nonsense[..], &[0; 9]].concat()).unwrap();
    page.state(0, |state| state["link"]["phase"] == "unclear");
    drop(wrong);
    page.state(0, |state| state["link"]["phase"] == "connecting");
    drop(waits);
    // Nor is what a stranger says beside the program.
    let mut program = KitClient::online(([127, 0, 0, 1], watch.port).into());
    program.exchange([1; 8]);
    let unclear = |state: &Value| state["watched"]["beside"]["code"] == "not_understood";
    let mut stranger = TcpStream::connect(("127.0.0.1", watch.port + 1)).unwrap();
    stranger.write_all(&[b'x'; 64]).unwrap();
    // It is not an error of the program.
    assert!(page.state(0, unclear)["link"]["error"].is_null());
    drop(stranger);
    page.state(0, |state| !unclear(state));
    program.end();
}

#[test]
fn a_stranger_hides_no_missing_answer() {
    let silence = Fault::at_exchange(1, FaultKind::Silence);
    let txt = SimulatedTxt::builder().fault(silence).start().unwrap();
    let watch = Watch::start(txt.address(), &["--leave-outputs"]);
    let mut page = watch.page();
    let mut program = KitClient::online(([127, 0, 0, 1], watch.port).into());
    program.exchange([1; 8]);
    program.send_all(&[[2; 8]]);
    let is_told = |state: &Value| state["link"]["error"]["code"] == "no_answer";
    page.state(0, is_told);
    // Refused, or not understood.
    for port in [watch.port + 1, watch.port + 2] {
        let mut stranger = TcpStream::connect(("127.0.0.1", port)).unwrap();
        let _ = stranger.write_all(&[b'x'; 64]);
        drop(stranger);
    }
    // Until it is seen.
    std::thread::sleep(std::time::Duration::from_millis(500));
    for _ in 0..20 {
        let state = page.state(0, |_| true);
        assert!(is_told(&state), "{state}");
    }
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn stderr_tells_once_of_each_connection_and_whose_it_is() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut command = command(txt.address(), &["--json", "--no-page"]);
    let running = Running::start(command.stderr(Stdio::piped()));
    let port = listening(&running.line());
    let address = ([127, 0, 0, 1], port).into();
    let has_seen = |connection: u64| loop {
        let line: Value = serde_json::from_str(&running.line()).unwrap();
        if line["what"] == "unknown" && line["connection_number"] == connection {
            break;
        }
    };
    let mut program = KitClient::online(address);
    let mut stranger = TcpStream::connect(address).unwrap();
    stranger.write_all(b"GET / HTTP/1.0\r\n\r\n").unwrap();
    has_seen(2);
    drop(stranger);
    program.stream.write_all(&0xDEAD_BEEF_u32.to_le_bytes()).unwrap();
    has_seen(1);
    drop(program);
    running.signal("INT");
    let ended = running.end();
    let said = String::from_utf8_lossy(&ended.stderr);
    let told: Vec<&str> = said.lines().filter(|line| line.contains("unknown command")).collect();
    assert_eq!(told.len(), 2, "{said}");
    assert!(told[0].contains("another connection (2): unknown command 0x20544547"), "{said}");
    assert!(told[1].contains("] unknown command 0xdeadbeef"), "{said}");
}

#[test]
fn robo_pro_is_answered_through_it_and_what_follows_is_understood() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let watch = Watch::with_lines(txt.address());
    let mut program = watch.connect();
    for (command, response, size) in
        [(0xACAB_31F7_u32, 0x15B1_758E_u32, 4), (0xDAF8_4364, 0x5170_C53B, 20)]
    {
        program.write_all(&command.to_le_bytes()).unwrap();
        let mut answer = vec![0; size];
        program.read_exact(&mut answer).unwrap();
        assert_eq!(answer[..4], response.to_le_bytes());
        for (from, id, bytes) in [("program", command, 4), ("controller", response, size)] {
            let line = watch.line_where(|line| line["what"] == "unknown");
            assert_eq!((&line["from"], &line["bytes"]), (&from.into(), &bytes.into()));
            assert_eq!(line["id"], format!("{id:#010x}"));
        }
    }
    let mut program = KitClient::over(program);
    program.exchange([7; 8]);
    watch.line_where(|line| line["duty"][0] == 7);
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn a_recording_says_that_an_answer_was_missing_before_the_program_ended() {
    let silence = Fault::at_exchange(5, FaultKind::Silence);
    let txt = SimulatedTxt::builder().fault(silence).start().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let watch = Watch::start(txt.address(), &["--no-page", "--record", path.to_str().unwrap()]);
    // It waits for two seconds, as programs do by default.
    let handler = watch.handler().build().unwrap();
    handler.begin_transfer().unwrap();
    while handler.areas().wait_cycle_for(LIMIT).is_ok() {}
    drop(handler);
    assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
    let transfers = transfers(&path);
    let Some(Transfer::EndedBy(failure)) = transfers.last() else { panic!("{transfers:?}") };
    assert_eq!(failure.kind, FailureKind::NoAnswer);
    assert!(failure.error.starts_with("no answer to ExchangeDataCmpr for "), "{failure:?}");
    assert!(failure.error.ends_with(" s, then the program ended"), "{failure:?}");
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn a_recording_has_no_version_that_nobody_has_asked_for() {
    let controller = SimulatedTxt::builder().start().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let watch =
        Watch::start(controller.address(), &["--no-page", "--record", path.to_str().unwrap()]);
    let mut program = KitClient::without_question(watch.connect());
    program.exchange([0; 8]);
    program.end();
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
    let transfers = transfers(&path);
    let Some(Transfer::Began { device_name, firmware, .. }) = transfers.first() else {
        panic!("{transfers:?}")
    };
    assert_eq!((&**device_name, &**firmware), ("", ""));
    let path = path.to_str().unwrap();
    let info = String::from_utf8(run(&["info", path]).stdout).unwrap();
    let begins = format!("controller   unknown at {}, firmware unknown\n", controller.address());
    assert!(info.starts_with(&begins), "{info}");
    let replay = Running::start(&mut txt(&["replay", path, "--port", "0"]));
    assert!(replay.line().contains("(unknown, firmware unknown, 1 cycles)"));
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn page_and_recording_have_the_controller_that_each_program_itself_was_told() {
    let first = at_free_ports(|port| SimulatedTxt::builder().port(port).device_name("FIRST"));
    let (address, port) = (first.address(), first.port());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let watch = Watch::start(address, &["--record", path.to_str().unwrap()]);
    let mut page = watch.page();
    let mut drive = |mut program: KitClient, name| {
        program.exchange([0; 8]);
        page.state(0, |state| is_running(state) && state["link"]["name"] == name);
        program.end();
        page.state(0, |state| !is_running(state));
    };
    drive(KitClient::over(watch.connect()), json!("FIRST"));
    drop(first);
    let _second = started(|| SimulatedTxt::builder().port(port).device_name("SECOND"));
    drive(KitClient::without_question(watch.connect()), json!(null));
    drive(KitClient::over(watch.connect()), json!("SECOND"));
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
    let names = transfers(&path).into_iter().filter_map(|transfer| match transfer {
        Transfer::Began { device_name, .. } => Some(device_name),
        _ => None,
    });
    assert_eq!(names.collect::<Vec<_>>(), ["FIRST", "", "SECOND"]);

    // They do not show who answers.
    for command in ["csv", "compare"] {
        let files = [path.to_str().unwrap(); 2];
        let files = if command == "csv" { &files[..1] } else { &files };
        let said = String::from_utf8(run(&[&[command], files].concat()).stderr).unwrap();
        assert!(said.contains(", firmware unknown in place of FIRST at"), "{said}");
    }
    let info = String::from_utf8(run(&["info", path.to_str().unwrap()]).stdout).unwrap();
    let mut lines = info.lines();
    let begins = format!("controller   FIRST at {address}, ");
    assert!(lines.next().unwrap().starts_with(&begins), "{info}");
    assert!(lines.next().unwrap().ends_with(" s) on unknown, firmware unknown"), "{info}");
    assert!(lines.next().unwrap().ends_with(" s) on SECOND, firmware 4.7.0"), "{info}");
}

#[test]
fn the_page_shows_nothing_of_a_controller_below_the_name_of_the_next_one() {
    let first = at_free_ports(|port| SimulatedTxt::builder().port(port));
    first.with_machine(|machine| machine.i2c_device(0x18)[7] = 99);
    let (address, port) = (first.address(), first.port());
    let watch = Watch::start(address, &[]);
    let mut page = watch.page();
    let handler = watch.handler().build().unwrap();
    handler.begin_transfer().unwrap();
    handler.i2c().unwrap().read(0x18, 7, &mut [0]).unwrap();
    handler.areas().wait_cycle().unwrap();
    handler.end_transfer().unwrap();
    page.state(0, |state| !is_running(state) && !state["watched"]["i2c"].is_null());
    drop(first);
    let _second = started(|| SimulatedTxt::builder().port(port).device_name("SECOND"));
    // It asks who is there, and is not online.
    let mut program = watch.connect();
    program.write_all(&CommandId::QueryStatus.id().to_le_bytes()).unwrap();
    program.read_exact(&mut [0; 24]).unwrap();
    let state = page.state(0, |state| state["link"]["name"] == "SECOND");
    assert_eq!((&state["watched"]["i2c"], &state["link"]["cycles"]), (&json!(null), &json!(0)));
}

/// Passes the first connection on to one controller, and the second one to another.
fn pass_on_to_both(controllers: [SocketAddr; 2]) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    thread::spawn(move || {
        let pass_on = |mut from: TcpStream, mut to: TcpStream| {
            thread::spawn(move || {
                let _ = std::io::copy(&mut from, &mut to);
                let _ = to.shutdown(Shutdown::Write);
            });
        };
        for controller in controllers {
            let (program, _) = listener.accept().unwrap();
            let controller = TcpStream::connect(controller).unwrap();
            pass_on(program.try_clone().unwrap(), controller.try_clone().unwrap());
            pass_on(controller, program);
        }
    });
    address
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn what_becomes_of_a_program_that_another_one_displaces_is_told_as_its_own() {
    let both = [(); 2].map(|()| SimulatedTxt::builder().start().unwrap());
    let address = pass_on_to_both([both[0].address(), both[1].address()]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let options = ["--json", "--no-page", "--record", path.to_str().unwrap()];
    let mut command = command(address, &options);
    let running = Running::start(command.stderr(Stdio::piped()));
    let port = listening(&running.line());
    let mut first = KitClient::online(([127, 0, 0, 1], port).into());
    first.exchange([1; 8]);
    let mut second = KitClient::online(([127, 0, 0, 1], port).into());
    second.exchange([2; 8]);
    drop(first);
    loop {
        let line: Value = serde_json::from_str(&running.line()).unwrap();
        if line["what"] == "outputs_off" {
            assert_eq!(line["connection_number"], 1, "{line}");
            break;
        }
    }
    second.exchange([3; 8]);
    let mut third = TcpStream::connect(("127.0.0.1", port)).unwrap();
    third.set_read_timeout(Some(LIMIT)).unwrap();
    assert!(!matches!(third.read(&mut [0]), Ok(1..)), "the controller takes two");
    second.end();
    running.signal("INT");
    let said = running.end();
    let said = String::from_utf8_lossy(&said.stderr);
    assert!(
        said.contains("another connection (3): the controller refuses the main connection"),
        "{said}"
    );
    assert!(
        said.contains("another connection (1): the program has closed its connection"),
        "{said}"
    );
    let transfers = transfers(&path);
    let [Transfer::Began { .. }, Transfer::EndedBy(failure), Transfer::Began { .. }, Transfer::Ended] =
        &transfers[..]
    else {
        panic!("{transfers:?}")
    };
    assert_eq!(failure.error, "a program on another connection went online");
}

#[test]
fn a_displaced_program_leaves_a_gap_only_if_it_does_not_end_properly() {
    let both = [(); 2].map(|()| SimulatedTxt::builder().start().unwrap());
    let gaps_after = |ends: fn(KitClient)| {
        let address = pass_on_to_both([both[0].address(), both[1].address()]);
        let watch = Watch::start(address, &[]);
        let mut page = watch.page();
        let mut first = KitClient::over(watch.connect());
        first.exchange([1; 8]);
        let mut second = KitClient::over(watch.connect());
        second.exchange([2; 8]);
        ends(first);
        second.exchange([3; 8]);
        page.state(0, is_running);
        second.end();
        let state = page.state(0, |state| state["link"]["phase"] == "idle");
        state["link"]["gaps"].clone()
    };
    assert_eq!(gaps_after(|first| drop(first.end())), 0);
    assert_eq!(gaps_after(drop), 1);
}
