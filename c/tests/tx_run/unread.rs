//! Programs whose output nobody reads, as at a paused terminal: they still end, with their motors off.

use std::fs::{self, File};
use std::io::Write;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::path::Path;
#[cfg(target_os = "linux")]
use std::process::Command;
use std::process::{Child, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::CommandId;
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use super::support::{has_compiler, has_ended, program, tx_run, txt, wait_for, wait_until, LIMIT};

/// A pipe: where it is read, and where it is written.
fn pipe() -> [File; 2] {
    let mut ends = [0; 2];
    // SAFETY: the place for the two ends is this function's.
    assert_eq!(unsafe { libc::pipe(ends.as_mut_ptr()) }, 0);
    ends.map(|end| {
        // SAFETY: nobody else has it.
        unsafe {
            libc::fcntl(end, libc::F_SETFD, libc::FD_CLOEXEC);
            OwnedFd::from_raw_fd(end).into()
        }
    })
}

/// How many bytes wait to be read.
fn waiting(pipe: &File) -> libc::c_int {
    let mut bytes = 0;
    // SAFETY: the place for the number is this function's.
    assert_eq!(unsafe { libc::ioctl(pipe.as_raw_fd(), libc::FIONREAD, &raw mut bytes) }, 0);
    bytes
}

fn wait_until_full(pipe: &File) {
    let (mut before, mut since) = (0, Instant::now());
    wait_until("the pipe is full", || waiting(pipe) > 1000);
    while since.elapsed() < Duration::from_millis(300) {
        let now = waiting(pipe);
        if now != before {
            (before, since) = (now, Instant::now());
        }
        thread::sleep(Duration::from_millis(10));
    }
}

fn wait_for_end(child: &mut Child) {
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > LIMIT {
            child.kill().unwrap();
            panic!("tx_run does not end");
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// Sends a signal to `tx_run` when its program's output is full.
fn ends_by(signal: i32, name: &str, flags: &str) {
    let txt = txt().start().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let [read, write] = pipe();
    let mut command = tx_run(&["--host", &txt.address().to_string()]);
    command.arg(program(name)).env("CFLAGS", flags).current_dir(folder.path());
    command.stdin(Stdio::null()).stdout(write.try_clone().unwrap()).stderr(write);
    let mut child = command.spawn().unwrap();
    drop(command);
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 512);
    wait_until_full(&read);
    let number = number_in(&folder.path().join("number"));
    // SAFETY: a call without pointers, for a child that was not waited for.
    assert_eq!(unsafe { libc::kill(child.id() as libc::pid_t, signal) }, 0);
    wait_for_end(&mut child);
    wait_for(&txt, "the motor is off", |machine| machine.controllers[0].outputs.duty == [0; 8]);
    wait_until("the program has ended", || has_ended(number));
    assert!(waiting(&read) > 1000, "nobody has read it");
}

fn number_in(file: &Path) -> i32 {
    fs::read_to_string(file).unwrap().trim().parse().unwrap()
}

#[test]
fn a_program_whose_output_nobody_reads_ends_when_it_is_asked_to() {
    if !has_compiler() {
        return;
    }
    let killed = if cfg!(target_os = "linux") { libc::SIGKILL } else { libc::SIGTERM };
    thread::scope(|scope| {
        for (signal, name, flags) in [
            (libc::SIGINT, "unread.c", ""),
            (libc::SIGTERM, "unread_tic.c", ""),
            (libc::SIGINT, "unread_tic.c", "-DPRINTS"),
            (killed, "unread.c", ""),
            (killed, "unread_tic.c", ""),
        ] {
            scope.spawn(move || ends_by(signal, name, flags));
        }
    });
}

/// Runs a program whose error output is full when I1 is pressed.
#[cfg(target_os = "linux")]
fn with_full_errors(options: &[&str], flags: &str, then: impl FnOnce(&SimulatedTxt)) {
    let txt = txt().start().unwrap();
    let [read, write] = pipe();
    let mut command = tx_run(&["--host", &txt.address().to_string()]);
    command.args(options).arg(program("unread_end.c")).stdin(Stdio::null()).stderr(write);
    let mut child = command.env("CFLAGS", flags).env("CXXFLAGS", flags).spawn().unwrap();
    drop(command);
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 512);
    txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
    wait_until("the pipe is full", || waiting(&read) > 1000);
    then(&txt);
    wait_for(&txt, "StopOnline", |machine| {
        machine.commands().last() == Some(CommandId::StopOnline) && !machine.connected()
    });
    drop(read);
    wait_for_end(&mut child);
}

/// What `tx_run` says while the program runs does not keep it from looking at the program.
#[cfg(target_os = "linux")]
#[test]
fn a_program_that_is_killed_is_stopped_when_nobody_reads_what_was_said_before() {
    if !has_compiler() {
        return;
    }
    with_full_errors(&[], "-DAGAIN", |txt| {
        let again = |machine: &Machine| machine.controllers[0].outputs.duty[0] == 300;
        wait_for(txt, "the motor turns again", again);
        txt.with_machine(|machine| machine.controllers[0].uni[1] = 1);
    });
}

/// Why a call has failed does not keep the program from its motors.
#[cfg(target_os = "linux")]
#[test]
fn a_program_goes_on_when_nobody_reads_what_the_library_says() {
    if !has_compiler() {
        return;
    }
    with_full_errors(&[], "-DFAILS", |txt| {
        let goes_on = |machine: &Machine| machine.controllers[0].outputs.duty[0] == 300;
        wait_for(txt, "the program goes on", goes_on);
        txt.with_machine(|machine| machine.controllers[0].uni[1] = 1);
    });
}

#[cfg(target_os = "linux")]
#[test]
fn the_motors_stop_before_the_message_of_an_assertion_or_an_exception() {
    if !has_compiler() {
        return;
    }
    with_full_errors(&[], "", |_| {});
    with_full_errors(&["-x", "c++"], "", |_| {});
    with_full_errors(&["-x", "c++"], "-DTHROW", |_| {});
    with_full_errors(&["-x", "c++"], "-DFROM_CALLBACK", |_| {});
    with_full_errors(&["-x", "c++"], "-DFROM_THREAD", |_| {});
    with_full_errors(&["-x", "c++"], "-DFROM_CONTROL", |_| {});
    with_full_errors(&["-x", "c++"], "-DFROM_CONSTRUCTOR", |_| {});
    with_full_errors(&[], "-DPERROR", |_| {});
    with_full_errors(&["-x", "c++"], "-DCHECK", |_| {});
    with_full_errors(&["-x", "c++"], "-DVIRTUAL", |_| {});
}

/// The program's own source is C, and what fails was compiled before.
#[cfg(target_os = "linux")]
#[test]
fn the_motors_stop_before_the_message_of_a_part_that_is_compiled_in_c_plus_plus() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let part = program("unread_elsewhere.cpp").display().to_string();
    for flags in ["-DNONE", "-DTHROW"] {
        let (object, archive) = (place("part.o"), place("libpart.a"));
        let library = place("libpart.so");
        run_well("c++", &["-c", "-fPIC", flags, &part, "-o", &object]);
        run_well("ar", &["rcs", &archive, &object]);
        run_well("c++", &["-shared", &object, "-o", &library]);
        for linked in [&object, &archive, &library] {
            with_full_errors(&[linked, "-l", "stdc++"], "-DELSEWHERE", |_| {});
        }
    }
}

