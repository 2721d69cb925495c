//! `txt classroom`: a controller for each pupil, and a page that looks at all.

use std::cell::Cell;
use std::fs;
use std::io::Write;
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::TransferAreaComHandler;
use serde_json::json;

use crate::lesson::get;
use crate::panel::page::{self, is_running, Page};
use crate::running::Running;

const LIMIT: Duration = Duration::from_secs(60);

/// A page's address and token, from its link.
fn place(link: &str) -> (String, String) {
    let place = link.strip_prefix("http://").and_then(|rest| rest.split_once("/?token="));
    let (address, token) = place.unwrap_or_else(|| panic!("{link:?} is not a link"));
    (address.to_owned(), token.to_owned())
}

struct Classroom {
    _running: Running,
    all: (String, String),
    /// Of each pupil: where programs connect to, and the page.
    pupils: Vec<(String, (String, String))>,
}

impl Classroom {
    fn start(count: usize) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(["classroom", &count.to_string(), "--port", "0", "--world", "slide"]);
        let running = Running::start(command.stdin(Stdio::null()));
        let all = place(running.line().strip_prefix("all ").unwrap());
        let pupil = |number: usize| {
            let line = running.line();
            let rest = line.strip_prefix(&format!("pupil {number}: program ")).unwrap();
            let (program, link) = rest.split_once(", page ").unwrap();
            (program.to_owned(), place(link))
        };
        let pupils = (1..=count).map(pupil).collect();
        Self { _running: running, all, pupils }
    }
}

#[test]
fn each_pupil_has_a_controller_and_the_page_for_all_only_looks() {
    let classroom = Classroom::start(3);
    let open = |(address, token): &(String, String)| Page::open(address, token);
    let mut all = open(&classroom.all);
    let (program, link) = &classroom.pupils[1];
    let mut own = open(link);
    let handler = TransferAreaComHandler::builder(&**program).build().unwrap();
    handler.begin_transfer().unwrap();
    assert_eq!(handler.device_name().as_deref(), Some("TXT 2"));
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 300;
    // The pupil's page has one controller.
    let state = own.state(0, is_running);
    assert_eq!(state["link"]["name"], "TXT 2");
    let state =
        all.state(1, |state| is_running(state) && state["areas"][0]["motors"][0]["duty"][0] == 300);
    assert_eq!(state["link"]["name"], "TXT 2");
    assert!(!is_running(&all.state(2, |_| true)));

    let press = |host| json!({"do": "press", "host": host, "input": 2, "pressed": true});
    assert_eq!(own.refused(press(1)), "no_host");
    assert_eq!(all.refused(press(1)), "only_looks");
    own.done(press(0));
    drop(handler.areas().wait_until(|areas| areas[LOCAL_IO].input.uni[2] == 1, LIMIT).unwrap());
    // The button of another pupil is not pressed.
    let others = all.state(0, |_| true);
    assert_eq!(others["world"]["boards"][0]["inputs"][2]["value"], 0.0);
    handler.end_transfer().unwrap();
}

#[test]
fn a_page_of_many_gets_more_of_the_controller_that_it_shows() {
    let classroom = Classroom::start(12);
    let mut all = Page::open(&classroom.all.0, &classroom.all.1);
    all.done(json!({"do": "look", "only": 3}));
    let mut count = |host: u64| {
        // From one state of the first controller to another one, however fast they come.
        let seen = Cell::new(0);
        for _ in 0..8 {
            all.wait(|state| {
                seen.set(seen.get() + u32::from(state["host"] == host));
                state["type"] == "state" && state["host"] == 0
            });
        }
        seen.get()
    };
    let (shown, other) = (count(3), count(5));
    assert!(shown >= 2 * other && other > 0, "{shown} and {other}");
}

#[test]
fn a_pupil_with_many_pages_leaves_room_for_others() {
    let classroom = Classroom::start(2);
    let (address, token) = &classroom.pupils[0].1;
    let open = || {
        let page = Page::connect(address, page::request(address, token)).ok();
        page.inspect(Page::ignore_all)
    };
    let _many: Vec<_> = (0..300).map_while(|_| open()).collect();
    for (address, token) in [&classroom.all, &classroom.pupils[1].1] {
        Page::open(address, token);
    }
}

#[test]
fn a_link_that_is_nearly_right_lets_nobody_in() {
    let classroom = Classroom::start(1);
    let (address, token) = &classroom.pupils[0].1;
    assert_ne!(*token, classroom.all.1);
    let wrong = page::request(address, &token[1..]);
    assert_eq!(Page::connect(address, wrong).err(), Some(403));
}

#[test]
fn a_number_of_pupils_for_whom_there_are_no_ports_is_a_sentence() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["classroom", "60", "--port", "65400"]).stdin(Stdio::null());
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("--port"), "{said}");
}

