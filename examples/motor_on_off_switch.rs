//! Motor on/off switch: M1 runs while I1 is pressed, on the master and on the first extension.
//! A port of the kit's sample MotorOnOffSwitch.
//!
//! Wiring, the same on both controllers: a push button on I1 (contacts 1 and 3), an ultrasonic
//! sensor on I2, a motor on M1. What is missing on the table reads as not connected.
//!
//! ```text
//! cargo run --example motor_on_off_switch                  # a simulated TXT with one extension
//! cargo run --example motor_on_off_switch -- 192.168.7.2   # a TXT on USB
//! cargo run --example motor_on_off_switch -- --seconds 60 192.168.8.2
//! cargo run --example motor_on_off_switch -- 127.0.0.1:65000   # the program simulated_txt
//! ```
//!
//! Every third exchange the inputs, counters and outputs of both controllers are printed. Ctrl-C
//! stops the motors and goes offline before the program exits.

use std::error::Error;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

use ft_transfer_area::simulator::SimulatedTxt;
use ft_transfer_area::transfer_area::{InputMode, UniConfig, DUTY_MAX, LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::{TransferAreaComHandler, PORT};

const USAGE: &str = "usage: motor_on_off_switch [--seconds N] [HOST[:PORT]]";

/// The simulated buttons change every half second: 50 exchanges of 10 ms.
const EXCHANGES_PER_CHANGE: u64 = 50;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let Some(Arguments { host, seconds }) = Arguments::parse()? else {
        println!("{USAGE}");
        return Ok(());
    };
    let interrupted = Arc::new(AtomicBool::new(false));
    ctrlc::set_handler({
        let interrupted = Arc::clone(&interrupted);
        move || interrupted.store(true, Ordering::Relaxed)
    })?;

    // Without a host, a simulated TXT takes the controller's place for as long as this lives.
    let simulated = if host.is_none() { Some(simulated_txt()?) } else { None };
    let (host, port) = match (&host, &simulated) {
        (None, Some(txt)) => ("127.0.0.1", txt.port()),
        (host, _) => host_and_port(host.as_deref().unwrap_or_default())?,
    };

    // Create the communication handler with its transfer areas: the master and one extension.
    let mut handler = TransferAreaComHandler::builder(host).port(port).areas(2).build()?;

    // Configure I2 of master and extension to ultrasonic.
    for area in handler.lock().iter_mut() {
        area.config.uni[1] = UniConfig::analog(InputMode::Ultrasonic);
        area.state.config_id += 1;
    }

    handler.begin_transfer()?;
    println!(
        "{} with firmware {} at {host}:{port}",
        handler.device_name().unwrap_or_default(),
        handler.version().map(|version| version.to_string()).unwrap_or_default()
    );

    // Loop for the given time, or until Ctrl-C.
    let mut transfers = 0_u64;
    while handler.lock()[LOCAL_IO].timer.timer_1s < seconds && !interrupted.load(Ordering::Relaxed)
    {
        // Wait for the inputs of the next exchange. It comes in every 10 ms.
        let mut areas = handler.wait_cycle()?;

        // Set M1 depending on I1. For the other direction, set duty[1] instead of duty[0].
        for index in [LOCAL_IO, REMOTE_IO_1] {
            let pressed = areas[index].input.uni[0] != 0;
            areas[index].output.duty[0] = if pressed { DUTY_MAX } else { 0 };
        }

        // Print after the guard is dropped: the console is slow, and the outputs leave then.
        let lines =
            (transfers % 3 == 0).then(|| format!("{}\n{}", areas[LOCAL_IO], areas[REMOTE_IO_1]));
        drop(areas);
        if let Some(lines) = lines {
            println!("{lines}");
        }
        transfers += 1;
    }

    // Stop the motors and go offline.
    let statistics = handler.statistics();
    handler.end_transfer()?;

    // This should be around 100 for each second.
    println!("{transfers} transfers done");
    println!(
        "{} cycles of {:.1} to {:.1} ms, {} late reactions, {} configurations sent",
        statistics.cycles,
        statistics.shortest_cycle.as_secs_f64() * 1e3,
        statistics.longest_cycle.as_secs_f64() * 1e3,
        statistics.late_reactions,
        statistics.config_updates,
    );
    Ok(())
}

/// A simulated TXT with one extension, whose I1 is pressed and released every half second.
fn simulated_txt() -> Result<SimulatedTxt, ft_transfer_area::Error> {
    println!("No host given, so this is a simulated TXT with one extension.");
    SimulatedTxt::builder()
        .extensions(1)
        .on_exchange(|machine| {
            let pressed = machine.exchanges() / EXCHANGES_PER_CHANGE % 2 == 1;
            // Something comes nearer, from 60 cm to 11 cm, and again.
            let distance = 60 - (machine.exchanges() % 50) as i16;
            for controller in &mut machine.controllers {
                controller.uni[0] = i16::from(pressed);
                controller.uni[1] = distance;
            }
        })
        .start()
}

/// Host and port of `HOST[:PORT]`. An IPv6 address has colons of its own, and no port here.
fn host_and_port(text: &str) -> Result<(&str, u16), String> {
    match text.split_once(':') {
        Some((host, port)) if !port.contains(':') => match port.parse() {
            Ok(port) => Ok((host, port)),
            Err(_) => Err(format!("{port:?} in {text:?} is no port\n{USAGE}")),
        },
        _ => Ok((text, PORT)),
    }
}

struct Arguments {
    host: Option<String>,
    seconds: u16,
}

impl Arguments {
    /// The command line, or `None` when it asks for help.
    fn parse() -> Result<Option<Self>, Box<dyn Error>> {
        use lexopt::prelude::{Long, Short, Value, ValueExt};

        let mut arguments = Self { host: None, seconds: 10 };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("seconds") => arguments.seconds = parser.value()?.parse()?,
                Long("help") | Short('h') => return Ok(None),
                Value(host) if arguments.host.is_none() => arguments.host = Some(host.string()?),
                other => return Err(format!("{}\n{USAGE}", other.unexpected()).into()),
            }
        }
        Ok(Some(arguments))
    }
}
