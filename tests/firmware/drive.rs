//! Drives a controller with the golden sessions, such as the maker's firmware under emulation:
//!
//! ```sh
//! cargo build --package ft-transfer-area-tests --example firmware_sessions
//! firmware_sessions 127.0.0.1:65000 FILE|FOLDER... [--board COMMAND] [--record]
//! ```
//!
//! The address is that of the main port; camera and I2C are the next two ports. Each FILE is a session, a FOLDER is all
//! of its `*.txt`; `packets.txt` is in the folder above, or in the same one. One line is printed for each session:
//! `ok`, `skipped` or `FAILED` with its name, the time, and what was different. The status is 1 if one failed.
//!
//! COMMAND is a program for what is plugged in. It gets lines from standard input, and answers each with one line:
//!
//! * `extensions N`: from now on a look for extensions finds N (0 or 1). The answer does not matter.
//! * `duty`: the answer is what the board has at O1 to O8, as bytes: `255 0 0 0 0 0 0 0`; `duty 1`: of extension 1.
//! * `modes`: the answer is what the board measures at I1 to I8, each as the number of the mode and 1 for digital, as
//!   with `11 11 11 11 11 11 11 11` after StartOnline.
//! * `frames`: the answer is how many requests the board has got for outputs and inputs; after
//!   `frames 0`, since then.
//! * `i2c 24`: the device 0x18 is plugged in, with registers of one byte, all 0 from 0x10 on. The answer does not matter.
//! * `camera`: a camera is plugged in. The answer does not matter.
//!
//! Without it, or when it answers `-`, a session that needs it is skipped. All inputs are 0 at the beginning, and
//! `extensions 0` comes before each session.
//!
//! With `--record`, each line with a question mark is replaced by what came, and times are put into the comments.

mod session;

use std::io::{BufRead, BufReader, Write};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use session::{run, Board, Controller, Outcome, Packets};

/// The controller with this main port, and the other ports right after it.
fn controller_at(main: SocketAddr) -> Controller {
    let port = main.port();
    Controller { ip: main.ip(), main: port, camera: port + 1, i2c: port + 2 }
}

/// Ends what a session leaves behind: the firmware's I2C server waits for a client for 5 s, and a StartOnline in that
/// time would end the program. A client that closes again ends the wait.
fn settle(controller: &Controller) {
    drop(controller.connect("i2c"));
    let deadline = Instant::now() + Duration::from_secs(15);
    while !controller.answers() && Instant::now() < deadline {
        thread::sleep(Duration::from_millis(100));
    }
}

/// A board of which nothing is known.
struct NoBoard;

impl Board for NoBoard {
    fn command(&mut self, _: &str) -> Option<String> {
        None
    }
}

/// A program that knows the board.
struct Program {
    child: Child,
}

impl Board for Program {
    fn command(&mut self, command: &str) -> Option<String> {
        let stdin = self.child.stdin.as_mut()?;
        writeln!(stdin, "{command}").ok()?;
        let mut answer = String::new();
        // It answers line by line, so nothing is left in the buffer.
        BufReader::with_capacity(1, self.child.stdout.as_mut()?).read_line(&mut answer).ok()?;
        let answer = answer.trim();
        (!answer.is_empty() && answer != "-").then(|| answer.to_owned())
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // Its input ends, and so does it.
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}

struct Options {
    controller: Controller,
    files: Vec<PathBuf>,
    board: Box<dyn Board>,
    records: bool,
}

fn options() -> Result<Options, String> {
    let mut arguments = env::args().skip(1);
    let address = arguments.next().ok_or("usage: firmware_sessions ADDRESS:PORT FILE|FOLDER...")?;
    let main = address.parse().map_err(|error| format!("{address}: {error}"))?;
    let controller = controller_at(main);
    let mut options =
        Options { controller, files: vec![], board: Box::new(NoBoard), records: false };
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--record" => options.records = true,
            "--board" => {
                let command = arguments.next().ok_or("--board COMMAND")?;
                let mut shell = Command::new("sh");
                shell.args(["-c", &command]).stdin(Stdio::piped()).stdout(Stdio::piped());
                let child = shell.spawn().map_err(|error| error.to_string())?;
                options.board = Box::new(Program { child });
            }
            path => options.files.extend(session_files(Path::new(path))?),
        }
    }
    Ok(options)
}

/// The file, or those in the folder in their order.
fn session_files(path: &Path) -> Result<Vec<PathBuf>, String> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let entries = fs::read_dir(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut files: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|file| {
        file.extension().is_some_and(|extension| extension == "txt")
            && file.file_name().is_some_and(|name| name != "packets.txt")
    });
    files.sort();
    Ok(files)
}

/// The packets for a session: in its folder or in the one above.
fn packets_for(file: &Path) -> Result<Packets, String> {
    let folder = file.parent().unwrap_or(Path::new("."));
    let own = folder.join("packets.txt");
    Packets::load(&if own.exists() { own } else { folder.join("..").join("packets.txt") })
}

fn play(file: &Path, options: &mut Options) -> Result<Outcome, String> {
    let text = fs::read_to_string(file).map_err(|error| error.to_string())?;
    let mut recorded = Vec::new();
    options.board.command("extensions 0");
    let outcome =
        run(&text, &packets_for(file)?, options.controller, options.board.as_mut(), &mut recorded);
    settle(&options.controller);
    if options.records && outcome == Ok(Outcome::Same) {
        fs::write(file, recorded.join("\n") + "\n").map_err(|error| error.to_string())?;
    }
    outcome
}

fn main() -> ExitCode {
    let mut options = match options() {
        Ok(options) => options,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::from(2);
        }
    };
    settle(&options.controller);
    let mut failed = 0;
    for file in options.files.clone() {
        let begin = Instant::now();
        let (word, why) = match play(&file, &mut options) {
            Ok(Outcome::Same) => ("ok", String::new()),
            Ok(Outcome::Skipped) => ("skipped", ": nobody knows the board".into()),
            Err(why) => ("FAILED", format!(": {why}")),
        };
        failed += usize::from(word == "FAILED");
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        println!("{word} {name} ({:.1} s){why}", begin.elapsed().as_secs_f64());
    }
    println!("{} sessions, {failed} failed", options.files.len());
    ExitCode::from(u8::from(failed > 0))
}