#[test]
fn a_class_with_another_ending_is_refused_because_two_could_share_one_table() {
    let folder = tempfile::tempdir().unwrap();
    for class in ["lessons.7b", "lessons.8a", "7b.csv", "7b"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        // There are not enough ports, so it ends in any case.
        command.args(["classroom", "2", "--port", "65533", "--class", class]);
        let output = command.current_dir(folder.path()).stdin(Stdio::null()).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains(class) && said.contains("ends in .toml"), "{class}: {said}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// A classroom with a class, its link for all, and the lines of its pupils.
pub(crate) fn with_class(arguments: &[&str], folder: &Path) -> (Running, String, Vec<String>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["classroom", "--class", "7b.toml", "--port", "0"]).args(arguments);
    let running = Running::start(command.current_dir(folder));
    let all = running.line().strip_prefix("all ").unwrap().to_owned();
    let pupils = (0..2).map(|_| running.line()).collect();
    (running, all, pupils)
}

pub(crate) fn link_in(line: &str) -> &str {
    line.split_once(", page ").unwrap().1
}

#[test]
fn the_links_of_a_class_stay_when_it_is_started_again() {
    let folder = tempfile::tempdir().unwrap();
    let (first, all, pupils) = with_class(&["2"], folder.path());
    drop(first);
    let class = folder.path().join("7b.toml");
    let text = fs::read_to_string(&class).unwrap().replace("TXT 2", "Zoë");
    fs::write(&class, text + "lesson = 3\n").unwrap();

    let (_running, all_again, pupils_again) = with_class(&["--sheet", "7b.html"], folder.path());
    assert_eq!(all_again, all);
    assert_eq!(link_in(&pupils_again[0]), link_in(&pupils[0]));
    assert!(pupils_again[1].starts_with("pupil 2: Zoë: program "), "{}", pupils_again[1]);
    let lesson = link_in(&pupils_again[1]);
    assert_eq!(lesson.replace("/lesson?", "/?"), link_in(&pupils[1]));
    let sheet = _running.line();
    assert_eq!(sheet, "sheet 7b.html");
    let sheet = fs::read_to_string(folder.path().join("7b.html")).unwrap();
    assert!(
        sheet.contains("<h2>Zoë</h2>") && sheet.replace("<wbr>", "").contains(lesson),
        "{sheet}"
    );
}

#[test]
fn a_warning_names_the_pupil_whose_controller_it_is_about() {
    let folder = tempfile::tempdir().unwrap();
    let class = "[[pupils]]\nname = \"Zoë\"\nlesson = 3\n[[pupils]]\nname = \"Ben\"\n";
    fs::write(folder.path().join("7b.toml"), class).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["classroom", "--class", "7b.toml", "--port", "0"]);
    let log = folder.path().join("log");
    command.stderr(fs::File::create(&log).unwrap());
    let running = Running::start(command.current_dir(folder.path()));
    assert!(running.line().starts_with("all "));
    for pupil in ["Zoë", "Ben"] {
        let line = running.line();
        let program = line.split_once(": program ").unwrap().1.split_once(", page ").unwrap().0;
        TcpStream::connect(program).unwrap().write_all(b"No TXT knows this.").unwrap();
        let begin = Instant::now();
        loop {
            let said = fs::read_to_string(&log).unwrap();
            if said.contains(&format!("{pupil}: client 1 is cut off")) {
                break;
            }
            assert!(begin.elapsed() < LIMIT, "{pupil}: {said}");
            thread::sleep(Duration::from_millis(20));
        }
    }
}

#[test]
fn a_page_learns_that_its_token_is_not_known() {
    let classroom = Classroom::start(1);
    let (address, token) = &classroom.pupils[0].1;
    let asked = |token: &str| get(address, &format!("/known?token={token}")).0;
    assert_eq!(asked(token), 204);
    assert_eq!(asked(&classroom.all.1), 204);
    assert_eq!(asked("0123456789abcdef0123456789abcdef"), 403);
}

/// Runs `txt` in a network without a default route, as behind a school's switch. `None` where that is not allowed.
#[cfg(target_os = "linux")]
fn without_a_route(arguments: &str) -> Option<Running> {
    let network = |rest: &str| {
        let set_up = "ip link set lo up && ip link add school type dummy && ip addr add 192.168.77.5/24 dev school \
            && ip link set school up";
        let mut unshare = Command::new("unshare");
        unshare.args(["--net", "--map-root-user", "sh", "-c", &format!("{set_up} && {rest}")]);
        unshare.stderr(Stdio::null());
        unshare
    };
    if !network("true").status().is_ok_and(|status| status.success()) {
        eprintln!("skipped: no network can be made here");
        return None;
    }
    let txt = format!("exec {} {arguments}", env!("CARGO_BIN_EXE_txt"));
    Some(Running::start(&mut network(&txt)))
}

#[cfg(target_os = "linux")]
#[test]
fn links_work_in_a_network_without_a_default_route() {
    let class = "classroom 1 --bind 0.0.0.0 --port 0";
    let Some(classroom) = without_a_route(class) else { return };
    assert!(classroom.line().starts_with("all http://192.168.77.5:"));
    let pupil = classroom.line();
    assert!(pupil.starts_with("pupil 1: program 192.168.77.5:"), "{pupil}");
    assert!(pupil.contains(", page http://192.168.77.5:"), "{pupil}");
    let panel = without_a_route("panel --bind 0.0.0.0 --no-browser").unwrap();
    assert!(panel.line().starts_with("http://127.0.0.1:"));
    let elsewhere = panel.line();
    assert!(elsewhere.starts_with("from other computers: http://192.168.77.5:"), "{elsewhere}");
}
