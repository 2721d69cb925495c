//! The fault matrix of `docs/reliability_matrix.md`, on Linux and Windows. See [`matrix`].

#[cfg(any(target_os = "linux", windows))]
mod matrix;
#[cfg(any(target_os = "linux", windows))]
#[path = "../proxy/mod.rs"]
mod proxy;
#[cfg(any(target_os = "linux", windows))]
#[path = "../still/mod.rs"]
#[allow(dead_code, reason = "the random programs use all of it")]
mod still;

#[cfg(any(target_os = "linux", windows))]
fn main() -> std::process::ExitCode {
    matrix::main()
}

#[cfg(not(any(target_os = "linux", windows)))]
fn main() {
    println!("skipped: the fault matrix needs Linux or Windows");
}
