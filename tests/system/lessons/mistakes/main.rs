//! What pupils get wrong at first: the name of a mistake, then the address of the controller.

mod light;
mod motion;
mod states;

use std::error::Error;
use std::io::Read;
use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::InvalidCall;
use ft_transfer_area::tx::Motor;
use ft_transfer_area::{Error as TxtError, FishX1Transfer, TransferAreaComHandler};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mistake = arguments.next().ok_or("no mistake")?;
    let address = arguments.next().ok_or("no address")?;
    let address = if mistake == "lamp/no_address" { String::from("127.0.0.1:1") } else { address };
    let handler = TransferAreaComHandler::builder(address).build()?;
    let (lesson, what) = mistake.split_once('/').ok_or("no lesson")?;
    set_up(&handler, &mistake);
    if mistake == "lamp/never_online" {
        return Ok(());
    }
    handler.begin_transfer()?;
    match lesson {
        "lamp" => light::lamp(&handler, what),
        "blink" => light::blink(&handler, what),
        "motor" => motion::motor(&handler, what),
        "end_switch" => motion::end_switch(&handler, what),
        "counter" => motion::counter(&handler, what),
        "distance" => motion::distance(&handler, what),
        "thermostat" => states::thermostat(&handler, what),
        "traffic_light" => states::traffic_light(&handler, what),
        "gate" => states::gate(&handler, what),
        "sorting" => states::sorting(&handler, what),
        _ => return Err("no such lesson".into()),
    }?;
    Ok(())
}

/// Configures inputs and outputs, unless that is the mistake.
fn set_up(handler: &TransferAreaComHandler, mistake: &str) {
    use ft_transfer_area::transfer_area::InputMode::{Resistance, Voltage};
    use ft_transfer_area::tx::Input::{I1, I2};
    let area = &mut handler.areas().lock()[LOCAL_IO];
    if mistake == "lamp/half_of_a_motor" || mistake == "thermostat/digital" {
        return;
    }
    match mistake.split('/').next() {
        Some("lamp" | "blink") => area.set_ft_motor_config(Motor::M4, false),
        Some("thermostat") => area.set_ft_uni_config(I1, Resistance, false),
        Some("traffic_light") => {
            area.set_ft_motor_config(Motor::M1, false);
            area.set_ft_motor_config(Motor::M2, false);
        }
        Some("sorting") => {
            area.set_ft_uni_config(I2, Voltage, false);
            area.set_ft_motor_config(Motor::M2, false);
        }
        _ => {}
    }
}

/// Answers each exchange, without end.
fn each_cycle(
    handler: &TransferAreaComHandler,
    mut answer: impl FnMut(&mut FishX1Transfer) -> Result<(), InvalidCall>,
) -> Result<(), TxtError> {
    loop {
        answer(&mut handler.areas().wait_cycle()?[LOCAL_IO])?;
    }
}

fn seconds(seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds));
}

/// Stops this process, and lets it go on after so many seconds.
fn stand_still(seconds: u32) -> std::io::Result<()> {
    let stop_and_go = format!("kill -STOP $PPID; echo; sleep {seconds}; kill -CONT $PPID");
    let mut shell = std::process::Command::new("sh");
    let shell = shell.args(["-c", &stop_and_go]).stdout(std::process::Stdio::piped()).spawn()?;
    // On a busy computer the shell begins when what should be disturbed is over, if this goes on meanwhile.
    shell.stdout.expect("it is piped").read_exact(&mut [0])
}

/// Whether this is the first program that this check has started.
fn is_first() -> std::io::Result<bool> {
    #[cfg(unix)]
    let check = std::os::unix::process::parent_id();
    #[cfg(not(unix))]
    let check = 0;
    let mark = std::env::temp_dir().join(format!("lesson_mistakes_{check}"));
    if std::fs::remove_file(&mark).is_ok() {
        return Ok(false);
    }
    std::fs::write(mark, "")?;
    Ok(true)
}
