//! The samples in `c/examples`: compiled and run with the commands in their first lines, and checked by what
//! the simulated TXT saw. Without a compiler for C and C++ they are skipped.

mod factory;
mod run;

use std::thread;

use run::{arguments, compilers, run, text, tx_run, Run};

/// The last exchange before this condition is no longer fulfilled.
fn last_with(run: &Run, condition: impl Fn(&run::Seen) -> bool) -> &run::Seen {
    run.seen[0].iter().rfind(|seen| condition(seen)).expect("it happens")
}

/// The number of a line such as "600 pulses back".
fn number_before(said: &str, words: &str) -> i32 {
    let (before, _) = said.split_once(words).unwrap_or_else(|| panic!("no {words:?} in {said}"));
    let number = before.split_whitespace().next_back().expect("a number");
    number.parse().unwrap_or_else(|_| panic!("{number:?} is not a number"))
}

#[test]
fn the_gate_opens_and_closes_twice() {
    let Some(run) = run("gate.c") else { return };
    let said = run.check();
    assert_eq!(run.duties(0, 6), [0, 512, 0, 512, 0], "O7");
    // To find its place it closes first.
    assert_eq!(run.duties(0, 0), [0, 512, 0, 512, 0], "forward");
    assert_eq!(run.duties(0, 1), [0, 512, 0, 512, 0, 512, 0], "backward");
    // The counter is set to 0 once, and each opening has a distance of its own.
    let mut resets: Vec<u16> =
        run.seen[0].iter().map(|seen| seen.outputs.counter_reset_id[0]).collect();
    resets.dedup();
    assert_eq!(resets.len(), 2, "{resets:?}");
    let open = last_with(&run, |seen| seen.outputs.duty[0] > 0);
    assert_eq!(open.outputs.distance[0], 150);
    assert!((150..=156).contains(&number_before(&said, " pulses")), "{said}");
}

#[test]
fn the_slide_goes_to_its_end_and_600_pulses_back() {
    let Some(run) = run("pc_slide.c") else { return };
    let said = run.check();
    assert_eq!(run.duties(0, 0), [0, 512, 0], "forward");
    assert_eq!(run.duties(0, 1), [0, 512, 0], "backward");
    let forward = last_with(&run, |seen| seen.outputs.duty[0] > 0);
    assert_eq!(forward.inputs.uni[1], 1, "it is at its end");
    let back = last_with(&run, |seen| seen.outputs.duty[1] > 0);
    assert_eq!((back.outputs.distance[0], back.inputs.uni[1]), (600, 0));
    assert!((600..=606).contains(&number_before(&said, " pulses back")), "{said}");
}

#[test]
fn the_motor_follows_the_button_in_the_callback() {
    let Some(run) = run("txt_button.cpp") else { return };
    let said = run.check();
    assert!(said.contains("press 3") && !said.contains("press 4"), "{said}");
    // It ends while the button is pressed for the third time.
    let duties = run.duties(0, 0);
    assert!(duties.starts_with(&[0, 512, 0, 512, 0]), "{duties:?}");
    // An answer is in the next request, and a busy machine may make a few late.
    let seen = &run.seen[0];
    let late = seen.windows(2).filter(|pair| {
        let [before, now] = pair else { return false };
        now.outputs.duty[0] > 0 && before.inputs.uni[0] == 0
    });
    assert!(late.count() < seen.len() / 10);
}

#[test]
fn the_kits_loop_drives_the_master_and_an_extension() {
    let Some(run) = run("kit_loop.cpp") else { return };
    // It ends after 600 cycles. If a busy machine makes them longer, the button is perhaps pressed then, and the end
    // of the transfer stops the motor.
    let said = run.check_status();
    assert_eq!(number_before(&said, " cycles"), 600, "{said}");
    assert!(number_before(&said, " pulses") > 100, "{said}");
    for controller in [0, 1] {
        let duties = run.duties(controller, 0);
        assert!(duties.starts_with(&[0, 512, 0, 512, 0]), "{duties:?} of {controller}");
    }
}

#[test]
fn the_kits_callbacks_turn_two_motors_together() {
    let Some(run) = run("kit_callbacks.cpp") else { return };
    let said = run.check();
    for part in ["press 1", "press 2", "M1 has done 1", "M2 has done 1"] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
    for motor in [0, 1] {
        assert_eq!(run.duties(0, 2 * motor), [0, 400, 0, 400, 0], "M{}", motor + 1);
        let turning = last_with(&run, |seen| seen.outputs.duty[2 * motor] > 0);
        assert_eq!(turning.outputs.distance[motor], 120);
    }
    let together = last_with(&run, |seen| seen.outputs.duty[0] > 0);
    assert_eq!(together.outputs.master[1], 1, "M2 follows M1");
}

/// As in the documents: `tx_run` has a simulated TXT of its own.
#[test]
fn samples_run_on_a_simulated_txt_of_tx_run() {
    if !compilers() {
        return;
    }
    thread::scope(|scope| {
        for sample in ["gate.c", "txt_button.cpp"] {
            scope.spawn(move || {
                let output = tx_run(&arguments(sample));
                let said = text(&output.stdout) + &text(&output.stderr);
                assert!(output.status.success(), "{sample}: {}: {said}", output.status);
            });
        }
    });
}
