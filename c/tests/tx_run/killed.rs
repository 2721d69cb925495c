//! A program is killed, or becomes another one: what it leaves is stopped.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex};

use ft_transfer_area_simulator::Machine;

use super::ends::{press, wait_stopped, with_a_motor};
#[cfg(target_os = "linux")]
use super::support::shared_library;
use super::support::{
    cache, has_compiler, has_ended, program, run_on, run_with, turns, tx_run, txt, wait_for,
    wait_until, Run,
};

#[test]
fn a_program_that_becomes_another_one_is_stopped_while_that_runs() {
    if !has_compiler() {
        return;
    }
    let kind = r#"LEAVE='execlp("sleep","sleep","1000",(char*)0)'"#;
    let ended = with_a_motor(kind, |txt, run| {
        press(txt, run);
        wait_stopped(txt);
        run.signal(libc::SIGTERM);
    });
    ended.badly("tx_run has sent it: all outputs are off");
}

#[test]
fn a_program_that_has_closed_all_its_files_drives_on() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "pc.c", "-DCLOSES");
    wait_for(&txt, "the motor turns", turns);
    let before = txt.with_machine(|machine| machine.exchanges());
    // In this time `tx_run` looks many times.
    wait_for(&txt, "more exchanges", |machine| machine.exchanges() > before + 50);
    press(&txt, &run);
    let ended = run.end();
    assert_eq!((ended.status, ended.err.contains("last exchange")), (Some(3), false), "{ended:#?}");
    wait_stopped(&txt);
}

/// Each has a controller of its own.
#[test]
fn what_one_process_of_a_program_leaves_is_stopped_while_another_one_drives() {
    if !has_compiler() {
        return;
    }
    for kind in ["_exit(0)", "raise(SIGKILL)", r#"execlp("sleep","sleep","1",(char*)0)"#] {
        let [first, second] = [txt().start().unwrap(), txt().start().unwrap()];
        let mut command = tx_run(&[]);
        let ports = format!("COM4={}, COM5={}", first.address(), second.address());
        command.env("FT_TXT_PORTS", ports).env("CFLAGS", format!("-w '-DLEAVE={kind}'"));
        let run = Run::start(command.arg(program("workers.c")));
        wait_for(&first, "the motor turns", turns);
        wait_for(&second, "the motor turns", turns);
        press(&first, &run);
        wait_stopped(&first);
        let before = second.with_machine(|machine| machine.exchanges());
        wait_for(&second, "more exchanges", |machine| machine.exchanges() > before + 5);
        assert!(second.with_machine(|machine| turns(machine)), "{kind}");
        press(&second, &run);
        wait_stopped(&second);
        let ended = run.end();
        ended.well();
        assert_eq!(ended.err.matches("tx_run has sent it").count(), 1, "{kind}: {ended:#?}");
    }
}

#[test]
fn what_a_program_does_after_its_end_can_crash_and_hang() {
    if !has_compiler() {
        return;
    }
    with_a_motor("AFTER_CRASH", press)
        .badly("ends was ended by SIGSEGV (memory that is not the program's); its transfer has ended with all outputs off");
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "ends.c", "-w -DAFTER_HANG");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 512);
    press(&txt, &run);
    wait_for(&txt, "the connection is closed", |machine| !machine.connected());
    // The first one may come before the last word.
    let ended = run.end_by(libc::SIGTERM);
    ended.badly("ends was ended by SIGTERM");
}

#[cfg(target_os = "linux")]
#[test]
fn nothing_is_left_running_when_the_command_is_killed() {
    if !has_compiler() {
        return;
    }
    let ended = with_a_motor("CODE=0", |_, run| run.signal(libc::SIGKILL));
    ended.badly("ended by SIGTERM; all outputs are off");
}

#[test]
fn a_program_that_is_killed_is_followed_by_an_exchange_that_stops_everything() {
    if !has_compiler() {
        return;
    }
    let duties = Arc::new(Mutex::new(Vec::new()));
    let kept = Arc::clone(&duties);
    let keep = move |machine: &mut Machine| {
        kept.lock().unwrap().push(machine.controllers[0].outputs.duty[0]);
    };
    let txt = txt().on_exchange(keep).start().unwrap();
    let run = run_on(&txt, "killed.c", "");
    // A controller keeps the outputs at a close, so what counts is what was exchanged.
    let ended = run.end();
    ended.badly("killed was ended by SIGKILL (it was killed)");
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(ended.err.contains("tx_run has sent it: all outputs are off"), "{ended:?}");
    let duties = duties.lock().unwrap();
    assert_eq!((duties.contains(&300), duties.last()), (true, Some(&0)));
    wait_stopped(&txt);
}

