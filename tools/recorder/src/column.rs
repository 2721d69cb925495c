//! Values by the names of their terminals, for tables and plots.

use std::fmt;
use std::str::FromStr;

use ft_transfer_area::transfer_area::MAX_AREAS;
use ft_transfer_area::tx::{Counter, Input, Motor, Output};
use ft_transfer_area::FishX1Transfer;

use crate::error::Error;

/// The [unit](Column::unit) of an input whose mode a recording does not know.
pub const UNKNOWN_UNIT: &str = "unknown unit";

/// A value of a cycle, by the name of its terminal: `I1` to `I8`, `C1` to `C4`, `M1` to `M4`, `O1` to `O8`, and
/// `E1.I1` for an extension.
///
/// ```
/// use ft_transfer_area::prelude::*;
/// use ft_transfer_area_recorder::Column;
///
/// # fn main() -> Result<(), ft_transfer_area_recorder::Error> {
/// let column: Column = "M1".parse()?;
/// let mut areas = [FishX1Transfer::default()];
/// areas[0].output.duty[O2] = 512;
/// assert_eq!(column.value(&areas), Some(-512));
/// assert_eq!("e1.c2".parse::<Column>()?.to_string(), "E1.C2");
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Column {
    area: usize,
    terminal: Terminal,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Terminal {
    Input(Input),
    Counter(Counter),
    Motor(Motor),
    Output(Output),
}

impl Column {
    /// The inputs, counters and motors of this many areas, in the order of a table.
    pub fn of_areas(areas: usize) -> Vec<Self> {
        let mut all = Self::all_of_areas(areas);
        all.retain(|column| !matches!(column.terminal, Terminal::Output(_)));
        all
    }

    /// The same with the single outputs of each area after its motors.
    pub fn all_of_areas(areas: usize) -> Vec<Self> {
        let of_area = |area| {
            let inputs = Input::ALL.map(Terminal::Input).into_iter();
            let counters = Counter::ALL.map(Terminal::Counter);
            let motors = Motor::ALL.map(Terminal::Motor);
            let outputs = Output::ALL.map(Terminal::Output);
            let terminals = inputs.chain(counters).chain(motors).chain(outputs);
            terminals.map(move |terminal| Self { area, terminal })
        };
        (0..areas.min(MAX_AREAS)).flat_map(of_area).collect()
    }

    /// Whether it is there with the configuration of a cycle, where M1 is either a motor or O1 and O2. Inputs and
    /// counters always are.
    pub fn is_configured(&self, areas: &[FishX1Transfer]) -> bool {
        let (motor, is_output) = match self.terminal {
            Terminal::Input(_) | Terminal::Counter(_) => return true,
            Terminal::Motor(motor) => (motor, false),
            Terminal::Output(output) => (output.motor(), true),
        };
        areas.get(self.area).is_some_and(|area| (area.config.motor[motor] == 0) == is_output)
    }

    /// Its value in the areas of a cycle; `None` if the area is not there, or is that of an extension that was not
    /// connected: its area has what was before. Motors are −512..=512, negative for backwards; counters are
    /// 0..=65535.
    pub fn value(&self, areas: &[FishX1Transfer]) -> Option<i32> {
        let area = areas.get(self.area)?;
        if self.area > 0 && areas[0].state.io_slave_alive[self.area - 1] == 0 {
            return None;
        }
        let duty = |index: usize| i32::from(area.output.duty[index]);
        Some(match self.terminal {
            Terminal::Input(input) => area.input.uni[input.index()].into(),
            // It is negative beyond 32767.
            Terminal::Counter(counter) => i32::from(area.input.counter[counter.index()] as u16),
            Terminal::Motor(motor) => duty(2 * motor.index()) - duty(2 * motor.index() + 1),
            Terminal::Output(output) => duty(output.index()),
        })
    }

    /// The unit of its value with the configuration of a cycle: `mV`, `Ω`, `cm`, `pulses`, `duty`, nothing for
    /// an input that reports 0 or 1, or [`UNKNOWN_UNIT`] for one whose mode the recording does not know.
    pub fn unit(&self, areas: &[FishX1Transfer]) -> &'static str {
        match self.terminal {
            Terminal::Input(input) => areas.get(self.area).map_or("", |area| {
                let config = area.config.uni[input.index()];
                let is_known = config.is_digital() || config.input_mode().is_some();
                if is_known {
                    config.unit()
                } else {
                    UNKNOWN_UNIT
                }
            }),
            Terminal::Counter(_) => "pulses",
            Terminal::Motor(_) | Terminal::Output(_) => "duty",
        }
    }

    /// The universal input that it is, if it is one.
    pub fn input(&self) -> Option<Input> {
        match self.terminal {
            Terminal::Input(input) => Some(input),
            Terminal::Counter(_) | Terminal::Motor(_) | Terminal::Output(_) => None,
        }
    }

    /// The index of its area: 0 the master, 1 the first extension.
    pub fn area(&self) -> usize {
        self.area
    }
}

