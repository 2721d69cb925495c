//! Lesson 8: a traffic light with a button: green, and after a press yellow, red, red and yellow, green.

use std::time::{Duration, Instant};

use ft_transfer_area::prelude::*;

/// What the traffic light shows. All but green have begun at some time.
#[derive(Clone, Copy)]
enum State {
    Green,
    Yellow(Instant),
    Red(Instant),
    RedYellow(Instant),
}

impl State {
    /// The state that follows now.
    fn next(self, pressed: bool, time: Instant) -> Self {
        let seconds = Duration::from_secs;
        match self {
            Self::Green if pressed => Self::Yellow(time),
            Self::Yellow(since) if time - since >= seconds(1) => Self::Red(time),
            Self::Red(since) if time - since >= seconds(3) => Self::RedYellow(time),
            Self::RedYellow(since) if time - since >= seconds(1) => Self::Green,
            same => same,
        }
    }

    /// Sets all three lamps.
    fn show(self, area: &mut FishX1Transfer) -> Result<(), Error> {
        let (red, yellow, green) = match self {
            Self::Green => (0, 0, DUTY_MAX),
            Self::Yellow(_) => (0, DUTY_MAX, 0),
            Self::Red(_) => (DUTY_MAX, 0, 0),
            Self::RedYellow(_) => (DUTY_MAX, DUTY_MAX, 0),
        };
        area.set_out_pwm_values(O1, red)?;
        area.set_out_pwm_values(O2, yellow)?;
        area.set_out_pwm_values(O3, green)?;
        Ok(())
    }
}

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    areas.lock()[LOCAL_IO].set_ft_motor_config(M1, false);
    areas.lock()[LOCAL_IO].set_ft_motor_config(M2, false);
    handler.begin_transfer()?;
    let mut state = State::Green;
    loop {
        let mut now = areas.wait_cycle()?;
        let time = now.arrived();
        let area = &mut now[LOCAL_IO];
        state = state.next(area.get_in_io_value_binary(I1)?, time);
        state.show(area)?;
    }
}
