//! When PrgTic is called.

use std::sync::{Arc, Mutex};

use ft_transfer_area::simulator::Machine;

use crate::support::{has_compiler, run_on, txt, wait_for};

#[test]
fn there_is_a_tic_every_millisecond_and_the_program_sees_what_the_facts_say() {
    if !has_compiler() {
        return;
    }
    let txt = txt().device_name("TX-2009").start().unwrap();
    let ended = run_on(&txt, "tics.c", "").end();
    ended.well();
    let tics: f64 = ended.out.trim().parse().expect(&ended.out);
    // Tics that are skipped on a busy machine are said.
    assert!((995.0..=1005.0).contains(&tics) || ended.err.contains("skipped"), "{ended:#?}");
}

/// How many changes of an input are answered.
const CHANGES: usize = 300;

#[test]
fn an_input_is_answered_in_the_next_request() {
    if !has_compiler() {
        return;
    }
    let answers = Arc::new(Mutex::new(Vec::new()));
    let noted = Arc::clone(&answers);
    let mut asked = 0;
    let txt = txt().on_exchange(move |machine: &mut Machine| {
        let controller = &mut machine.controllers[0];
        noted.lock().unwrap().push((asked, controller.outputs.duty[0]));
        asked = asked % 500 + 1;
        controller.uni[0] = asked;
    });
    let txt = txt.start().unwrap();
    let run = run_on(&txt, "echo.c", "");
    wait_for(&txt, "all changes", |machine| machine.exchanges() > CHANGES as u64 + 10);
    run.signal(libc::SIGTERM);
    run.end();
    // The first requests come before PrgInit has returned.
    let answers = answers.lock().unwrap()[10..10 + CHANGES].to_vec();
    let answered = answers.iter().filter(|(asked, answer)| asked == answer).count();
    assert!(answered * 100 >= CHANGES * 99, "{answered} of {CHANGES}: {answers:?}");
}
