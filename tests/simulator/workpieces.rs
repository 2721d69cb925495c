//! Worlds that carry workpieces, driven step by step in the manner of the programs for such models.

use ft_transfer_area::tx::{Input, Motor, Output};
use ft_transfer_area_simulator::world::{Piece, Plug, Whereabouts};

use crate::program::{sentences, Axes, Program, Turn};

/// Sorts what comes to the entry. Returns the lowest voltage of the colour sensor and the storage that it
/// came to.
fn sort(line: &mut Program) -> (i16, Input) {
    line.wait_until("something is at the entry", |line| line.input(Input::I1) == 0);
    line.turn(Motor::M1, Turn::Right);
    let mut lowest = 3000;
    line.wait_until("it is before the ejectors", |line| {
        lowest = lowest.min(line.input(Input::I2));
        line.input(Input::I3) == 0
    });
    line.set(Output::O8, true);
    let (edges, valve) = match lowest {
        200..940 => (5, Output::O5),
        940..1430 => (15, Output::O6),
        1430..2000 => (26, Output::O7),
        other => panic!("{other} mV is not a colour"),
    };
    let level = |line: &Program| line.machine.controllers[0].counter_input[0];
    let (mut counted, mut last) = (0, level(line));
    line.wait_until("it is before its ejector", |line| {
        let now = level(line);
        counted += u32::from(now != last);
        last = now;
        counted == edges
    });
    line.set(valve, true);
    line.wait(500);
    line.set(valve, false);
    line.set(Output::O8, false);
    line.turn(Motor::M1, Turn::Off);
    line.wait(1000);
    let mut storages = [Input::I8, Input::I7, Input::I6].into_iter();
    let filled = storages.find(|storage| line.input(*storage) == 0);
    (lowest, filled.expect("something has arrived"))
}

#[test]
fn a_sorting_line_sorts_workpieces_by_their_colour() {
    let mut line = Program::shipped("sorting_line");
    line.measure_voltage(Input::I2);
    assert_eq!(sort(&mut line), (564, Input::I6));
    assert_eq!(sort(&mut line), (1320, Input::I7));
    assert_eq!(sort(&mut line), (1540, Input::I8));
    let sorted = ["white_storage", "red_storage", "blue_storage"].map(|place| line.at(place));
    assert_eq!(sorted, [Piece::White, Piece::Red, Piece::Blue].map(Some));
    assert_eq!(line.world().mishaps(), []);
}

#[test]
fn the_pulse_switch_of_a_belt_changes_each_five_to_six_mm() {
    let mut line = Program::shipped("sorting_line");
    line.wait(2010);
    let mm = |line: &Program| match line.whereabouts(Piece::White) {
        Whereabouts::Belt { mm, .. } => mm,
        other => panic!("{other:?}"),
    };
    let (start, mut edges, mut last) = (mm(&line), 0, 0);
    line.turn(Motor::M1, Turn::Right);
    line.wait_until("200 mm have passed", |line| {
        let level = line.machine.controllers[0].counter_input[0];
        edges += u32::from(level != last);
        last = level;
        mm(line) >= start + 200.0
    });
    assert!((200.0 / 6.0..=200.0 / 5.0).contains(&f64::from(edges)), "{edges} edges");
}

#[test]
fn a_workpiece_jams_where_there_is_no_room_and_it_is_told_once() {
    let mut line = Program::shipped("sorting_line");
    line.measure_voltage(Input::I2);
    assert!(line.put(Piece::Blue, "white_storage"));
    line.wait(2010);
    assert!(!line.put(Piece::Red, "entry"), "the script was there first");
    line.turn(Motor::M1, Turn::Right);
    line.set(Output::O8, true);
    line.set(Output::O5, true);
    line.wait(8000);
    let jam = "the white workpiece jams at white_ejector: white_storage can't take it";
    assert_eq!(sentences(line.world()), [jam]);
    // It went on to the end of the belt.
    let end = Whereabouts::Belt { motor: String::from("M1"), mm: 290.0 };
    assert_eq!(line.whereabouts(Piece::White), end);
    assert_eq!(line.world().fallen(), 0);
}

#[test]
fn an_ejector_needs_its_valve_and_its_compressor() {
    let mut line = Program::shipped("sorting_line");
    assert!(line.put(Piece::Red, "red_ejector"));
    for (valve, compressor, is_ejected) in
        [(true, false, false), (false, true, false), (true, true, true)]
    {
        line.set(Output::O6, valve);
        line.set(Output::O8, compressor);
        line.wait(100);
        assert_eq!(line.at("red_storage").is_some(), is_ejected, "{valve} {compressor}");
    }
    assert_eq!(line.at("red_ejector"), None);
}

