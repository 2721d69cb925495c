//! What is wrong with a world: values out of their ranges, and parts that don't fit together.

use std::collections::BTreeSet;

use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::tx::{Input, Motor, Output};

use super::drawn::check_point;
use super::floor::Plan;
use super::i2c_device;
use super::mistake::{at, each, expect, finite, in_range, positive, short, Checked, Mistake};
use super::remote;
use super::slide::{SEEN_BY, SWITCHES};
use super::{Barrier, Board, Grip, Gripper, I2cDevice, Piece, Place, Plug, Remote, Sensor, World};

/// Inputs that something else in the world sets, each with its controller.
pub(super) type SetInputs = BTreeSet<(usize, Input)>;

/// An input that a slide sets.
struct Moved {
    /// The slide's motor.
    mover: Plug<Motor>,
    /// The key of the slide that names the input.
    key: &'static str,
    /// Its number in the list of switches along the travel.
    number: Option<usize>,
    /// The controller of the input.
    controller: usize,
    input: Input,
}

impl Moved {
    /// Adds the place of its key to a mistake.
    fn at<T>(&self, checked: Result<T, Mistake>) -> Result<T, Mistake> {
        let checked = match self.number {
            Some(number) => at(number, checked),
            None => checked,
        };
        at_motor(self.mover, at("slide", at(self.key, checked)))
    }
}

/// Adds the place of a motor to a mistake.
pub(super) fn at_motor<T>(motor: Plug<Motor>, checked: Result<T, Mistake>) -> Result<T, Mistake> {
    let checked = at("motors", at(motor.terminal, checked));
    match motor.controller.checked_sub(1) {
        None => at("master", checked),
        Some(extension) => at("extensions", at(extension, checked)),
    }
}

impl World {
    /// Checks the ranges, and that the parts fit together.
    pub(super) fn find_mistake(&self) -> Checked {
        at("master", self.master.check())?;
        let count = self.extensions.len();
        let reason = || format!("expected at most {MAX_EXTENSIONS} extensions, not {count}");
        let too_many = at(MAX_EXTENSIONS, expect(count <= MAX_EXTENSIONS, reason));
        at("extensions", too_many)?;
        each("extensions", &self.extensions, Board::check)?;
        self.check_places()?;
        self.check_ejectors()?;
        self.check_grippers()?;
        let set = self.check_seen(self.check_moved()?)?;
        // Before the script, which looks for one of them at each event: then there are only a few.
        each("remotes", &self.remotes, Remote::check)?;
        at("remotes", remote::check_settings(&self.remotes))?;
        each("i2c", &self.i2c, I2cDevice::check)?;
        at("i2c", i2c_device::check_addresses(&self.i2c))?;
        at("supply", self.supply.check())?;
        at("script", self.script.check(self, &set))
    }

    /// Checks the world together with its places: what names a place has to find it.
    pub(super) fn find_mistake_alone(&self) -> Checked {
        self.find_mistake()?;
        Plan::of(&[("", self)], &[]).map(|_| ()).map_err(|(_, mistake)| mistake)
    }

    /// What else in the world sets what is plugged in here, such as "pressed by a slide".
    pub(super) fn setter(&self, controller: usize, input: Input) -> Option<String> {
        let moved =
            self.moved().find(|moved| (moved.controller, moved.input) == (controller, input));
        let by_slide = moved.map(|moved| {
            String::from(if moved.key == SEEN_BY { "set by a slide" } else { "pressed by a slide" })
        });
        by_slide.or_else(|| {
            let mut places = self.places.iter();
            let place = places.find(|place| {
                place.inputs().any(|(_, seen, _)| seen == Plug { controller, terminal: input })
            });
            place.map(|place| format!("set by what is at {}", place.name))
        })
    }

    /// Checks that each input that a slide sets has the right sensor, and only one slide. Returns these
    /// inputs.
    fn check_moved(&self) -> Result<SetInputs, Mistake> {
        let mut known = BTreeSet::new();
        for moved in self.moved() {
            let Moved { key, controller, input, .. } = moved;
            let sensor = self.board(controller).and_then(|board| board.inputs.get(&input));
            let (right, expected) = if key == SEEN_BY {
                (matches!(sensor, Some(Sensor::Ultrasonic { .. })), "an ultrasonic sensor")
            } else {
                (matches!(sensor, Some(Sensor::Switch { .. })), "a switch")
            };
            let checked = expect(right, || format!("expected {expected} on {input}"));
            let is_new = known.insert((controller, input));
            moved.at(checked.and_then(|()| expect(is_new, || format!("{input} is used twice"))))?;
        }
        Ok(known)
    }

    /// Checks that each sensor that looks at a place is the right one, and that nothing else sets it. Returns the
    /// inputs with these, too.
    fn check_seen(&self, mut known: SetInputs) -> Result<SetInputs, Mistake> {
        let mut counters = BTreeSet::new();
        for (number, place) in self.places.iter().enumerate() {
            for (key, input, expected) in place.inputs() {
                let right = self.sensor(input).is_some_and(|sensor| sensor.kind() == expected);
                let is_new = known.insert((input.controller, input.terminal));
                let checked = expect(right, || format!("expected a {expected} on {input}"))
                    .and_then(|()| expect(is_new, || format!("{input} is used twice")));
                at("places", at(number, at(key, checked)))?;
            }
            if let Some(Barrier::Counter(counter)) = place.barrier {
                let board = self.board(counter.controller);
                let motor = Motor::ALL[counter.terminal.index()];
                let model = board.and_then(|board| board.motors.get(&motor));
                let is_free = model.is_none_or(|model| model.pulses_per_turn.is_none())
                    && counters.insert(counter);
                let checked = match board {
                    None => Err(Mistake::new(format!("there is no {counter} in this world"))),
                    Some(_) => expect(is_free, || format!("{counter} is used twice")),
                };
                at("places", at(number, at("barrier", checked)))?;
            }
        }
        Ok(known)
    }

