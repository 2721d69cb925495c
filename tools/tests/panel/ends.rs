//! How the program begins and ends.

use std::process::Stdio;

use ft_transfer_area::wire::CommandId;
use ft_transfer_area_simulator::{FaultKind, Machine, SimulatedTxt};
use serde_json::json;

use super::program::{command, Panel};
use super::LIMIT;

#[cfg_attr(not(unix), ignore = "a single program gets no signals there")]
#[test]
fn the_end_of_the_program_stops_the_motors_also_when_it_is_killed() {
    for signal in ["INT", "TERM", "QUIT", "TSTP", "KILL"] {
        let txts = [(); 2].map(|()| SimulatedTxt::builder().start().unwrap());
        let panel = Panel::of(&[&txts[0], &txts[1]]);
        let mut page = panel.driver();
        page.state(1, super::page::is_running);
        for (host, txt) in txts.iter().enumerate() {
            page.done(json!({"do": "motor", "host": host, "motor": 0, "duty": 512}));
            assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 512, LIMIT));
        }
        panel.running.signal(signal);
        let status = panel.running.end().status;
        assert_eq!(status.success(), signal != "KILL", "{signal}: {status}");
        for txt in &txts {
            assert!(txt.wait_until(is_stopped, LIMIT), "{signal}");
            let starts = |machine: &mut Machine| {
                machine.commands().filter(|command| *command == CommandId::StartOnline).count()
            };
            assert_eq!(txt.with_machine(starts), if signal == "KILL" { 2 } else { 1 }, "{signal}");
        }
    }
}

/// A killed program sends nothing more. What it leaves behind connects anew.
fn is_stopped(machine: &Machine) -> bool {
    let last = machine.commands().next_back();
    !machine.connected()
        && machine.controllers[0].outputs.duty[0] == 0
        && last == Some(CommandId::StopOnline)
}

/// The guardian of this process: the number of one that it has started, and its arguments.
#[cfg(target_os = "linux")]
fn guardian(of: u32) -> Option<(String, Vec<String>)> {
    let threads = std::fs::read_dir(format!("/proc/{of}/task")).unwrap();
    let children = |thread: std::io::Result<std::fs::DirEntry>| {
        // A thread may have ended meanwhile.
        std::fs::read_to_string(thread.unwrap().path().join("children")).unwrap_or_default()
    };
    let children: String = threads.map(children).collect();
    let guards = |child: &str| {
        let words = std::fs::read_to_string(format!("/proc/{child}/cmdline")).unwrap_or_default();
        let words: Vec<_> = words.split('\0').map(str::to_owned).collect();
        words.iter().any(|word| word == "--guard").then(|| (child.to_owned(), words))
    };
    children.split_whitespace().find_map(guards)
}

/// Somebody else may drive it by then.
#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn a_controller_that_has_ended_well_is_not_stopped_again_for_one_that_does_not_answer() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut simulate = std::process::Command::new(env!("CARGO_BIN_EXE_txt"));
    let hung = crate::running::Running::start(simulate.args(["simulate", "--port", "0"]));
    let address = hung.line().strip_prefix("main ").unwrap().to_owned();
    let mut command = command(&[&address, &txt.address().to_string(), "--no-browser"]);
    let running = crate::running::Running::start(command.stderr(Stdio::piped()));
    assert!(txt.wait_until(|machine| machine.exchanges() > 100, LIMIT));
    hung.signal("STOP");
    running.signal("INT");
    // Its errors end with those of all guardians.
    let ended = running.end();
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(said.contains("no answer from"), "{said}");
    let starts = txt.with_machine(|machine| {
        machine.commands().filter(|command| *command == CommandId::StartOnline).count()
    });
    assert_eq!(starts, 1, "{said}");
    hung.signal("CONT");
}

