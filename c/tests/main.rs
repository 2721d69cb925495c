//! The tests in one program, so that they are linked once, and those that wait for machines wait beside each other.
//! The names decide which begin first: the stations of `examples` take longest.

mod examples;
mod headers;
mod kits;
mod tables;
#[cfg(unix)]
mod terminal;
mod tx_run;

use std::path::Path;
use std::process::Command;

/// The compilers to try: these, and on Windows the one of those who have no other.
fn compilers_of(names: &[&'static str], zig: &'static str) -> Vec<&'static str> {
    names.iter().copied().chain(cfg!(windows).then_some(zig)).collect()
}

/// A command of a compiler, which may be named by two words.
fn compiler(named: &str) -> Command {
    let mut words = named.split(' ');
    let mut command = Command::new(words.next().unwrap_or_default());
    command.args(words);
    command
}

/// Whether a compiler is here.
fn is_here(named: &str) -> bool {
    compiler(named).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Has a compiler only check this file. zig can't do that without making an object.
fn check_only(command: &mut Command, file: &Path) {
    if cfg!(windows) {
        command.arg("-c").arg("-o").arg(file.with_extension("o"));
    } else {
        command.arg("-fsyntax-only");
    }
}

/// Says that a test needs these compilers. A test that has checked nothing must not look like one that has passed.
fn miss_compilers(names: &str) {
    assert!(
        std::env::var_os("NO_COMPILER").is_some(),
        "there is no {names}, which this test needs; with NO_COMPILER=1 it passes without a check"
    );
    eprintln!("skipped: there is no {names}");
}

/// In place of the tests in modules that are compiled on Unix only.
#[cfg(not(unix))]
mod on_unix {
    #[test]
    #[ignore = "the tests send signals to the programs of the kits"]
    fn kits_ends() {}

    #[test]
    #[ignore = "programs that handle signals"]
    fn kits_handlers() {}

    #[test]
    #[ignore = "no make, CMake and pkg-config are expected there"]
    fn kits_projects() {}

    #[test]
    #[ignore = "the tests send signals to tx_run"]
    fn tx_run_signals() {}

    #[test]
    #[ignore = "what zig compiles is kept by zig"]
    fn tx_run_cache_and_large() {}

    #[test]
    #[ignore = "terminals and pipes that are full differ there"]
    fn tx_run_terminal_and_unread() {}

    #[test]
    #[ignore = "the headers for other systems replace those of Windows"]
    fn headers_for_other_systems() {}
}