/// As before a title is written over it.
#[cfg(target_os = "linux")]
#[test]
fn a_program_that_clears_its_environment_drives_the_named_controller_and_is_stopped() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "killed.c", "-DCLEARED");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    let ended = run.end();
    ended.badly("killed was ended by SIGKILL (it was killed)");
    assert!(ended.err.contains("tx_run has sent it: all outputs are off"), "{ended:?}");
    wait_stopped(&txt);
}

/// Compiles what takes the place of functions of the C library.
#[cfg(target_os = "linux")]
fn library_of(name: &str, folder: &Path) -> std::path::PathBuf {
    let library = folder.join(name).with_extension("so");
    shared_library(&program(name), &library, &[]);
    library
}

/// As one that is frozen, or that is about to fail.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_stands_still_keeps_no_motor_on() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let still = library_of("still.c", folder.path());
    let killed = txt().start().unwrap();
    let run = run_with(&killed, "killed.c", "-DBECOMES", &[("LD_PRELOAD", &still)]);
    wait_for(&killed, "the motor turns", turns);
    wait_stopped(&killed);
    // Its exchange is not sent again and again.
    run.signal(libc::SIGTERM);
    let ended = run.end();
    assert_eq!(ended.err.matches("tx_run has sent it").count(), 1, "{ended:#?}");

    let [first, second] = [txt().start().unwrap(), txt().start().unwrap()];
    let mut command = tx_run(&[]);
    let ports = format!("COM4={}, COM5={}", first.address(), second.address());
    command.arg(program("both.c")).env("FT_TXT_PORTS", ports).env("LD_PRELOAD", &still);
    let run = Run::start(&mut command);
    let _ = [&first, &second].map(|txt| wait_for(txt, "the motor turns", turns));
    press(&first, &run);
    let _ = [&first, &second].map(wait_stopped);
    run.end();
}

/// As some sticks and folders that are shared with a virtual machine.
#[cfg(target_os = "linux")]
#[test]
fn a_program_that_is_killed_is_stopped_where_the_file_system_has_only_files() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let library = library_of("only_files.c", folder.path());
    let txt = txt().start().unwrap();
    let ended = run_with(&txt, "killed.c", "", &[("LD_PRELOAD", &library)]).end();
    ended.badly("leaves only at the end of the whole program");
    ended.badly("tx_run has sent it: all outputs are off");
    wait_stopped(&txt);
}

/// As by what tidies the folder for temporary files.
#[test]
fn a_program_whose_notes_were_removed_is_stopped_where_tx_run_knows_the_controller() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let address = txt.address().to_string();
    let (ports, port) =
        (format!("COM4={address} # the gate"), format!("-DHOST='\"{address}\"' -DAFTER"));
    // A controller that the program itself sets is known when its transfer began before.
    for (arguments, ports, flags) in [
        (&["--host", &*address][..], "", "-DBEFORE"),
        (&[], &ports, "-DBEFORE"),
        (&["--world", "none"], "", &port),
    ] {
        let mut command = tx_run(arguments);
        command.arg(program("killed.c")).env("CFLAGS", flags).env("FT_TXT_PORTS", ports);
        let ended = Run::start(&mut command).end();
        ended.badly("killed was ended by SIGKILL (it was killed)");
        let words = format!("were removed, so tx_run has sent a last exchange to {address}");
        assert!(ended.err.contains(&words), "{flags}: {ended:#?}");
        wait_stopped(&txt);
        assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty), [0; 8]);
    }
}

#[test]
fn what_is_noted_of_transfers_does_not_grow_with_their_number() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let ended = run_on(&txt, "restarts.c", "").end();
    ended.badly("tx_run has sent it: all outputs are off");
    let notes: Vec<&str> = ended.out.lines().filter(|line| line.starts_with("notes")).collect();
    assert_eq!(notes.len(), 30, "{ended:#?}");
    assert!(notes.iter().all(|line| *line == notes[0]), "{notes:#?}");
    wait_stopped(&txt);
}

