//! `txt replay`: a program decides and ends as in its recording.

use std::path::Path;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{InputMode, DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor};
use ft_transfer_area::{
    CameraFrame, CameraOptions, Error, Exchange, FishX1Transfer, LoggedCycle, TimeLimits,
    TransferAreaComHandler, TransferMode, TxtClient,
};
use ft_transfer_area_recorder::{Options, Recorded, Recorder, Recording, Transfer};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::recording::{in_folder, run, said, txt, DEADLINE};
use crate::running::Running;

/// What a program decides, and in which hundredth of a second.
type Decisions = Vec<(u16, String)>;

/// A handler in lock-step, so that each run is the same whatever else the computer does.
fn handler(port: u16) -> TransferAreaComHandler {
    let builder = TransferAreaComHandler::builder(format!("127.0.0.1:{port}")).lock_step();
    builder.reconnect(DEADLINE).build().unwrap()
}

/// Drives the slide to its end, resets its counter, and drives back by a distance, at this duty.
fn control(handler: &TransferAreaComHandler, duty: i16) -> Result<Decisions, Error> {
    let mut decisions = Vec::new();
    let mut decide = |area: &FishX1Transfer, what: &str| {
        let count = area.input.counter[0];
        decisions.push((area.timer.timer_10ms, format!("{what} at {count}")));
    };
    let at_end = |areas: &[FishX1Transfer]| areas[LOCAL_IO].input.uni[1] != 0;
    handler.areas().lock()[LOCAL_IO].output.duty[0] = duty;
    let mut areas = handler.areas().wait_until(at_end, DEADLINE)?;
    areas[LOCAL_IO].output.duty[0] = 0;
    areas[LOCAL_IO].start_counter_reset(Counter::C1);
    decide(&areas[LOCAL_IO], "end");
    drop(areas);
    let areas = handler.areas().wait_counter_reset(LOCAL_IO, Counter::C1, DEADLINE)?;
    decide(&areas[LOCAL_IO], "reset");
    drop(areas);
    let mut areas = handler.areas().lock();
    let area = &mut areas[LOCAL_IO];
    area.start_motor_ex_cmd(Motor::M1, duty, Direction::Ccw, &[], 200)?;
    drop(areas);
    let areas = handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, DEADLINE)?;
    decide(&areas[LOCAL_IO], "back");
    Ok(decisions)
}

/// A transfer with this program. When the connection is lost, it begins again.
fn program(handler: &TransferAreaComHandler, duty: i16) -> Decisions {
    handler.begin_transfer().unwrap();
    let decisions = match control(handler, duty) {
        Ok(decisions) => decisions,
        Err(Error::ConnectionLost { cause }) => {
            let is_crc = matches!(*cause, Error::WrongCrc { .. });
            let mut decisions = vec![(0, format!("lost by a wrong checksum: {is_crc}"))];
            decisions.extend(control(handler, duty).unwrap());
            decisions
        }
        Err(error) => panic!("{error}"),
    };
    handler.end_transfer().unwrap();
    decisions
}

/// Records the program on the slide, over this many transfers; returns what it decided.
pub(crate) fn record(path: &str, fault: Option<Fault>, transfers: usize) -> Vec<Decisions> {
    let mut txt = SimulatedTxt::builder().world(World::shipped("slide").unwrap()).lock_step();
    if let Some(fault) = fault {
        txt = txt.fault(fault);
    }
    let txt = txt.device_name("SLIDE").start().unwrap();
    let handler = handler(txt.port());
    let options = Options::default().capacity(6_000);
    let recorder = Recorder::start(&handler, Path::new(path), options).unwrap();
    let decisions = (0..transfers).map(|_| program(&handler, DUTY_MAX)).collect();
    assert_eq!(recorder.finish().unwrap().lost, 0);
    decisions
}

/// `txt replay` on a free port.
struct Replay {
    running: Running,
    port: u16,
}

