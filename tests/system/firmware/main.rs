//! The maker's firmware as a partner: its program, under emulation, serves our programs, and drives our worlds.
//!
//! `.ci/firmware` makes the folder with the program, and runs this in a network of its own, as root. Without the folder
//! nothing is run here.

#[cfg(target_os = "linux")]
mod board;
#[cfg(target_os = "linux")]
mod controller;
#[cfg(target_os = "linux")]
mod partner;

#[cfg(target_os = "linux")]
#[path = "../examples"]
mod examples {
    pub(crate) mod checks;
    #[allow(dead_code, reason = "the tests of everything use all of it")]
    pub(crate) mod run;
    pub(crate) mod sample;
}
/// A page of `txt panel`, from the tests of `txt`.
#[cfg(target_os = "linux")]
#[path = "."]
mod panel {
    #[path = "../../../tools/tests/panel/page.rs"]
    #[allow(dead_code, reason = "the tests of the panel use all of it")]
    pub(crate) mod page;

    /// Longer than anything takes on a busy machine; only a failing check waits this long.
    const LIMIT: std::time::Duration = std::time::Duration::from_secs(60);
}
#[cfg(target_os = "linux")]
#[path = "../program/mod.rs"]
#[allow(dead_code, reason = "the tests of everything use all of it")]
mod program;
#[cfg(target_os = "linux")]
#[path = "../../firmware/session.rs"]
#[allow(dead_code, reason = "the program that drives any controller uses all of it")]
mod session;

#[cfg(target_os = "linux")]
fn main() -> std::process::ExitCode {
    partner::main()
}

#[cfg(not(target_os = "linux"))]
fn main() {
    println!("skipped: the maker's firmware needs Linux");
}
