//! Worlds of the simulated machine, as text and built in code.

use std::time::Duration;

use arbitrary::{Result, Unstructured};
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::tx::{Input, Motor, Output};
use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area_simulator::world::{
    AxisSwitch, Belt, Board, Contact, Ejector, Factory, Grip, Gripper, I2cDevice, LampColour,
    MotorModel, Piece, Place, Plug, Remote, Script, ScriptEvent, SeenBy, Sensor, Slide, Travel,
    World,
};
use ft_transfer_area_simulator::Error;
use ft_transfer_area_simulator::Machine;

/// How many times a world is stepped.
const STEPS: u32 = 100;

/// Reads a text as a world, and as a factory. What is accepted can be stepped.
pub fn worlds(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match Factory::from_toml(text) {
        Ok(factory) => {
            for (_, machine) in factory.machines().expect("it was accepted") {
                step(machine, data);
            }
        }
        Err(Error::World { line, .. }) => {
            assert!((1..=text.lines().count() + 1).contains(&line), "line {line}");
        }
        Err(error) => panic!("{error}"),
    }
    match World::from_toml(text) {
        Ok(world) => {
            let extensions = world.extensions.len();
            let machine = Machine::with_world(extensions, world).expect("it was accepted");
            step(machine, data);
        }
        Err(Error::World { line, reason }) => {
            assert!((1..=text.lines().count() + 1).contains(&line), "line {line}: {reason}");
            assert!(!reason.is_empty() && !reason.contains('\n'));
        }
        Err(error) => panic!("{error}"),
    }
}

/// Builds a world of arbitrary values. An accepted world can be stepped.
pub fn built_worlds(data: &[u8]) {
    let mut input = Unstructured::new(data);
    // The input ends when there are no more bytes.
    let Ok((extensions, world)) = world(&mut input) else { return };
    match Machine::with_world(extensions, world) {
        Ok(machine) => step(machine, input.take_rest()),
        Err(Error::World { line: 0, reason }) => assert!(!reason.is_empty()),
        Err(error) => panic!("{error}"),
    }
}

/// Lets time pass with outputs from these bytes, in short steps and one long step.
fn step(mut machine: Machine, bytes: &[u8]) {
    let mut bytes = bytes.iter().copied().cycle();
    let mut next = || bytes.next().unwrap_or_default();
    for number in 0..STEPS {
        let mut outputs = ExchangeData::default();
        outputs.duty.fill_with(|| i16::from(next()) * 2);
        if next() & 3 == 0 {
            outputs.motor_command_id.fill_with(|| u16::from(next()));
            outputs.distance.fill_with(|| u16::from(next()));
            outputs.master.fill_with(|| i16::from(next() % 5));
        }
        let controllers = machine.controllers.len();
        let controller = number as usize % controllers;
        machine.set_outputs(controller, outputs);
        machine.step(Duration::from_millis(if number == STEPS / 2 { 1000 } else { 10 }));
        for controller in 0..controllers {
            assert!(machine.report(controller).is_some());
            let world = machine.world().expect("it has one");
            assert!(world.places().len() >= usize::from(!world.pieces().is_empty()));
            for motor in Motor::ALL {
                check_motor(&machine, controller, motor);
            }
        }
    }
}

fn check_motor(machine: &Machine, controller: usize, motor: Motor) {
    let world = machine.world().expect("it has one");
    let speed = world.motor_speed(controller, motor);
    assert!(speed.is_none_or(f64::is_finite), "{motor} turns at {speed:?}");
    let slide = world.slide(controller, motor);
    assert!(slide.is_none_or(f64::is_finite), "the slide of {motor} is at {slide:?}");
}

fn world(input: &mut Unstructured) -> Result<(usize, World)> {
    let master = board(input)?;
    let boards = input.int_in_range(0..=MAX_EXTENSIONS + 1)?;
    let extensions = (0..boards).map(|_| board(input)).collect::<Result<_>>()?;
    let events = (0..input.int_in_range(0..=4)?).map(|_| event(input)).collect::<Result<_>>()?;
    let period = option(input, number)?;
    let remotes = (0..input.int_in_range(0..=5)?).map(|_| remote(input)).collect::<Result<_>>()?;
    let machine = input.int_in_range(0..=MAX_EXTENSIONS)?;
    let devices = (0..input.int_in_range(0..=3)?).map(|_| device(input)).collect::<Result<_>>()?;
    let mut script = Script::default();
    (script.period, script.events) = (period, events);
    let mut world = World::new().master(master).script(script);
    (world.extensions, world.remotes, world.i2c) = (extensions, remotes, devices);
    add_carriers(&mut world, input)?;
    Ok((machine, world))
}