impl fmt::Display for Column {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.area > 0 {
            write!(f, "E{}.", self.area)?;
        }
        match self.terminal {
            Terminal::Input(input) => input.fmt(f),
            Terminal::Counter(counter) => counter.fmt(f),
            Terminal::Motor(motor) => motor.fmt(f),
            Terminal::Output(output) => output.fmt(f),
        }
    }
}

impl FromStr for Column {
    type Err = Error;

    fn from_str(given: &str) -> Result<Self, Error> {
        let name = given.to_uppercase();
        let (area, terminal) = match name.split_once('.') {
            Some(("TXT", terminal)) => (Some(0), terminal),
            Some((area, terminal)) => (area.strip_prefix('E').and_then(extension), terminal),
            None => (Some(0), &*name),
        };
        let terminal = terminal_of(terminal);
        let column = area.zip(terminal).map(|(area, terminal)| Self { area, terminal });
        column.ok_or_else(|| Error::NoColumn { name: given.to_owned() })
    }
}

fn extension(number: &str) -> Option<usize> {
    number.parse().ok().filter(|number| (1..MAX_AREAS).contains(number))
}

fn terminal_of(name: &str) -> Option<Terminal> {
    let inputs = Input::ALL.map(Terminal::Input).into_iter();
    let others = Counter::ALL.map(Terminal::Counter);
    let outputs = Output::ALL.map(Terminal::Output);
    let motors = Motor::ALL.map(Terminal::Motor);
    let mut all = inputs.chain(others).chain(outputs).chain(motors);
    all.find(|terminal| Column { area: 0, terminal: *terminal }.to_string() == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extension_that_is_not_connected_has_no_values() {
        let mut areas = [FishX1Transfer::default(); 3];
        areas[0].state.io_slave_alive[1] = 1;
        areas[1].input.uni[0] = 1;
        let values = ["I1", "E1.I1", "E1.M1", "E2.I1", "E3.I1"]
            .map(|name| name.parse::<Column>().unwrap().value(&areas));
        assert_eq!(values, [Some(0), None, None, Some(0), None]);
    }

    #[test]
    fn every_column_has_its_name() {
        let columns = Column::of_areas(2);
        assert_eq!(columns.len(), 32);
        for column in columns {
            assert_eq!(column.to_string().parse::<Column>().unwrap(), column);
        }
        assert_eq!("txt.o8".parse::<Column>().unwrap().to_string(), "O8");
        for wrong in
            ["", "I0", "I9", "C5", "M5", "O9", "E0.I1", "E9.I1", "E1", "E1.", "X1.I1", "I1.E1"]
        {
            assert!(wrong.parse::<Column>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_pair_is_a_motor_or_two_outputs() {
        let mut areas = [FishX1Transfer::default(); 2];
        areas[0].config.motor[1] = 0;
        let all = Column::all_of_areas(2);
        assert_eq!(all.len(), 48);
        let there = all.iter().filter(|column| column.is_configured(&areas));
        let there: Vec<_> = there.map(Column::to_string).skip(12).take(6).collect();
        assert_eq!(there, ["M1", "M3", "M4", "O3", "O4", "E1.I1"]);
    }

    #[test]
    fn the_unit_is_that_of_the_mode() {
        let mut areas = [FishX1Transfer::default()];
        let units = |areas: &[FishX1Transfer]| {
            ["I1", "C1", "M1", "E1.I1"].map(|name| name.parse::<Column>().unwrap().unit(areas))
        };
        assert_eq!(units(&areas), ["", "pulses", "duty", ""]);
        areas[0].config.uni[0].digital = 0;
        for (mode, unit) in ["mV", "Ω", "Ω", "cm", "unknown unit"].into_iter().enumerate() {
            areas[0].config.uni[0].mode = mode as u8;
            assert_eq!(units(&areas)[0], unit);
        }
    }
}
