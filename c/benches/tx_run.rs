//! How many tics a second a program gets that `tx_run` runs, and what they cost.
//!
//! ```text
//! cargo bench --package ft-transfer-area-c --bench tx_run
//! ```

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use ft_transfer_area_simulator::SimulatedTxt;

/// Runs for ten seconds, and prints its rate and what it has cost. It drives no motor.
const TICS: &str = r#"
#define _GNU_SOURCE
#include <stdio.h>
#include <sys/resource.h>
#include "ROBO_TX_PRG.h"

static int tics;
static UINT32 begin;

static double used(int who)
{
    struct rusage usage;
    getrusage(who, &usage);
    return (usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) * 1e6 + usage.ru_utime.tv_usec + usage.ru_stime.tv_usec;
}

void PrgInit(TA *p_ta_array, int ta_count)
{
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    UINT32 now = p_ta_array->hook_table.GetSystemTime(TIMER_UNIT_MICROSECONDS);

    if (!tics++)
        begin = now;
    if (now - begin < 10000000)
        return 0x7FFF;
    printf("tics: %.2f a second, %.1f us of processor time each, %.1f us of it in other threads\n",
           (tics - 1) * 1e6 / (now - begin), used(RUSAGE_SELF) / tics,
           (used(RUSAGE_SELF) - used(RUSAGE_THREAD)) / tics);
    return 0;
}
"#;

fn main() {
    // `cargo test --benches` only asks whether it compiles.
    if std::env::args().all(|argument| argument != "--bench") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let tics = folder.path().join("tics.c");
    fs::write(&tics, TICS).expect("a file");
    let txt = SimulatedTxt::builder().start().expect("a free port");
    let ended = tx_run(&tics, &txt).output().expect("it starts");
    print!("{}", text(&ended));
}

fn tx_run(source: &PathBuf, txt: &SimulatedTxt) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tx_run"));
    command.arg(source).args(["--host", &txt.address().to_string()]);
    command
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}