#[test]
fn a_script_that_puts_a_workpiece_where_there_is_no_room_is_told() {
    let mut line = Program::shipped("sorting_line");
    assert!(line.put(Piece::Blue, "entry"));
    let reported = "the white workpiece can't be put in: entry can't take it";
    // The second one, which is red, is not told again.
    for way in [2010, 12_000] {
        line.wait(way);
        assert_eq!(sentences(line.world()), [reported]);
    }
    assert_eq!(line.machine.world_mut().unwrap().take("entry"), Some(Piece::Blue));
    assert_eq!((line.at("entry"), line.world().fallen()), (None, 0));
    line.wait(12_000);
    assert_eq!(line.at("entry"), Some(Piece::Blue));
}

#[test]
fn what_a_place_has_at_the_start_and_who_looks_at_it_can_be_asked_for() {
    let warehouse = Program::shipped("high_bay_warehouse");
    let world = warehouse.world();
    assert_eq!(world.places().len(), 11);
    assert_eq!(world.pieces().len(), 9 + 6);
    assert_eq!(world.place_seen(0, Input::I4).as_deref(), Some("belt_inside"));
    assert_eq!((world.place_seen(0, Input::I5), world.place_seen(1, Input::I4)), (None, None));
}

#[test]
fn workpieces_on_a_belt_keep_their_distance() {
    let mut line = Program::shipped("sorting_line");
    line.turn(Motor::M1, Turn::Right);
    line.wait(40_000);
    let at = [Piece::White, Piece::Red, Piece::Blue].map(|piece| line.whereabouts(piece));
    let on_belt = [290.0, 263.0, 236.0].map(|mm| Whereabouts::Belt { motor: "M1".into(), mm });
    assert_eq!(at, on_belt);
}

const AT_SAW: Input = Input::I2;
const AT_BELT: Input = Input::I3;
const FEEDER: fn() -> Plug<Motor> = || Plug::extension(1, Motor::M1);
const SLIDE: fn() -> Plug<Motor> = || Plug::extension(1, Motor::M2);
const LOWER: fn() -> Plug<Output> = || Plug::extension(1, Output::O6);
const VACUUM: fn() -> Plug<Output> = || Plug::extension(1, Output::O5);
const AT_OVEN: fn() -> Plug<Input> = || Plug::extension(1, Input::I3);
const OVEN_LIGHT: fn() -> Plug<Input> = || Plug::extension(1, Input::I5);

/// All axes to their first switch.
fn reference_run(station: &mut Program) {
    station.drive(SLIDE(), Turn::Left, Input::I5);
    station.drive(Motor::M1, Turn::Left, Input::I1);
    station.drive(FEEDER(), Turn::Left, Plug::extension(1, Input::I2));
}

/// Into the oven and out again, and the gripper to the oven.
fn burn(station: &mut Program) {
    station.set(Output::O8, true);
    station.drive(FEEDER(), Turn::Right, Plug::extension(1, Input::I1));
    assert_eq!(station.input(OVEN_LIGHT()), 1, "it is inside");
    station.drive(SLIDE(), Turn::Right, AT_OVEN());
    station.drive(FEEDER(), Turn::Left, Plug::extension(1, Input::I2));
    assert_eq!(station.input(OVEN_LIGHT()), 0, "it is outside");
}

#[test]
fn a_processing_station_takes_a_workpiece_from_its_oven_to_the_end_of_its_belt() {
    let mut station = Program::shipped("processing_station");
    reference_run(&mut station);
    burn(&mut station);

    station.set(LOWER(), true);
    station.wait(1000);
    station.set(VACUUM(), true);
    station.wait(1000);
    station.set(LOWER(), false);
    station.wait(10);
    let held = Whereabouts::Gripper(String::from("vacuum_gripper"));
    assert_eq!((station.whereabouts(Piece::White), station.input(OVEN_LIGHT())), (held, 1));
    station.drive(SLIDE(), Turn::Left, Input::I5);
    station.set(LOWER(), true);
    station.wait(400);
    station.set(VACUUM(), false);
    station.wait(300);
    station.set(LOWER(), false);
    assert_eq!(station.at("table"), Some(Piece::White));

    station.drive(Motor::M1, Turn::Right, AT_SAW);
    assert_eq!((station.at("table"), station.at("saw")), (None, Some(Piece::White)));
    station.drive(Motor::M1, Turn::Right, AT_BELT);
    station.turn(Motor::M3, Turn::Right);
    station.wait(400);
    station.set(Output::O7, true);
    station.wait(100);
    station.set(Output::O7, false);
    station.wait_until("it is at the end of the belt", |station| station.input(Input::I4) == 0);
    station.wait(2000);
    assert_eq!((station.at("exit"), station.input(Input::I4)), (Some(Piece::White), 1));
    assert_eq!(station.world().mishaps(), []);
}