#[cfg(target_os = "linux")]
fn run_well(program: &str, arguments: &[&str]) {
    assert!(Command::new(program).args(arguments).status().unwrap().success(), "{arguments:?}");
}

/// Beside the first sentence there is no room for what it logs.
#[test]
fn the_simulated_txt_of_tx_run_answers_when_nobody_reads_what_it_logs() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("quiet.c");
    let text = r#"
        #include "ftMscLib.h"
        #include "ftErrCode.h"
        int main(void) {
            DWORD error, failed = 0;
            int times;
            HANDLE device;
            ftxInitLib();
            device = ftxOpenComDevice("COM4", 38400, &error);
            for (times = 0; times < 8 && !failed; times++) {
                failed = ftxStartTransferArea(device);
                SetOutMotorValues(device, 0, 0, 300, 0);
                ftxStopTransferArea(device);
            }
            return failed ? 3 : 0;
        }
    "#;
    fs::write(&source, text).unwrap();
    let [read, mut write] = pipe();
    write.write_all(&[0; (64 << 10) - 400]).unwrap();
    let mut command = tx_run(&["--world", "none"]);
    let mut child = command
        .arg(&source)
        .env("RUST_LOG", "info")
        .stderr(write.try_clone().unwrap())
        .spawn()
        .unwrap();
    wait_for_end(&mut child);
    assert!(waiting(&read) > (64 << 10) - 400, "it has said nothing");
    assert_eq!(child.wait().unwrap().code(), Some(0));
}
