//! The fault matrix of `docs/reliability_matrix.md`, on Linux. See [`matrix`].

#[cfg(target_os = "linux")]
mod matrix;
#[cfg(target_os = "linux")]
#[path = "../proxy/mod.rs"]
mod proxy;

#[cfg(target_os = "linux")]
fn main() -> std::process::ExitCode {
    matrix::main()
}

#[cfg(not(target_os = "linux"))]
fn main() {
    println!("skipped: the fault matrix needs Linux");
}