impl Replay {
    fn start(path: &str, options: &[&str]) -> Self {
        let running = Running::start(txt(&["replay", path, "--port", "0"]).args(options));
        let line = running.line();
        let port = line.split("127.0.0.1:").nth(1).and_then(|rest| rest.split('.').next());
        let port = port.unwrap_or_else(|| panic!("{line:?} has no port")).parse().unwrap();
        assert!(line.contains("SLIDE"), "{line}");
        Self { running, port }
    }

    /// A client that is online, without a library that ends well.
    fn online(&self) -> (TxtClient, Exchange) {
        let address = format!("127.0.0.1:{}", self.port);
        let mut client = TxtClient::connect(address, TimeLimits::default()).unwrap();
        let version = client.query_status().unwrap().version;
        client.start_online().unwrap();
        (client, Exchange::new(TransferMode::Compressed, version))
    }

    /// Waits until it ends; returns whether it ended well, and what it said.
    fn end(self) -> (bool, String) {
        let output = self.running.end();
        (output.status.success(), said(&output))
    }
}

#[test]
fn the_same_program_decides_and_ends_the_same_against_a_replay() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let recorded = record(&path, None, 2);
    assert_eq!(recorded[0].len(), 3);
    assert!(recorded[0] != recorded[1], "the slide begins elsewhere the second time");

    let replay = Replay::start(&path, &["--fast", "--once"]);
    let handler = handler(replay.port);
    let replayed: Vec<Decisions> = (0..2).map(|_| program(&handler, DUTY_MAX)).collect();
    assert_eq!(handler.device_name().unwrap(), "SLIDE");
    drop(handler);
    assert_eq!(replayed, recorded);
    let (well, said) = replay.end();
    assert!(well, "{said}");
    assert!(said.trim_end().ends_with("It did the same."), "{said}");
}

/// The second transfer continues the ids of the first, and a program that begins with it has none yet.
#[test]
fn ids_of_commands_are_those_of_the_program_that_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let recorded = record(&path, None, 2);
    let replay = Replay::start(&path, &["--fast", "--once"]);
    for recorded in recorded {
        assert_eq!(program(&handler(replay.port), DUTY_MAX), recorded);
    }
    let (well, said) = replay.end();
    assert!(well, "{said}");
}

#[test]
fn a_program_that_does_something_else_is_told_where() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    record(&path, None, 1);
    let replay = Replay::start(&path, &["--fast", "--once"]);
    let handler = handler(replay.port);
    program(&handler, 400);
    // It may be there again before its end is seen, and do the same then.
    if handler.begin_transfer().is_ok() && control(&handler, DUTY_MAX).is_ok() {
        let _ = handler.end_transfer();
    }
    let (well, said) = replay.end();
    assert!(!well, "{said}");
    assert!(said.contains("It first differed in cycle 1, "), "{said}");
    assert!(said.contains("O1 was 512 and is 400"), "{said}");
    assert!(said.contains("the program did not do the same"), "{said}");
}

/// The recorded values are those of the recorded modes.
#[test]
fn a_program_that_configures_an_input_otherwise_is_told_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    // The mode changes while it runs, and again.
    let modes = [InputMode::Ultrasonic, InputMode::Voltage, InputMode::Ultrasonic];
    let run = |port: u16, modes: [InputMode; 3], recorded: Option<&str>| {
        let handler = handler(port);
        let recorder = recorded.map(|path| Recorder::start(&handler, path, Options::default()));
        for (index, mode) in modes.into_iter().enumerate() {
            handler.areas().lock()[LOCAL_IO].set_ft_uni_config(Input::I4, mode, false);
            if index == 0 {
                handler.begin_transfer().unwrap();
            }
            for _ in 0..10 {
                drop(handler.areas().wait_cycle().unwrap());
            }
        }
        handler.end_transfer().unwrap();
        if let Some(recorder) = recorder {
            recorder.unwrap().finish().unwrap();
        }
    };
    let txt = SimulatedTxt::builder().lock_step().device_name("SLIDE").start().unwrap();
    run(txt.port(), modes, Some(&path));
    drop(txt);
    let replay = Replay::start(&path, &["--fast", "--once"]);
    run(replay.port, modes, None);
    let (well, said) = replay.end();
    assert!(well && said.contains("It did the same."), "{said}");
    let replay = Replay::start(&path, &["--fast", "--once"]);
    let others = [InputMode::Ultrasonic, InputMode::Resistance, InputMode::Ultrasonic];
    run(replay.port, others, None);
    let (well, said) = replay.end();
    let told = "I4 was for voltage and is for resistance";
    assert!(!well && said.contains(told), "{said}");
}

