//! When descriptors or threads are used up, or a world has no end, `txt` ends with a sentence.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::panel::program::Panel;
use crate::recording::{self, in_folder, said};
use crate::running::Running;

/// How long something may take, however busy the computer is.
const LIMIT: Duration = Duration::from_secs(60);

/// Runs `txt` in a shell that has done this before.
fn after(set_up: &str, args: &[&str]) -> Output {
    let script = format!("{set_up}; exec \"$0\" \"$@\"");
    let mut command = Command::new("sh");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_txt")]).args(args).stdin(Stdio::null());
    command.output().unwrap()
}

fn assert_one_sentence(output: &Output) -> String {
    let said = said(output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    said
}

#[cfg_attr(not(target_os = "linux"), ignore = "how many files a program has open differs")]
#[test]
fn when_no_more_files_may_be_open_it_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let mut reported = 0;
    for limit in 5..40 {
        let path = in_folder(&folder, &format!("{limit}.mcap"));
        let args = ["record", "--simulate", "--seconds", "0.05", "-o", &path];
        let output = after(&format!("ulimit -n {limit}"), &args);
        if output.status.success() {
            continue;
        }
        let said = said(&output);
        assert_eq!(output.status.code(), Some(1), "{limit}: {said}");
        // The simulated TXT logs a client that it can't accept, but not again and again.
        assert!(
            said.contains("open files") && said.trim_end().lines().count() < 6,
            "{limit}: {said}"
        );
        reported += usize::from(said.contains("raise the limit (ulimit -n)"));
    }
    assert!(reported > 3, "{reported}");
}

/// A thread whose stack is larger than the memory can't be started.
#[cfg_attr(not(target_os = "linux"), ignore = "there are other limits for threads")]
#[test]
fn when_no_thread_can_be_started_it_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    for args in [
        &["record", "--simulate", "-o", &path][..],
        &["record", "127.0.0.1", "-o", &path],
        &["simulate", "--port", "0"],
        &["panel", "--no-browser"],
        &["camera", "--simulate", "--watch"],
        &["find", "--only", "127.0.0.1:1"],
    ] {
        let output = after("export RUST_MIN_STACK=1152921504606846976", args);
        let said = assert_one_sentence(&output);
        assert!(said.contains("thread"), "{args:?}: {said}");
    }
}

#[cfg_attr(not(unix), ignore = "only Unix has devices and pipes with names like files")]
#[test]
fn a_world_that_is_a_device_or_a_pipe_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = in_folder(&folder, "pipe.toml");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for world in ["/dev/zero", &pipe] {
        for (args, status) in [
            (&["simulate", "--port", "0", "--world", world][..], 2),
            (&["panel", "--no-browser", "--world", world], 1),
            (&["record", "--simulate", world, "-o", &in_folder(&folder, "run.mcap")], 1),
        ] {
            let output = after("true", args);
            assert_eq!(output.status.code(), Some(status), "{args:?}: {}", said(&output));
            let said = said(&output);
            assert!(said.contains(world) && said.contains("it is a device or a pipe"), "{said}");
        }
    }
}

#[cfg_attr(not(unix), ignore = "only Unix has devices and pipes with names like files")]
#[test]
fn a_time_zone_that_is_a_device_or_a_pipe_is_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let (path, pipe) = (in_folder(&folder, "run.mcap"), in_folder(&folder, "pipe"));
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    recording::run(&["record", "--simulate", "-o", &path, "--seconds", "0.2"]);
    for zone in [&format!(":{pipe}"), &pipe, ":/dev/zero", "/dev/zero"] {
        for args in [&["csv", &path, "I1"][..], &["info", &path]] {
            let mut command = Command::new("timeout");
            command.args(["30", env!("CARGO_BIN_EXE_txt")]).args(args).env("TZ", zone);
            let output = command.stdin(Stdio::null()).output().unwrap();
            let said = said(&output);
            assert!(output.status.success(), "{zone}: {said}");
            assert_eq!(said.matches("times are in UTC").count(), 1, "{zone}: {said}");
            let times = String::from_utf8(output.stdout).unwrap();
            assert!(times.contains("+00:00"), "{zone}: {times}");
        }
    }
}

