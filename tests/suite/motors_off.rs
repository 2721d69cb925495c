//! The last exchange of a transfer stops all motors, for every way to end it.

use std::panic::{catch_unwind, AssertUnwindSafe};
use std::thread;
use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::wire::{CommandId, ExchangeData};
use ft_transfer_area::{
    stop_controller, Error, Exchange, FishX1Transfer, TimeLimits, TransferAreaComHandler,
    TransferMode, TxtClient,
};
use ft_transfer_area_simulator::{Fault, FaultKind, Machine, SimulatedTxt};

use crate::support::{check_client, handler_for, strict, wait_until, Record};

/// A machine with running motors, one of them on a distance command.
struct Running {
    txt: SimulatedTxt,
    record: Record,
    handler: TransferAreaComHandler,
}

/// The number of the first exchange's response in its connection.
const FIRST_EXCHANGE: u64 = 3;

impl Running {
    /// The fault occurs some exchanges later.
    fn start(fault: Option<FaultKind>) -> Self {
        let record = Record::default();
        let noted = record.clone();
        let mut txt = strict().on_exchange(move |machine| noted.note(machine));
        if let Some(kind) = fault {
            txt = txt.fault(Fault::at_response(FIRST_EXCHANGE + 100, kind));
        }
        let txt = txt.start().unwrap();
        // For a controller that falls silent; long enough for a busy machine.
        let limits = TimeLimits::default().read(Duration::from_secs(1));
        let handler = handler_for(&txt).time_limits(limits).build().unwrap();
        let mut areas = handler.areas().lock();
        let output = &mut areas[LOCAL_IO].output;
        *output.duty = [512, 0, 0, 300, 0, 0, 100, 0];
        *output.distance = [30_000, 0, 0, 0];
        *output.master = [0, 1, 0, 0];
        *output.motor_ex_cmd_id = [5, 6, 7, 8];
        drop(areas);
        handler.begin_transfer().unwrap();
        wait_until(&txt, "an exchange", |machine| machine.exchanges() > 0);
        assert_eq!(record.outputs()[0].duty, [512, 0, 0, 300, 0, 0, 100, 0]);
        Self { txt, record, handler }
    }

    /// Checks that the last exchange stopped the motors and that the controller is offline.
    fn check_stopped(txt: &SimulatedTxt, record: &Record) {
        wait_until(txt, "the end of online mode", |machine| !machine.online());
        let last = txt.with_machine(|machine| machine.commands().last());
        assert_eq!(last, Some(CommandId::StopOnline));
        check_client(txt);
        assert_eq!(
            record.last(),
            ExchangeData { motor_command_id: [6, 7, 8, 9], ..ExchangeData::default() }
        );
    }
}

#[test]
fn end_transfer_stops_the_motors_and_the_area_says_so() {
    let Running { txt, record, handler } = Running::start(None);
    handler.end_transfer().unwrap();
    Running::check_stopped(&txt, &record);
    let output = handler.areas().lock()[LOCAL_IO].output;
    assert_eq!(output.duty, [0; 8]);
    assert_eq!(output.motor_ex_cmd_id, [6, 7, 8, 9]);
    assert_eq!((*output.distance, *output.master), ([0; 4], [0; 4]));
}

#[test]
fn end_transfer_stops_the_motors_of_extensions_too() {
    let txt = strict().extensions(1).start().unwrap();
    let handler = handler_for(&txt).areas(2).build().unwrap();
    handler.areas().lock()[1].output.duty[0] = 200;
    handler.begin_transfer().unwrap();
    wait_until(&txt, "a duty", |machine| machine.controllers[1].outputs.duty[0] == 200);
    handler.end_transfer().unwrap();
    assert_eq!(handler.areas().lock()[1].output.duty[0], 0);
    assert_eq!(txt.with_machine(|machine| machine.controllers[1].outputs.duty[0]), 0);
}

#[test]
fn dropping_the_handler_stops_the_motors() {
    let Running { txt, record, handler } = Running::start(None);
    drop(handler);
    Running::check_stopped(&txt, &record);
}

#[test]
fn a_panic_in_the_thread_that_owns_the_handler_stops_the_motors() {
    let Running { txt, record, handler } = Running::start(None);
    let area = handler.areas().clone();
    let panicked = thread::spawn(move || {
        let _handler = handler;
        panic!("a program with a mistake");
    });
    panicked.join().unwrap_err();
    Running::check_stopped(&txt, &record);
    assert_eq!(area.wait_cycle().unwrap_err(), Error::ProgramPanicked);
}