/// When the program is killed, another controller may be the only one that answers, or there may be several.
#[cfg(target_os = "linux")]
#[test]
fn the_guardian_of_the_only_controller_has_its_address() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let (address, auto) = (txt.address().to_string(), format!("auto:{}", txt.address().port()));
    let mut bridge = std::process::Command::new(env!("CARGO_BIN_EXE_txt"));
    // Nobody is there, and it tries again.
    bridge.args(["bridge", "--mqtt", "127.0.0.1:1", &auto]).stdin(Stdio::null());
    for command in [command(&[&auto, "--no-browser"]), bridge] {
        let running = crate::running::Running::start(&mut { command });
        let begin = std::time::Instant::now();
        let words = loop {
            if let Some((_, words)) = guardian(running.id()) {
                break words;
            }
            assert!(begin.elapsed() < LIMIT, "there is none");
            std::thread::yield_now();
        };
        assert!(words.contains(&address) && !words.contains(&auto), "{words:?}");
    }
}

/// The guardian would wait until it is written.
#[cfg(target_os = "linux")]
#[test]
fn a_panel_that_crashes_writes_no_memory_image() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut shell = std::process::Command::new("sh");
    shell.args([
        "-c",
        "ulimit -S -c \"$(ulimit -H -c)\" && exec \"$0\" panel --port 0 --no-browser \"$1\"",
    ]);
    shell.args([env!("CARGO_BIN_EXE_txt"), &txt.address().to_string()]).stdin(Stdio::null());
    let running = crate::running::Running::start(&mut shell);
    assert!(txt.wait_until(|machine| machine.exchanges() > 10, LIMIT));
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", running.id())).unwrap();
    let core = limits.lines().find_map(|line| line.strip_prefix("Max core file size")).unwrap();
    let soft: u64 = core.split_whitespace().next().unwrap().parse().unwrap();
    assert!(soft <= 1, "{core}");
}

#[cfg(target_os = "linux")]
#[test]
fn another_guardian_takes_the_place_of_one_that_is_killed() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    let id = panel.running.id();
    let wait_for = |other_than: &Option<String>| {
        let begin = std::time::Instant::now();
        loop {
            let found = guardian(id).map(|(number, _)| number);
            if found.is_some() && found != *other_than {
                return found;
            }
            assert!(begin.elapsed() < LIMIT, "there is none");
            std::thread::yield_now();
        }
    };
    let first = wait_for(&None);
    let kill = ["-KILL", first.as_deref().unwrap()];
    assert!(std::process::Command::new("kill").args(kill).status().unwrap().success());
    let second = wait_for(&first);
    // It has to begin before it can ignore signals.
    let status = format!("/proc/{}/status", second.as_deref().unwrap());
    let begin = std::time::Instant::now();
    let ignores_terminate = || {
        let status = std::fs::read_to_string(&status).unwrap_or_default();
        let masks = status.lines().filter(|line| {
            ["SigBlk:", "SigIgn:", "SigCgt:"].iter().any(|mask| line.starts_with(mask))
        });
        let bits = masks.filter_map(|line| u64::from_str_radix(line[7..].trim(), 16).ok());
        bits.fold(0, |all, bits| all | bits) & 1 << 14 != 0
    };
    while !ignores_terminate() {
        assert!(begin.elapsed() < LIMIT, "it ends at a signal");
        std::thread::yield_now();
    }
    // As a service manager and the end of a session do with all that is left.
    for signal in ["-TERM", "-HUP", "-INT"] {
        let all = [signal, second.as_deref().unwrap()];
        assert!(std::process::Command::new("kill").args(all).status().unwrap().success());
    }
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 512, LIMIT));
    panel.running.signal("KILL");
    assert!(txt.wait_until(is_stopped, LIMIT));
}

