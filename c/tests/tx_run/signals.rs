//! Signals end programs, and what was suspended.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;

use super::ends::{goes_on_with_a_motor, press, wait_stopped, with_a_motor};
use super::support::{
    cache, has_compiler, has_ended, is_suspended, make_pipe, program, program_of, run_in_group,
    run_on, run_with, send, turns, tx_run, txt, wait_for, wait_until, Run,
};

#[test]
fn signals_end_the_program() {
    if !has_compiler() {
        return;
    }
    for (signal, name) in
        [(libc::SIGINT, "Ctrl-C"), (libc::SIGTERM, "SIGTERM"), (libc::SIGQUIT, "SIGQUIT")]
    {
        let ended = with_a_motor("CODE=0", |_, run| run.signal(signal));
        ended.badly(&format!("ended by {name}; all outputs are off"));
        let (txt, folder) = (txt().start().unwrap(), tempfile::tempdir().unwrap());
        let hangs = folder.path().join("hangs");
        let run = run_with(&txt, "ends.c", "-w -DHANG", &[("HANGS", &hangs)]);
        let ended = goes_on_with_a_motor(&txt, run, |txt, run| {
            press(txt, run);
            wait_for(txt, "it hangs", |_| hangs.exists());
            run.signal(signal);
        });
        // On a busy machine the limit for a call may be over first.
        let hangs = "PrgTic has not returned for half a second".to_owned();
        let asked = format!("ended by {name}, while PrgTic had not returned");
        assert!([asked, hangs].iter().any(|word| ended.err.contains(word)), "{}", ended.err);
        assert!(ended.err.contains("all outputs are off"), "{}", ended.err);
    }
}

/// The terminal sends it to all.
#[test]
fn ctrl_z_ends_a_program_that_knows_no_pauses() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_in_group(txt.address(), "ends.c", "-w -DCODE=0");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 512);
    run.signal_group(libc::SIGTSTP);
    wait_stopped(&txt);
    run.end().badly("ended by Ctrl-Z; all outputs are off");
}

/// Otherwise it would be killed with its motor on.
#[cfg(target_os = "linux")]
#[test]
fn tx_run_goes_on_with_a_program_that_is_continued_alone_and_drives_again() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_in_group(txt.address(), "pc.c", "-DAGAIN");
    wait_for(&txt, "the motor turns", turns);
    run.signal_group(libc::SIGTSTP);
    wait_until("it is suspended", || is_suspended(&run.id().to_string()));
    let program = program_of(&run);
    send("CONT", &program);
    wait_for(&txt, "the motor turns again", turns);
    send("KILL", &program);
    wait_stopped(&txt);
    run.end().badly("tx_run has sent it: all outputs are off");
}

#[cfg(target_os = "linux")]
#[test]
fn tx_run_is_suspended_with_its_program_and_stays_with_one_that_goes_on() {
    if !has_compiler() {
        return;
    }
    let first = txt().start().unwrap();
    let run = run_in_group(first.address(), "pc.c", "");
    wait_for(&first, "the motor turns", turns);
    run.signal_group(libc::SIGTSTP);
    wait_stopped(&first);
    wait_until("it is suspended", || is_suspended(&run.id().to_string()));
    run.signal_group(libc::SIGCONT);
    run.end_by(libc::SIGTERM).badly("pc was ended by SIGTERM");

    let second = txt().start().unwrap();
    let run = run_in_group(second.address(), "pc.c", "-DSTUBBORN -DLEAVE");
    wait_for(&second, "the motor turns", turns);
    run.signal_group(libc::SIGTSTP);
    press(&second, &run);
    wait_stopped(&second);
    run.end().badly("tx_run has sent it: all outputs are off");
}

#[test]
fn the_program_sees_that_it_is_to_end() {
    if !has_compiler() {
        return;
    }
    let ended = with_a_motor("ALLOWED", |txt, run| {
        press(txt, run);
        run.signal(libc::SIGINT);
    });
    ended.badly("ended by Ctrl-C");
}

