//! What a C program costs, beside one in Rust: the processor's time of the whole process for a cycle, and for a call
//! of `PrgTic`. And how many of 1000 changes of an input, one in each cycle of 10 ms, are answered in the next
//! request.
//!
//! ```text
//! cargo bench --package ft-transfer-area-c --bench c_programs
//! cargo bench --package ft-transfer-area-c --bench c_programs -- PrgTic
//! ```
//!
//! The simulated TXT is another process, so that its time is not counted.

#[cfg(unix)]
mod ways;

#[cfg(unix)]
fn main() {
    let is_given = |word: &str| std::env::args().any(|argument| argument == word);
    // The simulated TXT of this program is given its own word.
    if is_given(ways::TXT) {
        ways::serve();
    } else if is_given("--bench") {
        ways::compare();
    }
    // `cargo test --benches` only asks whether it compiles.
}

#[cfg(not(unix))]
fn main() {
    println!("skipped: the processor's time is read as Unix systems tell it");
}
