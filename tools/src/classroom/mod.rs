//! `txt classroom`: a simulated TXT with a world for each pupil.

mod class;
mod kept;
mod sheet;

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use anyhow::{ensure, Context};
use ft_transfer_area::PORT;
use ft_transfer_area_simulator::world::{Script, World};
use ft_transfer_area_simulator::{SimulatedTxt, SimulatedTxtBuilder};

use self::class::{Class, Pupil};
use self::kept::Kept;
use self::sheet::Part;
use crate::check::{self, Desk};
use crate::panel::pages::{Pages, Simulated};
use crate::{arguments, interrupt, lines, open_files, print, web};

/// How many ports each simulated TXT has.
const PORTS: u16 = 3;
/// The most pupils.
const PUPILS: u16 = 60;
/// The world whose script shows something to a program that nobody stands beside.
const DEFAULT_WORLD: &str = "default";

const AFTER: &str = "\
Each pupil has a controller with a machine: programs connect to the address that is printed,
with its port, and the link shows the machine with its buttons. The link for all shows every
controller, and only looks. A link is all that is needed to come in, so give each pupil only
their own.

With --class the links and ports stay, also when pupils leave or come: the file has the tokens
and places, and a name and a world or a lesson for each pupil, which you can change. Without one
links are new at each start. Beside it, as .csv, is how far each pupil is in the lessons, also for
a spreadsheet and the next start.

With --bind 0.0.0.0 the pupils' computers reach it, and whoever reaches it can drive the
simulated controllers. Ctrl-C ends it.

Examples:
  txt classroom 12 --bind 0.0.0.0                     for the computers of twelve pupils
  txt classroom 12 --class 7b.toml                    the same links each time, later without the 12
  txt classroom 12 --class 7b.toml --sheet 7b.html    a sheet to print, with names and QR codes
  txt classroom 12 --world lesson1                    lessons, with task and check on each page
  txt classroom 2 --world slide                       to try it out on this computer";

/// Simulate a controller with a world for each pupil
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// How many pupils, 1 to 60
    #[arg(value_name = "N", required_unless_present = "class", value_parser = clap::value_parser!(u16).range(1..=PUPILS as i64))]
    pupils: Option<u16>,
    /// File of a class, made if it does not exist: names, worlds, and what makes links stay
    #[arg(long, value_name = "FILE")]
    class: Option<PathBuf>,
    /// Write a page to print, with each pupil's name, link and QR code
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// What each controller has plugged in: a world by name, or a .toml file
    #[arg(long, value_name = "WORLD", default_value = DEFAULT_WORLD)]
    world: String,
    /// Main port of the first controller; that of each next place is 3 higher; 0: any free ones
    /// [default: that of the class, or 65000]
    #[arg(long, value_name = "N")]
    port: Option<u16>,
    /// Port of the pages; 0 is a free one [default: that of the class, or 0]
    #[arg(long, value_name = "N")]
    page_port: Option<u16>,
    /// Where to serve it; 0.0.0.0 lets other computers in
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver()?;
    lines::never_wait_to_log()?;
    let mut class = read_class(args)?;
    let port = first_port(args, &class)?;
    open_files::check(class.pupils.len(), true);
    let pages = listen(args, &class)?;
    let places = start(args, &class, port)?;
    if let Some(path) = &args.class {
        class.keep(path, port, pages.port()).with_context(|| path.display().to_string())?;
    }
    let ip = web::reachable(args.bind);
    let mut parts = Vec::new();
    let mut desks = Vec::new();
    let mut txts = Vec::new();
    for (Pupil { name, token, .. }, Place { port, simulated, desk }) in
        class.pupils.iter().zip(places)
    {
        let program = SocketAddr::new(ip, port).to_string();
        let page = if desk.is_some() { pages.lesson_link(token) } else { pages.link(token) };
        parts.push(Part { name, program, page });
        desks.extend(desk.map(|desk| (name.as_str(), desk)));
        txts.push((simulated, token.clone()));
    }
    let class_file = args.class.as_ref().filter(|_| !desks.is_empty());
    let kept = class_file.map(|path| Kept::go_on(path.with_extension("csv"), &desks));
    let kept = kept.transpose()?;
    let all = pages.link(&class.token);
    pages.serve(&class.token, txts)?;
    tell(args, &all, &parts)?;
    // Clients and pages are served while this waits.
    match kept {
        Some(kept) => kept.write_until(&interrupted, &desks),
        None => Ok(interrupted.recv()?),
    }
}

