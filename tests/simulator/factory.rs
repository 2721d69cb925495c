//! Several controllers whose worlds share workpieces: stepped, and over real sockets.

use std::net::TcpListener;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use ft_transfer_area::tx::{Input, Motor, Output};
use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area_simulator::world::{
    Belt, Board, Factory, MotorModel, Piece, Place, Plug, Sensor, Whereabouts, World,
};
use ft_transfer_area_simulator::{Error, SimulatedFactory};

use crate::drops_in_time;
use crate::program::{sentences, Axes, Program, Turn};
use crate::wire_client::{Client, LIMIT};

/// Programs for the controllers of the shipped factory: warehouse, robot, processing, sorting.
fn programs() -> [Program; 4] {
    let machines = Factory::shipped("factory").unwrap().machines().unwrap();
    let programs: Vec<_> = machines.into_iter().map(|(_, machine)| Program::new(machine)).collect();
    programs.try_into().ok().unwrap()
}

/// The robot's axes after their reference run.
fn robot_axes(robot: &mut Program) -> Axes<3> {
    let axes = [(Motor::M2, Input::I2), (Motor::M1, Input::I1), (Motor::M3, Input::I3)];
    Axes::reference_run(robot, axes)
}

/// Moves the robot, which counts the vertical axis first.
fn go(robot: &mut Program, axes: &mut Axes<3>, [rotate, vertical, horizontal]: [i32; 3]) {
    axes.go(robot, [vertical, rotate, horizontal]);
}

fn grip(robot: &mut Program) {
    robot.set(Output::O7, true);
    robot.wait(2000);
    robot.set(Output::O8, true);
    robot.wait(100);
}

fn release(robot: &mut Program) {
    robot.set(Output::O8, false);
    robot.set(Output::O7, false);
    robot.wait(100);
}

#[test]
fn a_robot_carries_workpieces_between_the_places_of_other_controllers() {
    let [_, mut robot, mut processing, _] = programs();
    robot.measure_voltage(Input::I8);
    let mut axes = robot_axes(&mut robot);
    let oven_light = Plug::extension(1, Input::I5);
    assert_eq!((robot.input(Input::I7), robot.machine.controllers[0].counter_input[3]), (1, 1));
    assert!(robot.put(Piece::Blue, "delivery"));
    robot.wait(10);
    assert_eq!(robot.input(Input::I7), 0);
    go(&mut robot, &mut axes, [22, 600, 19]);
    go(&mut robot, &mut axes, [22, 758, 19]);
    grip(&mut robot);
    go(&mut robot, &mut axes, [22, 600, 19]);
    assert_eq!((robot.input(Input::I7), robot.input(Input::I8)), (1, 2400));
    go(&mut robot, &mut axes, [123, 645, 75]);
    assert_eq!(robot.input(Input::I8), 1592, "blue over the colour sensor");

    processing.wait(10);
    assert_eq!(processing.input(oven_light), 1, "nothing is in the oven at the start");
    go(&mut robot, &mut axes, [931, 0, 880]);
    go(&mut robot, &mut axes, [931, 490, 934]);
    release(&mut robot);
    processing.wait(10);
    assert_eq!(processing.input(oven_light), 0);
    assert_eq!(processing.at("processing.oven"), Some(Piece::Blue));
    assert_eq!(processing.world().place_seen(1, Input::I5).unwrap(), "processing.oven");

    // And from there to the pickup place.
    grip(&mut robot);
    go(&mut robot, &mut axes, [931, 0, 880]);
    go(&mut robot, &mut axes, [263, 320, 590]);
    release(&mut robot);
    assert_eq!(robot.machine.controllers[0].counter_input[3], 0);
    assert_eq!(robot.world().mishaps(), []);
}

/// Programs for the robot end white at 850 mV and red at 1550 mV, those for the sorting line at 940 and 1430.
#[test]
fn a_robot_sees_colours_in_the_limits_of_its_own_programs_and_of_the_sorting_line() {
    for (piece, limits) in
        [(Piece::White, 200..850), (Piece::Red, 940..1430), (Piece::Blue, 1550..2000)]
    {
        let [_, mut robot, ..] = programs();
        robot.measure_voltage(Input::I8);
        let mut axes = robot_axes(&mut robot);
        assert!(robot.put(piece, "delivery"));
        go(&mut robot, &mut axes, [22, 758, 19]);
        grip(&mut robot);
        go(&mut robot, &mut axes, [123, 645, 75]);
        let mv = robot.input(Input::I8);
        assert!(limits.contains(&mv), "{piece} gives {mv} mV");
    }
}

