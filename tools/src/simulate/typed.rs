//! Lines that are typed while the simulated TXT runs.

use std::io::{BufRead, Read};
use std::str::FromStr;

use ft_transfer_area::transfer_area::{
    IR_RECEIVER_IDX_ALL_DATA, IR_RECEIVER_IDX_OFF_OFF, IR_RECEIVER_IDX_OFF_ON,
    IR_RECEIVER_IDX_ON_OFF, IR_RECEIVER_IDX_ON_ON,
};
use ft_transfer_area::tx::{Counter, Input};
use ft_transfer_area::wire::IrRemote;
use ft_transfer_area_simulator::world::{Piece, Remote, Sensor, WorldState};
use ft_transfer_area_simulator::Machine;

pub(crate) const HELP: &str = "\
I1 1 to I8 1                     presses what is plugged in there, or sets its value: ohms, mV, cm,
                                 degrees Celsius, percent of light; without a world the input itself
C1 1 to C4 1                     sets the level of a counter input, which counts when it rises
E1.I2 0, E1.C1 1                 the same on an extension
E1 0, E1 1                       unplugs an extension, plugs it in again
IR1 0 0 0 0 1 to IR4 ...         sets what an infrared remote sends: left x and y, right x and y
                                 (-15 to 15), 1 for ON, 2 for OFF, 3 for both; the DIP switches
                                 of IR1 to IR4 are off off, on off, off on, on on; without a world
                                 4 and 8 in the last number are these switches, IR0 is any remote
I2C 24 63 7                      sets a register of an I2C device: address, register, value
PUT blue seat                    puts a workpiece at a place: white, red, blue or container
TAKE seat                        takes away what is at a place";

/// The DIP switches of a remote, in the bits that it sends.
const DIP1: u8 = 4;
const DIP2: u8 = 8;

/// How many bytes a line may have.
const LONGEST: usize = 1000;

/// The next line that is not empty; `None` at the end. A longer one is an error, and is left out.
pub(crate) fn next_line(input: &mut impl BufRead) -> Option<Result<String, String>> {
    loop {
        let mut line = Vec::new();
        let read = input.by_ref().take(LONGEST as u64 + 1).read_until(b'\n', &mut line).ok()?;
        if read == 0 {
            return None;
        }
        if !line.ends_with(b"\n") && read > LONGEST {
            input.skip_until(b'\n').ok()?;
            return Some(Err(format!("a line has at most {LONGEST} characters")));
        }
        let line = String::from_utf8_lossy(&line);
        if !line.trim().is_empty() {
            return Some(Ok(line.into_owned()));
        }
    }
}

/// The controller that a line is for, and the rest of the line. It begins with the name of the controller, if that has
/// one, which may have several words and begin with another one's.
pub(crate) fn addressed<'a, T>(
    line: &'a str,
    controllers: &'a [(String, T)],
) -> Result<(&'a T, &'a str), String> {
    if let [(name, single)] = controllers {
        if name.is_empty() {
            return Ok((single, line));
        }
    }
    let line = line.trim();
    let behind = |name: &str| {
        let rest = line.strip_prefix(name)?;
        (rest.is_empty() || rest.starts_with(char::is_whitespace)).then_some(rest)
    };
    let named = controllers.iter().filter_map(|(name, one)| Some((name.len(), one, behind(name)?)));
    let found = named.max_by_key(|(length, ..)| *length);
    found.map(|(_, controller, rest)| (controller, rest.trim_start())).ok_or_else(|| {
        let first = line.split_whitespace().next().unwrap_or_default();
        let names: Vec<_> = controllers.iter().map(|(name, _)| name.as_str()).collect();
        format!("there is no controller {first:?}; a line begins with {}", names.join(", "))
    })
}

/// Carries out a line. The error is a sentence that says what is wrong with it.
pub(crate) fn carry_out(line: &str, machine: &mut Machine) -> Result<(), String> {
    let mut words = line.split_whitespace();
    let target = words.next().unwrap_or_default().to_uppercase();
    let values: Vec<&str> = words.collect();
    if target == "I2C" {
        let [address, register, value] = numbers::<u8, 3>(&target, &values)?;
        machine.i2c_device(address)[usize::from(register)] = value;
    } else if target == "PUT" {
        put(machine, &values)?;
    } else if target == "TAKE" {
        take(machine, &values)?;
    } else if let Some(remote) = target.strip_prefix("IR") {
        let remote: usize = remote.parse().map_err(|_| unknown(&target))?;
        set_remote(&target, machine, remote, &values)?;
    } else if let Some((extension, input)) = target.split_once('.') {
        let controller = extension_number(machine, extension)?;
        set_input(&target, machine, controller, input, &values)?;
    } else if target.starts_with('E') {
        let extension = extension_number(machine, &target)?;
        let [alive] = numbers::<u8, 1>(&target, &values)?;
        machine.alive[extension - 1] = alive != 0;
    } else {
        set_input(&target, machine, 0, &target, &values)?;
    }
    Ok(())
}

