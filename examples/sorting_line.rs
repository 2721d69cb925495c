//! A sorting line: a belt carries discs past a colour sensor, and air blows each one into the storage of its colour.
//!
//! Wiring: the belt's motor on M1 with its pulse switch on C1, phototransistors on I1 (entry), I3 (before the
//! valves) and I6, I7, I8 (storages of the white, red and blue discs), the colour sensor on I2, the valves on O5,
//! O6, O7, the compressor on O8. The belt runs with M1 counter-clockwise.
//!
//! ```text
//! cargo run --example sorting_line                  # a simulated TXT
//! cargo run --example sorting_line -- 192.168.7.2   # a TXT on USB
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! Each step of a disc is a state, and each answer of the loop leads from one to the next. The simulated line gets
//! three discs and ends; a real one runs until Ctrl-C. `txt simulate --world sorting_line --show` shows it.

use std::env;
use std::time::{Duration, Instant};

use ft_transfer_area::prelude::*;
use ft_transfer_area_simulator::world::{Piece, Script, ScriptEvent, World};
use ft_transfer_area_simulator::SimulatedTxt;

/// Without a disc the colour sensor measures more, in mV.
const NOTHING: i16 = 2000;
/// How long a valve is open.
const BLOW: Duration = Duration::from_millis(200);

#[derive(Clone, Copy, Debug)]
enum Colour {
    White,
    Red,
    Blue,
}

impl Colour {
    /// By the lowest voltage of the sensor while the disc passed.
    fn of(millivolts: i16) -> Self {
        match millivolts {
            ..940 => Self::White,
            940..1430 => Self::Red,
            1430.. => Self::Blue,
        }
    }

    /// Its valve, how many changes of C1 behind I3 that is, and the sensor of its storage.
    fn place(self) -> (Output, u16, Input) {
        match self {
            Self::White => (O5, 5, I6),
            Self::Red => (O6, 15, I7),
            Self::Blue => (O7, 26, I8),
        }
    }
}

/// What the disc on the belt does.
#[derive(Clone, Copy, Debug)]
enum State {
    /// There is none.
    Waits,
    /// It passes the colour sensor.
    Measures { lowest: i16 },
    /// It has passed I3. Since then the pulse switch has changed so often, last to this level.
    Travels { colour: Colour, changes: u16, level: bool },
    /// Its valve is open since then.
    Leaves { colour: Colour, since: Instant },
    /// It falls into its storage.
    Falls { colour: Colour },
}

impl State {
    /// One answer of the loop: what the sensors say, what the outputs do, and what comes next.
    fn answer(self, area: &mut FishX1Transfer, time: Instant) -> Result<Self, Error> {
        // The counter counts only when the level rises; that is too coarse here.
        let now = area.get_in_cnt_state(C1);
        // There is no light while a disc is before the phototransistor.
        let has_disc = |input| area.get_in_io_value_binary(input).map(|light| !light);
        let next = match self {
            Self::Waits if has_disc(I1)? => Self::Measures { lowest: NOTHING },
            Self::Measures { lowest } if has_disc(I3)? => {
                Self::Travels { colour: Colour::of(lowest), changes: 0, level: now }
            }
            Self::Measures { lowest } => {
                Self::Measures { lowest: lowest.min(area.get_in_io_value_analogue(I2)?) }
            }
            Self::Travels { colour, changes, .. } if changes >= colour.place().1 => {
                Self::Leaves { colour, since: time }
            }
            Self::Travels { colour, changes, level } if level != now => {
                Self::Travels { colour, changes: changes + 1, level: now }
            }
            Self::Leaves { colour, since } if time - since >= BLOW => Self::Falls { colour },
            Self::Falls { colour } if has_disc(colour.place().2)? => Self::Waits,
            Self::Waits | Self::Travels { .. } | Self::Leaves { .. } | Self::Falls { .. } => self,
        };
        let runs = !matches!(next, Self::Waits | Self::Falls { .. });
        let direction = if runs { Direction::Ccw } else { Direction::Halt };
        area.set_out_motor_values(M1, DUTY_MAX, direction)?;
        let open =
            if let Self::Leaves { colour, .. } = next { Some(colour.place().0) } else { None };
        for valve in [O5, O6, O7] {
            area.set_out_pwm_values(valve, if open == Some(valve) { DUTY_MAX } else { 0 })?;
        }
        area.set_out_pwm_values(O8, if runs { DUTY_MAX } else { 0 })?;
        Ok(next)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Without an address, a simulated TXT runs as long as the second value lives.
    let (address, simulated) = controller()?;
    // The belt stops when the loop below hangs for two seconds.
    let builder = TransferAreaComHandler::builder(address).watchdog(Duration::from_secs(2));
    let handler = builder.build()?;
    let areas = handler.areas();
    {
        let area = &mut areas.lock()[LOCAL_IO];
        for input in [I1, I3, I6, I7, I8] {
            area.set_ft_uni_config(input, InputMode::Resistance, true);
        }
        area.set_ft_uni_config(I2, InputMode::Voltage, false);
        // Valves and compressor: the terminals of M3 and M4 are single outputs.
        area.set_ft_motor_config(M3, false);
        area.set_ft_motor_config(M4, false);
    }
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, which stops the motors.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    let mut state = State::Waits;
    let mut sorted = 0;
    while simulated.is_none() || sorted < 3 {
        let mut now = match areas.wait_cycle() {
            Err(Error::NotStarted) => break, // Ctrl-C
            cycle => cycle?,
        };
        let time = now.arrived();
        let before = state;
        state = before.answer(&mut now[LOCAL_IO], time)?;
        // Printing is slow, and the outputs are sent after the guard is dropped.
        drop(now);
        match (before, state) {
            (State::Waits, State::Measures { .. }) => println!("A disc comes."),
            (State::Measures { .. }, State::Travels { colour, .. }) => {
                println!("  It is {colour:?}.")
            }
            (State::Falls { colour }, State::Waits) => {
                sorted += 1;
                println!("  It is in the storage at {}.", colour.place().2);
            }
            _ => {}
        }
    }
    // Stops the belt, closes the valves and returns the error, if one has ended the transfer.
    handler.end_transfer()?;
    Ok(())
}

/// The controller on the command line, or a simulated TXT, which runs as long as the second value lives.
fn controller() -> Result<(String, Option<SimulatedTxt>), ft_transfer_area_simulator::Error> {
    if let Some(address) = env::args().nth(1) {
        return Ok((address, None));
    }
    println!("No address is given, so this is a simulated sorting line. It gets three discs.");
    let discs = [(1.0, Piece::White), (6.0, Piece::Red), (12.0, Piece::Blue)];
    let put = |script: Script, (at, disc)| script.event(ScriptEvent::put(at, disc, "entry"));
    let script = discs.into_iter().fold(Script::default(), put);
    let world = World::shipped("sorting_line")?.script(script);
    let txt = SimulatedTxt::builder().world(world).start()?;
    Ok((txt.address().to_string(), Some(txt)))
}