#[test]
fn a_robot_takes_a_workpiece_out_of_a_container_and_puts_it_into_one() {
    let [mut warehouse, mut robot, ..] = programs();
    let mut axes = robot_axes(&mut robot);
    assert!(warehouse.put(Piece::Container, "belt_outside"));
    assert!(warehouse.put(Piece::Red, "belt_outside"));
    go(&mut robot, &mut axes, [1410, 170, 186]);
    grip(&mut robot);
    go(&mut robot, &mut axes, [1410, 50, 186]);
    let held = Whereabouts::Gripper(String::from("robot.gripper"));
    assert_eq!(robot.world().pieces().into_iter().next_back(), Some((Piece::Red, held)));
    assert_eq!(robot.at("warehouse.belt_outside"), Some(Piece::Container));
    release(&mut robot);
    let last = robot.world().pieces().pop().unwrap().1;
    assert!(matches!(last, Whereabouts::Container(_)), "{last:?}");
    // A second one does not fit.
    assert!(robot.put(Piece::White, "delivery"));
    go(&mut robot, &mut axes, [22, 758, 19]);
    grip(&mut robot);
    go(&mut robot, &mut axes, [1410, 50, 186]);
    release(&mut robot);
    let fall = "the white workpiece falls: warehouse.belt_outside can't take it";
    assert_eq!(sentences(robot.world()), [fall]);
    assert_eq!(warehouse.world().fallen(), 1);
}

#[test]
fn a_workpiece_is_not_gripped_twice() {
    let [_, mut robot, mut processing, _] = programs();
    assert!(processing.put(Piece::White, "oven"));
    let slide = Plug::extension(1, Motor::M2);
    processing.drive(slide, Turn::Right, Plug::extension(1, Input::I3));
    for output in
        [Output::O8.into(), Plug::extension(1, Output::O6), Plug::extension(1, Output::O5)]
    {
        processing.set(output, true);
    }
    processing.wait(100);
    let mut axes = robot_axes(&mut robot);
    go(&mut robot, &mut axes, [931, 490, 934]);
    grip(&mut robot);
    let twice = "robot.gripper can't grip the white workpiece: processing.vacuum_gripper holds it";
    assert_eq!(sentences(robot.world()), [twice]);
    let held = Whereabouts::Gripper(String::from("processing.vacuum_gripper"));
    assert!(robot.world().pieces().contains(&(Piece::White, held)));
}

#[test]
fn a_workpiece_runs_from_the_belt_of_one_controller_onto_that_of_another() {
    let [_, _, mut processing, mut sorting] = programs();
    assert!(processing.put(Piece::Red, "belt"));
    processing.turn(Motor::M3, Turn::Right);
    processing.wait_until("it is at the end", |processing| processing.input(Input::I4) == 0);
    processing.wait(2000);
    sorting.wait(10);
    assert_eq!((processing.input(Input::I4), sorting.input(Input::I1)), (1, 0));
    // The next one jams until there is room for it.
    assert!(processing.put(Piece::Blue, "belt"));
    processing.wait(4000);
    let jam = "the blue workpiece jams on the belt of processing.M3: processing.exit can't take it";
    assert_eq!(sentences(processing.world()), [jam]);
    sorting.turn(Motor::M1, Turn::Right);
    sorting.wait(1000);
    processing.wait(100);
    assert_eq!(sorting.at("sorting.entry"), Some(Piece::Blue));
    assert_eq!(sentences(processing.world()), [jam]);
}

#[test]
fn a_copy_of_a_machine_has_workpieces_of_its_own() {
    let [_, mut robot, ..] = programs();
    let copy = robot.machine.clone();
    assert!(robot.put(Piece::Red, "delivery"));
    let copied = copy.world().unwrap().pieces();
    assert_eq!(copied.len() + 1, robot.world().pieces().len());
}

