//! The controller of a program is away, slow or lost.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use ft_transfer_area_simulator::{FaultKind, Machine, SimulatedTxt};

use super::ends::wait_stopped;
use super::support::{
    has_compiler, has_ended, is_suspended, own_port, program, program_of, run_in_group, run_on,
    send, turns, tx_run, txt, wait_for, wait_until, Run,
};

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

#[test]
fn a_controller_that_can_not_be_stopped_is_told() {
    if !has_compiler() {
        return;
    }
    let txt = txt().port(own_port()).start().unwrap();
    let run = run_on(&txt, "killed.c", "-DGONE");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    drop(txt);
    run.end().badly("tx_run could send none, so motors may go on: ");
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
    wait_until("it can't be stopped", || words().contains("tx_run could send none"));
    let again = txt().port(address.port()).start().unwrap();
    wait_stopped(&again);
    wait_until("it is said", || words().contains("tx_run has sent it: all outputs are off"));
    assert_eq!(words().matches("could send none").count(), 1, "{}", words());
    // SAFETY: a call without pointers, for a child that was not waited for.
    assert_eq!(unsafe { libc::kill(child.id() as libc::pid_t, libc::SIGTERM) }, 0);
    child.wait().unwrap();
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
