//! The programs of docs/camera.md.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use std::{env, fs};

use ft_transfer_area::CameraFrame;
use ft_transfer_area_simulator::{CameraConnection, Machine, SimulatedTxt};

use crate::program::{example, DEADLINE};

/// A simulated TXT on three ports in a row, whose camera starts immediately.
fn txt() -> (SimulatedTxt, String) {
    let txt = SimulatedTxt::builder().camera_start_up(Duration::ZERO);
    let txt = txt.camera_connection(CameraConnection::Txt40).start().unwrap();
    assert_eq!(txt.camera_port(), txt.port() + 1);
    let host = format!("127.0.0.1:{}", txt.port());
    (txt, host)
}

/// An empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Runs a program, which must end without an error. Returns what it has printed.
fn run(command: &mut Command) -> String {
    let Output { status, stdout, stderr } = command.output().unwrap();
    assert!(status.success(), "{status}: {}", String::from_utf8_lossy(&stderr));
    String::from_utf8(stdout).unwrap()
}

fn assert_offline(txt: &SimulatedTxt) {
    assert!(txt.wait_until(|machine| !machine.online(), DEADLINE), "it is online");
}

#[test]
fn pictures_become_files() {
    let (txt, host) = txt();
    let folder = folder("pictures");
    let said = run(example("camera_pictures").arg(host).current_dir(&folder));
    let files: Vec<&str> =
        said.lines().map(|line| line.strip_suffix(" is saved").expect("a file")).collect();
    assert_eq!(files.len(), 3);
    for file in files {
        let picture = BufReader::new(File::open(folder.join(file)).unwrap());
        let mut picture = png::Decoder::new(picture).read_info().unwrap();
        let mut pixels = vec![0; picture.output_buffer_size().unwrap()];
        let info = picture.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (320, 240));
        assert_eq!(pixels.len(), 3 * 320 * 240);
    }
    assert_offline(&txt);
}

#[test]
fn a_file_holds_whole_pictures_one_after_the_other() {
    let (txt, host) = txt();
    let folder = folder("file");
    run(example("camera_file").arg(host).current_dir(&folder));
    let mut rest = &fs::read(folder.join("camera.mjpeg")).unwrap()[..];
    let mut pictures = 0;
    while !rest.is_empty() {
        // The pictures need no repair, so `jpeg` returns the first picture of the rest unchanged.
        let frame = CameraFrame::new(rest.to_vec());
        let jpeg = frame.jpeg().unwrap();
        rest = rest.strip_prefix(&*jpeg).expect("a whole picture");
        pictures += 1;
    }
    assert_eq!(pictures, 150);
    assert_offline(&txt);
}

/// A program that runs until it is ended by dropping this.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn browsers_get_pictures_one_after_the_other() {
    let (txt, host) = txt();
    let mut command = example("camera_browser");
    let child = command.arg(host).arg("127.0.0.1:0").stdout(Stdio::piped()).spawn().unwrap();
    let mut program = Running(child);
    let mut said = BufReader::new(program.0.stdout.take().unwrap()).lines();
    let line = said.next().unwrap().unwrap();
    let address = line.strip_prefix("open http://").and_then(|line| line.strip_suffix('/'));
    for _ in 0..2 {
        let mut browser = TcpStream::connect(address.unwrap()).unwrap();
        browser.set_read_timeout(Some(DEADLINE)).unwrap();
        browser.write_all(b"GET / HTTP/1.1\r\nHost: here\r\n\r\n").unwrap();
        let mut answer = BufReader::new(browser);
        assert_eq!(header(&mut answer)[0], "HTTP/1.1 200 OK");
        for _ in 0..3 {
            let head = header(&mut answer);
            assert_eq!(head[..2], ["--x", "Content-Type: image/jpeg"]);
            let size = head[2].strip_prefix("Content-Length: ").unwrap().parse().unwrap();
            let mut jpeg = vec![0; size];
            answer.read_exact(&mut jpeg).unwrap();
            assert_eq!(CameraFrame::new(jpeg).to_rgb().unwrap().width, 320);
            assert_eq!(line_of(&mut answer), "");
        }
    }
    drop(program);
    assert_offline(&txt);
}

fn line_of(answer: &mut impl BufRead) -> String {
    let mut line = String::new();
    answer.read_line(&mut line).unwrap();
    line.trim_end().to_owned()
}

/// The lines up to the empty one.
fn header(answer: &mut impl BufRead) -> Vec<String> {
    std::iter::from_fn(|| Some(line_of(answer)).filter(|line| !line.is_empty())).collect()
}

#[test]
fn the_motor_follows_the_newest_frame() {
    let (txt, host) = txt();
    let mut program = Running(example("camera_newest").arg(host).spawn().unwrap());
    let duty = |machine: &Machine| machine.controllers[0].outputs.duty[0];
    // A white bar moves over the test card.
    assert!(txt.wait_until(|machine| duty(machine) == 512, DEADLINE), "never bright");
    assert!(txt.wait_until(|machine| duty(machine) == 0, DEADLINE), "bright forever");
    let begin = Instant::now();
    while program.0.try_wait().unwrap().is_none() {
        assert!(begin.elapsed() < DEADLINE, "it does not end");
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(program.0.wait().unwrap().success());
    assert_offline(&txt);
}