fn read_class(args: &Args) -> anyhow::Result<Class> {
    let Some(path) = &args.class else {
        return Class::numbered(args.pupils.context("how many pupils are there?")?);
    };
    // Beside it is a file of the same name that ends in .csv: two classes must not share it.
    ensure!(
        path.extension().is_some_and(|ending| ending == "toml"),
        "{}: a class is a file that ends in .toml; give it such a name",
        path.display()
    );
    let class = Class::load(path, args.pupils).with_context(|| path.display().to_string())?;
    let count = class.pupils.len();
    ensure!(
        count <= usize::from(PUPILS),
        "{}: {count} pupils are too many, at most {PUPILS}",
        path.display()
    );
    Ok(class)
}

/// The main port of the first controller, after which there must be enough.
fn first_port(args: &Args, class: &Class) -> anyhow::Result<u16> {
    let port = args.port.or(class.port).unwrap_or(PORT);
    let places = class.pupils.iter().map(|pupil| pupil.place).max().unwrap_or(0);
    let last = usize::from(port) + usize::from(places) * usize::from(PORTS);
    ensure!(
        port == 0 || last <= 1 + usize::from(u16::MAX),
        "there are too few ports after {port} for {places} controllers; choose a lower one with --port"
    );
    Ok(port)
}

/// The main port of the controller at this place.
fn port_at(place: u16, first: u16) -> u16 {
    match first {
        0 => 0,
        first => first.saturating_add(place.saturating_sub(1).saturating_mul(PORTS)),
    }
}

fn listen(args: &Args, class: &Class) -> anyhow::Result<Pages> {
    let port = args.page_port.or(class.page_port).unwrap_or(0);
    Pages::listen(SocketAddr::new(args.bind, port)).context(
        "the pages can't be served; with --page-port 0 they get a free port, and other links",
    )
}

/// What runs for one pupil.
struct Place {
    port: u16,
    simulated: Simulated,
    /// If the pupil's world is that of a lesson.
    desk: Option<Desk>,
}

/// A simulated TXT for each pupil.
fn start(args: &Args, class: &Class, first: u16) -> anyhow::Result<Vec<Place>> {
    let mut started = Vec::new();
    for (pupil, device_name) in class.pupils.iter().zip(class.device_names()) {
        let world = pupil.world.as_ref().unwrap_or(&args.world);
        let port = port_at(pupil.place, first);
        let builder = SimulatedTxt::builder().bind(args.bind).port(port);
        let builder = builder.device_name(&device_name).log_name(&pupil.name);
        let place = place(&pupil.name, world, builder).with_context(|| pupil.name.clone())?;
        started.push(place);
    }
    Ok(started)
}

fn place(name: &str, world: &str, builder: SimulatedTxtBuilder) -> anyhow::Result<Place> {
    if let Some(lesson) = check::number_of_world(world) {
        let desk = check::desk(&lesson.to_string(), builder, name.to_owned())?;
        let simulated = desk.simulated();
        return Ok(Place { port: desk.port(), simulated, desk: Some(desk) });
    }
    let world = read_world(world)?;
    let txt = builder.world(world.clone()).start()?;
    let port = txt.port();
    let simulated = Simulated::alone(txt, Some(world), name.to_owned());
    Ok(Place { port, simulated, desk: None })
}

/// A world in which the pupil presses the buttons, not a script.
fn read_world(name: &str) -> anyhow::Result<World> {
    if name == DEFAULT_WORLD {
        return Ok(World::default().script(Script::default()));
    }
    arguments::world(name)
}

/// Prints the links, and writes the sheet.
fn tell(args: &Args, all: &str, parts: &[Part]) -> anyhow::Result<()> {
    print::line(format_args!("all {all}"))?;
    for (index, Part { name, program, page }) in parts.iter().enumerate() {
        let name = if args.class.is_some() { format!("{name}: ") } else { String::new() };
        print::line(format_args!("pupil {}: {name}program {program}, page {page}", index + 1))?;
    }
    if args.bind.is_unspecified() {
        let others: Vec<_> = web::own_addresses().iter().skip(1).map(ToString::to_string).collect();
        if !others.is_empty() {
            print::line(format_args!(
                "this computer has other addresses, for pupils in other networks: {}",
                others.join(", ")
            ))?;
        }
    }
    if let Some(path) = &args.sheet {
        class::write(path, &sheet::html(parts)?).with_context(|| path.display().to_string())?;
        print::line(format_args!("sheet {}", path.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use ft_transfer_area::tx::Input;
    use ft_transfer_area_simulator::Machine;

    use super::*;

    #[test]
    fn nobody_presses_the_buttons_of_the_default_world() {
        let mut machine = Machine::with_world(1, read_world(DEFAULT_WORLD).unwrap()).unwrap();
        for _ in 0..100 {
            machine.step(Duration::from_millis(100));
            let button = machine.world().and_then(|world| world.sensor(0, Input::I1)).unwrap();
            assert_eq!(button.value().value, 0.0);
        }
    }
}
