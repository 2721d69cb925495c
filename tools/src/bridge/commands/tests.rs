use super::*;

/// The areas of a master and an extension, which is connected.
fn two_areas() -> [FishX1Transfer; 2] {
    let mut areas = [FishX1Transfer::default(); 2];
    areas[0].state.io_slave_alive[0] = 1;
    areas
}

/// Those areas after this command.
fn after(tail: &str, payload: &str) -> Result<[FishX1Transfer; 2], String> {
    let mut areas = two_areas();
    Received::parse(tail, payload.as_bytes())?.apply(&mut areas)?;
    Ok(areas)
}

#[test]
fn duties_turn_motors_either_way_on_any_controller() {
    let duty = |tail, payload| after(tail, payload).map(|areas| areas.map(|a| *a.output.duty));
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
    assert_eq!((*areas[0].output.distance, *areas[0].output.master), ([0; 4], [0, 1, 0, 0]));
}

#[test]
fn stop_switches_off_everything_everywhere() {
    let mut areas = two_areas();
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
        assert_eq!((*area.output.duty, *area.output.distance), ([0; 8], [0; 4]));
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
fn what_is_wrong_is_told_in_words_of_the_field_and_changes_nothing() {
    for (tail, payload, error) in [
        ("M1/set", "abc", "the payload is not JSON (expected value at line 1 column 1)"),
        ("M1/set", "300", r#"the payload is 300; send {"duty": 300}"#),
        ("M1/set", "", r#"duty is missing: a whole number from -512 to 512; send {"duty": 300}"#),
        ("M1/set", r#"{"duty": 513}"#, "duty is a whole number from -512 to 512, not 513"),
        ("M1/set", r#"{"duty": 99999999999999999999}"#, "from -512 to 512, not 1"),
        ("M1/set", r#"{"dutty": 5}"#, "duty is missing"),
        ("M1/set", r#"{"duty": 5, "dutty": 5}"#, r#""dutty" is not a field of this command"#),
        ("M1/set", r#"{"duty": "5"}"#, r#"-512 to 512, not "5""#),
        ("O1/set", r#"{"duty": 5}"#, "O1 and O2 are the motor M1"),
        ("O1/set", r#"{"duty": -5}"#, "duty is a whole number from 0 to 512, not -5"),
        ("M1/move", r#"{"duty": 5, "distance": 0}"#, "distance is a whole number from 1 to 65535"),
        ("M1/move", r#"{"duty": 5, "with": [{"motor": "M1"}]}"#, "M1 is named twice"),
        ("M1/move", r#"{"duty": 5, "with": [{"motor": "M9"}]}"#, r#"motor is M1 to M4, not "M9""#),
        ("M1/move", r#"{"duty": 5, "with": ["M2"]}"#, r#"with is a list of motors, as [{"motor""#),
        ("I1/mode", r#"{"mode": "colour", "digital": true}"#, "mode is voltage or resistance or"),
        ("I1/mode", r#"{"mode": "voltage", "digital": 1}"#, "digital is true or false, not 1"),
        ("sound/set", r#"{"sound": 100}"#, "sound is a sound's name or number, not 100"),
        ("sound/set", r#"{"sound": "Ding"}"#, "1 Airplane, 2 Alarm, 3 Bell,"),
        ("sound/set", r#"{"sound": 1, "repeat": -1}"#, "repeat is a whole number from 0 to 65535"),
        ("ext9/M1/set", r#"{"duty": 5}"#, "there is no ext9"),
        ("ext2/M1/set", r#"{"duty": 5}"#, "there is no extension 2"),
    ] {
        let found = after(tail, payload).unwrap_err();
        assert!(found.contains(error), "{tail} {payload}: {found}");
    }
    let error = Received::parse("M1/set", &[0xFF, 0xFE]).unwrap_err();
    assert!(error.contains("not UTF-8"), "{error}");
    let error = Received::parse("M1/set", &[b' '; 4097]).unwrap_err();
    assert!(error.contains("4097 bytes"), "{error}");
    let deep = "[".repeat(4000);
    assert!(Received::parse("M1/set", deep.as_bytes()).is_err());
    let topic = format!("ext{}/M1/set", "ä".repeat(1000));
    assert!(Received::parse(&topic, b"").unwrap_err().len() < 300);
    let long = format!("{{\"duty\": \"{}\"}}", "ä".repeat(1000));
    let error = Received::parse("M1/set", long.as_bytes()).unwrap_err();
    assert!(error.len() < 300 && error.contains("ää…"), "{error}");
}

#[test]
fn a_topic_that_is_no_command_is_answered_with_those_that_are() {
    for (tail, error) in [
        ("M1/go", "M1 has no command \"go\"; its commands are M1/set, M1/move, M1/stop, M1/mode"),
        ("ext1/O8/go", "O8 has no command \"go\"; its commands are O8/set"),
        ("I1/set", "its commands are I1/mode"),
        ("sound/play", "its commands are sound/set"),
        (
            "M5/set",
            "there is no terminal \"M5\" that takes commands; there are M1 to M4 with /set,",
        ),
        ("ext1/stop", "stop and heartbeat for the whole controller"),
        ("", "there is no terminal \"\""),
    ] {
        let found = after(tail, r#"{"duty": 5}"#).unwrap_err();
        assert!(found.contains(error), "{tail}: {found}");
    }
}

#[test]
fn each_command_that_is_named_is_one() {
    for (terminals, verbs) in COMMANDS {
        for verb in verbs {
            let terminal = terminals.split(' ').next().unwrap();
            let error = Received::parse(&format!("{terminal}/{verb}"), b"{}").err();
            let error = error.unwrap_or_default();
            assert!(!error.contains("has no command") && !error.contains("no terminal"), "{error}");
        }
    }
}

#[test]
fn a_stop_needs_no_right_payload() {
    let mut areas = [FishX1Transfer::default(); 2];
    for stop in ["M1/stop", "stop"] {
        Received::parse("M1/set", br#"{"duty": 200}"#).unwrap().apply(&mut areas).unwrap();
        Received::parse(stop, &[0xFF]).unwrap().apply(&mut areas).unwrap();
        assert_eq!(areas[0].output.duty, [0; 8], "{stop}");
    }
}

#[test]
fn outputs_need_their_mode_and_motors_theirs() {
    let mut areas = [FishX1Transfer::default()];
    let mut send = |tail: &str, payload: &str| {
        Received::parse(tail, payload.as_bytes())?.apply(&mut areas)?;
        Ok::<_, String>(*areas[0].output.duty)
    };
    send("M1/mode", r#"{"mode": "outputs"}"#).unwrap();
    assert_eq!(send("O2/set", r#"{"duty": 9}"#), Ok([0, 9, 0, 0, 0, 0, 0, 0]));
    let error = send("M1/set", r#"{"duty": 9}"#).unwrap_err();
    assert!(error.contains("M1 is the two outputs O1 and O2"), "{error}");
}
