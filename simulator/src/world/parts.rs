//! How each part of a world is read from its file.

use toml::de::{DeTable, DeValue};

use super::check::{at, Mistake};
use super::i2c_device::I2cDevice;
use super::read::{list, map, number, only, terminal, terminal_value, truth, whole, Keys, Read};
use super::remote::AXIS_MAX;
use super::script::{Script, ScriptAction, ScriptEvent};
use super::{Board, Contact, MotorModel, Remote, SeenBy, Sensor, Slide, Travel, World};
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::tx::{Input, Motor, Output};

/// The greatest index of a controller.
const CONTROLLERS: i64 = MAX_EXTENSIONS as i64;

const BOARD: &str = "expected a table, as in [master]";
const INPUTS: &str = "expected a table, as in [master.inputs]";
const MOTORS: &str = "expected a table, as in [master.motors.M1]";
const LAMPS: &str = "expected a list, as in lamps = [\"O7\"]";
const SENSOR: &str = "expected one sensor, as in I1 = { button = {} }";
const VALUES: &str = "expected what belongs to it in braces, as in { ultrasonic = { cm = 30 } }";
const CONTACT: &str = "expected \"normally_open\" or \"normally_closed\"";
const MOTOR: &str = "expected a motor, as in M1 = { pulses_per_turn = 63.3 }";
const SLIDE: &str = "expected a slide, as in slide = { travel = { pulses = 1000 } }";
const TRAVEL: &str = "expected one length, as in travel = { pulses = 1000 }";
const MM: &str = "expected a table, as in travel = { mm = { length = 120, per_turn = 4.5 } }";
const SEEN_BY: &str = "expected a table, as in { input = \"I4\", start_cm = 5, end_cm = 25 }";
const SCRIPT: &str = "expected a table, as in [script]";
const EVENTS: &str = "expected a list, as in [[script.events]]";
const EVENT: &str = "expected an event, as in { at = 1, input = \"I3\", pressed = true }";
const EXTENSIONS: &str = "expected double brackets, as in [[extensions]]";
const REMOTES: &str = "expected double brackets, as in [[remotes]]";
const REMOTE: &str = "expected a remote, as in { dip1 = true }";
const I2C: &str = "expected double brackets, as in [[i2c]]";
const DEVICE: &str = "expected a device, as in { address = 0x18 }";
const REGISTERS: &str = "expected a list, as in registers = [{ register = 2, values = [0, 64] }]";
const BYTES: &str = "expected a list of bytes, as in values = [0, 64]";

pub(super) fn world(table: &DeTable<'_>) -> Read<World> {
    let keys = Keys::of_table(table, &["master", "extensions", "script", "remotes", "i2c"])?;
    Ok(World {
        master: keys.or("master", Board::default(), board)?,
        extensions: keys.or("extensions", Vec::new(), list(EXTENSIONS, board))?,
        script: keys.or("script", Script::default(), script)?,
        remotes: keys.or("remotes", Vec::new(), list(REMOTES, remote))?,
        i2c: keys.or("i2c", Vec::new(), list(I2C, device))?,
    })
}

fn board(value: &DeValue<'_>) -> Read<Board> {
    let keys = Keys::of(value, BOARD, &["inputs", "motors", "lamps"])?;
    let inputs =
        |value: &DeValue<'_>| map(value, INPUTS, |name| terminal(&Input::ALL, name), sensor);
    let motors =
        |value: &DeValue<'_>| map(value, MOTORS, |name| terminal(&Motor::ALL, name), motor);
    let lamps = list(LAMPS, terminal_value(&Output::ALL));
    Ok(Board {
        inputs: keys.optional("inputs", inputs)?.unwrap_or_default(),
        motors: keys.optional("motors", motors)?.unwrap_or_default(),
        lamps: keys.optional("lamps", lamps)?.unwrap_or_default().into_iter().collect(),
    })
}