#[test]
fn a_program_with_main_ends_its_transfer_when_it_is_asked_to_end() {
    if !has_compiler() {
        return;
    }
    for (signal, name) in [(libc::SIGQUIT, "SIGQUIT"), (libc::SIGTERM, "SIGTERM")] {
        let txt = txt().start().unwrap();
        let run = run_on(&txt, "pc.c", "");
        wait_for(&txt, "the motor turns", turns);
        run.signal(signal);
        let ended = run.end();
        ended
            .badly(&format!("pc was ended by {name}; its transfer has ended with all outputs off"));
        assert!(!ended.err.contains("last exchange"), "{}", ended.err);
        wait_stopped(&txt);
    }
}

/// The C library's `system` ignores Ctrl-C, which then ends only the command, if the terminal has sent it.
#[test]
fn ctrl_c_ends_a_program_that_waits_for_a_command() {
    if !has_compiler() {
        return;
    }
    for to_all in [false, true] {
        let txt = txt().start().unwrap();
        let mut command = tx_run(&["--host", &txt.address().to_string()]);
        command.arg(program("pc.c")).env("CFLAGS", "-w -DCOMMAND").process_group(0);
        let folder = tempfile::tempdir().unwrap();
        let runs = folder.path().join("runs");
        let run = Run::start(command.env("RUNS", &runs));
        wait_until("the command runs", || runs.exists());
        wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
        if to_all {
            run.signal_group(libc::SIGINT);
        } else {
            run.signal(libc::SIGINT);
        }
        let ended = run.end();
        ended.badly("pc was ended by SIGINT; its transfer has ended with all outputs off");
        assert!(!ended.out.contains("status"), "{}", ended.out);
        wait_stopped(&txt);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_program_that_is_suspended_is_ended_by_the_first_signal() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_in_group(txt.address(), "pc.c", "");
    wait_for(&txt, "the motor turns", turns);
    let program = program_of(&run);
    send("TSTP", &program);
    wait_until("it is suspended", || is_suspended(&program));
    run.signal(libc::SIGTERM);
    run.end().badly("pc was ended by SIGTERM");
    wait_stopped(&txt);
}

#[test]
fn of_the_signals_that_are_ignored_from_the_start_only_a_hangup_stays_so() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let tx_run = tx_run(&["--host", &txt.address().to_string()]);
    let mut command = Command::new("sh");
    // As `nohup` does, and a script with a command that ends with `&`.
    command.args(["-c", "trap '' HUP INT QUIT TERM; exec \"$0\" \"$@\""]).arg(tx_run.get_program());
    command.args(tx_run.get_args()).arg(program("pc.c"));
    command.envs(tx_run.get_envs().filter_map(|(name, value)| Some((name, value?))));
    let run = Run::start(&mut command);
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    run.signal(libc::SIGHUP);
    let before = txt.with_machine(|machine| machine.exchanges());
    wait_for(&txt, "more exchanges", |machine| machine.exchanges() > before + 5);
    run.signal(libc::SIGINT);
    run.end().badly("pc was ended by SIGINT");
    wait_stopped(&txt);
}

#[test]
fn a_program_that_takes_a_signal_from_the_library_is_stopped_too() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "pc.c", "-DDEFAULT");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    run.signal(libc::SIGINT);
    run.end().badly("pc was ended by SIGINT");
    wait_stopped(&txt);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty), [0; 8]);
}

#[test]
fn a_program_with_a_function_for_ctrl_c_goes_on_and_is_stopped_when_that_does_not_handle_it() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "pc.c", "-DCONTROL");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    run.signal(libc::SIGINT);
    let before = txt.with_machine(|machine| machine.exchanges());
    wait_for(&txt, "more exchanges", |machine| machine.exchanges() > before + 20);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 300);
    run.signal(libc::SIGTERM);
    let ended = run.end();
    ended.badly("pc was ended by SIGTERM; its transfer has ended with all outputs off");
    assert_eq!(ended.out, "asked\nasked\n");
    wait_stopped(&txt);
}

#[test]
fn a_second_signal_ends_a_program_that_does_not_end() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "pc.c", "-DDEAF");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    // No longer: one more signal would end `tx_run` while it says what follows.
    wait_until("the motor is stopped", || {
        run.signal(libc::SIGINT);
        txt.with_machine(|machine| machine.controllers[0].outputs.duty[0] == 0)
    });
    let ended = run.end();
    ended.badly("pc was ended by SIGKILL (it was killed)");
    assert!(ended.err.contains("tx_run has sent it: all outputs are off"), "{ended:?}");
    wait_stopped(&txt);
}