#[test]
fn wrong_lines_without_an_end_get_two_answers_a_second() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["simulate", "--port", "0"]).stdin(Stdio::piped()).stdout(Stdio::null());
    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    // Also between right ones.
    let lines = "y\nI1 1\n".repeat(1000);
    let writer = thread::spawn(move || while input.write_all(lines.as_bytes()).is_ok() {});
    let errors = BufReader::new(child.stderr.take().unwrap());
    let (begin, mut answers) = (Instant::now(), 0);
    for line in errors.lines().map_while(Result::ok) {
        answers += u32::from(line.contains(r#"there is no "Y" to set"#));
        if answers == 5 {
            break;
        }
    }
    let took = begin.elapsed();
    crate::running::end(&mut child);
    writer.join().unwrap();
    assert!(answers == 5 && took > Duration::from_secs(2), "{answers} answers in {took:?}");
}

#[cfg_attr(not(target_os = "linux"), ignore = "how many files a program has open differs")]
#[test]
fn a_page_that_can_t_accept_says_so_once() {
    let mut said = tempfile::NamedTempFile::new().unwrap();
    let mut command = crate::panel::program::command(&["127.0.0.1:9"]);
    let panel = Panel::by(command.stderr(said.reopen().unwrap()));
    // It has looked how many files it may open.
    let _page = panel.page();
    let process = panel.running.id().to_string();
    let open = std::fs::read_dir(format!("/proc/{process}/fd")).unwrap().count();
    let most = format!("--nofile={}", open + 5);
    let limited = Command::new("prlimit").args(["--pid", &process, &most]).status().unwrap();
    assert!(limited.success());
    let connections: Vec<_> =
        (0..100).map(|_| TcpStream::connect(&panel.address).unwrap()).collect();
    let (mut text, begin) = (String::new(), Instant::now());
    while !text.contains("can't be accepted") {
        assert!(begin.elapsed() < LIMIT, "it says nothing: {text}");
        thread::sleep(Duration::from_millis(50));
        said.read_to_string(&mut text).unwrap();
    }
    // It tries again every 50 ms, as long as they are open.
    thread::sleep(Duration::from_millis(500));
    panel.running.signal("INT");
    drop(connections);
    panel.running.end();
    said.read_to_string(&mut text).unwrap();
    assert_eq!(text.matches("can't be accepted").count(), 1, "{text}");
}

/// A world with this many controllers, which have nothing.
fn factory_of(folder: &tempfile::TempDir, controllers: usize) -> String {
    let path = in_folder(folder, "many.toml");
    let one = |number| format!("[[controllers]]\nname = \"c{number}\"\n");
    std::fs::write(&path, (0..controllers).map(one).collect::<String>()).unwrap();
    path
}

#[cfg_attr(not(target_os = "linux"), ignore = "how many files a program has open differs")]
#[test]
fn with_too_few_files_for_many_controllers_it_says_how_many_are_needed() {
    let folder = tempfile::tempdir().unwrap();
    let world = factory_of(&folder, 100);
    let args = ["simulate", "--port", "0", "--world", &world];
    let output = after("ulimit -n 256", &args);
    let said = said(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("100 controllers with their clients need 1264 open files"), "{said}");
    assert!(said.contains("256 are allowed here: enter `ulimit -n 1264` first"), "{said}");
    // The error itself, too.
    assert!(said.contains("raise the limit (ulimit -n)"), "{said}");
}

#[cfg_attr(not(target_os = "linux"), ignore = "how many files a program has open differs")]
#[test]
fn with_as_many_files_as_it_says_all_controllers_serve_a_client_at_each_port() {
    let folder = tempfile::tempdir().unwrap();
    let world = factory_of(&folder, 20);
    let mut limited = Command::new("sh");
    let script = "ulimit -n 304 && exec \"$0\" simulate --port 0 --world \"$1\"";
    limited.args(["-c", script, env!("CARGO_BIN_EXE_txt"), &world]);
    let running = Running::start(limited.stdin(Stdio::piped()).stderr(Stdio::piped()));
    let mut clients = Vec::new();
    for _ in 0..60 {
        let line = running.line();
        let address = line.rsplit(' ').next().unwrap().to_owned();
        // The camera's port refuses clients until it is started.
        clients.extend(TcpStream::connect(address));
    }
    assert!(clients.len() >= 20, "{}", clients.len());
    running.signal("INT");
    let said = said(&running.end());
    assert!(!said.contains("open files"), "{said}");
}
