//! `txt find`.

use std::net::{IpAddr, SocketAddr};
use std::thread;
use std::time::Duration;

use ft_transfer_area::{
    find_controllers, CameraOptions, Error, FoundController, SearchOptions, TransferAreaComHandler,
    TriedAddress, PORT, USUAL_HOSTS,
};
use indicatif::ProgressBar;
use serde_json::{json, Value};

use crate::{arguments, print};

const AFTER: &str = "\
It asks at 192.168.7.2 (USB), 192.168.8.2 (Wi-Fi), 192.168.9.2 (Bluetooth), 127.0.0.1 and at the
addresses that you give, all at the same time. This moves nothing. A controller on which somebody is
online does not answer others, and is not disturbed: it is listed without its name.

A controller does not say whether it has a camera. With --try-camera, each one that answers goes
online and starts its camera for up to 8 seconds. This stops a program that runs on it.

The exit status is 1 when no controller has answered.

Example: txt find 192.168.1.17 127.0.0.1:65010";

/// A packet that is lost on Wi-Fi is sent again after a second.
const LIMIT: Duration = Duration::from_millis(1500);

/// How long the first picture may take: a camera needs 2 s, a connection that is refused is tried for 5 s.
const PICTURE: Duration = Duration::from_secs(8);

const UNKNOWN: &str = "unknown";

/// List the controllers that answer
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    #[command(flatten)]
    places: Places,
    /// Start each camera to see whether there is one
    #[arg(long)]
    try_camera: bool,
    /// Print JSON, for scripts
    #[arg(long)]
    json: bool,
}

/// Where to ask.
#[derive(clap::Args, Default)]
pub(crate) struct Places {
    /// Further addresses, with or without a port
    #[arg(value_parser = address)]
    addresses: Vec<String>,
    /// Ask only at the given addresses
    #[arg(long, requires = "addresses")]
    only: bool,
}

impl Places {
    /// Asks everywhere at the same time.
    pub(crate) fn search(&self) -> Result<Findings, Error> {
        let usual = if self.only { &[] } else { USUAL_HOSTS };
        let addresses = each_once(usual, &self.addresses);
        let mut all = Findings::default();
        match find_controllers(&SearchOptions::default().addresses(addresses).limit(LIMIT)) {
            Ok(answers) => {
                for controller in answers.controllers {
                    // It may have been asked by its name, too.
                    if !all.has(controller.address) {
                        all.found.push(Found { controller, camera: None });
                    }
                }
                all.tried = answers.others;
            }
            Err(Error::NoController { tried }) => all.tried = tried,
            Err(error) => return Err(error),
        }
        Ok(all)
    }
}

/// An address is not "auto", which has programs search as this command does.
fn address(given: &str) -> Result<String, &'static str> {
    if arguments::is_auto(given) {
        return Err("\"auto\" is no address: without any, this command asks where \"auto\" does");
    }
    Ok(given.to_owned())
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let progress = ProgressBar::new_spinner().with_message("asking for controllers");
    progress.tick();
    let mut all = args.places.search()?;
    if args.try_camera {
        progress.set_message("starting the cameras");
        all.try_cameras();
    }
    progress.finish_and_clear();
    let answer = if args.json { print::json(&all.json())? } else { all.table() };
    if !answer.is_empty() {
        print::line(answer.trim_end_matches('\n'))?;
    }
    if all.found.is_empty() {
        return Err(Error::NoController { tried: all.tried }.into());
    }
    let silent = all.tried.iter().filter(|tried| !tried.perhaps_in_use);
    let asked_for = silent.filter(|tried| args.places.addresses.contains(&tried.address));
    asked_for.for_each(|tried| eprintln!("{}", print::clean(&tried.to_string())));
    Ok(())
}

/// The given addresses and the usual ones, none of them twice: a controller answers one at a time.
fn each_once<'a>(usual: &[&'a str], given: &'a [String]) -> Vec<&'a str> {
    let usual = usual.iter().copied().filter(|usual| !given.iter().any(|one| is_same(usual, one)));
    let mut addresses: Vec<&str> = usual.collect();
    for one in given {
        if !addresses.iter().any(|other| is_same(other, one)) {
            addresses.push(one);
        }
    }
    addresses
}

