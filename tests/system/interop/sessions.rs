//! A client goes online and offline, and an extension comes and goes.

use ft_transfer_area::transfer_area::{InputMode, UniConfig};
use serde_json::json;

use super::ftrobopy::Ftrobopy;
use super::own::Own;
use super::{end_well, start, Exchange};

/// How often the log has this text.
fn times(log: &str, reported: &str) -> usize {
    log.lines().filter(|line| line.contains(reported)).count()
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn both_go_online_and_offline_a_hundred_times() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let mut program = start("inputs.toml", &[]);
    // 2200 Ω reads as closed, because a new connection begins with digital inputs.
    assert_eq!(ftrobopy.run(&mut program, "reconnect", Exchange::Compressed), json!([1]));
    let handler = program.handler().areas(2).build().unwrap();
    for area in handler.areas().lock().iter_mut() {
        *area.config.uni = [UniConfig::digital(InputMode::Resistance); 8];
    }
    for _ in 0..100 {
        handler.begin_transfer().unwrap();
        assert_eq!(handler.areas().wait_cycle().unwrap()[0].input.uni[2], 1);
        handler.end_transfer().unwrap();
    }
    let log = program.interrupt();
    for reported in ["connects to the main port", "sends StartOnline", "sends StopOnline"] {
        assert_eq!(times(&log, reported), 200, "{reported}: {log}");
    }
    assert_eq!(times(&log, "is refused"), 0, "{log}");
}

/// I3 as a resistance up to 15 kΩ.
const RESISTANCE: [(u8, u8); 8] = [(2, 0); 8];

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn ftrobopy_reads_an_extension_again_that_was_cut_off() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let mut program = start("inputs.toml", &[]);
    // ftrobopy does not check which controllers a response includes, and always expands the words of
    // two. Without the extension there are too few words, so it ends with a network error and reports
    // that it is offline. So does a new connection with use_extension. One without it goes on.
    let read = ftrobopy.run(&mut program, "extension", Exchange::Compressed);
    assert_eq!(read, json!([[2200, 12_345], [2200], [2300, 12_345]]));
    program.interrupt();
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn this_crate_goes_on_without_an_extension_and_has_it_again() {
    // This also runs without ftrobopy, because ftrobopy can't do it.
    let mut program = start("inputs.toml", &[]);
    let own = Own::begin(&program, Exchange::Compressed);
    for area in 0..2 {
        own.configure(area, RESISTANCE);
    }
    own.until(|areas| areas[0].input.uni[2] == 2200 && areas[1].input.uni[2] == 12_345);
    assert_eq!(own.master(|master| master.state.io_slave_alive[0]), 1);

    program.type_line("E1 0");
    own.until(|areas| areas[0].state.io_slave_alive[0] == 0);
    program.type_line("E1.I3 9999");
    program.type_line("I3 2300");
    own.until(|areas| areas[0].input.uni[2] == 2300);
    assert_eq!(own.look(1, |extension| extension.input.uni[2]), 12_345, "as it was last seen");

    program.type_line("E1 1");
    own.until(|areas| areas[0].state.io_slave_alive[0] == 1);
    own.until(|areas| areas[1].input.uni[2] == 9999);
    assert_eq!(own.master(|master| master.input.uni[2]), 2300);
    own.end();
    end_well(program);
}