#[test]
fn each_program_is_told_what_it_did_itself() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    record(&path, None, 3);
    let replay = Replay::start(&path, &["--fast", "--once"]);
    for duty in [400, DUTY_MAX, 300] {
        program(&handler(replay.port), duty);
    }
    let (well, said) = replay.end();
    assert!(!well, "{said}");
    let lines: Vec<&str> = said.lines().filter(|line| line.contains("has left")).collect();
    assert_eq!(lines.len(), 3, "{said}");
    for (line, what) in lines.iter().zip(["is 400", "It did the same", "is 300"]) {
        assert!(line.contains(what), "{line}");
    }
}

#[test]
fn a_part_of_a_recording_is_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    record(&path, None, 1);
    let cycles: Vec<_> = Recording::open(&path)
        .unwrap()
        .map(Result::unwrap)
        .filter_map(|entry| match entry.what {
            Recorded::Cycle(cycle) => Some((entry.at, cycle.areas[LOCAL_IO].input.counter[0])),
            _ => None,
        })
        .collect();
    let before = |cycle: usize| ((cycles[cycle - 1].0 + cycles[cycle].0) / 2).as_secs_f64();
    let [from, to] = [before(100), before(104)].map(|at| at.to_string());
    let replay = Replay::start(&path, &["--fast", "--once", "--from", &from, "--to", &to]);
    let (mut client, mut exchange) = replay.online();
    let mut areas = [FishX1Transfer::default()];
    areas[LOCAL_IO].output.duty[0] = DUTY_MAX;
    let counts = [100, 101, 102, 103, 103].map(|cycle: usize| {
        client.do_transfer(&mut exchange, &mut areas).unwrap();
        (areas[LOCAL_IO].input.counter[0], cycles[cycle].1)
    });
    assert!(counts.iter().all(|(is, was)| is == was), "{counts:?}");
    assert!(counts[0].0 > 10, "the slide moves since a second");
    drop(client);
    let (well, said) = replay.end();
    assert!(well, "{said}");
}

#[test]
fn a_program_that_leaves_sooner_or_later_is_told_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    record(&path, None, 1);
    let replay = Replay::start(&path, &["--fast", "--once"]);
    // One that was killed, so it has stopped no motors.
    let (mut killed, mut exchange) = replay.online();
    let mut areas = [FishX1Transfer::default()];
    areas[LOCAL_IO].output.duty[0] = DUTY_MAX;
    (0..5).for_each(|_| killed.do_transfer(&mut exchange, &mut areas).unwrap());
    drop(killed);
    let (well, said) = replay.end();
    assert!(!well && said.contains("it left, and the recorded one went on"), "{said}");

    let replay = Replay::start(&path, &["--fast", "--once"]);
    let later = handler(replay.port);
    later.begin_transfer().unwrap();
    control(&later, DUTY_MAX).unwrap();
    later.areas().wait_cycle().map(drop).unwrap();
    later.areas().wait_cycle().map(drop).unwrap();
    later.end_transfer().unwrap();
    let (well, said) = replay.end();
    assert!(!well && said.contains("first differed in cycle"), "{said}");
}

/// How another client plays a recording of one transfer.
enum Stop {
    /// As the kit's client: all duties 0, and nothing else.
    OnlyDuties,
    /// Without an exchange that stops the motors.
    None,
    /// In an exchange that drives a motor.
    Driving,
    /// All duties 0 one exchange too soon, and motors again.
    TooSoon,
}