/// Whether both are the same, with and without the usual port.
fn is_same(one: &str, other: &str) -> bool {
    let number = |text: &str| {
        text.parse().or_else(|_| text.parse().map(|ip: IpAddr| SocketAddr::new(ip, PORT))).ok()
    };
    one == other || number(one).is_some_and(|one| number(other) == Some(one))
}

struct Found {
    controller: FoundController,
    /// `None` when it is not known.
    camera: Option<bool>,
}

/// What the search has found.
#[derive(Default)]
pub(crate) struct Findings {
    found: Vec<Found>,
    tried: Vec<TriedAddress>,
}

impl Findings {
    fn has(&self, address: SocketAddr) -> bool {
        self.found.iter().any(|found| found.controller.address == address)
    }

    /// Starts the cameras of all that answered, at the same time.
    fn try_cameras(&mut self) {
        thread::scope(|scope| {
            for Found { controller, camera } in &mut self.found {
                let address = controller.address;
                let asked = thread::Builder::new().spawn_scoped(scope, move || {
                    *camera = has_camera(&address.to_string()).unwrap_or_else(|error| {
                        log::warn!("{address}: {error:#}");
                        None
                    });
                });
                if let Err(error) = asked {
                    log::warn!("{address}: no thread could be started for its camera: {error:#}");
                }
            }
        });
    }

    fn table(&self) -> String {
        let head = ["ADDRESS", "WAY", "NAME", "FIRMWARE", "CAMERA", "ONLINE"].map(String::from);
        let found = self.found.iter().map(|Found { controller, camera }| {
            [
                controller.address.to_string(),
                controller.connection.to_string(),
                print::clean(&controller.name).into_owned(),
                controller.firmware.to_string(),
                String::from(camera.map_or(UNKNOWN, |there| if there { "yes" } else { "no" })),
                String::from("nobody"),
            ]
        });
        let in_use = self.tried.iter().filter(|tried| tried.perhaps_in_use).map(|tried| {
            let [name, firmware, camera] = [(); 3].map(|()| String::from(UNKNOWN));
            let online = format!("perhaps: {}", tried.outcome);
            [tried.address.clone(), tried.connection.to_string(), name, firmware, camera, online]
        });
        let rows: Vec<_> = found.chain(in_use).collect();
        if rows.is_empty() {
            return String::new();
        }
        lines(&[vec![head], rows].concat())
    }

    pub(crate) fn json(&self) -> Value {
        let controllers = self.found.iter().map(|Found { controller, camera }| {
            json!({
                "address": controller.address.to_string(),
                "way": controller.connection.to_string(),
                "name": controller.name,
                "firmware": controller.firmware.to_string(),
                "camera": camera,
                "online": false,
            })
        });
        let others = self.tried.iter().map(|tried| {
            json!({
                "address": tried.address,
                "way": tried.connection.to_string(),
                "perhaps_in_use": tried.perhaps_in_use,
                "outcome": tried.outcome,
            })
        });
        json!({ "controllers": Value::from_iter(controllers), "others": Value::from_iter(others) })
    }
}

/// Whether a picture comes; `None` when something else has gone wrong.
fn has_camera(address: &str) -> Result<Option<bool>, Error> {
    let handler = TransferAreaComHandler::builder(address).build()?;
    handler.begin_transfer()?;
    let frames = handler.start_camera(CameraOptions::default())?;
    let frame = frames.recv_timeout(PICTURE);
    let error = handler.camera_error();
    handler.end_transfer()?;
    match (frame, error) {
        (Ok(_), _) => Ok(Some(true)),
        (_, None | Some(Error::ConnectionRefused { .. } | Error::NoAnswer { .. })) => {
            Ok(Some(false))
        }
        (_, Some(error)) => Err(error),
    }
}

/// The rows as lines with aligned columns.
fn lines(rows: &[[String; 6]]) -> String {
    let widest = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
    let widths: [usize; 6] = std::array::from_fn(|column| widest(column).unwrap_or(0));
    let line = |row: &[String; 6]| {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}  "));
        format!("{}\n", cells.collect::<String>().trim_end())
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_address_is_asked_once() {
        let given = ["127.0.0.1:65000", "txt:4000", "::1", "[::1]:65000", "txt:4000", "10.0.0.1:1"];
        let given = given.map(str::to_owned);
        let asked = each_once(&["192.168.7.2", "127.0.0.1"], &given);
        assert_eq!(asked, ["192.168.7.2", "127.0.0.1:65000", "txt:4000", "::1", "10.0.0.1:1"]);
    }
}
