//! Random programs against a specification, on Linux and Windows. See [`programs`], and `docs/random_programs.md`.

#[cfg(any(target_os = "linux", windows))]
mod programs;
#[cfg(any(target_os = "linux", windows))]
#[path = "../proxy/mod.rs"]
#[allow(dead_code, reason = "the fault matrix uses all of it")]
mod proxy;
#[cfg(any(target_os = "linux", windows))]
#[path = "../still/mod.rs"]
mod still;

#[cfg(any(target_os = "linux", windows))]
fn main() -> std::process::ExitCode {
    programs::main()
}

#[cfg(not(any(target_os = "linux", windows)))]
fn main() {
    println!("skipped: random programs need Linux or Windows");
}