    fn check_places(&self) -> Checked {
        let mut names = BTreeSet::new();
        for (number, place) in self.places.iter().enumerate() {
            let is_new = names.insert(&place.name);
            let reason = || format!("there are two places with the name {:?}", place.name);
            let named =
                short(&place.name).and_then(|()| expect(is_new && !place.name.is_empty(), reason));
            at("places", at(number, at("name", named).and_then(|()| self.check_place(place))))?;
        }
        Ok(())
    }

    fn check_ejectors(&self) -> Checked {
        each("ejectors", &self.ejectors, |ejector| {
            self.check_output("valve", Some(ejector.valve))?;
            self.check_output("compressor", ejector.compressor)
        })
    }

    /// Checks that an output, if any, is one that no motor uses.
    fn check_output(&self, key: &str, output: Option<Plug<Output>>) -> Checked {
        let Some(output) = output else { return Ok(()) };
        let motor = output.terminal.motor();
        let checked = match self.board(output.controller) {
            None => Err(Mistake::new(format!("there is no {output} in this world"))),
            Some(board) => expect(!board.motors.contains_key(&motor), || {
                format!("{output} is a terminal of the motor on {motor}")
            }),
        };
        at(key, checked)
    }

    fn check_place(&self, place: &Place) -> Checked {
        if let Some(reach) = place.reach {
            positive("reach", reach, f64::MAX)?;
        }
        if let Some(content) = place.content {
            let fits = place.piece == Some(Piece::Container) && content != Piece::Container;
            let reason = || String::from("expected a workpiece in a container");
            at("content", expect(fits, reason))?;
        }
        if let Some(point) = &place.drawn {
            check_point("drawn", point)?;
            let reason =
                || String::from("expected no point, because it is drawn where it is on its motor");
            at("drawn", expect(place.on.is_none(), reason))?;
        }
        let Some(motor) = place.on else { return finite("at", place.at) };
        let model = self.motor(motor);
        let slide = model.and_then(|model| model.slide.as_ref());
        let belt = model.and_then(|model| model.belt.as_ref());
        let length = slide.map(|slide| slide.travel.length()).or(belt.map(|belt| belt.length));
        match length {
            Some(length) => in_range("at", place.at, 0.0..=length),
            None => at("on", Err(Mistake::new(format!("expected a belt or a slide on {motor}")))),
        }
    }

    fn check_grippers(&self) -> Checked {
        let mut names = BTreeSet::new();
        for (number, gripper) in self.grippers.iter().enumerate() {
            let is_new = names.insert(&gripper.name);
            let reason = || format!("there are two grippers with the name {:?}", gripper.name);
            let named = short(&gripper.name)
                .and_then(|()| expect(is_new && !gripper.name.is_empty(), reason));
            let checked = at("name", named).and_then(|()| gripper.check());
            at("grippers", at(number, checked.and_then(|()| self.check_axes(gripper))))?;
        }
        Ok(())
    }

    fn check_axes(&self, gripper: &Gripper) -> Checked {
        let slides = |motor: Plug<Motor>| {
            let right = self.motor(motor).is_some_and(|model| model.slide.is_some());
            expect(right, || format!("expected a motor with a slide on {motor}"))
        };
        each("axes", &gripper.axes, |axis| slides(*axis))?;
        let count = gripper.axes.len();
        let least = match gripper.grip {
            Grip::Vacuum { valve, compressor, lower } => {
                let outputs =
                    [("valve", Some(valve)), ("compressor", compressor), ("lower", lower)];
                let mut outputs = outputs.into_iter();
                at("vacuum", outputs.try_for_each(|(key, output)| self.check_output(key, output)))?;
                1
            }
            Grip::Fork { motor, .. } => {
                at("fork", at("motor", slides(motor)))?;
                2
            }
        };
        at("axes", expect(count >= least, || format!("expected at least {least}, not {count}")))?;
        each("positions", &gripper.positions, |position| {
            let given = position.at.len();
            let reason = || format!("expected a number for each of the {count} axes, not {given}");
            at("at", expect(given == count, reason))?;
            position.at.iter().try_for_each(|number| finite("at", *number))
        })
    }

    /// The inputs that slides set.
    fn moved(&self) -> impl Iterator<Item = Moved> + '_ {
        let boards = std::iter::once(&self.master).chain(&self.extensions).enumerate();
        boards.flat_map(|(controller, board)| {
            let slides = board.motors.iter().filter_map(move |(motor, model)| {
                let mover = Plug { controller, terminal: *motor };
                model.slide.as_ref().map(|slide| (mover, slide))
            });
            slides.flat_map(move |(mover, slide)| {
                let own = slide.moved_inputs().map(move |(key, input)| Moved {
                    mover,
                    key,
                    number: None,
                    controller,
                    input,
                });
                let switches = slide.switches.iter().enumerate();
                own.chain(switches.map(move |(number, switch)| Moved {
                    mover,
                    key: SWITCHES,
                    number: Some(number),
                    controller: switch.controller.unwrap_or(controller),
                    input: switch.input,
                }))
            })
        })
    }
}
