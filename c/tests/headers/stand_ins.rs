//! What console programs use of Windows does on other systems what it does there: the programs in `stand_ins`. Each but
//! those that wait for somebody ends with the line that found a mistake, or with 0.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use super::compilers::{self, Language};
use super::running::linked;
use crate::terminal::AtTerminal;

/// Compiles and links a program.
fn built(name: &str, language: Language) -> Option<Command> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/headers/stand_ins").join(name);
    // Tests of one name run at the same time.
    let file = compilers::write(&fs::read_to_string(source).unwrap(), language);
    let options: &[&str] = if language == Language::Cpp { &["-std=c++11"] } else { &[] };
    Some(linked(compilers::of(language)?, &file, options))
}

#[track_caller]
fn ends_well(program: &mut Command, input: &str) {
    let mut child = program.stdin(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let ended = child.wait().unwrap();
    assert!(ended.success(), "the check in line {:?} has failed", ended.code());
}

#[test]
fn functions_with_sizes_write_no_more_than_fits() {
    let Some(mut program) = built("texts.c", Language::C) else { return };
    ends_well(&mut program, "");
}

#[test]
fn arrays_need_no_size_in_cpp() {
    let Some(mut program) = built("arrays.cpp", Language::Cpp) else { return };
    ends_well(&mut program, "");
}

#[test]
fn texts_are_read_into_places_of_a_size() {
    let Some(mut program) = built("scan.c", Language::C) else { return };
    ends_well(&mut program, "17\nstart\n y\nM 1 on\nlonger than fits\n");
}

#[test]
fn names_beside_the_larger_parts_are_there() {
    let Some(mut program) = built("names.c", Language::C) else { return };
    let folder = tempfile::tempdir().unwrap();
    ends_well(program.current_dir(folder.path()), "nx");
}

#[test]
fn min_and_max_go_with_the_standard_library() {
    let Some(mut program) = built("min_max.cpp", Language::Cpp) else { return };
    ends_well(&mut program, "");
}

#[test]
fn settings_are_kept_in_a_file() {
    let Some(mut program) = built("settings.c", Language::C) else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("gate.ini");
    ends_well(program.arg(&file), "");
    assert_eq!(fs::read_to_string(file).unwrap(), "[Motor]\r\nDUTY=-400\r\n");
}

#[test]
fn a_console_is_a_terminal() {
    let Some(mut program) = built("console.c", Language::C) else { return };
    let mut run = AtTerminal::start(&mut program);
    run.expect(
        "before \x1b[0;91;49mred \x1b]0;Gate1\x07\x1b[3;5H\x1b7\x1b[1;1H\x1b[J\x1b812 4 2 1\r\n",
    );
    run.expect("\x1b[?25l\x1b]0;two\x07shown\r\n\x1b[0;32;49m");
    run.press("a");
    run.expect("A goes down");
    run.press("\x1b[A");
    run.expect("up is down");
    run.press("\x1b");
    run.expect("end\r\n\x1b[0m\x1b[?25h");
    assert_eq!(run.end("").code(), Some(0));
    assert!(run.has_lines());
}

#[test]
fn without_a_terminal_nothing_is_written_for_a_console() {
    let Some(mut program) = built("console.c", Language::C) else { return };
    let mut child = program.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    // It is no key. The program may have ended already.
    let _ = child.stdin.take().unwrap().write_all(b"\x1b");
    let output = child.wait_with_output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stdout), "before red shown\n");
    assert_eq!(output.status.code(), Some(3));
}

/// A program that runs, with the next lines that it prints.
struct Running {
    child: Child,
    lines: Box<dyn Iterator<Item = String>>,
}

impl Running {
    fn start(program: &mut Command) -> Self {
        let mut child = program.stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut running = Self { child, lines: Box::new(lines.map(Result::unwrap)) };
        assert!(running.lines.next().unwrap().starts_with("begun"));
        running
    }

    /// Sends a signal.
    fn get(&self, signal: i32) {
        // SAFETY: a call without pointers, for a child that was not waited for.
        assert_eq!(unsafe { libc::kill(self.child.id() as libc::pid_t, signal) }, 0);
    }

    #[track_caller]
    fn says(&mut self, line: &str) {
        assert_eq!(self.lines.next().as_deref(), Some(line));
    }

    #[track_caller]
    fn ends_by(mut self, signal: i32) {
        assert_eq!(self.lines.next(), None);
        assert_eq!(self.child.wait().unwrap().signal(), Some(signal));
    }
}

#[test]
fn ctrl_c_is_for_the_programs_functions_and_then_ends_it() {
    let Some(mut program) = built("control.c", Language::C) else { return };
    let mut run = Running::start(&mut program);
    for _ in 0..2 {
        run.get(libc::SIGINT);
        run.says("second 0");
    }
    run.get(libc::SIGINT);
    run.says("second 0");
    run.says("first 0");
    run.ends_by(libc::SIGINT);
    // The end of the console can't be handled away.
    let mut run = Running::start(&mut program);
    run.get(libc::SIGTERM);
    run.says("second 2");
    run.ends_by(libc::SIGTERM);
    // One that waits keeps no other event from it, and puts the end off for five seconds.
    let mut waits = built("control.c", Language::C).unwrap();
    let mut run = Running::start(waits.arg("wait"));
    for _ in 0..2 {
        run.get(libc::SIGINT);
        run.says("second 0");
    }
    run.get(libc::SIGTERM);
    run.says("second 2");
    run.ends_by(libc::SIGTERM);
    let mut run = Running::start(program.arg("ignore"));
    run.get(libc::SIGINT);
    run.get(libc::SIGQUIT);
    run.says("second 1");
    run.get(libc::SIGHUP);
    run.says("second 2");
    run.ends_by(libc::SIGHUP);
}