#[test]
fn a_panic_under_a_guard_stops_the_motors_and_nothing_half_written_goes_out() {
    let Running { txt, record, handler } = Running::start(None);
    let panicked = catch_unwind(AssertUnwindSafe(|| {
        let mut areas = handler.areas().lock();
        areas[LOCAL_IO].output.distance[0] = 1;
        panic!("before the command id is written");
    }));
    panicked.unwrap_err();
    Running::check_stopped(&txt, &record);
    assert!(record.outputs().iter().all(|outputs| outputs.distance[0] != 1));
    assert_eq!(handler.end_transfer(), Err(Error::ProgramPanicked));
}

#[test]
fn a_panic_in_another_thread_with_a_handle_stops_the_motors() {
    let Running { txt, record, handler } = Running::start(None);
    let area = handler.areas().clone();
    let panicked = thread::spawn(move || {
        let _area = area;
        panic!("in the thread that controls the motors");
    });
    panicked.join().unwrap_err();
    Running::check_stopped(&txt, &record);
    while handler.areas().wait_cycle().is_ok() {}
    assert_eq!(handler.areas().error(), Some(Error::ProgramPanicked));
}

#[test]
fn a_destructor_may_use_the_area_while_its_thread_unwinds() {
    struct Brake<'a>(&'a TransferAreaComHandler);
    impl Drop for Brake<'_> {
        fn drop(&mut self) {
            *self.0.areas().lock()[LOCAL_IO].output.duty = [1, 0, 0, 0, 0, 0, 0, 0];
        }
    }
    let Running { txt, handler, .. } = Running::start(None);
    let panicked = catch_unwind(AssertUnwindSafe(|| {
        let _brake = Brake(&handler);
        panic!("a program with a brake");
    }));
    panicked.unwrap_err();
    wait_until(&txt, "the brake's duty", |machine| machine.controllers[0].outputs.duty[0] == 1);
    assert!(handler.areas().error().is_none());
}

#[test]
fn a_response_that_is_wrong_stops_the_motors() {
    let faults = [
        FaultKind::WrongCrc,
        FaultKind::WrongId,
        FaultKind::CutData,
        FaultKind::Surplus(3),
        // Enough bytes that a close without reading them would reset the connection.
        FaultKind::Surplus(60_000),
        FaultKind::Silence,
    ];
    // Each case waits for a limit, so they run in parallel.
    thread::scope(|scope| {
        for fault in faults {
            scope.spawn(move || {
                println!("{fault:?}");
                let Running { txt, record, handler } = Running::start(Some(fault));
                wait_until(&txt, "a lost client", |machine| !machine.connected());
                Running::check_stopped(&txt, &record);
                handler.end_transfer().unwrap_err();
                assert_eq!(handler.areas().lock()[LOCAL_IO].output.duty, [0; 8]);
            });
        }
    });
}

#[test]
fn a_connection_that_the_controller_closes_leaves_the_motors_to_the_board() {
    let Running { txt, handler, .. } = Running::start(Some(FaultKind::Close { after: 5 }));
    wait_until(&txt, "a lost client", |machine| !machine.connected());
    let outputs = txt.with_machine(|machine| machine.controllers[0].outputs);
    assert_eq!(outputs.duty, [512, 0, 0, 300, 0, 0, 100, 0], "no exchange can be sent");
    assert!(matches!(handler.end_transfer(), Err(Error::ConnectionClosed { .. })));
    assert_eq!(handler.areas().lock()[LOCAL_IO].output.duty, [0; 8]);
}

#[test]
fn what_a_lost_program_has_left_on_is_stopped_without_configurations() {
    let txt = SimulatedTxt::builder().extensions(1).start().unwrap();
    let mut client = TxtClient::connect(txt.address(), TimeLimits::default()).unwrap();
    let version = client.query_status().unwrap().version;
    client.start_online().unwrap();
    let mut exchange = Exchange::new(TransferMode::Compressed, version);
    let mut areas = vec![FishX1Transfer::default(); 2];
    // Outputs of an extension are sent when a response has said that it is there.
    for _ in 0..2 {
        for area in &mut areas {
            area.output.duty[0] = 512;
        }
        client.do_transfer(&mut exchange, &mut areas).unwrap();
    }
    let duties = |machine: &Machine| [0, 1].map(|at| machine.controllers[at].outputs.duty[0]);
    assert_eq!(txt.with_machine(|machine| duties(machine)), [512; 2]);
    drop(client);
    wait_until(&txt, "it has left", |machine| !machine.connected());
    let before = txt.with_machine(|machine| machine.commands().count());

    let stopped = stop_controller(txt.address(), TimeLimits::default()).unwrap();
    assert_eq!(stopped.version, version);
    txt.with_machine(|machine| {
        assert_eq!(duties(machine), [0; 2]);
        let sent: Vec<_> = machine.commands().skip(before).collect();
        // Without the exchanges.
        assert_eq!(sent, [CommandId::QueryStatus, CommandId::StartOnline, CommandId::StopOnline]);
    });
}