/// Sends what was recorded, up to the last exchange, which stops the motors in this way.
fn play(path: &str, stop: &Stop) -> (bool, String) {
    let replay = Replay::start(path, &["--fast", "--once"]);
    let recorded = Recording::open(path).unwrap().filter_map(|entry| match entry.unwrap().what {
        Recorded::Cycle(cycle) => Some(cycle.areas[LOCAL_IO]),
        _ => None,
    });
    let recorded: Vec<FishX1Transfer> = recorded.collect();
    let (mut client, mut exchange) = replay.online();
    let mut areas = [FishX1Transfer::default()];
    let (last, others) = recorded.split_last().unwrap();
    assert_eq!(last.output.duty, [0; 8], "the recorded program stops the motors");
    let mut send = |output, sound| {
        areas[LOCAL_IO].output = output;
        areas[LOCAL_IO].txt_outputs = sound;
        client.do_transfer(&mut exchange, &mut areas).unwrap();
    };
    for (index, area) in others.iter().enumerate() {
        let mut output = area.output;
        if matches!(stop, Stop::TooSoon) && index + 1 == others.len() {
            *output.duty = [0; 8];
        }
        send(output, area.txt_outputs);
    }
    let mut output = others.last().unwrap().output;
    match stop {
        Stop::OnlyDuties => *output.duty = [0; 8],
        Stop::None => {}
        Stop::Driving => output.duty[0] = 100,
        Stop::TooSoon => output = last.output,
    }
    if !matches!(stop, Stop::None) {
        send(output, last.txt_outputs);
    }
    client.stop_online().unwrap();
    drop(client);
    replay.end()
}

/// Those before the end of a transfer, too.
#[test]
fn cycles_that_were_lost_at_the_end_are_played_without_a_difference() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let (recorder, mut feed) = Recorder::fed(&path, Options::default()).unwrap();
    feed.transfer(
        Instant::now(),
        Transfer::Began {
            device_name: "SLIDE".to_owned(),
            firmware: "4.7.0".to_owned(),
            address: String::new(),
            areas: 1,
        },
    );
    for number in 1..=10 {
        let mut cycle = LoggedCycle::new(number, &[FishX1Transfer::default()]);
        cycle.first = number == 1;
        feed.cycle(cycle);
    }
    feed.transfer(Instant::now(), Transfer::NotRecorded { entries: 5 });
    feed.transfer(Instant::now(), Transfer::Ended);
    recorder.finish().unwrap();
    for (cycles, expected) in
        [(15, "It did the same."), (17, "it goes on, and the recorded one left")]
    {
        let replay = Replay::start(&path, &["--fast", "--once"]);
        let (mut client, mut exchange) = replay.online();
        let mut areas = [FishX1Transfer::default()];
        (0..cycles).for_each(|_| client.do_transfer(&mut exchange, &mut areas).unwrap());
        client.stop_online().unwrap();
        drop(client);
        let (_, said) = replay.end();
        assert!(said.contains(expected), "{cycles}: {said}");
    }
}

/// The library also ends distances and sounds in the exchange that stops the motors.
#[test]
fn how_another_client_stops_the_motors_is_no_difference() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    record(&path, None, 1);
    let (well, said) = play(&path, &Stop::OnlyDuties);
    assert!(well && said.contains("It did the same, but stopped the motors otherwise: "), "{said}");
    let (well, said) = play(&path, &Stop::None);
    assert!(well && said.contains("it left without stopping the motors first"), "{said}");
    for stop in [Stop::Driving, Stop::TooSoon] {
        let (well, said) = play(&path, &stop);
        assert!(!well && said.contains("first differed in cycle"), "{said}");
    }
}

#[test]
fn a_lost_connection_is_lost_again_in_the_same_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let fault = Fault::at_exchange(60, FaultKind::WrongCrc);
    let recorded = record(&path, Some(fault), 1);
    assert_eq!(recorded[0][0].1, "lost by a wrong checksum: true");
    let info = said(&run(&["info", &path]));
    assert!(info.contains("1, with 1 gap\n"), "{info}");

    let replay = Replay::start(&path, &["--once"]);
    assert_eq!(program(&handler(replay.port), DUTY_MAX), recorded[0]);
    let (well, said) = replay.end();
    assert!(well, "{said}");
}

