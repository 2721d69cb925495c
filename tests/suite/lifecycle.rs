//! A transfer begins, waits, ends, and begins again.

use std::net::TcpListener;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{LOCAL_IO, REMOTE_IO_1, REMOTE_IO_2};
use ft_transfer_area::tx::{Counter, Motor};
use ft_transfer_area::{
    CameraFrame, CycleLog, Error, Events, FirmwareVersion, I2cClient, TimeLimits,
    TransferAreaComHandler, TransferAreas, TransferMode, TxtClient,
};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::support::{check_client, handler_for, unpaced, wait_until, DEADLINE};

/// Does not compile when a type can't be used by several threads at the same time.
fn shared<T: Send + Sync>() {}

#[test]
fn what_a_handler_gives_can_be_shared_by_threads() {
    shared::<TransferAreaComHandler>();
    shared::<TransferAreas>();
    shared::<Events>();
    shared::<CycleLog>();
    shared::<I2cClient>();
    shared::<TxtClient>();
    shared::<CameraFrame>();
    shared::<Error>();
}

/// The connection is closed at this many StartOnline, as a TXT does whose firmware ends there.
fn ending_at_start_online(count: u64) -> SimulatedTxt {
    // The second response of a connection; each of these strikes once.
    let close = Fault::at_response(1, FaultKind::Close { after: 0 });
    (0..count).fold(unpaced(), |txt, _| txt.fault(close)).start().unwrap()
}

#[test]
fn a_controller_that_ends_at_start_online_is_tried_again() {
    let txt = ending_at_start_online(3);
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap();
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn a_controller_that_always_ends_at_start_online_is_an_error_within_the_limit_for_connecting() {
    let txt = ending_at_start_online(100);
    let limits = TimeLimits::default().connect(Duration::from_millis(300));
    let handler = handler_for(&txt).time_limits(limits).build().unwrap();
    let closed = Error::ConnectionClosed { command: "StartOnline", received: 0 };
    assert_eq!(handler.begin_transfer(), Err(closed.clone()));
    assert_eq!(handler.areas().error(), Some(closed));
}

#[test]
fn a_transfer_that_is_tried_again_can_be_ended() {
    let txt = ending_at_start_online(10_000);
    let limits = TimeLimits::default().connect(Duration::from_secs(3600));
    let handler = handler_for(&txt).time_limits(limits).build().unwrap();
    thread::scope(|scope| {
        let begun = scope.spawn(|| handler.begin_transfer());
        wait_until(&txt, "a second attempt", |machine| machine.connections() >= 2);
        handler.end_transfer().unwrap();
        assert_eq!(begun.join().unwrap(), Err(Error::NotStarted));
    });
}

/// The connection of a transfer is lost with a motor on, and the next one answers StartOnline late.
#[test]
fn an_end_while_the_next_transfer_begins_stops_the_motors_of_the_one_before() {
    let late = Fault::at_response(1, FaultKind::Delay(Duration::from_millis(300)));
    let lost = Fault::at_response(60, FaultKind::Close { after: 0 });
    // A fault strikes once: the first of these at the first connection.
    let txt = unpaced().fault(lost).fault(late).fault(late).start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
    handler.begin_transfer().unwrap();
    wait_until(&txt, "the loss", |_| handler.areas().error().is_some());
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 512);
    thread::scope(|scope| {
        let begun = scope.spawn(|| handler.begin_transfer());
        wait_until(&txt, "another connection", |machine| machine.connections() >= 2);
        handler.end_transfer().unwrap();
        assert!(matches!(begun.join().unwrap(), Ok(()) | Err(Error::NotStarted)));
    });
    let duty = txt.with_machine(|machine| machine.controllers[0].outputs.duty);
    assert_eq!(duty, [0; 8], "a motor is on");
}

