//! Signals end programs, and what ends in other ways than Windows knows.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs::{self, File, Permissions};
use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use ft_transfer_area_simulator::{FaultKind, Machine, SimulatedTxt};

use super::ends::{goes_on_with_a_motor, press, wait_stopped, with_a_motor};
#[cfg(target_os = "linux")]
use super::support::shared_library;
use super::support::{
    cache, has_compiler, has_ended, make_pipe, own_port, program, run_on, run_with, tx_run, txt,
    wait_for, wait_until, Run,
};

/// Whether the motor of the programs for a PC turns.
fn turns(machine: &Machine) -> bool {
    machine.controllers[0].outputs.duty[0] == 300
}

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

/// As a shell does, which suspends all of it.
fn run_in_group(controller: SocketAddr, name: &str, flags: &str) -> Run {
    let mut command = tx_run(&["--host", &controller.to_string()]);
    Run::start(command.arg(program(name)).env("CFLAGS", flags).process_group(0))
}

/// The number of the program that `tx_run` has started.
#[cfg(target_os = "linux")]
fn program_of(run: &Run) -> String {
    let children = format!("/proc/{0}/task/{0}/children", run.id());
    fs::read_to_string(children).unwrap().trim().to_owned()
}

#[cfg(target_os = "linux")]
fn send(signal: &str, process: &str) {
    assert!(Command::new("kill").args(["-s", signal, process]).status().unwrap().success());
}

#[cfg(target_os = "linux")]
fn is_suspended(process: &str) -> bool {
    fs::read_to_string(format!("/proc/{process}/stat")).unwrap().contains(") T ")
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

/// Over a slow network. The last exchange comes after that answer.
#[test]
fn a_program_that_waits_for_an_answer_still_sends_its_last_exchange() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "pc.c", "");
    wait_for(&txt, "the motor turns", turns);
    txt.with_machine(|machine| machine.disturb(FaultKind::Delay(Duration::from_millis(1400))));
    run.signal(libc::SIGTERM);
    let ended = run.end();
    ended.badly("pc was ended by SIGTERM");
    assert!(!ended.err.contains("last exchange"), "{ended:#?}");
    wait_stopped(&txt);
}

/// Passes connections to this controller on, and each of its answers after more than a second, as on a bad network.
#[cfg(target_os = "linux")]
fn slowly(controller: SocketAddr) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let pass_on = |mut from: TcpStream, mut to: TcpStream, pause| {
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = from.read(&mut bytes) {
                thread::sleep(pause);
                if to.write_all(&bytes[..count]).is_err() {
                    break;
                }
            }
            let _ = to.shutdown(Shutdown::Both);
        });
    };
    thread::spawn(move || {
        for program in listener.incoming().flatten() {
            let Ok(controller) = TcpStream::connect(controller) else { continue };
            let both = (program.try_clone().unwrap(), controller.try_clone().unwrap());
            pass_on(both.0, both.1, Duration::ZERO);
            pass_on(controller, program, Duration::from_millis(1200));
        }
    });
    address
}

/// The first thread of the program is in a call that takes long, and no other one would take the signal.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_waits_for_no_call_that_begins_with_another_controller() {
    if !has_compiler() {
        return;
    }
    for signal in ["ALRM", "USR1", "ABRT", "TSTP", "RTMIN"] {
        let [fast, slow] = [txt().start().unwrap(), txt().start().unwrap()];
        let ports = format!("COM4={}, COM5={}", fast.address(), slowly(slow.address()));
        let mut command = tx_run(&[]);
        let run = Run::start(command.arg(program("both.c")).env("FT_TXT_PORTS", ports));
        wait_for(&fast, "the motor turns", turns);
        let begins = |machine: &Machine| machine.online();
        wait_for(&slow, "the next one", begins);
        let process = program_of(&run);
        send(signal, &process);
        wait_for(&fast, "the motor is off", |machine| {
            machine.controllers[0].outputs.duty == [0; 8]
        });
        assert_eq!(slow.with_machine(|machine| machine.exchanges()), 0, "{signal}");
        send("KILL", &process);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn while_one_controller_does_not_answer_another_one_of_a_killed_program_is_stopped() {
    if !has_compiler() {
        return;
    }
    let [lost, other] = [txt().start().unwrap(), txt().start().unwrap()];
    let (lost_at, ports) =
        (lost.address(), format!("COM4={}, COM5={}", lost.address(), other.address()));
    let mut command = tx_run(&[]);
    let run = Run::start(command.arg(program("both.c")).env("FT_TXT_PORTS", ports));
    wait_for(&other, "the motor turns", turns);
    drop(lost);
    let silent = TcpListener::bind(lost_at).unwrap();
    // It tries to stop that one.
    let (mut tries, _) = silent.accept().unwrap();
    send("KILL", &program_of(&run));
    wait_stopped(&other);
    tries.set_nonblocking(true).unwrap();
    let end = io::copy(&mut tries, &mut io::sink()).unwrap_err();
    assert_eq!(end.kind(), io::ErrorKind::WouldBlock, "it has given the first one up before");
    run.end().badly("both was ended by SIGKILL (it was killed)");
}

/// As when its firmware is started again.
#[cfg(target_os = "linux")]
#[test]
fn a_controller_that_is_away_when_its_program_is_killed_is_stopped_when_it_is_back() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "pc.c", "");
    wait_for(&txt, "the motor turns", turns);
    let process = program_of(&run);
    txt.with_machine(|machine| machine.set_absent(true));
    send("KILL", &process);
    wait_until("the program has ended", || has_ended(process.parse().unwrap()));
    // The first try is over in this time.
    thread::sleep(Duration::from_millis(500));
    txt.with_machine(|machine| machine.set_absent(false));
    let ended = run.end();
    ended.badly("tx_run has sent it: all outputs are off");
    assert!(ended.err.contains("could not be stopped; it is tried for 10 s"), "{ended:#?}");
    wait_stopped(&txt);
}

