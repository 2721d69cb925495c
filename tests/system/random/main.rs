//! Random programs against a specification, on Linux. See [`programs`], and `docs/random_programs.md`.

#[cfg(target_os = "linux")]
mod programs;
#[cfg(target_os = "linux")]
#[path = "../proxy/mod.rs"]
#[allow(dead_code, reason = "the fault matrix uses all of it")]
mod proxy;

#[cfg(target_os = "linux")]
fn main() -> std::process::ExitCode {
    programs::main()
}

#[cfg(not(target_os = "linux"))]
fn main() {
    println!("skipped: random programs count threads as only Linux shows them");
}
