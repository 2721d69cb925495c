//! A simulated TXT as a program, for clients in any language.
//!
//! ```text
//! cargo run --example simulated_txt                            # ports 65000 to 65002
//! cargo run --example simulated_txt -- --port 0 --extensions 1 # free ports, one extension
//! cargo run --example simulated_txt -- --world car             # another world than the default one
//! cargo run --example simulated_txt -- --world src/simulator/worlds/everything.toml
//! cargo run --example simulated_txt -- --fault crc@exchange:100
//! cargo run --example simulated_txt -- --help
//! ```
//!
//! It prints where it listens, one port per line, and serves one client after another until Ctrl-C.
//! Lines that you type while it runs change its inputs: `I3 1` presses a button. It warns about clients
//! that do something wrong. With `RUST_LOG=info` it also tells who connects and what clients do.
//! `docs/simulator.md` describes everything.

mod options;
mod typed;

use std::error::Error;
use std::io;
use std::process::ExitCode;
use std::sync::{mpsc, Arc, Weak};
use std::thread;

use env_logger::Env;
use ft_transfer_area::simulator::{SimulatedTxt, SimulatedTxtBuilder};

use options::HELP;

fn main() -> ExitCode {
    env_logger::Builder::from_env(Env::default().default_filter_or("warn")).init();
    match options::from_env() {
        Ok(None) => {
            print!("{HELP}");
            ExitCode::SUCCESS
        }
        Ok(Some(txt)) => match run(txt) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{error}");
                ExitCode::FAILURE
            }
        },
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(txt: SimulatedTxtBuilder) -> Result<(), Box<dyn Error>> {
    let (sender, interrupted) = mpsc::channel();
    ctrlc::set_handler(move || {
        // Without a receiver the program is already ending.
        let _ = sender.send(());
    })?;

    let txt = Arc::new(txt.start()?);
    println!("main 127.0.0.1:{}", txt.port());
    println!("camera 127.0.0.1:{}", txt.camera_port());
    println!("i2c 127.0.0.1:{}", txt.i2c_port());

    let typed = Arc::downgrade(&txt);
    thread::Builder::new().name(String::from("typed")).spawn(move || read_lines(&typed))?;
    // Clients are served while this waits. The sender lives as long as the program.
    let _ = interrupted.recv();
    Ok(())
}

/// Carries out typed lines. Without a keyboard, or at the end of the input, the program just goes on.
fn read_lines(txt: &Weak<SimulatedTxt>) {
    for line in io::stdin().lines() {
        let (Ok(line), Some(txt)) = (line, txt.upgrade()) else { return };
        if line.trim().is_empty() {
            continue;
        }
        if let Err(sentence) = txt.with_machine(|machine| typed::carry_out(&line, machine)) {
            eprintln!("{sentence}\n{}", typed::HELP);
        }
    }
}
