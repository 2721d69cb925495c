//! A motor that turns.

use super::motor_model::MotorModel;
use super::slide::{AxisSwitch, Slide, Travel};
use crate::machine::motor::{Pulses, Turning};

/// One tick of the world in µs.
pub(super) const TICK_MICROS: u64 = 1000;

/// The same in s.
const TICK: f64 = TICK_MICROS as f64 / 1e6;

/// From this part of a pulse on its level is low.
const HALF: f64 = 0.5 - ROUNDING;

/// What a sum of parts of a pulse may be too little by, because numbers are rounded.
const ROUNDING: f64 = 1e-9;

/// A slide is at its end switch within this part of its travel.
const SWITCH_ZONE: f64 = 0.01;

/// A motor with its speed and position.
#[derive(Clone, Debug)]
pub(super) struct Shaft {
    motor: MotorModel,
    /// Turns per second, negative for backwards.
    speed: f64,
    /// Position of the slide, in the unit of its travel.
    position: f64,
    /// How far it has turned since its last pulse, as a part of a pulse.
    part: f64,
    /// The turns of the last tick, negative for backwards.
    turned: f64,
}

impl Shaft {
    pub(super) fn new(motor: &MotorModel) -> Self {
        let position = motor.slide.as_ref().map_or(0.0, |slide| slide.position);
        Self { motor: motor.clone(), speed: 0.0, position, part: 0.0, turned: 0.0 }
    }

    pub(super) fn slide(&self) -> Option<&Slide> {
        self.motor.slide.as_ref()
    }

    pub(super) fn has_encoder(&self) -> bool {
        self.motor.pulses_per_turn.is_some()
    }

    /// Turns per second, negative for backwards.
    pub(super) fn speed(&self) -> f64 {
        self.speed
    }

    /// What the control of its controller knows of it.
    pub(super) fn turning(&self) -> Turning {
        let pulse_rate = self.speed.abs() * self.motor.pulses_per_turn.unwrap_or(0.0);
        Turning { pulse_rate, runs_out: self.motor.run_out.is_some() }
    }

    /// Position of the slide, in the unit of its travel.
    pub(super) fn position(&self) -> f64 {
        self.position
    }

    /// Position of the slide as a part of its travel; `None` without a slide.
    pub(super) fn part_of_travel(&self) -> Option<f64> {
        Some(self.position / self.length()?)
    }

    /// The turns of the last tick, negative for backwards.
    pub(super) fn turned(&self) -> f64 {
        self.turned
    }

    /// Stops immediately.
    pub(super) fn halt(&mut self) {
        (self.speed, self.turned) = (0.0, 0.0);
    }

    /// Turns for one tick, or for more at the speed after one, with this part of full power, −1.0..=1.0. Returns the
    /// pulses. Without power it brakes, like a motor whose contacts are connected.
    pub(super) fn turn(&mut self, power: f64, ticks: u64) -> Pulses {
        let MotorModel { top_speed, time_constant, load, reversed, run_out, .. } = self.motor;
        let power = if reversed { -power } else { power };
        let goal = power.signum() * top_speed * (power.abs() - load).max(0.0);
        self.speed = match run_out {
            Some(pulses) if power == 0.0 => self.braked(pulses),
            Some(_) | None => self.speed + (goal - self.speed) * TICK / (time_constant + TICK),
        };
        self.turned = self.move_slide(self.speed * TICK * ticks as f64);
        self.count(self.turned.abs())
    }

    /// Its speed after a tick in which it is braked evenly: from its top speed it turns by so many pulses.
    fn braked(&self, run_out: f64) -> f64 {
        let turns = run_out / self.motor.pulses_per_turn.unwrap_or(f64::INFINITY);
        let slower = self.motor.top_speed.powi(2) / (2.0 * turns) * TICK;
        self.speed.signum() * (self.speed.abs() - slower).max(0.0)
    }

    /// Moves the slide by this many turns of the motor, or as far as it can. Returns the turns made.
    fn move_slide(&mut self, turns: f64) -> f64 {
        let Some(Slide { travel, .. }) = &self.motor.slide else { return turns };
        let travel = *travel;
        let per_turn = match travel {
            Travel::Pulses(_) => self.motor.pulses_per_turn.unwrap_or(0.0),
            Travel::Mm { per_turn, .. } => per_turn,
        };
        let before = self.position;
        let asked_for = before + turns * per_turn;
        self.position = asked_for.clamp(0.0, travel.length());
        if self.position == asked_for {
            return turns;
        }
        self.speed = 0.0;
        (self.position - before) / per_turn
    }

    fn count(&mut self, turns: f64) -> Pulses {
        let was_low = self.part >= HALF;
        self.part += turns * self.motor.pulses_per_turn.unwrap_or(0.0);
        let pulses = (self.part + ROUNDING).floor();
        self.part -= pulses;
        // A counter has 16 bits and keeps the lowest ones.
        let count = pulses as u64 as u16;
        let is_low = self.part >= HALF;
        let changed = count > 0 || is_low != was_low;
        Pulses { count, level: changed.then_some(!is_low) }
    }

    /// Whether the slide is at its start and at its end.
    pub(super) fn at_stops(&self) -> [bool; 2] {
        let Some(length) = self.length() else { return [false; 2] };
        let zone = SWITCH_ZONE * length;
        [self.position <= zone, self.position >= length - zone]
    }

