//! Lesson 10: a sorting line. White discs are blown into their storage, the others run off the end.

use std::time::Duration;

use ft_transfer_area::prelude::*;

/// The colour sensor measures more without a disc, and less for a white one, in mV.
const NOTHING: i16 = 2000;
const WHITE: i16 = 940;
/// How many pulses the valve is behind I3.
const TO_VALVE: u16 = 8;

/// What the disc on the belt does.
#[derive(Clone, Copy)]
enum State {
    /// There is none.
    Waits,
    /// It passes the colour sensor.
    Measures { lowest: i16 },
    /// It is white and has passed I3, when C1 had this count.
    Travels { from: u16 },
    /// The valve is open.
    Blows,
    /// It is not white and runs off the end.
    RunsOff,
}

impl State {
    fn next(self, area: &FishX1Transfer) -> Result<Self, Error> {
        // There is no light while a disc is in the light barrier.
        let has_disc = |input| area.get_in_io_value_binary(input).map(|light| !light);
        let pulses = area.get_in_cnt_count(C1);
        Ok(match self {
            Self::Waits if has_disc(I1)? => Self::Measures { lowest: NOTHING },
            Self::Measures { lowest } if !has_disc(I3)? => {
                Self::Measures { lowest: lowest.min(area.get_in_io_value_analogue(I2)?) }
            }
            Self::Measures { lowest } if lowest < WHITE => Self::Travels { from: pulses },
            Self::Measures { .. } => Self::RunsOff,
            Self::Travels { from } if pulses.wrapping_sub(from) >= TO_VALVE => Self::Blows,
            Self::Blows if has_disc(I6)? => Self::Waits,
            Self::RunsOff if has_disc(I7)? => Self::Waits,
            same => same,
        })
    }

    /// Belt, valve and compressor in this state.
    fn show(self, area: &mut FishX1Transfer) -> Result<(), Error> {
        let runs = !matches!(self, Self::Waits);
        let blows = matches!(self, Self::Blows);
        let compresses = matches!(self, Self::Travels { .. } | Self::Blows);
        let direction = if runs { Direction::Cw } else { Direction::Halt };
        area.set_out_motor_values(M1, DUTY_MAX, direction)?;
        area.set_out_pwm_values(O3, if blows { DUTY_MAX } else { 0 })?;
        area.set_out_pwm_values(O4, if compresses { DUTY_MAX } else { 0 })?;
        Ok(())
    }
}

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    {
        let area = &mut areas.lock()[LOCAL_IO];
        for input in [I1, I3, I6, I7] {
            area.set_ft_uni_config(input, InputMode::Resistance, true);
        }
        area.set_ft_uni_config(I2, InputMode::Voltage, false);
        // O3 and O4 are two single outputs, no motor M2.
        area.set_ft_motor_config(M2, false);
    }
    handler.begin_transfer()?;
    let mut state = State::Waits;
    loop {
        let mut now = areas.wait_cycle()?;
        let area = &mut now[LOCAL_IO];
        state = state.next(area)?;
        state.show(area)?;
    }
}
