//! The stations of the factory, each on its shipped world and with a broker of its own. Without Mosquitto or its library
//! they are skipped.

use std::env;
use std::io::{self, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::world::{Piece, World};
use ft_transfer_area_simulator::SimulatedTxt;

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

/// All places, each with what lies there.
type Places = Vec<(String, Option<Piece>)>;

/// Runs a station with these arguments on its world: what it has said, and what lies where.
fn drive(station: &str, arguments: &[&str]) -> Option<(String, Places)> {
    let broker = Broker::start().filter(|_| compilers() && has_library());
    let Some(broker) = broker else {
        // A test's own print would only be shown if it fails.
        let _ = writeln!(io::stderr(), "skipped: there is no Mosquitto or no library of it here");
        return None;
    };
    let world = World::shipped(station).expect("it is shipped");
    let txt = SimulatedTxt::builder().world(world).start().expect("free ports");
    let mut line = vec![format!("c/examples/factory/{station}.cpp")];
    let address = txt.address().to_string();
    let options =
        ["-l", "mosquitto", "--host", &address, "--"].into_iter().chain(arguments.iter().copied());
    line.extend(options.map(str::to_owned));
    let output = tx_run_with(&line, &[("FACTORY_BROKER", format!("127.0.0.1:{}", broker.port))]);
    let (said, errors) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{}: {said}{errors}", output.status);
    assert!(txt.wait_until(DEADLINE, |machine| !machine.connected()), "the connection stays open");
    txt.with_machine(|machine| {
        let world = machine.world().expect("it has one");
        assert_eq!(world.mishaps(), [""; 0]);
        Some((said, world.places()))
    })
}

fn piece(places: &[(String, Option<Piece>)], name: &str) -> Option<Piece> {
    places.iter().find(|(place, _)| place == name).expect("there is this place").1
}

#[cfg_attr(windows, ignore = "no C compiler is expected there")]
#[test]
fn discs_end_in_the_storages_of_their_colours() {
    let Some((said, places)) = drive("sorting_line", &["3"]) else { return };
    for (colour, wanted) in [("white", Piece::White), ("red", Piece::Red), ("blue", Piece::Blue)] {
        assert!(said.contains(&format!("sorted {colour}")), "{said}");
        assert_eq!(piece(&places, &format!("{colour}_storage")), Some(wanted), "{said}");
    }
}

#[cfg_attr(windows, ignore = "no C compiler is expected there")]
#[test]
fn a_disc_is_burnt_and_sawn_and_leaves_the_processing_station() {
    let Some((said, places)) = drive("processing_station", &["1"]) else { return };
    assert!(said.ends_with("factory/processing_station: done\n"), "{said}");
    assert_eq!((piece(&places, "oven"), piece(&places, "exit")), (None, Some(Piece::White)));
}

#[cfg_attr(windows, ignore = "no C compiler is expected there")]
#[test]
fn a_container_comes_out_of_the_warehouse_and_back_to_its_shelf() {
    let Some((said, places)) = drive("high_bay_warehouse", &["A1"]) else { return };
    assert!(said.contains("offers A1") && said.contains("has stored A1"), "{said}");
    for shelf in ["A1", "B2", "C3"] {
        assert_eq!(piece(&places, shelf), Some(Piece::Container), "{shelf}");
    }
}
