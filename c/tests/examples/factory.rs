//! The stations of the factory, each on its shipped world and all together, with a broker for each test. Without
//! Mosquitto or its library they are skipped. And the simulated reader for the robot of other programs.

use std::env;
use std::io::{self, Write};
use std::iter;
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::world::{Factory, Piece, Whereabouts, World};
use ft_transfer_area_simulator::{SimulatedFactory, SimulatedTxt, SimulatedTxtBuilder};

use super::run::{compilers, text, tx_run_with, DEADLINE};

/// A running Mosquitto.
struct Broker {
    process: Child,
    port: u16,
}

impl Broker {
    /// `None` where it is not installed.
    fn start() -> Option<Self> {
        let folders = env::split_paths(&env::var_os("PATH")?).collect::<Vec<_>>();
        let folders = folders.into_iter().chain([PathBuf::from("/usr/sbin")]);
        let program =
            folders.map(|folder| folder.join("mosquitto")).find(|program| program.is_file())?;
        let begin = Instant::now();
        loop {
            let port = TcpListener::bind("127.0.0.1:0").ok()?.local_addr().ok()?.port();
            let mut command = Command::new(&program);
            command.args(["-p", &port.to_string()]).stdout(Stdio::null()).stderr(Stdio::null());
            let mut broker = Self { process: command.spawn().expect("it is installed"), port };
            // Another program may have taken the port meanwhile; then Mosquitto ends.
            while broker.process.try_wait().expect("it can be asked").is_none() {
                if TcpStream::connect(("127.0.0.1", port)).is_ok() {
                    return Some(broker);
                }
                assert!(begin.elapsed() < DEADLINE, "Mosquitto does not listen");
                thread::sleep(Duration::from_millis(10));
            }
        }
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn has_library() -> bool {
    let mut compiler = Command::new("c++");
    compiler.args(["-fsyntax-only", "-include", "mosquitto.h", "-x", "c++", "/dev/null"]);
    compiler.output().is_ok_and(|output| output.status.success())
}

/// A broker, if the programs can be compiled and have one. If not, this is said.
fn broker() -> Option<Broker> {
    let broker = Broker::start().filter(|_| compilers() && has_library());
    if broker.is_none() {
        // A test's own print would only be shown if it fails.
        let _ = writeln!(io::stderr(), "skipped: there is no Mosquitto or no library of it here");
    }
    broker
}

/// All places, each with what lies there.
type Places = Vec<(String, Option<Piece>)>;

/// Each exchange is 10 ms for the machine, and for the programs, which count exchanges. Here it takes less.
fn hasten(builder: SimulatedTxtBuilder) -> SimulatedTxtBuilder {
    builder.pace(Duration::ZERO)
}

/// Runs a station with these arguments until it ends. Returns what it has said.
fn run(station: &str, arguments: &str, txt: &SimulatedTxt, broker: &Broker) -> String {
    let address = txt.address();
    let line =
        format!("c/examples/factory/{station}.cpp -l mosquitto --host {address} -- {arguments}");
    let line: Vec<_> = line.split(' ').map(str::to_owned).collect();
    let output = tx_run_with(&line, &[("FACTORY_BROKER", format!("127.0.0.1:{}", broker.port))]);
    let (said, errors) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{station}: {}: {said}{errors}", output.status);
    assert!(txt.wait_until(|machine| !machine.connected(), DEADLINE), "the connection stays open");
    let mishaps = txt.with_machine(|machine| Some(machine.world()?.mishaps()));
    assert_eq!(mishaps, Some(Vec::new()), "{said}");
    said
}

/// Runs a station on its shipped world: what it has said, and what lies where.
fn drive(station: &str, arguments: &str) -> Option<(String, Places)> {
    let broker = broker()?;
    let world = World::shipped(station).expect("it is shipped");
    let txt = hasten(SimulatedTxt::builder()).world(world).start().expect("free ports");
    let said = run(station, arguments, &txt, &broker);
    Some((said, txt.with_machine(|machine| machine.world().expect("it has one").places())))
}

fn piece(places: &[(String, Option<Piece>)], name: &str) -> Option<Piece> {
    places.iter().find(|(place, _)| place == name).expect("there is this place").1
}

#[cfg_attr(windows, ignore = "no Mosquitto is expected there")]
#[test]
fn discs_end_in_the_storages_of_their_colours() {
    let Some((said, places)) = drive("sorting_line", "3") else { return };
    for (colour, wanted) in [("white", Piece::White), ("red", Piece::Red), ("blue", Piece::Blue)] {
        assert!(said.contains(&format!("sorted {colour}")), "{said}");
        assert_eq!(piece(&places, &format!("{colour}_storage")), Some(wanted), "{said}");
    }
}

#[cfg_attr(windows, ignore = "no Mosquitto is expected there")]
#[test]
fn a_disc_is_burnt_and_sawn_and_leaves_the_processing_station() {
    let Some((said, places)) = drive("processing_station", "1") else { return };
    assert!(said.ends_with("factory/processing_station: done\n"), "{said}");
    assert_eq!((piece(&places, "oven"), piece(&places, "exit")), (None, Some(Piece::White)));
}

#[cfg_attr(windows, ignore = "no Mosquitto is expected there")]
#[test]
fn a_container_comes_out_of_the_warehouse_and_back_to_its_shelf() {
    let Some((said, places)) = drive("high_bay_warehouse", "A1") else { return };
    assert!(said.contains("offers A1") && said.contains("has stored A1"), "{said}");
    for shelf in ["A1", "B2", "C3"] {
        assert_eq!(piece(&places, shelf), Some(Piece::Container), "{shelf}");
    }
}

/// Delivers a workpiece to the robot, and takes it away where the robot brings it in the end.
fn order(robot: &SimulatedTxt, wanted: Piece) {
    let put = robot.with_machine(|machine| {
        machine.world_mut().is_some_and(|world| world.put(wanted, "delivery"))
    });
    assert!(put, "{wanted} can't be delivered");
    let is_there = |places: Places| piece(&places, "robot.pickup") == Some(wanted);
    let comes = robot.wait_until(
        |machine| machine.world().is_some_and(|world| is_there(world.places())),
        DEADLINE,
    );
    assert!(comes, "{wanted} does not come back");
    assert_eq!(robot.with_machine(|machine| machine.world_mut()?.take("pickup")), Some(wanted));
}

/// Whether `THOROUGH` is in the environment.
fn is_thorough() -> bool {
    env::var_os("THOROUGH").is_some()
}

/// The workpieces that go through the factory: one, or of each colour when it is thorough. The first one is of another
/// colour than the one that the processing station has when it is alone.
fn orders() -> &'static [Piece] {
    if is_thorough() {
        &[Piece::Blue, Piece::White, Piece::Red]
    } else {
        &[Piece::Red]
    }
}

/// The shipped factory; with faster motors, to save a minute, unless it is thorough.
fn factory() -> SimulatedFactory {
    let mut factory = Factory::shipped("factory").expect("it is shipped");
    // The sorting line is as it is: it counts what its belt runs.
    let is_hastened = |name: &String| name != "sorting" && !is_thorough();
    for (_, world) in factory.controllers.iter_mut().filter(|(name, _)| is_hastened(name)) {
        let boards = iter::once(&mut world.master).chain(&mut world.extensions);
        boards.flat_map(|board| board.motors.values_mut()).for_each(|motor| motor.top_speed *= 4.0);
    }
    SimulatedFactory::start(factory, 0, |_, builder| hasten(builder)).expect("free ports")
}

/// Controllers with their programs, and how often each has to do with a workpiece.
const STATIONS: [(&str, &str, usize); 4] = [
    ("warehouse", "high_bay_warehouse", 2),
    ("robot", "gripper_robot", 1),
    ("processing", "processing_station", 1),
    ("sorting", "sorting_line", 1),
];

#[cfg_attr(windows, ignore = "no Mosquitto is expected there")]
#[test]
fn workpieces_go_through_the_whole_factory_and_come_back() {
    let Some(broker) = broker() else { return };
    let factory = factory();
    let txt = |name| factory.txt(name).expect("it is one of them");
    thread::scope(|scope| {
        for (name, station, times) in STATIONS {
            let (txt, broker, times) = (txt(name), &broker, times * orders().len());
            // What it has said is shown if the test fails.
            scope.spawn(move || print!("{}", run(station, &times.to_string(), txt, broker)));
        }
        orders().iter().for_each(|wanted| order(txt("robot"), *wanted));
    });
    let mut pieces =
        txt("robot").with_machine(|machine| machine.world().expect("it has one").pieces());
    // As many as at the start: the robot has brought back no other one.
    assert_eq!(pieces.len(), 15);
    pieces.retain(|(_, place)| !is_in_a_shelf(place));
    assert_eq!(pieces, []);
}

/// Or in a container, which is a piece itself.
fn is_in_a_shelf(place: &Whereabouts) -> bool {
    match place {
        Whereabouts::Place(name) => name.starts_with("warehouse.") && !name.contains("belt"),
        place => matches!(place, Whereabouts::Container(_)),
    }
}

/// What a program with the reader says with this tag on it.
fn read_tag(tag: &str) -> String {
    let line = "c/tests/examples/reader.cpp c/examples/factory/reader -I c/examples/factory/reader";
    let line: Vec<_> = line.split(' ').map(str::to_owned).collect();
    let output = tx_run_with(&line, &[("FACTORY_TAG", tag.to_owned())]);
    let (said, errors) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{tag}: {}: {said}{errors}", output.status);
    said
}

#[test]
fn the_reader_has_a_tag_of_the_colour_that_is_named_and_keeps_what_is_written() {
    if !compilers() {
        return;
    }
    for (tag, expected) in [
        ("white", "04000000000001 type 1, then 9 8 7 6\n"),
        ("blue", "04000000000003 type 3, then 9 8 7 6\n"),
        ("none", "no tag\n"),
    ] {
        assert_eq!(read_tag(tag).replace('\r', ""), expected);
    }
}