#[cfg(target_os = "linux")]
#[test]
fn what_a_killed_command_has_left_is_removed_by_the_next_one() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let left = || fs::read_dir(folder.path()).unwrap().count();
    let txt = txt().start().unwrap();
    let mut command = tx_run(&["--host", &txt.address().to_string()]);
    let run = Run::start(command.arg(program("pc.c")).env("TMPDIR", folder.path()));
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    let start_next = || {
        let mut command = tx_run(&["--world", "none"]);
        Run::start(command.arg(program("strings.c")).env("TMPDIR", folder.path())).end()
    };
    start_next();
    assert_eq!(left(), 1, "one that is used stays");
    run.signal(libc::SIGKILL);
    run.end();
    assert_eq!(left(), 1);
    start_next();
    assert_eq!(left(), 0);
}

#[cfg(target_os = "linux")]
#[test]
fn the_outputs_are_off_before_anything_that_waits_at_the_end() {
    if !has_compiler() {
        return;
    }
    for flags in ["-DWAITS", "-DWAITS -DEXIT"] {
        let txt = txt().start().unwrap();
        let run = run_on(&txt, "pc.c", flags);
        wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
        press(&txt, &run);
        wait_stopped(&txt);
        run.end_by(libc::SIGTERM);
    }
}

/// Such a process has the connection, or makes one.
#[cfg(target_os = "linux")]
#[test]
fn what_a_program_has_made_by_fork_ends_with_it() {
    if !has_compiler() {
        return;
    }
    let kinds = [
        ("-DFORK", true),
        ("-DDAEMON", false),
        ("-DFORK -DRENAMED", true),
        ("-DFORK -DREMOVED", true),
        ("-DFORK -DTHREAD", true),
        ("-DCHAIN", true),
        ("-DFORK -DEXEC", true),
    ];
    for (kind, last) in kinds {
        let txt = txt().start().unwrap();
        let ended = run_on(&txt, "pc.c", kind).end();
        assert_eq!(ended.status, Some(4), "{kind}: {ended:?}");
        assert!(ended.err.contains("what pc has left running was ended"), "{kind}: {ended:?}");
        let sent = ended.err.contains("tx_run has sent it: all outputs are off");
        assert_eq!(sent, last, "{kind}: {ended:?}");
        wait_stopped(&txt);
        assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty), [0; 8]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_motor_does_not_wait_for_a_process_that_takes_its_time_to_end() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let number = folder.path().join("helper");
    let was_first = |_| {
        let txt = txt().start().unwrap();
        let run = run_with(&txt, "pc.c", "-DHELPER -DLEAVE", &[("HELPER", &number)]);
        wait_for(&txt, "the motor turns", turns);
        let helper = || fs::read_to_string(&number).unwrap_or_default().trim().parse().ok();
        wait_until("the helper runs", || helper().is_some());
        press(&txt, &run);
        wait_stopped(&txt);
        let was_first = !has_ended(helper().unwrap());
        run.end().badly("what pc has left running was ended");
        fs::remove_file(&number).unwrap();
        was_first
    };
    // On a busy machine the other one may be first by chance.
    assert!((0..5).any(was_first));
}