/// Names of places and grippers. Two parts may have the same.
const NAMES: [&str; 5] = ["a", "b", "c", "d", ""];

/// Adds what carries workpieces.
fn add_carriers(world: &mut World, input: &mut Unstructured) -> Result<()> {
    for model in world.master.motors.values_mut() {
        model.reversed = input.arbitrary()?;
        match input.int_in_range(0..=2)? {
            0 => {}
            1 => {
                let mut belt = Belt::new(number(input)?, number(input)?);
                (belt.start, belt.end) = (option(input, name)?, option(input, name)?);
                model.belt = Some(belt);
            }
            _ => {
                let mut switch = AxisSwitch::new(socket(input)?, number(input)?);
                switch.width = option(input, number)?;
                switch.controller = option(input, |input| input.int_in_range(0..=2))?;
                model.slide = model.slide.take().map(|slide| slide.switch(switch));
            }
        }
    }
    for _ in 0..input.int_in_range(0..=4)? {
        let mut place = Place::new(&name(input)?);
        (place.on, place.at) = (option(input, |input| plug(input, &Motor::ALL))?, number(input)?);
        place.reach = option(input, number)?;
        place.colour = option(input, |input| plug(input, &Input::ALL))?;
        (place.piece, place.content) = (option(input, piece)?, option(input, piece)?);
        let barrier = option(input, |input| plug(input, &Input::ALL))?;
        world.places.push(match barrier {
            Some(barrier) => place.barrier(barrier),
            None => place,
        });
    }
    for _ in 0..input.int_in_range(0..=2)? {
        let mut ejector = Ejector::new(plug(input, &Output::ALL)?, &name(input)?, &name(input)?);
        ejector.compressor = option(input, |input| plug(input, &Output::ALL))?;
        world.ejectors.push(ejector);
    }
    for _ in 0..input.int_in_range(0..=2)? {
        let gripper = gripper(input)?;
        world.grippers.push(gripper);
    }
    Ok(())
}

fn gripper(input: &mut Unstructured) -> Result<Gripper> {
    let output = |input: &mut Unstructured| plug(input, &Output::ALL);
    let grip = if input.arbitrary()? {
        let (compressor, lower) = (option(input, output)?, option(input, output)?);
        Grip::Vacuum { valve: output(input)?, compressor, lower }
    } else {
        Grip::Fork { motor: plug(input, &Motor::ALL)?, lift: number(input)? }
    };
    let axes = (0..input.int_in_range(0..=3)?).map(|_| plug(input, &Motor::ALL));
    let axes = axes.collect::<Result<Vec<_>>>()?;
    let mut gripper = Gripper::new(&name(input)?, &axes, grip).tolerance(number(input)?);
    for _ in 0..input.int_in_range(0..=3)? {
        let at = axes.iter().map(|_| number(input)).collect::<Result<Vec<_>>>()?;
        gripper = gripper.position(&name(input)?, &at);
    }
    Ok(gripper)
}

fn name(input: &mut Unstructured) -> Result<String> {
    Ok(String::from(*input.choose(&NAMES)?))
}

fn piece(input: &mut Unstructured) -> Result<Piece> {
    Ok(*input.choose(&Piece::ALL)?)
}

fn plug<T: Copy>(input: &mut Unstructured, all: &[T]) -> Result<Plug<T>> {
    Ok(Plug { controller: input.int_in_range(0..=2)?, terminal: *input.choose(all)? })
}

fn board(input: &mut Unstructured) -> Result<Board> {
    let mut board = Board::default();
    for _ in 0..input.int_in_range(0..=8)? {
        let socket = *input.choose(&Input::ALL)?;
        board.inputs.insert(socket, sensor(input)?);
    }
    for _ in 0..input.int_in_range(0..=4)? {
        let socket = *input.choose(&Motor::ALL)?;
        board.motors.insert(socket, motor(input)?);
    }
    for _ in 0..input.int_in_range(0..=3)? {
        board.lamps.insert(*input.choose(&Output::ALL)?);
        if input.arbitrary()? {
            board
                .lamp_colours
                .insert(*input.choose(&Output::ALL)?, *input.choose(&LampColour::ALL)?);
        }
    }
    Ok(board)
}

