//! Programs whose signal handlers call the library.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::thread;
use std::time::Duration;

use ft_transfer_area_simulator::SimulatedTxt;

use super::support::{compile, simulated, wait_duty, wait_stopped, Running, SIGNALS};

/// The program for both libraries: ftMscLib and KeLib.
fn programs() -> &'static [PathBuf] {
    static PROGRAMS: OnceLock<Vec<PathBuf>> = OnceLock::new();
    let source = include_str!("programs/handlers.cpp");
    PROGRAMS.get_or_init(|| {
        let pc = compile("", "c++11", &format!("#define PC\n{source}"), "handlers_pc");
        let txt = compile("txt", "c++11", source, "handlers_txt");
        pc.into_iter().chain(txt).collect()
    })
}

/// Starts a program, and sends it SIGINT some time after its motor turns.
fn interrupted(program: &Path, how: &str, after: u64) -> (SimulatedTxt, Running) {
    let txt = simulated().start().unwrap();
    let mut running = Running::with(program, &txt, &[how]);
    running.expect("turns");
    wait_duty(&txt, 0, 512);
    thread::sleep(Duration::from_micros(after));
    running.signal(SIGNALS[0]);
    (txt, running)
}

/// A handler that waits for a lock of its own thread would hang, with the motor on.
#[test]
fn a_handler_may_call_the_library_wherever_the_program_is() {
    for program in programs() {
        let (txt, running) = interrupted(program, "stop", 0);
        running.end().well();
        wait_stopped(&txt);
    }
}

#[test]
fn a_handler_may_stop_the_motors_and_end_the_program() {
    for program in programs() {
        thread::scope(|scope| {
            for part in 0..2 {
                scope.spawn(move || {
                    for number in 0..6 {
                        let (txt, running) = interrupted(program, "exit", part * 500 + number * 70);
                        let ended = running.end();
                        assert_eq!(ended.code, Some(3), "{}", ended.err);
                        wait_stopped(&txt);
                    }
                });
            }
        });
    }
}

/// The C library allows no such call there, but this library's memory is its own.
#[test]
fn a_handler_may_do_so_when_it_has_interrupted_malloc() {
    for program in programs() {
        for number in 0..8 {
            let how = ["stop while allocating", "exit while allocating"][number as usize % 2];
            let (txt, running) = interrupted(program, how, number * 70);
            let ended = running.end();
            assert_eq!(ended.code, Some(3), "{how}: {}", ended.err);
            wait_stopped(&txt);
        }
    }
}

/// In `malloc` a handler must not begin to wait: the first time a thread does, values of it are registered, with memory
/// of the C library.
#[cfg(target_os = "linux")]
#[test]
fn a_handler_that_waits_first_needs_no_memory_of_the_c_library() {
    let source = include_str!("programs/first_wait.cpp");
    let Some(program) = compile("", "c++11", source, "first_wait") else { return };
    let txt = simulated().start().unwrap();
    let ended = Running::with(&program, &txt, &[]).end();
    assert_eq!(ended.code, Some(3), "{}", ended.err);
    wait_stopped(&txt);
}

/// Such a handler runs within the call that has used the pointer.
#[cfg(target_os = "linux")]
#[test]
fn a_handler_for_a_wrong_pointer_may_make_the_same_call() {
    let source = include_str!("programs/wrong_pointer.cpp");
    let Some(program) = compile("", "c++11", source, "wrong_pointer") else { return };
    let txt = simulated().start().unwrap();
    let ended = Running::with(&program, &txt, &[]).end();
    assert_eq!(ended.code, Some(3), "{}", ended.err);
    wait_stopped(&txt);
}