    /// The switches along the travel of its slide, each with whether it is pressed.
    pub(super) fn switches(&self) -> impl Iterator<Item = (&AxisSwitch, bool)> {
        let slides = self.slide().into_iter();
        slides.flat_map(|Slide { switches, travel, .. }| {
            let pressed = |switch: &AxisSwitch| switch.is_pressed(self.position, travel.length());
            switches.iter().map(move |switch| (switch, pressed(switch)))
        })
    }

    /// The distance from the slide to the ultrasonic sensor that looks at it, in cm.
    pub(super) fn seen_at(&self) -> Option<f64> {
        let seen_by = self.slide()?.seen_by?;
        let part = self.part_of_travel()?;
        Some(seen_by.start_cm + part * (seen_by.end_cm - seen_by.start_cm))
    }

    fn length(&self) -> Option<f64> {
        self.slide().map(|slide| slide.travel.length())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(shaft: &mut Shaft, power: f64, ticks: u32) -> u32 {
        (0..ticks).map(|_| u32::from(shaft.turn(power, 1).count)).sum()
    }

    #[test]
    fn the_speed_approaches_what_the_load_leaves() {
        for (power, load, speed) in
            [(1.0, 0.0, 3.0), (0.5, 0.0, 1.5), (1.0, 0.5, 1.5), (-1.0, 0.2, -2.4), (0.3, 0.5, 0.0)]
        {
            let mut shaft = Shaft::new(&MotorModel { load, ..MotorModel::default() });
            turn(&mut shaft, power, 1000);
            assert!((shaft.speed() - speed).abs() < 1e-6, "{power} {load}: {}", shaft.speed());
        }
    }

    #[test]
    fn inertia_takes_its_time() {
        let mut shaft = Shaft::new(&MotorModel { time_constant: 0.1, ..MotorModel::default() });
        turn(&mut shaft, 1.0, 100);
        assert!((1.8..2.0).contains(&shaft.speed()), "{}", shaft.speed());
        turn(&mut shaft, 0.0, 100);
        assert!((0.6..0.8).contains(&shaft.speed()), "{}", shaft.speed());
        let mut light = Shaft::new(&MotorModel { time_constant: 0.0, ..MotorModel::default() });
        turn(&mut light, 1.0, 1);
        assert!((light.speed() - 3.0).abs() < 1e-9);
    }

    #[test]
    fn pulses_follow_from_turns_in_both_directions() {
        let motor =
            MotorModel { time_constant: 0.0, top_speed: 2.0, ..MotorModel::encoder_motor() };
        let mut shaft = Shaft::new(&motor);
        let pulses = turn(&mut shaft, 1.0, 10_000);
        assert!((1265..=1266).contains(&pulses), "{pulses}");
        let pulses = turn(&mut shaft, -1.0, 10_000);
        assert!((1265..=1267).contains(&pulses), "{pulses}");
        let mut plain = Shaft::new(&MotorModel::default());
        assert_eq!(turn(&mut plain, 1.0, 1000), 0);
    }

    #[test]
    fn a_motor_that_runs_out_turns_on_by_the_square_of_its_speed() {
        for (duty, expected) in [(1.0, 20), (0.5, 5), (0.25, 1)] {
            let mut shaft = Shaft::new(&MotorModel::encoder_motor().run_out(20.5));
            turn(&mut shaft, duty, 1000);
            shaft.part = 0.0;
            let pulses = turn(&mut shaft, 0.0, 1000);
            assert_eq!((pulses, shaft.speed()), (expected, 0.0));
        }
        let mut exact = Shaft::new(&MotorModel::encoder_motor().run_out(0.0));
        turn(&mut exact, 1.0, 1000);
        assert_eq!((turn(&mut exact, 0.0, 1), exact.speed()), (0, 0.0));
    }

    #[test]
    fn a_motor_with_swapped_wires_turns_the_other_way() {
        let mut shaft = Shaft::new(&MotorModel::encoder_motor().wires_swapped());
        assert!(turn(&mut shaft, 1.0, 1000) > 150 && shaft.speed() < -2.9, "{}", shaft.speed());
    }

    #[test]
    fn a_slide_in_millimetres_stops_at_its_ends() {
        let slide = Slide::new(Travel::Mm { length: 100.0, per_turn: 4.0 }).position(50.0).seen_by(
            super::super::SeenBy {
                input: ft_transfer_area::tx::Input::I4,
                start_cm: 20.0,
                end_cm: 10.0,
            },
        );
        let mut shaft =
            Shaft::new(&MotorModel { slide: Some(slide), ..MotorModel::encoder_motor() });
        assert_eq!((shaft.at_stops(), shaft.seen_at()), ([false, false], Some(15.0)));
        let pulses = turn(&mut shaft, 1.0, 20_000);
        // 50 mm are 12.5 turns.
        assert_eq!(pulses, 791);
        assert_eq!((shaft.position(), shaft.speed(), shaft.seen_at()), (100.0, 0.0, Some(10.0)));
        assert_eq!(shaft.at_stops(), [false, true]);
        assert_eq!(turn(&mut shaft, 1.0, 1000), 0);
        turn(&mut shaft, -1.0, 20_000);
        assert_eq!((shaft.position(), shaft.at_stops()), (0.0, [true, false]));
    }
}