fn sensor(value: &DeValue<'_>) -> Read<Sensor> {
    let (name, value) = only(value, SENSOR)?;
    at(name, sensor_named(name, value))
}

fn sensor_named(name: &str, value: &DeValue<'_>) -> Read<Sensor> {
    let keys = |known: &[&str]| Keys::of(value, VALUES, known);
    let contacts = || {
        let keys = keys(&["contact", "pressed"])?;
        Ok((keys.or("contact", Contact::default(), contact)?, keys.or("pressed", false, truth)?))
    };
    let mv = || keys(&["mv"])?.required("mv", whole(0..=u16::MAX.into()));
    Ok(match name {
        "switch" => contacts().map(|(contact, pressed)| Sensor::Switch { contact, pressed })?,
        "button" => contacts().map(|(contact, pressed)| Sensor::Button { contact, pressed })?,
        "resistor" => {
            let ohms = keys(&["ohms"])?.required("ohms", whole(0..=u32::MAX.into()))?;
            Sensor::Resistor { ohms }
        }
        "ntc" => Sensor::Ntc { celsius: keys(&["celsius"])?.required("celsius", number)? },
        "photo_transistor" => {
            Sensor::PhotoTransistor { light: keys(&["light"])?.required("light", number)? }
        }
        "voltage" => Sensor::Voltage { mv: mv()? },
        "ultrasonic" => Sensor::Ultrasonic { cm: keys(&["cm"])?.required("cm", number)? },
        "colour" => Sensor::Colour { mv: mv()? },
        "trail" => Sensor::Trail { white: keys(&["white"])?.required("white", truth)? },
        _ => {
            return Err(Mistake::new(
                "there is no such sensor; there are switch, button, resistor, ntc, \
                 photo_transistor, voltage, ultrasonic, colour, trail",
            ))
        }
    })
}

fn contact(value: &DeValue<'_>) -> Read<Contact> {
    match value.as_str() {
        Some("normally_open") => Ok(Contact::NormallyOpen),
        Some("normally_closed") => Ok(Contact::NormallyClosed),
        _ => Err(Mistake::new(CONTACT)),
    }
}

fn motor(value: &DeValue<'_>) -> Read<MotorModel> {
    let known = ["top_speed", "time_constant", "load", "pulses_per_turn", "slide"];
    let keys = Keys::of(value, MOTOR, &known)?;
    let default = MotorModel::default();
    Ok(MotorModel {
        top_speed: keys.or("top_speed", default.top_speed, number)?,
        time_constant: keys.or("time_constant", default.time_constant, number)?,
        load: keys.or("load", default.load, number)?,
        pulses_per_turn: keys.optional("pulses_per_turn", number)?,
        slide: keys.optional("slide", slide)?,
    })
}

fn slide(value: &DeValue<'_>) -> Read<Slide> {
    let known = ["travel", "position", "start_switch", "end_switch", "seen_by"];
    let keys = Keys::of(value, SLIDE, &known)?;
    Ok(Slide {
        travel: keys.required("travel", travel)?,
        position: keys.or("position", 0.0, number)?,
        start_switch: keys.optional("start_switch", terminal_value(&Input::ALL))?,
        end_switch: keys.optional("end_switch", terminal_value(&Input::ALL))?,
        seen_by: keys.optional("seen_by", seen_by)?,
    })
}

fn travel(value: &DeValue<'_>) -> Read<Travel> {
    match only(value, TRAVEL)? {
        ("pulses", value) => at("pulses", number(value).map(Travel::Pulses)),
        ("mm", value) => at("mm", mm(value)),
        (name, _) => at(name, Err(Mistake::new("there is no such unit; there are pulses, mm"))),
    }
}

fn mm(value: &DeValue<'_>) -> Read<Travel> {
    let keys = Keys::of(value, MM, &["length", "per_turn"])?;
    Ok(Travel::Mm {
        length: keys.required("length", number)?,
        per_turn: keys.required("per_turn", number)?,
    })
}