#[test]
fn a_gripper_needs_pressure_and_has_to_be_lowered() {
    let mut station = Program::shipped("processing_station");
    station.drive(SLIDE(), Turn::Right, AT_OVEN());
    station.set(VACUUM(), true);
    station.set(LOWER(), true);
    station.wait(100);
    assert_eq!(station.at("oven"), Some(Piece::White), "no pressure");
    station.set(Output::O8, true);
    station.set(LOWER(), false);
    station.wait(100);
    assert_eq!(station.at("oven"), Some(Piece::White), "not lowered");
    station.set(LOWER(), true);
    station.wait(100);
    assert_eq!(station.at("oven"), None);
    // It keeps the workpiece without pressure.
    station.set(Output::O8, false);
    station.wait(100);
    assert_eq!(station.whereabouts(Piece::White), Whereabouts::Gripper("vacuum_gripper".into()));
}

#[test]
fn a_workpiece_that_is_let_go_elsewhere_falls_and_it_is_told() {
    let mut station = Program::shipped("processing_station");
    station.drive(SLIDE(), Turn::Right, AT_OVEN());
    for output in [VACUUM(), LOWER(), Output::O8.into()] {
        station.set(output, true);
    }
    station.wait(100);
    station.turn(SLIDE(), Turn::Left);
    station.wait(1500);
    station.set(VACUUM(), false);
    station.wait(10);
    let fall = "the white workpiece falls: vacuum_gripper lets go of it where there is no place";
    assert_eq!(sentences(station.world()), [fall]);
    assert_eq!((station.world().fallen(), station.world().pieces()), (1, Vec::new()));
}

/// A program for the warehouse.
struct Warehouse {
    program: Program,
    axes: Axes<2>,
}

impl Warehouse {
    fn new() -> Self {
        let mut program = Program::shipped("high_bay_warehouse");
        program.drive(Motor::M3, Turn::Left, Input::I6);
        let axes = [(Motor::M2, Input::I5), (Motor::M4, Input::I8)];
        let axes = Axes::reference_run(&mut program, axes);
        Self { program, axes }
    }

    fn go(&mut self, column: i32, row: i32) {
        self.axes.go(&mut self.program, [column, row]);
    }

    fn fork(&mut self, is_out: bool) {
        let (turn, switch) =
            if is_out { (Turn::Right, Input::I7) } else { (Turn::Left, Input::I6) };
        self.program.drive(Motor::M3, turn, switch);
    }

    fn belt(&mut self, turn: Turn, ms: u32) {
        self.program.turn(Motor::M1, turn);
        self.program.wait(ms);
        self.program.turn(Motor::M1, Turn::Off);
        self.program.wait(200);
    }
}

#[test]
fn a_cantilever_fetches_a_container_and_stores_it_with_a_workpiece() {
    let mut warehouse = Warehouse::new();
    warehouse.go(780, 855);
    warehouse.fork(true);
    warehouse.go(780, 815);
    warehouse.fork(false);
    assert_eq!(warehouse.program.at("C1"), None);
    warehouse.go(20, 720);
    warehouse.fork(true);
    warehouse.go(20, 760);
    assert_eq!(warehouse.program.at("belt_inside"), Some(Piece::Container));
    assert_eq!(warehouse.program.input(Input::I4), 0);
    warehouse.belt(Turn::Right, 1200);
    assert_eq!([Input::I1, Input::I4].map(|input| warehouse.program.input(input)), [0, 1]);

    assert!(warehouse.program.put(Piece::Red, "belt_outside"));
    assert!(!warehouse.program.put(Piece::Blue, "belt_outside"), "one for each container");
    warehouse.go(20, 720);
    warehouse.belt(Turn::Left, 1000);
    warehouse.go(20, 680);
    warehouse.fork(false);
    warehouse.go(1390, 445);
    assert!(warehouse.program.world().mishaps().is_empty());
    // This shelf is taken, so it is brought back to where it was.
    warehouse.go(1390, 405);
    warehouse.fork(true);
    warehouse.go(1390, 485);
    let full = "cantilever can't put the container down: B2 can't take it";
    assert_eq!(sentences(warehouse.program.world()), [full]);
    warehouse.go(1390, 405);
    warehouse.fork(false);
    warehouse.go(780, 815);
    warehouse.fork(true);
    warehouse.go(780, 895);
    warehouse.fork(false);
    assert_eq!(warehouse.program.at("C1"), Some(Piece::Container));
    // Two red workpieces were there before.
    let pieces = warehouse.program.world().pieces();
    let stored = pieces.iter().rfind(|(piece, _)| *piece == Piece::Red).unwrap();
    let Whereabouts::Container(container) = stored.1 else { panic!("{stored:?}") };
    assert_eq!(pieces[container].1, Whereabouts::Place(String::from("C1")));
}
