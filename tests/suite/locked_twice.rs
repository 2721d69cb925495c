//! A thread that would wait for itself panics with an explanation, and its motors stop.

use std::any::Any;
use std::cell::RefCell;
use std::env;
use std::ops::ControlFlow;
use std::panic::{self, catch_unwind, AssertUnwindSafe};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::{Input, Motor};
use ft_transfer_area::{Error, TransferAreaComHandler, TransferAreas};
use ft_transfer_area_simulator::Machine;

use crate::support::{check_client, handler_for, strict, unpaced, wait_until, DEADLINE};

fn text(panic: &(dyn Any + Send)) -> &str {
    panic.downcast_ref::<String>().map_or("no text", String::as_str)
}

/// Locks twice in some way, in a program with a running motor.
fn check(lock_twice: impl Fn(&TransferAreaComHandler)) {
    let txt = strict().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
    handler.begin_transfer().unwrap();
    wait_until(&txt, "a motor", |machine| machine.controllers[0].outputs.duty[0] == 512);
    let panic = catch_unwind(AssertUnwindSafe(|| lock_twice(&handler))).unwrap_err();
    let text = text(&*panic);
    assert!(text.contains("locked_twice::") && text.contains("drop the guard first"), "{text}");
    wait_until(&txt, "a stopped motor", |machine| !machine.connected());
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty), [0; 8]);
    assert_eq!(handler.end_transfer(), Err(Error::ProgramPanicked));
    check_client(&txt);
}

#[test]
fn the_panic_names_the_line_of_the_program() {
    thread_local!(static PLACE: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) });
    let before = Arc::new(panic::take_hook());
    let print = Arc::clone(&before);
    panic::set_hook(Box::new(move |info| {
        PLACE.with_borrow_mut(|places| {
            places.extend(info.location().map(|at| at.file().to_owned()))
        });
        print(info);
    }));
    let calls: [fn(&TransferAreas); 5] = [
        |area| drop(area.lock()),
        |area| drop(area.wait_cycle()),
        |area| drop(area.wait_cycle_for(Duration::ZERO)),
        |area| drop(area.wait_until(|_| true, Duration::ZERO)),
        |area| drop(area.wait_sound(LOCAL_IO, Duration::ZERO)),
    ];
    for call in calls {
        let txt = strict().start().unwrap();
        let handler = handler_for(&txt).build().unwrap();
        handler.begin_transfer().unwrap();
        let area = handler.areas().clone();
        let _held = area.lock();
        catch_unwind(AssertUnwindSafe(|| call(&area))).unwrap_err();
    }
    panic::set_hook(Box::new(move |info| before(info)));
    let places = PLACE.take();
    assert_eq!(places.len(), calls.len());
    assert!(places.iter().all(|file| file.ends_with("locked_twice.rs")), "{places:?}");
}

#[test]
fn in_a_match_on_a_value_of_the_area() {
    check(|handler| match handler.areas().lock()[LOCAL_IO].input.uni[0] {
        0 => handler.areas().lock()[LOCAL_IO].output.duty[0] = 0,
        _ => unreachable!("I1 is not pressed"),
    });
}

#[test]
fn in_one_statement() {
    check(|handler| {
        println!(
            "{} {}",
            handler.areas().lock()[0].input.uni[0],
            handler.areas().lock()[0].input.uni[1]
        );
    });
}

#[test]
fn by_every_call_that_waits() {
    check(|handler| {
        let _areas = handler.areas().lock();
        let _ = handler.areas().wait_cycle();
    });
    check(|handler| {
        let _areas = handler.areas().wait_cycle().unwrap();
        let _ = handler.areas().clone().wait_cycle_for(DEADLINE);
    });
    check(|handler| {
        let _areas = handler.areas().lock();
        let _ = handler.areas().wait_until(|_| true, DEADLINE);
    });
    check(|handler| {
        let _areas = handler.areas().lock();
        let _ = handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, DEADLINE);
    });
    check(|handler| {
        let _areas = handler.areas().lock();
        let _ = handler.areas().wait_input_change(LOCAL_IO, Input::I1, DEADLINE);
    });
    check(|handler| {
        let _areas = handler.areas().lock();
        let _ = handler.areas().update_config();
    });
    check(|handler| {
        let condition = |_: &[_]| handler.areas().lock().is_empty();
        let _ = handler.areas().wait_until(condition, DEADLINE);
    });
}

#[test]
fn in_a_hook() {
    let txt = strict().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let area = handler.areas().clone();
    handler
        .set_cycle_hook(move |_| {
            drop(area.lock());
            ControlFlow::Continue(())
        })
        .unwrap();
    handler.begin_transfer().unwrap();
    // On a busy computer the panic's message may take longer than a hook may.
    while matches!(handler.areas().wait_cycle(), Ok(_) | Err(Error::WatchdogExpired { .. })) {}
    assert_eq!(handler.end_transfer(), Err(Error::ProgramPanicked));
    wait_until(&txt, "the end", |machine| !machine.connected());
}

/// Set for the process that locks twice while it panics: how, and the address of its controller.
const PANICS: &str = "LOCKED_TWICE_PANICS";

/// The second panic aborts the program before the guard and the handler are dropped.
#[test]
fn in_a_panic_the_motors_stop_before_the_program_is_aborted() {
    if let Ok(role) = env::var(PANICS) {
        let (how, address) = role.split_once(' ').unwrap();
        return panic_and_lock(how, address);
    }
    for how in ["drop", "hook"] {
        // It is on for a moment, which a busy computer may miss.
        let was_on = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&was_on);
        let look = move |machine: &mut Machine| _ = seen.fetch_or(is_on(machine), Ordering::SeqCst);
        let txt = unpaced().on_exchange(look).start().unwrap();
        let name = "locked_twice::in_a_panic_the_motors_stop_before_the_program_is_aborted";
        let mut program = Command::new(env::current_exe().unwrap());
        program.args(["--exact", name, "--nocapture"]);
        program.env(PANICS, format!("{how} {}", txt.address()));
        let mut program = program.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        wait_until(&txt, "a running motor", |_| was_on.load(Ordering::SeqCst));
        assert!(!program.wait().unwrap().success());
        wait_until(&txt, "the end", |machine| !machine.connected());
        assert!(!txt.with_machine(|machine| is_on(machine)), "in the {how}");
    }
}

fn is_on(machine: &Machine) -> bool {
    machine.controllers[0].outputs.duty[0] == 512
}

fn panic_and_lock(how: &str, address: &str) {
    struct MotorsOff(TransferAreas);

    impl Drop for MotorsOff {
        fn drop(&mut self) {
            self.0.lock()[LOCAL_IO].output.duty[0] = 0;
        }
    }

    let handler = TransferAreaComHandler::builder(address).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[0] = 512;
    while handler.areas().wait_cycle().unwrap().cycle() < 3 {}
    let off = MotorsOff(handler.areas().clone());
    let _guard = handler.areas().wait_cycle().unwrap();
    let _dropped_first = match how {
        "hook" => {
            panic::set_hook(Box::new(move |_| off.0.lock()[LOCAL_IO].output.duty[0] = 0));
            None
        }
        _ => Some(off),
    };
    panic!("under a guard");
}

#[test]
fn not_when_another_thread_has_the_areas_or_the_guard_is_dropped() {
    let txt = strict().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let areas = handler.areas().lock();
    std::thread::scope(|scope| {
        let waiting = scope.spawn(|| drop(handler.areas().lock()));
        std::thread::sleep(Duration::from_millis(10));
        drop(areas);
        waiting.join().unwrap();
    });
    drop(handler.areas().lock());
    drop(handler.areas().lock());
}
