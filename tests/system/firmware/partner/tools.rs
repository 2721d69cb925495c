//! The commands of `txt` that talk to a controller.

use std::fs;
use std::net::TcpStream;
use std::process::{Command, Stdio};

use ft_transfer_area::tx::Input;
use ft_transfer_area::TransferAreaComHandler;
use ft_transfer_area_simulator::world::World;
use serde_json::json;

use super::{check, no_i2c_server_waits, stopped, wait_until, Check, ADDRESS};
use crate::controller::Controller;
use crate::examples::run::Run;
use crate::panel::page::Page;
use crate::program::{example, output_in_time, txt};

/// Where `txt watch` and the broker listen.
const WATCHED: &str = "127.0.0.1:65100";
const BROKER: &str = "127.0.0.1:1883";

pub(super) fn checks() -> Vec<(String, Check)> {
    vec![
        check("txt find, then record at once, twice", find_and_record),
        check("txt camera", camera),
        check("txt panel", panel),
        check("txt panel, which is killed", killed_panel),
        check("txt bridge", bridge),
        check("txt stop, after the end of a program", stop),
        check("txt watch, and the end of its program", watch),
        check("txt watch with a program, which is killed", watch_with_program),
        check("selftest by txt", selftest),
    ]
}

/// Runs `txt` until it ends well; returns what it has printed.
fn run(arguments: &[&str]) -> String {
    let output = output_in_time(txt().args(arguments));
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    said
}

fn find_and_record(controller: &Controller) {
    controller.plug_in(World::default());
    let found = run(&["find", "--only", ADDRESS, "--try-camera"]);
    assert!(found.contains("4.7.0"), "{found}");
    let folder = tempfile::tempdir().unwrap();
    for number in 0..2 {
        let file = folder.path().join(format!("{number}.mcap"));
        let file = file.to_str().unwrap();
        run(&["record", ADDRESS, "--seconds", "2", "-o", file]);
        let known = run(&["info", file]);
        assert!(known.contains("4.7.0"), "{known}");
        assert!(run(&["csv", file]).lines().count() > 10, "few cycles");
    }
}