/// `/proc` is covered, which only root may do, or a user in a name space where the system allows it.
#[cfg(target_os = "linux")]
#[test]
fn what_can_t_be_seen_without_proc_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let cover = "mount -t tmpfs none /proc";
    let in_space = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["-rm", "sh", "-c", script, "sh"]);
        command
    };
    if !in_space(cover).status().is_ok_and(|status| status.success()) || !has_compiler() {
        return eprintln!("skipped: nothing can be mounted here");
    }
    // The second process has none of what the test reads, and ends with the folder.
    let text = r#"
        #include <fcntl.h>
        #include <unistd.h>
        int main(int count, char **of) {
            close(creat(of[1], 0600));
            if (fork() == 0) {
                for (int i = 0; i < 3; i++) close(i);
                while (access(of[1], F_OK) == 0) usleep(5000);
                return 0;
            }
            while (access(of[2], F_OK) != 0) usleep(5000);
            return 4;
        }"#;
    let path = folder.path().join("alone.c");
    fs::write(&path, text).unwrap();
    let (runs, covered) = (folder.path().join("runs"), folder.path().join("covered"));
    let script = format!(
        "\"$@\" & while [ ! -e '{}' ]; do sleep 0.01; done; {cover}; : > '{}'; wait $!",
        runs.display(),
        covered.display()
    );
    let tx_run = tx_run(&["--world", "none"]);
    let mut command = in_space(&script);
    command.arg(tx_run.get_program()).args(tx_run.get_args()).arg(&path).arg("--");
    command.args([&runs, &covered]);
    command.envs(tx_run.get_envs().filter_map(|(name, value)| Some((name, value?))));
    let ended = Run::start(&mut command).end();
    assert_eq!(ended.status, Some(4), "{ended:?}");
    let words = "/proc is not mounted, so what alone may have left running goes on";
    assert!(ended.err.contains(words), "{ended:?}");
}

#[test]
fn a_simulated_txt_ends_with_a_program_that_is_killed() {
    if !has_compiler() {
        return;
    }
    let mut command = tx_run(&["--world", "none"]);
    let ended = Run::start(command.arg(program("pc.c")).env("CFLAGS", "-DKILLED")).end();
    ended.badly("pc was ended by SIGKILL (it was killed)");
    assert!(
        ended.err.contains("nothing is known of its last exchange; its simulated TXT ends now"),
        "{ended:?}"
    );
    assert!(!ended.err.contains("outputs are off"), "{ended:?}");
}

#[test]
fn a_simulated_txt_is_stopped_while_what_the_program_has_become_goes_on() {
    if !has_compiler() {
        return;
    }
    // A script presses I1.
    let mut command = tx_run(&["--world", "default"]);
    let flags = r#"-w '-DLEAVE=execlp("sleep","sleep","2",(char*)0)'"#;
    let ended = Run::start(command.arg(program("ends.c")).env("CFLAGS", flags)).end();
    assert!(ended.err.contains("so tx_run has sent it: all outputs are off"), "{ended:?}");
    assert!(!ended.err.contains("ends now"), "{ended:?}");
}

/// As by a program that does not want to wait for what it starts.
#[cfg(target_os = "linux")]
#[test]
fn a_program_runs_where_the_ends_of_children_are_ignored() {
    if !has_compiler() {
        return;
    }
    let mut command = Command::new("env");
    command.arg("--ignore-signal=CHLD").arg(env!("CARGO_BIN_EXE_tx_run"));
    command.arg(program("ends.c")).env("XDG_CACHE_HOME", cache()).env("CFLAGS", "-w -DCODE=0");
    Run::start(&mut command).end().well();
}

/// Needs a file system of its own, which only root may make, or a user in a name space where the system allows it.
#[cfg_attr(not(target_os = "linux"), ignore = "only Linux has such name spaces")]
#[test]
fn a_full_folder_for_temporary_files_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let full = folder.path().join("full");
    fs::create_dir(&full).unwrap();
    let in_space = |size: &str, program: &str| {
        let mut command = Command::new("unshare");
        let script = format!("mount -t tmpfs -o size={size} none \"$1\" && shift && {program}");
        command.args(["-rm", "sh", "-c", &script, "sh"]).arg(&full);
        command
    };
    if !in_space("4k", "true").status().is_ok_and(|status| status.success()) || !has_compiler() {
        return eprintln!("skipped: no file system can be mounted here");
    }
    // Where the headers have no room, and where the program has none.
    for size in ["4k", "40k", "400k"] {
        let mut command = in_space(size, "exec \"$@\"");
        command.arg(env!("CARGO_BIN_EXE_tx_run")).arg(program("ends.c")).env("TMPDIR", &full);
        // What is compiled already needs less room.
        let cache = folder.path().join(size);
        command.env("XDG_CACHE_HOME", &cache).env("HOME", &cache).env("CFLAGS", "-w -DCODE=1");
        let ended = Run::start(&mut command).end();
        ended.badly(full.to_str().unwrap());
        ended.badly("make room, or name another folder in the variable TMPDIR");
    }
}
