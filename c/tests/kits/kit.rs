//! Programs with the class of kit 4.1.6.

use std::path::PathBuf;
use std::sync::atomic::{AtomicI16, Ordering};
use std::sync::{Arc, OnceLock};

use ft_transfer_area::transfer_area::{InputMode, UniConfig};
use ft_transfer_area_simulator::{Fault, FaultKind, Machine, SimulatedTxt};

use super::support::{
    compile, set_input, simulated, wait_duty, wait_offline, wait_stopped, wait_until, Running,
    SIGNALS,
};

fn program() -> Option<&'static PathBuf> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    let source = include_str!("programs/kit.cpp");
    PROGRAM.get_or_init(|| compile("kit/Common", "c++98", source, "kit")).as_ref()
}

/// A simulated TXT, and the duty of O1 in its last exchange.
fn txt_and_last_duty() -> (SimulatedTxt, Arc<AtomicI16>) {
    let last_duty = Arc::new(AtomicI16::new(0));
    let noted = Arc::clone(&last_duty);
    let note = move |machine: &mut Machine| {
        noted.store(machine.controllers[0].outputs.duty[0], Ordering::Relaxed);
    };
    (simulated().on_exchange(note).start().unwrap(), last_duty)
}

fn begun(txt: &SimulatedTxt, what: &str) -> Option<Running> {
    let mut running = Running::with(program()?, txt, &[what]);
    running.expect("begun");
    Some(running)
}