#[test]
fn a_transfer_has_a_device_name_a_version_and_statistics() {
    let txt = unpaced().firmware(FirmwareVersion::new(4, 7, 0)).device_name("TXT on the desk");
    let txt = txt.start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    assert_eq!((handler.version(), handler.device_name()), (None, None));
    handler.begin_transfer().unwrap();
    assert_eq!(handler.version(), Some(FirmwareVersion::new(4, 7, 0)));
    assert_eq!(handler.device_name().as_deref(), Some("TXT on the desk"));
    for _ in 0..10 {
        handler.areas().wait_cycle().unwrap();
    }
    let statistics = handler.areas().statistics();
    assert!(statistics.cycles >= 10);
    assert!(statistics.shortest_cycle > Duration::ZERO);
    assert!(statistics.shortest_cycle <= statistics.last_cycle);
    assert!(statistics.last_cycle <= statistics.longest_cycle);
    handler.end_transfer().unwrap();
    let ended = handler.areas().statistics();
    assert!(ended.cycles > statistics.cycles, "figures stay after the end");
    thread::sleep(Duration::from_millis(20));
    handler.begin_transfer().unwrap();
    let first = handler.areas().wait_cycle().unwrap();
    let statistics = handler.areas().statistics();
    // Under a guard at most two more responses come in.
    assert!(statistics.cycles < ended.cycles, "figures begin again");
    drop(first);
}

#[test]
fn a_handler_tells_whether_its_transfer_runs() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    assert!(!handler.areas().is_running());
    handler.begin_transfer().unwrap();
    assert!(handler.areas().is_running());
    handler.end_transfer().unwrap();
    assert!(!handler.areas().is_running());
    handler.begin_transfer().unwrap();
    assert!(handler.areas().is_running());
    drop(txt);
    while handler.areas().wait_cycle().is_ok() {}
    assert!(!handler.areas().is_running(), "an error ended it");
    assert!(handler.begin_transfer().is_err());
    assert!(!handler.areas().is_running(), "it could not begin again");
}