/// Sets an input of the controller with this index.
fn set_input(
    target: &str,
    machine: &mut Machine,
    controller: usize,
    input: &str,
    values: &[&str],
) -> Result<(), String> {
    if let (Some(world), Some(plug)) = (machine.world_mut(), plug(input)) {
        let [value] = numbers::<f64, 1>(target, values)?;
        if !value.is_finite() {
            return Err(format!("{value} is not a value for {target}"));
        }
        return set_sensor(target, world, controller, plug, value);
    }
    let controller = &mut machine.controllers[controller];
    if let Some(plug) = plug(input) {
        [controller.uni[plug.index()]] = numbers(target, values)?;
        return Ok(());
    }
    let counter = Counter::ALL.into_iter().find(|counter| counter.to_string() == input);
    let counter = counter.ok_or_else(|| unknown(target))?;
    match numbers::<u16, 1>(target, values)? {
        [level @ 0..=1] => controller.set_counter_level(counter, level == 1),
        [level] => return Err(format!("the level of {target} is 0 or 1, not {level}")),
    }
    Ok(())
}

/// The universal input with this name, I1 to I8.
fn plug(input: &str) -> Option<Input> {
    Input::ALL.into_iter().find(|plug| plug.to_string() == input)
}

/// Presses what is plugged in, or changes its value.
fn set_sensor(
    target: &str,
    world: &mut WorldState,
    controller: usize,
    plug: Input,
    value: f64,
) -> Result<(), String> {
    if let Some(motor) = world.moved_by(controller, plug) {
        return Err(match world.sensor(controller, plug) {
            Some(Sensor::Ultrasonic { .. }) => {
                format!("{target} measures the distance to the slide of {motor}")
            }
            _ => format!("{target} is pressed by the slide of {motor}"),
        });
    }
    if let Some(place) = world.place_seen(controller, plug) {
        return Err(format!("{target} looks at the place {place}; PUT puts a workpiece there"));
    }
    let Some(mut sensor) = world.sensor(controller, plug).cloned() else {
        return Err(format!("nothing is plugged into {target} in this world"));
    };
    sensor.set_value(value);
    world.set_sensor(controller, plug, Some(sensor));
    Ok(())
}

/// Puts a workpiece at a place.
fn put(machine: &mut Machine, values: &[&str]) -> Result<(), String> {
    let &[piece, place] = values else {
        return Err(format!("PUT wants a workpiece and a place, not {:?}", values.join(" ")));
    };
    let named = |known: &Piece| known.name().eq_ignore_ascii_case(piece);
    let piece = Piece::ALL.into_iter().find(named).ok_or_else(|| {
        let names = Piece::ALL.map(Piece::name).join(", ");
        format!("there is no workpiece {piece:?}; there are {names}")
    })?;
    let world = machine.world_mut().ok_or("there is no world with places")?;
    if world.put(piece, place) {
        return Ok(());
    }
    check_place(world, place)?;
    Err(format!("there is no room for it at {place}"))
}

/// Takes away what is at a place.
fn take(machine: &mut Machine, values: &[&str]) -> Result<(), String> {
    let &[place] = values else {
        return Err(format!("TAKE wants a place, not {:?}", values.join(" ")));
    };
    let world = machine.world_mut().ok_or("there is no world with places")?;
    if world.take(place).is_some() {
        return Ok(());
    }
    check_place(world, place)?;
    Err(format!("there is nothing at {place}"))
}

/// Answers a name that no place has.
fn check_place(world: &WorldState, place: &str) -> Result<(), String> {
    if world.has_place(place) {
        return Ok(());
    }
    let names: Vec<_> = world.places().into_iter().map(|(name, _)| name).collect();
    match names.is_empty() {
        true => Err(String::from("this world has no places")),
        false => Err(format!("there is no place {place:?}; there are {}", names.join(", "))),
    }
}

