//! Lines that are typed while the simulated TXT runs.

use std::str::FromStr;

use ft_transfer_area::simulator::Machine;
use ft_transfer_area::wire::IrRemote;

pub(crate) const HELP: &str = "\
I1 1 to I8 1                     sets an input, in the unit of its mode
C1 1 to C4 1                     sets the level of a counter input
E1.I2 0, E1.C1 1                 the same on an extension
E1 0, E1 1                       cuts an extension off, plugs it in again
IR0 0 0 0 0 1 to IR4 ...         sets what an infrared remote sends: left x and y, right x and y
                                 (-15 to 15), and its bits: 1 ON, 2 OFF, 4 and 8 the DIP switches
I2C 24 63 7                      sets a register of an I2C device: address, register, value";

/// Does what a line says; otherwise a sentence that tells what is wrong with it.
pub(crate) fn carry_out(line: &str, machine: &mut Machine) -> Result<(), String> {
    let mut words = line.split_whitespace();
    let target = words.next().unwrap_or_default().to_uppercase();
    let values: Vec<&str> = words.collect();
    if target == "I2C" {
        let [address, register, value] = numbers::<u8, 3>(&target, &values)?;
        machine.i2c_device(address)[usize::from(register)] = value;
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
    let controller = &mut machine.controllers[controller];
    let number = |digits: &str| digits.parse::<usize>().ok()?.checked_sub(1);
    let place = match input.split_at_checked(1) {
        Some(("I", digits)) => number(digits).and_then(|index| controller.uni.get_mut(index)),
        Some(("C", digits)) => {
            number(digits).and_then(|index| controller.counter_input.get_mut(index))
        }
        _ => None,
    };
    let place = place.ok_or_else(|| unknown(target))?;
    [*place] = numbers(target, values)?;
    Ok(())
}

fn set_remote(
    target: &str,
    machine: &mut Machine,
    remote: usize,
    values: &[&str],
) -> Result<(), String> {
    let place = machine.controllers[0].ir.get_mut(remote).ok_or_else(|| unknown(target))?;
    let [left_x, left_y, right_x, right_y, bits] = numbers::<i8, 5>(target, values)?;
    let bits = u8::try_from(bits).map_err(|_| format!("{bits} is no number of bits"))?;
    *place = IrRemote { left_x, left_y, right_x, right_y, bits };
    Ok(())
}

/// The index of the controller that `E1` names.
fn extension_number(machine: &Machine, name: &str) -> Result<usize, String> {
    let number = name.strip_prefix('E').and_then(|digits| digits.parse().ok());
    number
        .filter(|number| (1..machine.controllers.len()).contains(number))
        .ok_or_else(|| format!("there is no extension {name:?}; --extensions tells how many"))
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
