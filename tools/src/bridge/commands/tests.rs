use super::*;

/// The master's area and an extension's after this command.
fn after(tail: &str, payload: &str) -> Result<[FishX1Transfer; 2], String> {
    let mut areas = [FishX1Transfer::default(); 2];
    Received::parse(tail, payload.as_bytes())?.apply(&mut areas)?;
    Ok(areas)
}

#[test]
fn duties_turn_motors_either_way_on_any_controller() {
    let duty = |tail, payload| after(tail, payload).map(|areas| areas.map(|a| a.output.duty));
    let off = [0; 8];
    let turned = [[300, 0, 0, 0, 0, 0, 0, 0], off];
    assert_eq!(duty("M1/set", r#"{"duty": 300}"#), Ok(turned));
    let turned = [off, [0, 0, 0, 512, 0, 0, 0, 0]];
    assert_eq!(duty("ext1/M2/set", r#"{"duty": -512}"#), Ok(turned));
}

#[test]
fn a_distance_is_for_a_group_and_a_plain_duty_ends_it() {
    let order = r#"{"duty": -200, "distance": 90, "with": [{"motor": "M3", "reverse": true}]}"#;
    let mut areas = after("M2/move", order).unwrap();
    assert_eq!(areas[0].output.distance, [0, 90, 90, 0]);
    assert_eq!(areas[0].output.master, [0, 0, 2, 0]);
    assert_eq!(areas[0].output.duty, [0, 0, 0, 200, 200, 0, 0, 0]);
    let id = areas[0].output.motor_ex_cmd_id[1];
    let plain = Received::parse("M2/set", br#"{"duty": 7}"#).unwrap();
    plain.apply(&mut areas).unwrap();
    assert_eq!(areas[0].output.distance, [0, 0, 90, 0]);
    assert_ne!(areas[0].output.motor_ex_cmd_id[1], id, "a new command");
    // Together, forever.
    let areas = after("M1/move", r#"{"duty": 5, "with": [{"motor": "M2"}]}"#).unwrap();
    assert_eq!((areas[0].output.distance, areas[0].output.master), ([0; 4], [0, 1, 0, 0]));
}

#[test]
fn stop_switches_off_everything_everywhere() {
    let mut areas = [FishX1Transfer::default(); 2];
    for (tail, payload) in [
        ("M1/move", r#"{"duty": 200, "distance": 90}"#),
        ("ext1/M2/set", r#"{"duty": 200}"#),
        ("M4/mode", r#"{"mode": "outputs"}"#),
        ("O8/set", r#"{"duty": 512}"#),
        ("sound/set", r#"{"sound": "Bell", "repeat": 0}"#),
    ] {
        let command = Received::parse(tail, payload.as_bytes()).unwrap();
        command.apply(&mut areas).unwrap();
    }
    assert_eq!((areas[0].output.duty[7], areas[0].txt_outputs.sound_index), (512, 3));
    Received::parse("stop", b"").unwrap().apply(&mut areas).unwrap();
    for area in areas {
        assert_eq!((area.output.duty, area.output.distance), ([0; 8], [0; 4]));
        assert_eq!(area.txt_outputs.sound_index, 0);
    }
}

#[test]
fn counters_and_modes_are_set() {
    let area = |tail, payload| after(tail, payload).unwrap()[0];
    assert_eq!(area("C2/reset", "").output.cnt_reset_cmd_id, [0, 1, 0, 0]);
    assert_eq!(area("C3/mode", r#"{"mode": "inverted"}"#).config.cnt[2].mode, 0);
    let input = area("I8/mode", r#"{"mode": "ultrasonic", "digital": false}"#);
    assert_eq!((input.config.uni[7].mode, input.config.uni[7].digital), (3, 0));
    assert_eq!(input.state.config_id, 2, "it goes out");
}

#[test]
fn what_is_wrong_is_a_sentence_and_changes_nothing() {
    for (tail, payload, error) in [
        ("M1/set", "abc", "the payload is wrong: expected value"),
        ("M1/set", "", "missing field `duty`"),
        ("M1/set", r#"{"duty": 513}"#, "the duty is 513, but has to be -512 to 512"),
        ("M1/set", r#"{"duty": 99999999999999999999}"#, "the payload is wrong"),
        ("M1/set", r#"{"dutty": 5}"#, "unknown field `dutty`"),
        ("M1/set", r#"{"duty": "5"}"#, "invalid type: string"),
        ("M5/set", r#"{"duty": 5}"#, "there is no command \"M5/set\""),
        ("M1/go", "{}", "there is no command \"M1/go\""),
        ("O1/set", r#"{"duty": 5}"#, "O1 and O2 are the motor M1"),
        ("O1/set", r#"{"duty": -5}"#, "has to be 0 to 512"),
        ("M1/move", r#"{"duty": 5, "distance": 0}"#, "a distance is 1 to 65535 pulses"),
        ("M1/move", r#"{"duty": 5, "with": [{"motor": "M1"}]}"#, "M1 is named twice"),
        ("M1/move", r#"{"duty": 5, "with": [{"motor": "M9"}]}"#, "there is no motor \"M9\""),
        ("I1/mode", r#"{"mode": "colour", "digital": true}"#, "unknown mode \"colour\""),
        ("sound/set", r#"{"sound": 100}"#, "the sound's index is 100"),
        ("sound/set", r#"{"sound": "Ding"}"#, "there is no sound \"Ding\""),
        ("sound/set", r#"{"sound": []}"#, "a sound is a number or a name"),
        ("ext9/M1/set", r#"{"duty": 5}"#, "there is no ext9"),
        ("ext2/M1/set", r#"{"duty": 5}"#, "there is no extension 2"),
        ("ext1/stop", "", "there is no command"),
        ("", "", "there is no command"),
    ] {
        let found = after(tail, payload).unwrap_err();
        assert!(found.contains(error), "{tail} {payload}: {found}");
    }
    let error = Received::parse("M1/set", &[0xFF, 0xFE]).unwrap_err();
    assert!(error.contains("no UTF-8"), "{error}");
    let error = Received::parse("M1/set", &[b' '; 4097]).unwrap_err();
    assert!(error.contains("4097 bytes"), "{error}");
    let deep = "[".repeat(4000);
    assert!(Received::parse("M1/set", deep.as_bytes()).is_err());
}

#[test]
fn outputs_need_their_mode_and_motors_theirs() {
    let mut areas = [FishX1Transfer::default()];
    let mut send = |tail: &str, payload: &str| {
        Received::parse(tail, payload.as_bytes())?.apply(&mut areas)?;
        Ok::<_, String>(areas[0].output.duty)
    };
    send("M1/mode", r#"{"mode": "outputs"}"#).unwrap();
    assert_eq!(send("O2/set", r#"{"duty": 9}"#), Ok([0, 9, 0, 0, 0, 0, 0, 0]));
    let error = send("M1/set", r#"{"duty": 9}"#).unwrap_err();
    assert!(error.contains("M1 is the two outputs O1 and O2"), "{error}");
}