fn seen_by(value: &DeValue<'_>) -> Read<SeenBy> {
    let keys = Keys::of(value, SEEN_BY, &["input", "start_cm", "end_cm"])?;
    Ok(SeenBy {
        input: keys.required("input", terminal_value(&Input::ALL))?,
        start_cm: keys.required("start_cm", number)?,
        end_cm: keys.required("end_cm", number)?,
    })
}

fn script(value: &DeValue<'_>) -> Read<Script> {
    let keys = Keys::of(value, SCRIPT, &["period", "events"])?;
    Ok(Script {
        period: keys.optional("period", number)?,
        events: keys.or("events", Vec::new(), list(EVENTS, event))?,
    })
}

fn event(value: &DeValue<'_>) -> Read<ScriptEvent> {
    let known = ["at", "controller", "input", "pressed", "remote", "i2c"];
    let all = Keys::of(value, EVENT, &known)?;
    let at = all.required("at", number)?;
    // Each kind has its own keys besides the time.
    let action = if all.has("remote") {
        let keys = Keys::of(value, EVENT, &["at", "remote"])?;
        ScriptAction::Remote(keys.required("remote", remote)?)
    } else if all.has("i2c") {
        Keys::of(value, EVENT, &["at", "i2c"])?.required("i2c", registers_of_device)?
    } else {
        ScriptAction::Press {
            controller: all.or("controller", 0, whole(0..=CONTROLLERS))?,
            input: all.required("input", terminal_value(&Input::ALL))?,
            pressed: all.required("pressed", truth)?,
        }
    };
    Ok(ScriptEvent { at, action })
}

fn remote(value: &DeValue<'_>) -> Read<Remote> {
    let known = ["dip1", "dip2", "left_x", "left_y", "right_x", "right_y", "on", "off"];
    let keys = Keys::of(value, REMOTE, &known)?;
    let axis = |key| keys.or(key, 0, whole(-i64::from(AXIS_MAX)..=AXIS_MAX.into()));
    let bit = |key| keys.or(key, false, truth);
    Ok(Remote {
        dip1: bit("dip1")?,
        dip2: bit("dip2")?,
        left_x: axis("left_x")?,
        left_y: axis("left_y")?,
        right_x: axis("right_x")?,
        right_y: axis("right_y")?,
        on: bit("on")?,
        off: bit("off")?,
    })
}

fn device(value: &DeValue<'_>) -> Read<I2cDevice> {
    let keys = Keys::of(value, DEVICE, &["address", "registers"])?;
    let address = keys.required("address", device_address())?;
    let written = keys.or("registers", Vec::new(), list(REGISTERS, registers))?;
    Ok(written.into_iter().fold(I2cDevice::new(address), |device, (register, values)| {
        device.with_registers(register, &values)
    }))
}

/// A register, and values for it and the following ones.
fn registers(value: &DeValue<'_>) -> Read<(u8, Vec<u8>)> {
    register_keys(&Keys::of(value, DEVICE, &["register", "values"])?)
}

fn registers_of_device(value: &DeValue<'_>) -> Read<ScriptAction> {
    let keys = Keys::of(value, DEVICE, &["address", "register", "values"])?;
    let address = keys.required("address", device_address())?;
    let (register, values) = register_keys(&keys)?;
    Ok(ScriptAction::I2c { address, register, values })
}

fn register_keys(keys: &Keys<'_, '_>) -> Read<(u8, Vec<u8>)> {
    Ok((keys.required("register", byte())?, keys.required("values", list(BYTES, byte()))?))
}

/// An I2C address of 7 bits.
fn device_address() -> impl Fn(&DeValue<'_>) -> Read<u8> {
    whole(0..=0x7F)
}

fn byte() -> impl Fn(&DeValue<'_>) -> Read<u8> {
    whole(0..=u8::MAX.into())
}