#[test]
fn inputs_of_all_extensions_reach_their_areas() {
    let txt = unpaced().extensions(2).start().unwrap();
    txt.with_machine(|machine| {
        for (index, controller) in machine.controllers.iter_mut().enumerate() {
            controller.uni[7] = 100 + index as i16;
            controller.ir[2].left_x = -3 - index as i8;
            controller.mic_log = 7 + index as u16;
        }
    });
    let handler = handler_for(&txt).areas(3).build().unwrap();
    handler.areas().lock()[REMOTE_IO_2].output.duty[3] = 9;
    handler.begin_transfer().unwrap();
    wait_until(&txt, "the duty of extension 2", |m| m.controllers[2].outputs.duty[3] == 9);
    let areas = handler.areas().wait_cycle().unwrap();
    for (index, area) in areas.iter().enumerate() {
        assert_eq!(area.input.uni[7], 100 + index as i16);
        assert_eq!(area.txt_inputs.ir_input[2].joy_left_x, -3 - index as i16);
        assert_eq!(area.txt_inputs.ir_input[2].joy_left_x_to_left, 3 + index as u16);
        assert_eq!(area.txt_inputs2.mic_log, 7 + index as u16);
        assert_eq!(usize::from(area.state.id), index);
    }
    assert_eq!(areas[LOCAL_IO].state.io_slave_alive, [1, 1, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn extensions_without_areas_are_ignored() {
    let txt = unpaced().extensions(8).start().unwrap();
    txt.with_machine(|machine| machine.controllers[1].uni[0] = 1234);
    let handler = handler_for(&txt).areas(2).build().unwrap();
    handler.areas().lock()[REMOTE_IO_1].output.duty[6] = 8;
    handler.begin_transfer().unwrap();
    wait_until(&txt, "the duty of extension 1", |m| m.controllers[1].outputs.duty[6] == 8);
    let areas = handler.areas().wait_cycle().unwrap();
    assert_eq!(areas[REMOTE_IO_1].input.uni[0], 1234);
    assert_eq!(areas[LOCAL_IO].state.io_slave_alive, [1; 8]);
    drop(areas);
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn extensions_come_and_go() {
    let txt = unpaced().extensions(3).start().unwrap();
    let handler = handler_for(&txt).areas(4).build().unwrap();
    handler.begin_transfer().unwrap();
    for round in 1..50 {
        let alive = [round & 1 != 0, round & 2 != 0, round & 4 != 0];
        txt.with_machine(|machine| {
            machine.alive[..3].copy_from_slice(&alive);
            for (index, controller) in machine.controllers.iter_mut().enumerate() {
                controller.uni = [round * 10 + index as i16; 8];
            }
        });
        let mut areas = handler.areas().lock();
        for (index, area) in areas.iter_mut().enumerate() {
            *area.output.duty = [0, round, 0, 0, 0, 0, index as i16, 0];
        }
        drop(areas);
        // The outputs for an extension that has just come go out in the next exchange.
        for _ in 0..4 {
            handler.areas().wait_cycle().unwrap();
        }
        let areas = handler.areas().wait_cycle().unwrap();
        let controllers = txt.with_machine(|machine| machine.controllers.clone());
        for index in 0..4 {
            if index > 0 {
                let reported = areas[LOCAL_IO].state.io_slave_alive[index - 1];
                assert_eq!(reported, u8::from(alive[index - 1]));
            }
            if index == 0 || alive[index - 1] {
                assert_eq!(areas[index].input.uni, [round * 10 + index as i16; 8]);
                assert_eq!(controllers[index].outputs.duty, areas[index].output.duty);
            }
        }
    }
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn firmware_before_4_2_4_and_the_simple_mode_work_as_well() {
    for (firmware, mode) in [
        (FirmwareVersion::OLDEST_SUPPORTED, TransferMode::Compressed),
        (FirmwareVersion::OLDEST_SUPPORTED, TransferMode::Simple),
        (FirmwareVersion::new(4, 7, 0), TransferMode::Simple),
    ] {
        let txt = unpaced().firmware(firmware).start().unwrap();
        txt.with_machine(|machine| machine.controllers[0].uni = [1, 2, 3, 4, 5, 6, 7, 8]);
        let handler = handler_for(&txt).mode(mode).build().unwrap();
        handler.areas().lock()[LOCAL_IO].output.duty[7] = 512;
        handler.begin_transfer().unwrap();
        wait_until(&txt, "a duty", |machine| machine.controllers[0].outputs.duty[7] == 512);
        assert_eq!(
            handler.areas().wait_cycle().unwrap()[LOCAL_IO].input.uni,
            [1, 2, 3, 4, 5, 6, 7, 8]
        );
        handler.end_transfer().unwrap();
    }
}

#[test]
fn the_checksum_shows_how_many_words_a_response_has() {
    for (firmware, microphone) in
        [(FirmwareVersion::OLDEST_SUPPORTED, true), (FirmwareVersion::new(4, 7, 0), false)]
    {
        let txt = unpaced().extensions(1).firmware(firmware).microphone(microphone);
        let txt = txt.start().unwrap();
        txt.with_machine(|machine| machine.controllers[1].uni[0] = 77);
        let handler = handler_for(&txt).areas(2).build().unwrap();
        handler.begin_transfer().unwrap();
        for _ in 0..5 {
            assert_eq!(handler.areas().wait_cycle().unwrap()[REMOTE_IO_1].input.uni[0], 77);
        }
        handler.end_transfer().unwrap();
    }
}

#[test]
fn the_timers_count_from_the_beginning_and_catch_up_after_a_pause() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    assert_eq!(handler.areas().lock()[LOCAL_IO].timer.timer_1ms, 0);
    let before = Instant::now();
    handler.begin_transfer().unwrap();
    let begun = Instant::now();
    thread::sleep(Duration::from_millis(30));
    let least = begun.elapsed().as_millis();
    let timer = handler.areas().lock()[LOCAL_IO].timer;
    let most = before.elapsed().as_millis();
    assert!((least..=most).contains(&timer.timer_1ms.into()), "{least} {timer:?} {most}");
    assert_eq!(timer.timer_10ms, timer.timer_1ms / 10);
    handler.end_transfer().unwrap();
    let before_again = Instant::now();
    handler.begin_transfer().unwrap();
    let timer = handler.areas().lock()[LOCAL_IO].timer;
    let most = before_again.elapsed().as_millis();
    assert!(u128::from(timer.timer_1ms) <= most, "the timers begin again");
}

#[test]
fn finished_commands_set_their_flags_and_the_program_clears_them() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    let mut areas = handler.areas().wait_cycle().unwrap();
    areas[LOCAL_IO].start_counter_reset(Counter::C3);
    areas[LOCAL_IO].output.duty[0] = 512;
    areas[LOCAL_IO].output.distance[0] = 20;
    areas[LOCAL_IO].raise_motor_ex_cmd_id(Motor::M1);
    drop(areas);
    let mut reached = handler.areas().wait_cycle().unwrap();
    while reached[LOCAL_IO].input.motor_ex_reached[0] == 0 {
        drop(reached);
        reached = handler.areas().wait_cycle_for(DEADLINE).unwrap();
    }
    let input = &mut reached[LOCAL_IO].input;
    assert!(input.counter[0] >= 20, "reached too early: {}", input.counter[0]);
    assert_eq!(input.cnt_resetted, [0, 0, 1, 0]);
    assert_eq!(input.motor_ex_reached, [1, 0, 0, 0]);
    assert_eq!((input.cnt_reset_cmd_id[2], input.motor_ex_cmd_id[0]), (1, 1));
    *input.cnt_resetted = [0; 4];
    *input.motor_ex_reached = [0; 4];
    drop(reached);
    for _ in 0..3 {
        let areas = handler.areas().wait_cycle().unwrap();
        assert_eq!(areas[LOCAL_IO].input.cnt_resetted, [0; 4]);
        assert_eq!(areas[LOCAL_IO].input.motor_ex_reached, [0; 4]);
    }
}

#[test]
fn waiting_has_a_limit_and_the_transfer_goes_on_after_it() {
    let txt = SimulatedTxt::builder().pace(Duration::from_millis(200)).start().unwrap();
    let handler = handler_for(&txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap();
    let limit = Duration::from_millis(1);
    let mut timed_out = false;
    // A busy machine may let a whole cycle pass before the waiting begins.
    while !timed_out {
        timed_out = match handler.areas().wait_cycle_for(limit) {
            Ok(_) => false,
            Err(error) => {
                assert_eq!(error, Error::WaitTimedOut { limit });
                true
            }
        };
    }
    handler.areas().wait_cycle_for(Duration::MAX).unwrap();
    handler.end_transfer().unwrap();
}

#[test]
fn a_thread_that_no_longer_waits_delays_nothing() {
    let pace = Duration::from_millis(200);
    let txt = SimulatedTxt::builder().pace(pace).start().unwrap();
    let handler = handler_for(&txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    let mut given_up = 0;
    while given_up < 3 {
        handler.areas().wait_cycle().unwrap();
        given_up += u32::from(handler.areas().wait_cycle_for(Duration::from_millis(1)).is_err());
    }
    // If one of them were still expected, its window would have lasted to the end.
    assert_eq!(handler.areas().statistics().late_reactions, 0);
    handler.end_transfer().unwrap();
}

#[test]
fn beginning_and_ending_do_not_wait_for_a_guard() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let area = handler.areas().clone();
    let mut areas = area.lock();
    handler.begin_transfer().unwrap();
    areas[LOCAL_IO].output.duty[0] = 100;
    handler.end_transfer().unwrap();
    drop(areas);
    // The guard is older than the stop of the motors, and its outputs must not undo the stop.
    assert_eq!(handler.areas().lock()[LOCAL_IO].output.duty[0], 0);
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap();
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 0);
}

#[test]
fn a_thread_that_waits_gets_the_end() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    let area = handler.areas().clone();
    let waiting = thread::spawn(move || loop {
        if let Err(error) = area.wait_cycle() {
            return error;
        }
    });
    handler.end_transfer().unwrap();
    assert_eq!(waiting.join().unwrap(), Error::NotStarted);
}

#[test]
fn a_controller_that_says_nothing_ends_every_wait_in_time() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let limits = TimeLimits::default().read(Duration::from_millis(50));
    let handler = TransferAreaComHandler::builder(format!(
        "127.0.0.1:{}",
        listener.local_addr().unwrap().port()
    ))
    .time_limits(limits)
    .build()
    .unwrap();
    let error = handler.begin_transfer().unwrap_err();
    let expected = Error::NoAnswer { command: "QueryStatus", limit: limits.read, received: 0 };
    assert_eq!(error, expected);
    assert_eq!(handler.areas().wait_cycle().unwrap_err(), expected);
}

#[test]
fn a_controller_that_falls_silent_ends_the_transfer_with_an_error() {
    let fault = Fault::at_response(10, FaultKind::Silence);
    let txt = unpaced().fault(fault).start().unwrap();
    let limits = TimeLimits::default().read(Duration::from_secs(2));
    let handler = handler_for(&txt).time_limits(limits).build().unwrap();
    handler.begin_transfer().unwrap();
    let error = loop {
        if let Err(error) = handler.areas().wait_cycle() {
            break error;
        }
    };
    let expected = Error::NoAnswer { command: "ExchangeDataCmpr", limit: limits.read, received: 0 };
    assert_eq!(error, expected);
    assert_eq!(handler.areas().wait_cycle_for(DEADLINE).unwrap_err(), expected);
    assert_eq!(handler.areas().error(), Some(expected.clone()));
    assert_eq!(handler.end_transfer(), Err(expected));
}

#[test]
fn a_transfer_begins_again_after_its_end_and_after_an_error() {
    // The compression starts again: with its old state the checksums would be wrong.
    let fault = Fault::at_response(50, FaultKind::WrongCrc);
    let txt = unpaced().extensions(1).fault(fault).start().unwrap();
    txt.with_machine(|machine| machine.controllers[1].uni = [1, 0, 333, 4, 0, 0, 0, 9]);
    let handler = handler_for(&txt).areas(2).build().unwrap();
    let mut failures = 0;
    for round in 0..5 {
        handler.begin_transfer().unwrap();
        assert_eq!(handler.areas().error(), None);
        handler.areas().lock()[LOCAL_IO].output.duty[4] = 100 + round;
        let result = (0..60).try_for_each(|_| handler.areas().wait_cycle().map(drop));
        failures += usize::from(result.is_err());
        assert_eq!(handler.areas().lock()[REMOTE_IO_1].input.uni, [1, 0, 333, 4, 0, 0, 0, 9]);
        assert_eq!(handler.end_transfer(), result);
    }
    assert_eq!(failures, 1, "the fault occurs once");
    assert_eq!(txt.with_machine(|machine| machine.connections()), 5);
    assert_eq!(handler.end_transfer(), Ok(()));
    check_client(&txt);
}

#[test]
fn every_thread_that_ends_the_transfer_returns_when_it_has_ended() {
    let txt = unpaced().fault(Fault::at_exchange(20, FaultKind::Silence)).start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    assert!(txt.wait_until(|machine| machine.exchanges() > 20, DEADLINE));
    thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                let result = handler.end_transfer();
                assert!(!handler.areas().is_running(), "its motors may still be on");
                assert!(matches!(result, Err(Error::NoAnswer { .. })), "{result:?}");
            });
        }
    });
}
