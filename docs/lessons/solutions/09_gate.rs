//! Lesson 9: a gate with end switches, a light barrier, a button that opens it, and a stop button.

use std::time::{Duration, Instant};

use ft_transfer_area::prelude::*;

#[derive(Clone, Copy)]
enum State {
    /// Closed, or stopped on the way.
    Stopped,
    Opens,
    /// Since then.
    Open(Instant),
    Closes,
}

/// What the inputs say.
struct Inputs {
    closed: bool,
    open: bool,
    button: bool,
    blocked: bool,
    stop: bool,
}

impl Inputs {
    fn read(area: &FishX1Transfer) -> Result<Self, Error> {
        Ok(Self {
            closed: area.get_in_io_value_binary(I1)?,
            open: area.get_in_io_value_binary(I2)?,
            button: area.get_in_io_value_binary(I3)?,
            // There is light while nothing is in the way.
            blocked: !area.get_in_io_value_binary(I4)?,
            // Normally closed: it is open while it is pressed.
            stop: !area.get_in_io_value_binary(I5)?,
        })
    }
}

impl State {
    fn next(self, inputs: &Inputs, time: Instant) -> Self {
        match self {
            // This comes first, so it works in every state.
            _ if inputs.stop => Self::Stopped,
            Self::Stopped if inputs.button => Self::Opens,
            Self::Opens if inputs.open => Self::Open(time),
            Self::Open(since) if time - since >= Duration::from_secs(2) => Self::Closes,
            Self::Closes if inputs.blocked => Self::Opens,
            Self::Closes if inputs.closed => Self::Stopped,
            same => same,
        }
    }

    fn direction(self) -> Direction {
        match self {
            Self::Opens => Direction::Cw,
            Self::Closes => Direction::Ccw,
            Self::Stopped | Self::Open(_) => Direction::Halt,
        }
    }
}

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    for input in [I1, I2, I3, I4, I5] {
        areas.lock()[LOCAL_IO].set_ft_uni_config(input, InputMode::Resistance, true);
    }
    handler.begin_transfer()?;
    let mut state = State::Stopped;
    loop {
        let mut now = areas.wait_cycle()?;
        let time = now.arrived();
        let area = &mut now[LOCAL_IO];
        state = state.next(&Inputs::read(area)?, time);
        area.set_out_motor_values(M1, DUTY_MAX, state.direction())?;
    }
}
