//! What is run with the firmware, one after the other.

mod c_programs;
mod clients;
mod golden;
mod random;
mod samples;
mod sessions;
mod tools;

use std::net::TcpStream;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};
use std::{env, thread};

use libtest_mimic::{Arguments, Trial};

use crate::controller::Controller;

/// Longer than anything takes on a busy machine; only a failing check waits this long.
const DEADLINE: Duration = Duration::from_secs(60);

/// Where the samples and programs find the controller.
const ADDRESS: &str = "127.0.0.1";

/// A check, which panics when something is wrong.
type Check = Box<dyn Fn(&Controller) + Send>;

pub(crate) fn main() -> ExitCode {
    let Some(root) = env::var_os("FIRMWARE_ROOT").map(PathBuf::from) else {
        println!(
            "skipped: nothing runs with the maker's firmware, which `.ci/firmware FOLDER` does"
        );
        return ExitCode::SUCCESS;
    };
    let mut arguments = Arguments::from_args();
    // It serves one client.
    arguments.test_threads = Some(1);
    let log = env::var_os("FIRMWARE_LOG").map_or_else(|| root.join("tmp/log"), PathBuf::from);
    let controller = match Controller::start(&root, &log) {
        Ok(controller) => Arc::new(controller),
        Err(error) => {
            eprintln!("the program in {} can't be started: {error}", root.display());
            return ExitCode::FAILURE;
        }
    };
    let trials = checks().into_iter().map(|(name, check)| trial(name, check, &controller));
    libtest_mimic::run(&arguments, trials.collect()).exit_code()
}

fn checks() -> Vec<(String, Check)> {
    let mut checks = Vec::new();
    checks.extend(sessions::checks());
    checks.extend(samples::checks());
    checks.extend(tools::checks());
    checks.extend(c_programs::checks());
    checks.extend(clients::checks());
    checks.extend(random::checks());
    checks.extend(golden::checks());
    checks
}

fn check(name: &str, check: fn(&Controller)) -> (String, Check) {
    (name.to_owned(), Box::new(check))
}

/// A check, after which the firmware's program must still be the same.
fn trial(name: String, check: Check, controller: &Arc<Controller>) -> Trial {
    let controller = Arc::clone(controller);
    let run = move || {
        controller.wait_for_port();
        let before = controller.ends().len();
        check(&controller);
        match &controller.ends()[before..] {
            [] => Ok(()),
            ends => Err(format!("the firmware's program has ended: {}", ends.join(", ")).into()),
        }
    };
    Trial::test(name, run)
}

/// Waits for what the board or a program does.
#[track_caller]
fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !condition() {
        assert!(begin.elapsed() < DEADLINE, "never: {what}");
        thread::sleep(Duration::from_millis(5));
    }
}

/// Ends what a session leaves behind that has never used I2C: the firmware's I2C server waits for a client, and would end
/// the program at the next StartOnline. A client that closes again ends the wait, and then the server.
fn no_i2c_server_waits() {
    wait_until("no I2C server waits", || TcpStream::connect((ADDRESS, 65_002)).is_err());
}

/// The last exchange has switched everything off, because the firmware does not.
#[track_caller]
fn stopped(controller: &Controller) {
    for controller in &controller.board.state().machine.controllers {
        assert_eq!(controller.outputs.duty, [0; 8], "its outputs are on");
    }
}