/// Sets what a remote sends.
fn set_remote(
    target: &str,
    machine: &mut Machine,
    remote: usize,
    values: &[&str],
) -> Result<(), String> {
    let [left_x, left_y, right_x, right_y, bits] = numbers::<i8, 5>(target, values)?;
    let axes = [left_x, left_y, right_x, right_y];
    if let Some(axis) = axes.iter().find(|axis| !(-15..=15).contains(*axis)) {
        return Err(format!("a joystick of {target} goes from -15 to 15, not to {axis}"));
    }
    let bits = u8::try_from(bits).ok().filter(|bits| *bits < 16);
    let bits = bits.ok_or_else(|| format!("the last number of {target} is 0 to 15"))?;
    if let Some(world) = machine.world_mut() {
        let dips = dip_switches(target, remote)?;
        if bits >= DIP1 && bits & (DIP1 | DIP2) != dips {
            return Err(format!(
                "{target} already sets the DIP switches, so its last number is 0 to 3"
            ));
        }
        let is_set = |bit: u8| (bits | dips) & bit != 0;
        let (on, off, dip1, dip2) = (is_set(1), is_set(2), is_set(DIP1), is_set(DIP2));
        world.set_remote(Remote { dip1, dip2, left_x, left_y, right_x, right_y, on, off });
        return Ok(());
    }
    let place = machine.controllers[0].ir.get_mut(remote);
    let place = place.ok_or_else(|| format!("there is no {target}, only IR0 to IR4"))?;
    *place = IrRemote { left_x, left_y, right_x, right_y, bits };
    Ok(())
}

/// The DIP switches of the remote that a world knows by this number.
fn dip_switches(target: &str, remote: usize) -> Result<u8, String> {
    match remote {
        IR_RECEIVER_IDX_OFF_OFF => Ok(0),
        IR_RECEIVER_IDX_ON_OFF => Ok(DIP1),
        IR_RECEIVER_IDX_OFF_ON => Ok(DIP2),
        IR_RECEIVER_IDX_ON_ON => Ok(DIP1 | DIP2),
        IR_RECEIVER_IDX_ALL_DATA => {
            Err(format!("{target} is any remote; in a world use IR1 to IR4"))
        }
        _ => Err(format!("there is no {target} in a world, only IR1 to IR4")),
    }
}

/// The index of the controller that `E1` names.
fn extension_number(machine: &Machine, name: &str) -> Result<usize, String> {
    let number = name.strip_prefix('E').and_then(|digits| digits.parse().ok());
    number.filter(|number| (1..machine.controllers.len()).contains(number)).ok_or_else(|| {
        format!("there is no extension {name:?}; --extensions sets how many there are")
    })
}

fn numbers<T: FromStr, const N: usize>(target: &str, values: &[&str]) -> Result<[T; N], String> {
    let parsed: Result<Vec<T>, _> = values.iter().map(|value| value.parse()).collect();
    parsed
        .ok()
        .and_then(|values| values.try_into().ok())
        .ok_or_else(|| format!("{target} wants {N} number(s), not {:?}", values.join(" ")))
}

fn unknown(target: &str) -> String {
    format!("there is no {target:?} to set")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_may_begin_with_a_name_of_several_words() {
        let controllers = ["line", "line 2", "Band 1"].map(|name| (name.to_owned(), name));
        let to = |line: &'static str| addressed(line, &controllers);
        assert_eq!(to("line I1 1"), Ok((&"line", "I1 1")));
        assert_eq!(to(" line 2 I1 1\n"), Ok((&"line 2", "I1 1")));
        assert_eq!(to("Band 1   PUT blue seat"), Ok((&"Band 1", "PUT blue seat")));
        let error = to("Band 12 I1 1").unwrap_err();
        assert!(error.contains("line, line 2, Band 1"), "{error}");
    }

    #[test]
    fn a_line_has_a_bound_and_the_next_one_counts() {
        let long = std::io::repeat(b'x').take(1 << 20);
        let mut input = std::io::BufReader::new(long.chain(&b"\n\n  \nI1 1\nI2 1"[..]));
        let lines = std::iter::from_fn(|| next_line(&mut input));
        let lines: Vec<_> = lines.map(|line| line.map_err(drop)).collect();
        assert_eq!(lines, [Err(()), Ok("I1 1\n".to_owned()), Ok("I2 1".to_owned())]);
    }
}