/// A name leads nowhere when the network is away.
#[cfg(target_os = "linux")]
#[test]
fn a_controller_whose_name_is_forgotten_is_stopped_at_its_address() {
    let folder = tempfile::tempdir().unwrap();
    let hosts = folder.path().join("hosts");
    fs::write(&hosts, "127.0.0.1 mytxt\n").unwrap();
    let in_space = |program: &str| {
        let mut command = Command::new("unshare");
        let script = format!("mount --bind \"$0\" /etc/hosts && exec {program} \"$@\"");
        command.args(["-rm", "sh", "-c", &script]).arg(&hosts);
        command
    };
    let known = in_space("getent").args(["hosts", "mytxt"]).output();
    if !known.is_ok_and(|output| output.status.success()) || !has_compiler() {
        return eprintln!("skipped: there are no names of its own here");
    }
    let sources = [
        (
            "main.cpp",
            r#"
            #include <signal.h>
            #include <unistd.h>
            #include "KeLibTxtDl.h"
            int main() {
                if (StartTxtDownloadProg() != KELIB_ERROR_NONE) return 1;
                FISH_X1_TRANSFER *area = GetKeLibTransferAreaMainAddress();
                area->ftX1out.duty[0] = 300;
                while (!area->ftX1in.uni[0]) usleep(2000);
                return raise(SIGKILL);
            }"#,
        ),
        (
            "tic.c",
            r#"
            #include <signal.h>
            #include "ROBO_TX_PRG.h"
            void PrgInit(TA *areas, int count) {}
            int PrgTic(TA *areas, int count) {
                areas[TA_LOCAL].output.duty[0] = 300;
                if (areas[TA_LOCAL].input.uni[0]) raise(SIGKILL);
                return 0x7FFF;
            }"#,
        ),
    ];
    for (name, text) in sources {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        let txt = txt().start().unwrap();
        fs::write(&hosts, "127.0.0.1 mytxt\n").unwrap();
        let mut command = in_space(env!("CARGO_BIN_EXE_tx_run"));
        command.arg(&path).arg("--host").arg(format!("mytxt:{}", txt.address().port()));
        let run = Run::start(&mut command);
        wait_for(&txt, "the motor turns", turns);
        fs::write(&hosts, "").unwrap();
        txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
        run.end().badly("tx_run has sent it: all outputs are off");
        wait_stopped(&txt);
    }
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

#[test]
fn a_controller_that_can_not_be_stopped_is_told() {
    if !has_compiler() {
        return;
    }
    let txt = txt().port(own_port()).start().unwrap();
    let run = run_on(&txt, "killed.c", "-DGONE");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    drop(txt);
    run.end().badly("tx_run could not either, so motors may go on: ");
}

/// The program has become another one, which does not end.
#[test]
fn a_controller_that_can_not_be_stopped_at_first_is_stopped_when_it_answers_again() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let said = folder.path().join("said");
    let gone = txt().port(own_port()).start().unwrap();
    let address = gone.address();
    let mut command = tx_run(&["--host", &address.to_string()]);
    command.arg(program("killed.c")).env("CFLAGS", "-w -DGONE -DBECOMES");
    command.stdin(Stdio::null()).stderr(File::create(&said).unwrap());
    let mut child = command.spawn().unwrap();
    wait_for(&gone, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    drop(gone);
    let words = || fs::read_to_string(&said).unwrap();
    wait_until("it can't be stopped", || words().contains("tx_run could not either"));
    let again = txt().port(address.port()).start().unwrap();
    wait_stopped(&again);
    wait_until("it is said", || words().contains("tx_run has sent it: all outputs are off"));
    assert_eq!(words().matches("could not either").count(), 1, "{}", words());
    // SAFETY: a call without pointers, for a child that was not waited for.
    assert_eq!(unsafe { libc::kill(child.id() as libc::pid_t, libc::SIGTERM) }, 0);
    child.wait().unwrap();
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

/// Passes connections on to a controller, until they are cut.
struct Line {
    address: SocketAddr,
    open: Arc<Mutex<Vec<TcpStream>>>,
    /// Whether nothing gets through meanwhile.
    is_held: Arc<AtomicBool>,
}

impl Line {
    fn to(txt: &SimulatedTxt) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (address, controller) = (listener.local_addr().unwrap(), txt.address());
        let (open, is_held) = <(Arc<Mutex<Vec<TcpStream>>>, Arc<AtomicBool>)>::default();
        let (of_thread, held) = (Arc::clone(&open), Arc::clone(&is_held));
        thread::spawn(move || {
            for near in listener.incoming().flatten() {
                let Ok(far) = TcpStream::connect(controller) else { return };
                let copy = |stream: &TcpStream| stream.try_clone().unwrap();
                for (from, to) in [(&far, &near), (&near, &far)] {
                    let (from, to, held) = (copy(from), copy(to), Arc::clone(&held));
                    thread::spawn(move || {
                        let _ = pass_on(&from, &to, &held);
                        let _ = to.shutdown(Shutdown::Both);
                    });
                }
                of_thread.lock().unwrap().extend([far, near]);
            }
        });
        Self { address, open, is_held }
    }

    fn hold(&self, is_held: bool) {
        self.is_held.store(is_held, Ordering::SeqCst);
    }

    /// Ends those that are open, the controller's side first.
    fn cut(&self) {
        self.open.lock().unwrap().drain(..).for_each(|stream| _ = stream.shutdown(Shutdown::Both));
    }

    fn run(&self, flags: &str) -> Run {
        run_in_group(self.address, "pc.c", flags)
    }
}

fn pass_on(mut from: &TcpStream, mut to: &TcpStream, is_held: &AtomicBool) -> io::Result<()> {
    let mut bytes = [0; 4096];
    loop {
        let size = from.read(&mut bytes)?;
        if size == 0 {
            return Ok(());
        }
        while is_held.load(Ordering::SeqCst) {
            thread::sleep(Duration::from_millis(5));
        }
        to.write_all(&bytes[..size])?;
    }
}

/// Otherwise its motor would go on with `tx_run` in front of a program that never goes on.
#[cfg(target_os = "linux")]
#[test]
fn a_program_that_was_suspended_before_its_last_exchange_is_stopped() {
    if !has_compiler() {
        return;
    }
    let txt = txt().idle_limit(Duration::from_secs(1)).start().unwrap();
    let line = Line::to(&txt);
    let run = line.run("");
    wait_for(&txt, "the motor turns", turns);
    line.hold(true);
    run.signal_group(libc::SIGTSTP);
    let program = program_of(&run);
    wait_until("the program is suspended", || is_suspended(&program));
    assert!(txt.with_machine(|machine| turns(machine)));
    line.hold(false);
    wait_stopped(&txt);
    wait_until("tx_run is suspended", || is_suspended(&run.id().to_string()));
    run.signal_group(libc::SIGCONT);
    let ended = run.end_by(libc::SIGTERM);
    assert!(ended.err.contains("so tx_run has sent it: all outputs are off"), "{}", ended.err);
}

#[test]
fn a_lost_controller_is_stopped_while_the_program_goes_on() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let line = Line::to(&txt);
    let run = line.run("");
    wait_for(&txt, "the motor turns", turns);
    line.cut();
    // The program waits for its button, of which it hears nothing more.
    wait_stopped(&txt);
    txt.with_machine(|machine| assert_eq!(machine.controllers[0].outputs.duty, [0; 8]));
    let ended = run.end_by(libc::SIGTERM);
    assert!(ended.err.contains("so tx_run has sent it: all outputs are off"), "{}", ended.err);
}

#[test]
fn a_lost_controller_is_left_to_a_program_that_begins_again() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let line = Line::to(&txt);
    let run = line.run("-DAGAIN");
    wait_for(&txt, "the motor turns", turns);
    let before = txt.with_machine(|machine| machine.exchanges());
    line.cut();
    wait_for(&txt, "it turns again", |machine| machine.exchanges() > before + 20 && turns(machine));
    wait_for(&txt, "more exchanges", |machine| {
        assert!(turns(machine));
        machine.exchanges() > before + 200
    });
    let ended = run.end_by(libc::SIGTERM);
    assert!(!ended.err.contains("last exchange"), "{}", ended.err);
    wait_stopped(&txt);
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
fn a_simulated_txt_ends_with_a_program_that_is_killed() {
    if !has_compiler() {
        return;
    }
    let mut command = tx_run(&["--world", "none"]);
    let ended = Run::start(command.arg(program("pc.c")).env("CFLAGS", "-DKILLED")).end();
    ended.badly("pc was ended by SIGKILL (it was killed)");
    assert!(
        ended.err.contains("could send no last exchange; its simulated TXT ends now"),
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