/// Two controllers: a belt, and the storage behind it.
fn belt_and_storage() -> Factory {
    let belt = MotorModel::default().belt(Belt::new(100.0, 20.0).end("second.storage"));
    let entry = Place::new("entry").position(Motor::M1, 20.0).piece(Piece::White);
    let first = World::new().master(Board::default().motor(Motor::M1, belt)).place(entry);
    let light = Sensor::PhotoTransistor { light: 1.0 };
    let second = World::new()
        .master(Board::default().input(Input::I1, light))
        .place(Place::new("storage").barrier(Input::I1));
    Factory::new().controller("first", first).controller("second", second)
}

#[test]
fn a_simulated_factory_serves_a_client_on_each_controller() {
    let factory = SimulatedFactory::start(belt_and_storage(), 0, |_, builder| {
        builder.pace(Duration::ZERO).idle_limit(Duration::from_secs(3600))
    });
    let factory = factory.unwrap();
    let [first, second] = ["first", "second"].map(|name| factory.txt(name).unwrap());
    assert!(factory.txt("third").is_none());
    let mut clients = [first, second].map(Client::online);
    let outputs = ft_transfer_area::wire::ExchangeData {
        duty: [512, 0, 0, 0, 0, 0, 0, 0],
        ..Default::default()
    };
    let mut seen = Vec::new();
    for _ in 0..300 {
        clients[0].exchange(&outputs);
        seen.push(clients[1].exchange(&Default::default()).uni[0]);
    }
    assert_eq!((seen[0], seen[299]), (1, 0));
    second.with_machine(|machine| {
        let places = machine.world().unwrap().places();
        let storage = (String::from("second.storage"), Some(Piece::White));
        assert_eq!(places, [(String::from("first.entry"), None), storage]);
    });
}

#[test]
fn the_ports_of_a_factory_are_in_a_row_and_a_taken_one_is_told() {
    let start = |port| SimulatedFactory::start(belt_and_storage(), port, |_, builder| builder);
    // Other programs may use some of these ports.
    let started = (20_000..30_000).step_by(7).find_map(|port| Some((port, start(port).ok()?)));
    let (port, factory) = started.expect("six ports in a row are free somewhere");
    let ports: Vec<_> = factory.txts().map(|(name, txt)| (name, txt.port())).collect();
    assert_eq!(ports, [("first", port), ("second", port + 3)]);
    assert_eq!(factory.txt("second").unwrap().i2c_port(), port + 5);
    drop(factory);

    let reported = (30_000..40_000).step_by(7).find_map(|port| {
        let _taken = TcpListener::bind(("127.0.0.1", port + 3)).ok()?;
        let sentence = format!("{:#}", start(port).unwrap_err());
        sentence.contains("second").then_some((port, sentence))
    });
    let (port, sentence) = reported.expect("five ports in a row are free somewhere");
    assert!(sentence.contains(&format!(": second, port {}: ", port + 3)), "{sentence}");

    let error = start(65_531).unwrap_err();
    assert!(matches!(error, Error::OutOfRange { given: 65_531, most: 65_530, .. }), "{error}");
}

#[test]
fn a_factory_with_a_mistake_starts_nothing() {
    let mut factory = belt_and_storage();
    factory.controllers[1].1.places[0].name = String::from("bin");
    let error = SimulatedFactory::start(factory, 0, |_, builder| builder).unwrap_err();
    let sentence = error.to_string();
    assert!(sentence.contains("controllers.0.master.motors.M1.belt.end"), "{sentence}");
    assert!(sentence.contains("there are entry, second.bin"), "{sentence}");
}

/// Each of them has a script that does not return.
#[test]
fn many_that_wait_take_no_longer_to_end_than_one() {
    let worlds = (0..20).fold(Factory::new(), |factory, number| {
        factory.controller(&format!("txt{number}"), World::new())
    });
    let (runs, running) = mpsc::channel();
    let factory = SimulatedFactory::start(worlds, 0, |_, builder| {
        let runs = runs.clone();
        builder.pace(Duration::ZERO).on_exchange(move |_| {
            let _ = runs.send(());
            thread::park_timeout(Duration::from_secs(120));
        })
    });
    let factory = factory.unwrap();
    for (_, txt) in factory.txts() {
        Client::online(txt).send_exchange(&ExchangeData::default());
        running.recv_timeout(LIMIT).unwrap();
    }
    drops_in_time(factory);
}