#[test]
fn a_replay_has_the_pace_of_its_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let recorded = record(&path, None, 1);
    let replay = Replay::start(&path, &["--once"]);
    let handler = handler(replay.port);
    let begin = Instant::now();
    assert_eq!(program(&handler, DUTY_MAX), recorded[0]);
    // The recorded clock moved by 10 ms with each cycle.
    let cycles = handler.areas().statistics().cycles as u32;
    assert!(begin.elapsed() >= Duration::from_millis(10) * (cycles - 1));
    drop(handler);
    assert!(replay.end().0);
}

/// A camera's pictures of 320×240.
const PICTURES: [&[u8]; 2] = [
    include_bytes!("../../tests/camera/clean_320x240_420.jpg"),
    include_bytes!("../../tests/camera/clean_320x240_422.jpg"),
];

#[test]
fn recorded_pictures_come_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let txt = SimulatedTxt::builder().device_name("SLIDE").lock_step().start().unwrap();
    let recorded = handler(txt.port());
    let recorder = Recorder::start(&recorded, &path, Options::default()).unwrap();
    recorded.begin_transfer().unwrap();
    for (index, picture) in PICTURES.into_iter().enumerate() {
        recorder.frames().record(&CameraFrame::new(picture.to_vec()));
        let begin = Instant::now();
        while recorder.recorded().frames <= index as u64 {
            assert!(begin.elapsed() < DEADLINE, "the picture is not recorded");
        }
        (0..20).for_each(|_| drop(recorded.areas().wait_cycle().unwrap()));
    }
    recorded.end_transfer().unwrap();
    recorder.finish().unwrap();

    let replay = Replay::start(&path, &["--fast"]);
    let builder = TransferAreaComHandler::builder(format!("127.0.0.1:{}", replay.port));
    let handler = builder.camera_port(replay.port + 1).lock_step().build().unwrap();
    handler.begin_transfer().unwrap();
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    let picture = || frames.recv_timeout(DEADLINE).unwrap().jpeg().unwrap().into_owned();
    assert!(picture() == PICTURES[0], "before the first cycle the first picture");
    // In a cycle after the one in which the second one came.
    (0..40).for_each(|_| drop(handler.areas().wait_cycle().unwrap()));
    let begin = Instant::now();
    loop {
        let picture = picture();
        if picture == PICTURES[1] {
            break;
        }
        assert!(picture == PICTURES[0], "a picture that was not recorded");
        assert!(begin.elapsed() < DEADLINE, "the second picture does not come");
    }
    handler.end_transfer().unwrap();

    // The recording begins again with a program that exchanges.
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    let picture = frames.recv_timeout(DEADLINE).unwrap().jpeg().unwrap().into_owned();
    assert!(picture == PICTURES[0], "the last picture, before the second one");
    handler.end_transfer().unwrap();
}

/// Also a terminal that is paused.
#[cfg(unix)]
#[test]
fn an_output_that_nobody_reads_holds_up_no_program() {
    use std::io::{BufRead, BufReader, Write};

    use crate::{ending, running};

    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let recorded = record(&path, None, 1);
    let (_path, mut pipe) = ending::pipe(&folder, 64 << 10);
    let mut command = txt(&["replay", &path, "--port", "0", "--fast"]);
    let mut child = command.stdout(pipe.try_clone().unwrap()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(&pipe).read_line(&mut line).unwrap();
    let port = line.split("127.0.0.1:").nth(1).and_then(|rest| rest.split('.').next());
    let port = port.unwrap_or_else(|| panic!("{line:?} has no port")).parse().unwrap();
    // From now on it takes no more.
    pipe.write_all(&[0; 64 << 10]).unwrap();
    for _ in 0..3 {
        assert_eq!(program(&handler(port), DUTY_MAX), recorded[0]);
    }
    running::end(&mut child);
}
