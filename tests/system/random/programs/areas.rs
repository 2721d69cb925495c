//! The calls that get the areas, of a handle and of the handler.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::{Direction, Input, Sound};
use ft_transfer_area::{Error, FishX1Transfer, TransferAreaGuard, TransferAreas};

use super::plan::{Act, Get};
use super::record::{duties_of, Awaited, Orders, Record};

fn ms(count: u64) -> Duration {
    Duration::from_millis(count)
}

/// Gets the areas. Each check of a condition is noted.
pub(crate) fn get<'a>(
    areas: &'a TransferAreas,
    get: Get,
    check: &dyn Fn(),
) -> Result<TransferAreaGuard<'a>, Error> {
    match get {
        Get::Lock => Ok(areas.lock()),
        Get::Cycle => areas.wait_cycle(),
        Get::CycleFor(limit) => areas.wait_cycle_for(ms(limit)),
        Get::Until(checks, limit) => {
            let mut left = checks;
            let condition = |_: &[FishX1Transfer]| {
                check();
                left = left.saturating_sub(1);
                left == 0
            };
            areas.wait_until(condition, ms(limit))
        }
        Get::Motor(motor, limit) => areas.wait_motor_ex(LOCAL_IO, motor, ms(limit)),
        Get::Counter(counter, limit) => areas.wait_counter_reset(LOCAL_IO, counter, ms(limit)),
        Get::Sound(limit) => areas.wait_sound(LOCAL_IO, ms(limit)),
        Get::Input(limit) => areas.wait_input_change(LOCAL_IO, Input::I1, ms(limit)),
    }
}

impl Get {
    pub(crate) fn awaits(self) -> Option<Awaited> {
        match self {
            Self::Motor(motor, _) => Some(Awaited::Motor(motor)),
            Self::Counter(counter, _) => Some(Awaited::Counter(counter)),
            Self::Sound(_) => Some(Awaited::Sound),
            _ => None,
        }
    }

    /// Whether it returns each response only once to a handle.
    pub(crate) fn is_new(self) -> bool {
        matches!(self, Self::Cycle | Self::CycleFor(_))
    }
}

/// Does this with the areas.
pub(crate) fn act(areas: &mut [FishX1Transfer], acts: &[Act], record: &Record) -> Orders {
    let mut orders = Orders::default();
    for act in acts {
        match *act {
            Act::Write => {
                let tag = record.number();
                for area in &mut *areas {
                    area.output.duty[..4].copy_from_slice(&duties_of(tag));
                }
                orders.tag = Some(tag);
            }
            Act::Zero => {
                areas.iter_mut().for_each(|area| *area.output.duty = [0; 8]);
                orders.tag = Some(0);
            }
            Act::Drive(motor, pulses) => {
                // With the pulses, this duty is used by one command only.
                let duty = 413 + (record.number() % 100) as i16;
                let area = &mut areas[LOCAL_IO];
                let given = area.start_motor_ex_cmd(motor, duty, Direction::Cw, &[], pulses.into());
                given.expect("M3 and M4 are motors");
                orders.drives[motor.index()] = Some((pulses, duty));
            }
            Act::Halt(motor) => {
                areas[LOCAL_IO].stop_motor_ex_cmd(motor).expect("M3 and M4 are motors");
                orders.drives[motor.index()] = Some((0, 0));
            }
            Act::Reset(counter) => {
                areas[LOCAL_IO].start_counter_reset(counter);
                orders.resets[counter.index()] = true;
            }
            Act::Sound => {
                let repeat = (record.number() % 60_000) as u16 + 1;
                areas[LOCAL_IO].set_sound(Sound::Airplane, repeat).expect("it is a sound");
                orders.sound = Some(repeat);
            }
            Act::Config => areas[LOCAL_IO].raise_config_id(),
        }
    }
    orders
}

/// What a program does that is busy with the areas.
pub(crate) fn hold(ms_held: u64) {
    let end = Instant::now() + ms(ms_held);
    while let Some(left) = end.checked_duration_since(Instant::now()) {
        std::thread::sleep(left);
    }
}