/// As an update does.
#[cfg(target_os = "linux")]
#[test]
fn a_guardian_starts_also_when_the_file_of_the_program_was_replaced() {
    use std::fs;

    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let (program, other) = (folder.path().join("txt"), folder.path().join("other"));
    fs::copy(env!("CARGO_BIN_EXE_txt"), &program).unwrap();
    fs::write(&other, "#!/bin/false\n").unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut command = std::process::Command::new(&program);
    command.args(["panel", "--no-browser", &txt.address().to_string()]);
    let running = crate::running::Running::start(&mut command);
    let mut first = None;
    crate::running::wait_for("a guardian", || {
        first = guardian(running.id());
        first.is_some()
    });
    fs::rename(&other, &program).unwrap();
    let (first, words) = first.unwrap();
    assert!(std::process::Command::new("kill").args(["-KILL", &first]).status().unwrap().success());
    crate::running::wait_for("another guardian", || {
        guardian(running.id()).is_some_and(|second| second.0 != first && second.1 == words)
    });
}

#[cfg_attr(not(unix), ignore = "a single program gets no signals there")]
#[test]
fn a_controller_that_is_away_at_the_end_is_stopped_when_it_is_back() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut command = command(&[&txt.address().to_string()]);
    // Nobody reads what it says.
    #[cfg(target_os = "linux")]
    let _full = {
        let (folder, (path, full)) = crate::ending::full_pipe();
        command.stderr(std::fs::File::options().write(true).open(path).unwrap());
        (folder, full)
    };
    let panel = Panel::by(&mut command);
    let mut page = panel.driver();
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 512, LIMIT));
    txt.with_machine(|machine| {
        machine.set_absent(true);
        machine.disturb(FaultKind::Close { after: 0 });
    });
    page.state(0, |state| !state["link"]["error"].is_null());
    panel.running.signal("INT");
    assert!(panel.running.end().status.success());
    txt.with_machine(|machine| machine.set_absent(false));
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 0, LIMIT));
}

#[cfg_attr(not(unix), ignore = "a single program gets no signals there")]
#[test]
fn the_program_ends_while_a_controller_is_missing() {
    let panel = Panel::by(command(&["127.0.0.1:9"]).stderr(Stdio::piped()));
    panel.page().state(0, |state| !state["link"]["error"].is_null());
    panel.running.signal("INT");
    let ended = panel.running.end();
    assert!(ended.status.success());
    // Nothing was on, so nobody tries to stop it.
    assert_eq!(String::from_utf8_lossy(&ended.stderr), "");
}

#[test]
fn a_taken_port_is_told() {
    let panel = Panel::start(&[]);
    let port = panel.address.rsplit(':').next().unwrap();
    let output = command(&["--no-browser", "--port", port]).output().unwrap();
    assert!(!output.status.success());
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains(&format!("port {port} is taken")), "{error}");
}

#[test]
fn wrong_arguments_are_told() {
    for (arguments, sentence) in [
        (&["--world", "nowhere"][..], "nowhere"),
        (&["--world", "nowhere.toml"], "nowhere.toml"),
        (&["--extensions", "9"], "9 is not in 0..=8"),
        (&["--bind", "192.0.2.1"], "192.0.2.1 is not an address of this computer"),
        (&["--bind", "here"], "invalid value 'here'"),
        (&["192.168.7.2:x"], "is not a controller's address"),
    ] {
        let output = command(arguments).arg("--no-browser").output().unwrap();
        assert!(!output.status.success(), "{arguments:?}");
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(error.contains(sentence), "{arguments:?}: {error}");
    }
}

#[cfg_attr(not(unix), ignore = "a browser is found without the environment there")]
#[test]
fn without_a_browser_the_panel_says_so_and_goes_on() {
    use std::io::{BufRead, BufReader};

    // No program can be found, so no browser can.
    let mut command = command(&[]);
    command.env_clear().stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stderr.take().unwrap()).read_line(&mut line).unwrap();
    assert!(line.contains("no browser could be opened"), "{line}");
    assert!(child.try_wait().unwrap().is_none(), "it ended");
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn the_help_fits_on_a_screen_and_shows_how_to_begin() {
    let output = command(&["--help"]).output().unwrap();
    let help = String::from_utf8(output.stdout).unwrap();
    assert!(help.lines().count() <= 40, "{help}");
    assert!(help.lines().all(|line| line.chars().count() <= 100), "{help}");
    assert!(help.contains("txt panel 192.168.7.2"), "{help}");
}
