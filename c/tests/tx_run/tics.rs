//! When PrgTic is called.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::Arc;

use ft_transfer_area_simulator::Machine;

use super::support::{has_compiler, own_port, run_on, txt, wait_for};

#[cfg(unix)]
#[test]
fn a_process_that_prg_tic_has_made_ends_when_it_returns() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let ended = run_on(&txt, "fork_tic.c", "").end();
    assert!(ended.out.contains("ended with 1"), "{ended:#?}");
    assert!(ended.err.contains("a child process after fork can't use the library"), "{ended:#?}");
    assert!(!ended.err.contains("panicked"), "{ended:#?}");
}

#[test]
fn there_is_a_tic_every_millisecond_and_the_program_sees_what_the_facts_say() {
    if !has_compiler() {
        return;
    }
    let txt = txt().device_name("TX-2009").start().unwrap();
    let ended = run_on(&txt, "tics.c", "").end();
    ended.well();
    let tics: f64 = ended.out.trim().parse().expect(&ended.out);
    // On a busy machine tics are skipped, or come after a delay, which the first or the last one may still have.
    let made_up = ended
        .err
        .split_once(" of them made up")
        .and_then(|(before, _)| before.rsplit(' ').next()?.parse::<f64>().ok());
    let difference = 5.0 + made_up.unwrap_or_default();
    assert!((tics - 1000.0).abs() <= difference || ended.err.contains("skipped"), "{ended:#?}");
}

/// How many changes in a row are answered in the very next request. A program that answers later never has two.
const IN_A_ROW: u32 = 50;

#[test]
fn an_input_is_answered_in_the_next_request() {
    if !has_compiler() {
        return;
    }
    let longest = Arc::new(AtomicU32::new(0));
    let noted = Arc::clone(&longest);
    let (mut asked, mut in_a_row) = (0, 0);
    let txt = txt().on_exchange(move |machine: &mut Machine| {
        let controller = &mut machine.controllers[0];
        let answered = asked != 0 && asked == controller.outputs.duty[0];
        in_a_row = if answered { in_a_row + 1 } else { 0 };
        noted.fetch_max(in_a_row, Ordering::Relaxed);
        asked = asked % 500 + 1;
        controller.uni[0] = asked;
    });
    let txt = txt.port(own_port()).start().unwrap();
    let run = run_on(&txt, "echo.c", "");
    // A busy machine makes a program late now and then, but not forever.
    wait_for(&txt, "answers in a row", |_| longest.load(Ordering::Relaxed) >= IN_A_ROW);
    drop(txt);
    run.end();
}
