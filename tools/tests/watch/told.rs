//! What the lines of JSON say.

use ft_transfer_area::transfer_area::{InputMode, LOCAL_IO};
use ft_transfer_area::tx::{Input, Motor};
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::json;

use super::support::Watch;

#[test]
fn each_change_is_a_line_with_the_names_of_the_page() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let watch = Watch::with_lines(txt.address());
    let handler = watch.handler().build().unwrap();
    handler.lock()[LOCAL_IO].set_ft_uni_config(Input::I2, InputMode::Voltage, false);
    handler.begin_transfer().unwrap();
    let line = watch.line_where(|line| line["what"] == "controller");
    assert_eq!((&line["name"], &line["firmware"]), (&json!("TX2013"), &json!("4.7.0")));
    let line = watch.line_where(|line| line["command"] == "UpdateConfig");
    assert_eq!(line["what"], "command");
    // The first cycle has a line for each terminal.
    let line = watch.line_where(|line| line["input"] == "I2");
    assert_eq!(
        (&line["controller"], &line["cycle"], &line["mode"]),
        (&json!("TXT"), &json!(1), &json!("voltage"))
    );
    txt.with_machine(|machine| machine.controllers[0].uni[1] = 4711);
    let line = watch.line_where(|line| line["input"] == "I2");
    assert_eq!((&line["value"], &line["unit"]), (&json!(4711), &json!("mV")));
    handler.lock()[LOCAL_IO].output.duty[2] = 77;
    let motor = Motor::M2.to_string();
    let line = watch.line_where(|line| line["motor"] == motor.as_str() && line["duty"][0] == 77);
    assert_eq!((&line["kind"], &line["ready"]), (&json!("motor"), &json!(true)));
    handler.end_transfer().unwrap();
    let line = watch.line_where(|line| line["what"] == "offline");
    assert_eq!(line["by_program"], true);
    watch.line_where(|line| line["what"] == "closed" && line["connection"] == "main");
}