#[test]
fn a_loop_answers_inputs_of_master_and_extension_and_prints_the_kits_line() {
    let txt = simulated().extensions(1).start().unwrap();
    let Some(mut running) = begun(&txt, "") else { return };
    let config = txt.with_machine(|machine| machine.controllers[0].config);
    assert_eq!((config.uni[1], *config.motor), (UniConfig::analog(InputMode::Ultrasonic), [1; 4]));
    for _ in 0..2 {
        set_input(&txt, 0, 1);
        wait_duty(&txt, 0, 512);
        set_input(&txt, 0, 0);
        wait_duty(&txt, 0, 0);
    }
    txt.with_machine(|machine| machine.controllers[1].uni[0] = 1);
    wait_until(&txt, "the extension's motor", |machine| {
        machine.controllers[1].outputs.duty[0] == 512
    });
    set_input(&txt, 1, 27);
    set_input(&txt, 7, 1);
    running.expect("1");
    running.expect_area("Transfer ID=0 I=0 27 0 0 0 0 0 1 C=", " O=0-0 0-0 0-0 0-0");
    running.expect_area("Transfer ID=1 I=1 0 0 0 0 0 0 0 C=", " O=512-0 0-0 0-0 0-0");
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn the_simple_exchange_does_the_same_for_the_master() {
    let txt = simulated().start().unwrap();
    let Some(running) = begun(&txt, "simple") else { return };
    set_input(&txt, 0, 1);
    wait_duty(&txt, 0, 512);
    set_input(&txt, 7, 1);
    running.end().well();
    wait_offline(&txt);
}

#[cfg_attr(windows, ignore = "Windows has no signals")]
#[test]
fn a_signal_ends_the_transfer_and_then_the_program() {
    let (txt, last_duty) = txt_and_last_duty();
    let Some(running) = begun(&txt, "") else { return };
    set_input(&txt, 0, 1);
    wait_duty(&txt, 0, 512);
    running.signal(SIGNALS[0]);
    let ended = running.end();
    assert_eq!(ended.signal, Some(SIGNALS[0]));
    // The only one is for calls before BeginTransfer. That its loop goes on meanwhile is no mistake of the program's.
    assert_eq!(ended.err.lines().count(), 1, "{}", ended.err);
    wait_stopped(&txt);
    assert_eq!(last_duty.load(Ordering::Relaxed), 0);
}

/// The controller's firmware leaves outputs as they are at StopOnline.
#[test]
fn the_end_of_a_transfer_stops_the_motors_by_an_exchange() {
    let (txt, last_duty) = txt_and_last_duty();
    let Some(running) = begun(&txt, "") else { return };
    set_input(&txt, 0, 1);
    wait_duty(&txt, 0, 512);
    set_input(&txt, 7, 1);
    running.end().well();
    wait_stopped(&txt);
    assert_eq!(last_duty.load(Ordering::Relaxed), 0);
}

#[test]
fn commands_are_done_once_and_after_another_programs() {
    let txt = simulated().start().unwrap();
    // The controller remembers the ids of the program before.
    for _ in 0..2 {
        let Some(mut running) = begun(&txt, "commands") else { return };
        running.expect("1 1");
        running.expect("0");
        running.end().well();
        wait_offline(&txt);
    }
}

#[test]
fn a_configuration_goes_out_by_the_call_without_a_new_id() {
    let txt = simulated().start().unwrap();
    let Some(running) = begun(&txt, "config") else { return };
    set_input(&txt, 7, 1);
    running.end().well();
    let config = txt.with_machine(|machine| machine.controllers[0].config);
    assert_eq!(config.motor, [1, 1, 1, 0]);
}

#[test]
fn frames_of_the_camera_come_in_repaired() {
    let txt = simulated().camera_tables(false).start().unwrap();
    let Some(mut running) = begun(&txt, "camera") else { return };
    for _ in 0..3 {
        running.expect("1");
        running.expect("4070000");
    }
    running.end().well();
    assert_eq!(txt.with_machine(|machine| machine.camera()), None);
}

#[test]
fn a_program_that_ends_without_the_end_of_its_transfer_leaves_no_motor_on() {
    let txt = simulated().start().unwrap();
    let Some(running) = begun(&txt, "leave") else { return };
    set_input(&txt, 0, 1);
    wait_duty(&txt, 0, 512);
    set_input(&txt, 7, 1);
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn failures_are_false_with_the_reason_on_the_standard_error() {
    let Some(program) = program() else { return };
    let ended = Running::start(program, "127.0.0.1:1", &[]).end();
    assert_eq!((ended.code, ended.out.as_str()), (Some(7), "not begun\n"));
    let reasons: Vec<_> = ended.err.lines().collect();
    let who = "127.0.0.1:1: no transfer is running; call BeginTransfer first";
    assert!(reasons[0].ends_with(who), "{reasons:?}");
    assert!(reasons[1].contains("127.0.0.1:1"), "{reasons:?}");
    assert_eq!(reasons.len(), 2, "{reasons:?}");

    let txt =
        simulated().fault(Fault::at_response(40, FaultKind::Close { after: 0 })).start().unwrap();
    let Some(mut running) = begun(&txt, "") else { return };
    running.expect("lost");
    // It has begun again.
    running.end().well();
}

#[test]
fn null_pointers_and_wrong_numbers_of_areas_are_false() {
    let source = "#include \"ftProInterface2013TransferAreaCom.h\"\n\
        int main() {\n\
        ftIF2013TransferAreaComHandler none(NULL, 1, NULL, NULL);\n\
        static FISH_X1_TRANSFER areas[10];\n\
        ftIF2013TransferAreaComHandler many(areas, 10), no(areas, 0), one(areas, 1, NULL, NULL);\n\
        unsigned char *buffer; size_t size;\n\
        none.PrintIO(0); none.EndTransfer(); none.StopCamera(); one.PrintIO(-1); one.StopCamera();\n\
        return none.BeginTransfer() || many.BeginTransfer() || no.BeginTransfer() || none.GetVersion()\n\
        || one.StartCamera() || one.GetCameraFrameJpeg(&buffer, &size)\n\
        || one.GetCameraFrameJpeg(NULL, NULL); }\n";
    let Some(program) = compile("kit", "c++98", source, "kit_null") else { return };
    Running::start(&program, "127.0.0.1:1", &[]).end().well();
}