/// A number that is plausible in most cases, or any.
fn number(input: &mut Unstructured) -> Result<f64> {
    Ok(match input.int_in_range(0..=7)? {
        0 => input.arbitrary()?,
        1 => *input.choose(&[0.0, -0.0, 1.0, f64::MAX, f64::MIN_POSITIVE, f64::INFINITY])?,
        2 => input.arbitrary::<u16>()?.into(),
        _ => f64::from(input.arbitrary::<u8>()?) / 256.0,
    })
}

fn option<T>(
    input: &mut Unstructured,
    value: impl FnOnce(&mut Unstructured) -> Result<T>,
) -> Result<Option<T>> {
    Ok(if input.arbitrary()? { Some(value(input)?) } else { None })
}

fn socket(input: &mut Unstructured) -> Result<Input> {
    Ok(*input.choose(&Input::ALL)?)
}

fn sensor(input: &mut Unstructured) -> Result<Sensor> {
    let contact = if input.arbitrary()? { Contact::NormallyOpen } else { Contact::NormallyClosed };
    let pressed = input.arbitrary()?;
    Ok(match input.int_in_range(0..=8)? {
        0 => Sensor::Switch { contact, pressed },
        1 => Sensor::Button { contact, pressed },
        2 => Sensor::Resistor { ohms: input.arbitrary()? },
        3 => Sensor::Ntc { celsius: number(input)? },
        4 => Sensor::PhotoTransistor { light: number(input)? },
        5 => Sensor::Voltage { mv: input.arbitrary()? },
        6 => Sensor::Ultrasonic { cm: number(input)? },
        7 => Sensor::Colour { mv: input.arbitrary()? },
        _ => Sensor::Trail { white: pressed },
    })
}

fn motor(input: &mut Unstructured) -> Result<MotorModel> {
    let mut motor = MotorModel::default();
    motor.top_speed = number(input)?;
    motor.time_constant = number(input)?;
    motor.load = number(input)?;
    motor.pulses_per_turn = option(input, number)?;
    motor.slide = option(input, slide)?;
    motor.run_out = option(input, number)?;
    Ok(motor)
}

fn slide(input: &mut Unstructured) -> Result<Slide> {
    let travel = if input.arbitrary()? {
        Travel::Pulses(number(input)?)
    } else {
        Travel::Mm { length: number(input)?, per_turn: number(input)? }
    };
    let mut slide = Slide::new(travel).position(number(input)?);
    slide.start_switch = option(input, socket)?;
    slide.end_switch = option(input, socket)?;
    slide.seen_by = option(input, |input| {
        let (start_cm, end_cm) = (number(input)?, number(input)?);
        Ok(SeenBy { input: socket(input)?, start_cm, end_cm })
    })?;
    Ok(slide)
}

fn event(input: &mut Unstructured) -> Result<ScriptEvent> {
    let at = number(input)?;
    Ok(match input.int_in_range(0..=3)? {
        0 => ScriptEvent::remote(at, remote(input)?),
        1 => ScriptEvent::i2c(at, input.int_in_range(0..=4)?, input.arbitrary()?, input.bytes(2)?),
        _ => {
            let controller = input.int_in_range(0..=MAX_EXTENSIONS + 1)?;
            ScriptEvent::press(at, controller, socket(input)?, input.arbitrary()?)
        }
    })
}

fn device(input: &mut Unstructured) -> Result<I2cDevice> {
    let device = I2cDevice::new(input.int_in_range(0..=4)?);
    Ok(device.registers(input.arbitrary()?, input.bytes(2)?))
}

fn remote(input: &mut Unstructured) -> Result<Remote> {
    let mut axis = || input.int_in_range(-16..=16);
    let (left_x, left_y, right_x, right_y) = (axis()?, axis()?, axis()?, axis()?);
    let mut bit = || input.arbitrary();
    let (dip1, dip2, on, off) = (bit()?, bit()?, bit()?, bit()?);
    Ok(Remote { dip1, dip2, left_x, left_y, right_x, right_y, on, off })
}