#[test]
fn a_signal_ends_what_a_script_for_the_compiler_has_started() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    for (answered, what) in [
        ("--version", "the program was compiled"),
        ("nothing", "a compiler was asked for its version"),
    ] {
        let (script, number) = (folder.path().join("compiler"), folder.path().join(answered));
        let text = format!(
            "#!/bin/sh\n[ \"$1\" = {answered} ] && exit\nsleep 1000 &\necho $! > '{0}.new'\nmv '{0}.new' '{0}'\nwait\n",
            number.display()
        );
        fs::write(&script, text).unwrap();
        fs::set_permissions(&script, Permissions::from_mode(0o755)).unwrap();
        let mut command = tx_run(&["--world", "none"]);
        let run = Run::start(command.arg(program("motor.c")).env("CC", &script));
        wait_until("the script runs", || number.exists());
        run.signal(libc::SIGTERM);
        run.end().badly(&format!("ended by SIGTERM while {what}"));
        let sleeper: libc::pid_t = fs::read_to_string(&number).unwrap().trim().parse().unwrap();
        wait_until("nothing is left", || has_ended(sleeper));
    }
}

/// Whether a process has a handler for a signal.
#[cfg(target_os = "linux")]
fn handles(process: u32, signal: i32) -> bool {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let handled = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
    u64::from_str_radix(handled.trim(), 16).unwrap() >> (signal - 1) & 1 == 1
}

/// As by a thread of a program that leaves signals to another one.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_ends_a_program_that_was_started_where_signals_are_held_back() {
    if !has_compiler() {
        return;
    }
    for (source, off) in
        [("ends.c", "all outputs are off"), ("pc.c", "its transfer has ended with all outputs off")]
    {
        let txt = txt().start().unwrap();
        let mut command = Command::new("env");
        command.arg("--block-signal=INT,TERM,HUP,QUIT").arg(env!("CARGO_BIN_EXE_tx_run"));
        command.args(["--host", &txt.address().to_string()]).arg(program(source));
        command.env("XDG_CACHE_HOME", cache()).env("CFLAGS", "-w -DCODE=0");
        let run = Run::start(&mut command);
        wait_for(&txt, "a motor turns", |machine| machine.controllers[0].outputs.duty != [0; 8]);
        run.signal(libc::SIGTERM);
        run.end().badly(&format!("ended by SIGTERM; {off}"));
    }
}

/// It never comes from a pipe, and may not from a folder in the network.
#[cfg(target_os = "linux")]
#[test]
fn a_second_signal_ends_the_wait_for_a_file() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    make_pipe(&folder.path().join("a.o"));
    let run = Run::start(tx_run(&["a.o", "--world", "none"]).current_dir(folder.path()));
    wait_until("it takes signals up", || handles(run.id(), libc::SIGTERM));
    assert_eq!(run.end_by(libc::SIGTERM).status, Some(1));
}

#[test]
fn ctrl_c_ends_a_program_whose_world_is_still_being_opened() {
    if !has_compiler() {
        return;
    }
    // A program `txt` that opens its world forever is found beside `tx_run`.
    let tx_run = Path::new(env!("CARGO_BIN_EXE_tx_run"));
    let name = format!("{DLL_PREFIX}ftMscLib{DLL_SUFFIX}");
    let library = tx_run.with_file_name("deps").join(&name);
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    fs::hard_link(tx_run, folder.path().join("tx_run")).unwrap();
    fs::hard_link(library, folder.path().join(&name)).unwrap();
    let (txt, opens) = (folder.path().join("txt"), folder.path().join("opens"));
    fs::write(&txt, format!("#!/bin/sh\n: > '{}'\nexec sleep 1000\n", opens.display())).unwrap();
    fs::set_permissions(&txt, Permissions::from_mode(0o755)).unwrap();
    let mut command = Command::new(folder.path().join("tx_run"));
    command
        .env("XDG_CACHE_HOME", cache())
        .arg(program("pc.c"))
        .args(["--world", "slide", "--show"]);
    let run = Run::start(&mut command);
    wait_until("the world is being opened", || opens.exists());
    run.signal(libc::SIGINT);
    let ended = run.end();
    ended.badly("ended by Ctrl-C while the world was opened");
}