fn camera(controller: &Controller) {
    controller.plug_in(World::default());
    let folder = tempfile::tempdir().unwrap();
    run(&["camera", ADDRESS, "-o", folder.path().to_str().unwrap(), "--count", "5"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 5);
}

fn panel(controller: &Controller) {
    controller.plug_in(World::default());
    let before = controller.board.state().frames;
    let mut panel = Run::of(txt().args(["panel", ADDRESS, "--no-browser"]));
    panel.wait_for("http://");
    wait_until("exchanges of the panel", || controller.board.state().frames > before + 100);
    panel.interrupt();
    panel.finish();
    stopped(controller);
}

/// Of what a killed panel leaves on, its guardian takes care.
fn killed_panel(controller: &Controller) {
    controller.plug_in(World::default());
    let mut panel = Run::of(txt().args(["panel", ADDRESS, "--no-browser"]));
    panel.wait_for("http://");
    let url = panel.last_line().trim_start_matches("http://");
    let (address, token) = url.split_once("/?token=").expect("an address with a token");
    let mut page = Page::open(address, token);
    page.wait_until_running();
    page.done(json!({"do": "drive"}));
    page.done(json!({"do": "motor", "host": 0, "motor": 3, "duty": 300}));
    wait_until("the motor runs", || !is_off(controller));
    drop(panel);
    wait_until("the motor is stopped", || is_off(controller));
}

/// A button that is pressed in the world arrives at the broker, and a command from there at the motor.
fn bridge(controller: &Controller) {
    if Command::new("mosquitto").arg("-h").output().is_err() {
        println!("not checked, there is no mosquitto: ");
        return;
    }
    // It is killed at the end.
    let _broker = Run::of(Command::new("mosquitto").args(["-p", "1883"]).stderr(Stdio::null()));
    wait_until("the broker listens", || TcpStream::connect(BROKER).is_ok());
    controller.plug_in(World::default());
    let turning = || {
        let bridge = Run::of(txt().args(["bridge", "--mqtt", BROKER, ADDRESS, "--name", "press"]));
        let set = ["-t", "ft/press/M4/set", "-m", r#"{"duty": 300}"#];
        wait_until("the motor runs", || {
            assert!(Command::new("mosquitto_pub").args(set).status().unwrap().success());
            controller.board.state().machine.controllers[0].outputs.duty[6] == 300
        });
        bridge
    };
    // Of what is left on by a killed one, its guardian takes care.
    drop(turning());
    wait_until("the motor is stopped", || is_off(controller));
    let bridge = turning();
    let mut heard = Command::new("mosquitto_sub");
    let heard = output_in_time(heard.args(["-C", "1", "-W", "20", "-t", "ft/press/I3"]));
    assert!(heard.status.success(), "nothing from I3");
    bridge.interrupt();
    bridge.finish();
    stopped(controller);
}

/// `txt stop` switches off what a killed program has left on.
fn stop(controller: &Controller) {
    controller.plug_in(World::default());
    leave_on(controller, ADDRESS);
    assert_ne!(controller.board.state().machine.controllers[0].outputs.duty, [0; 8]);
    run(&["stop", ADDRESS]);
    stopped(controller);
}

/// `txt watch` does so by itself.
fn watch(controller: &Controller) {
    controller.plug_in(World::default());
    let mut watch = Run::of(txt().args(["watch", ADDRESS, "--port", "65100", "--no-page"]));
    watch.wait_for("main");
    leave_on(controller, WATCHED);
    wait_until("the motor is stopped", || is_off(controller));
    // Behind another port than 65000, which the firmware has here, the sample does not know where I2C is.
    no_i2c_server_waits();
    for _ in 0..5 {
        let builder = TransferAreaComHandler::builder(format!("{ADDRESS}:65100")).i2c_port(65_102);
        let handler = builder.build().unwrap();
        handler.begin_transfer().unwrap();
        drop(handler.areas().wait_cycle().unwrap());
        handler.end_transfer().unwrap();
    }
    watch.interrupt();
    watch.finish();
}

/// The same for a program that it has started.
fn watch_with_program(controller: &Controller) {
    controller.plug_in(World::default());
    let sample = example("motor_on_off_switch");
    let mut watch = txt();
    watch.args(["watch", ADDRESS, "--port", "65100", "--no-page", "--"]);
    let watch = Run::of(watch.arg(sample.get_program()).arg(WATCHED));
    motor_runs(controller);
    let children = format!("/proc/{0}/task/{0}/children", watch.id());
    let children = fs::read_to_string(children).unwrap();
    // Beside the process that ends the program when txt watch is killed.
    let is_sample = |child: &&str| {
        let program = fs::read_link(format!("/proc/{child}/exe")).unwrap_or_default();
        program.ends_with("motor_on_off_switch")
    };
    let sample = children.split_whitespace().find(is_sample).expect("the program runs");
    assert!(Command::new("kill").args(["-KILL", sample]).status().unwrap().success());
    wait_until("the motor is stopped", || is_off(controller));
    watch.fail();
    no_i2c_server_waits();
    stopped(controller);
}

/// Kills a program whose motor runs.
fn leave_on(controller: &Controller, address: &str) {
    let program = Run::start("motor_on_off_switch", &[address]);
    motor_runs(controller);
    drop(program);
}

/// Presses the button of the sample.
fn motor_runs(controller: &Controller) {
    controller.board.state().machine.world_mut().unwrap().press(0, Input::I1, true);
    wait_until("the motor runs", || {
        controller.board.state().machine.controllers[0].outputs.duty[0] > 0
    });
}

fn is_off(controller: &Controller) -> bool {
    controller.board.state().machine.controllers[0].outputs.duty == [0; 8]
}

/// What `txt selftest` knows of the firmware is true of it.
fn selftest(controller: &Controller) {
    // Nobody presses a button in this world, so only the configuration changes what the inputs report.
    let mut world = World::shipped("slide").unwrap();
    world.i2c = World::default().i2c;
    controller.plug_in(world);
    let folder = tempfile::tempdir().unwrap();
    let output = output_in_time(txt().args(["selftest", ADDRESS]).current_dir(folder.path()));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(!said.contains("differs"), "{said}");
    stopped(controller);
}
