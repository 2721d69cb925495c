//! `txt camera`: pictures in files and in the browser, and what may go wrong.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use ft_transfer_area::CameraFrame;
use ft_transfer_area_simulator::SimulatedTxt;

use crate::running::Running;

/// Longer than anything takes on a busy machine; only a failing test waits this long.
const DEADLINE: Duration = Duration::from_secs(60);

fn camera(host: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["camera", host]);
    command
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn quick() -> SimulatedTxt {
    SimulatedTxt::builder().camera_start_up(Duration::ZERO).start().unwrap()
}

fn run(txt: &SimulatedTxt, options: &[&str], output: &Path) -> Output {
    let mut command = camera(&txt.address().to_string());
    command.args(["--size", "64x48", "--fps", "60", "-o"]).arg(output).args(options);
    command.output().unwrap()
}

/// Starts it with its errors to be read.
fn start(command: &mut Command) -> Running {
    Running::start(command.stderr(Stdio::piped()))
}

/// Its exit status and what it has said on stderr.
fn end(running: Running) -> (Option<i32>, String) {
    let output = running.end();
    (output.status.code(), text(&output.stderr).to_owned())
}

/// The size of a whole JPEG picture.
fn size(jpeg: Vec<u8>) -> (u16, u16) {
    let picture = CameraFrame::new(jpeg).to_rgb().unwrap();
    (picture.width, picture.height)
}

/// A file of pictures, in parts from one start of a picture to the next.
fn pictures(film: &[u8]) -> Vec<Vec<u8>> {
    let starts: Vec<_> =
        film.windows(3).enumerate().filter(|(_, three)| **three == [0xFF, 0xD8, 0xFF]).collect();
    let ends = starts.iter().skip(1).map(|(at, _)| *at).chain([film.len()]);
    starts.iter().zip(ends).map(|((start, _), end)| film[*start..end].to_vec()).collect()
}

#[test]
fn pictures_are_numbered_files() {
    let (txt, folder) = (quick(), tempfile::tempdir().unwrap());
    let folder = folder.path().join("new/pictures");
    let output = run(&txt, &["--count", "3"], &folder);
    assert!(output.status.success(), "{output:?}");
    assert!(text(&output.stdout).contains("3 picture(s) saved in"), "{output:?}");
    let mut names: Vec<_> =
        fs::read_dir(&folder).unwrap().map(|file| file.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["00001.jpg", "00002.jpg", "00003.jpg"]);
    for name in &names {
        assert_eq!(size(fs::read(folder.join(name)).unwrap()), (64, 48));
    }
    txt.with_machine(|machine| assert!(!machine.online() && machine.camera().is_none()));

    // What is there is not overwritten by chance.
    let first = fs::read(folder.join("00001.jpg")).unwrap();
    let output = run(&txt, &["--count", "1"], &folder);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("00001.jpg is there already; --force"), "{output:?}");
    assert_eq!(fs::read(folder.join("00001.jpg")).unwrap(), first);
    assert!(run(&txt, &["--count", "1", "--force"], &folder).status.success());
}

#[test]
fn a_film_is_one_picture_after_the_other() {
    let (txt, folder) = (quick(), tempfile::tempdir().unwrap());
    let film = folder.path().join("film.mjpeg");
    assert!(run(&txt, &["--count", "5"], &film).status.success());
    let pictures = pictures(&fs::read(&film).unwrap());
    assert_eq!(pictures.len(), 5);
    for picture in pictures {
        assert_eq!(picture[picture.len() - 2..], [0xFF, 0xD9], "it has its end");
        assert_eq!(size(picture), (64, 48));
    }
}

#[test]
fn a_picture_every_so_often_leaves_out_those_between() {
    let (txt, folder) = (quick(), tempfile::tempdir().unwrap());
    let begin = Instant::now();
    let output = run(&txt, &["--count", "3", "--every", "0.3"], folder.path());
    assert!(output.status.success(), "{output:?}");
    assert!(begin.elapsed() >= Duration::from_millis(600));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 3);
    txt.with_machine(|machine| assert!(machine.camera_frames() > 5));
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn ctrl_c_ends_a_film_well_but_not_an_unfinished_count() {
    let txt = quick();
    for (options, status, sentence) in [
        (&[][..], Some(0), ""),
        (&["--count", "1000000"], Some(1), "stopped before all 1000000 pictures had come"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let film = folder.path().join("film.mjpeg");
        let mut command = camera(&txt.address().to_string());
        let running = start(command.arg("-o").arg(&film).args(options));
        let begin = Instant::now();
        while fs::metadata(&film).map_or(0, |film| film.len()) == 0 {
            assert!(begin.elapsed() < DEADLINE, "no picture comes");
            std::thread::sleep(Duration::from_millis(5));
        }
        running.signal("INT");
        let (ended, said) = end(running);
        assert_eq!(ended, status, "{said}");
        assert!(said.contains(sentence), "{said}");
        assert!(fs::read(&film).unwrap().ends_with(&[0xFF, 0xD9]));
        assert!(txt.wait_until(|machine| !machine.connected(), DEADLINE));
    }
}

/// Removes the film while it is written, and perhaps makes another one in its place.
#[cfg(unix)]
#[test]
fn a_film_that_is_removed_while_it_is_written_is_missed() {
    let (txt, folder) = (quick(), tempfile::tempdir().unwrap());
    let film = folder.path().join("film.mjpeg");
    for (is_replaced, sentence) in [(false, "not there any more"), (true, "is another file now")] {
        let mut command = camera(&txt.address().to_string());
        let running = start(command.arg("-o").arg(&film).arg("--force"));
        let begin = Instant::now();
        while fs::metadata(&film).map_or(0, |film| film.len()) == 0 {
            assert!(begin.elapsed() < DEADLINE, "no picture comes");
            std::thread::sleep(Duration::from_millis(5));
        }
        fs::remove_file(&film).unwrap();
        if is_replaced {
            fs::write(&film, "").unwrap();
        }
        running.signal("INT");
        let (status, said) = end(running);
        assert_eq!(status, Some(1), "{said}");
        assert!(said.contains(sentence), "{said}");
        assert!(txt.wait_until(|machine| !machine.connected(), DEADLINE));
    }
}

#[test]
fn a_film_is_overwritten_by_the_first_picture_and_not_before() {
    let (txt, folder) = (quick(), tempfile::tempdir().unwrap());
    let film = folder.path().join("film.mjpeg");
    let old = vec![7; 1 << 20];
    fs::write(&film, &old).unwrap();
    let nobody = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = nobody.local_addr().unwrap().to_string();
    drop(nobody);
    let new = folder.path().join("new.mjpeg");
    for output in [&film, &new] {
        let output = camera(&address).arg("-o").arg(output).arg("--force").output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{output:?}");
    }
    assert!(fs::read(&film).unwrap() == old, "it has changed");
    assert!(!new.exists(), "an empty film is left");
    assert!(run(&txt, &["--count", "2", "--force"], &film).status.success());
    let new = fs::read(&film).unwrap();
    assert!(new.len() < old.len() && pictures(&new).len() == 2);
}

#[cfg(unix)]
#[test]
fn a_full_disk_ends_it_with_a_sentence() {
    let (txt, folder) = (quick(), tempfile::tempdir().unwrap());
    let film = folder.path().join("film.mjpeg");
    std::os::unix::fs::symlink("/dev/full", &film).unwrap();
    let output = run(&txt, &["--count", "3", "--force"], &film);
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("0 picture(s) saved") && said.contains("No space left"), "{said}");
    assert!(txt.wait_until(|machine| !machine.connected(), DEADLINE));
}

#[cfg(not(unix))]
#[test]
#[ignore = "only Unix has a file that is always full"]
fn a_full_disk_ends_it_with_a_sentence() {}

#[test]
fn a_folder_that_can_not_be_made_is_named() {
    let (txt, folder) = (quick(), tempfile::tempdir().unwrap());
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let pictures = file.join("pictures");
    let output = run(&txt, &["--count", "1"], &pictures);
    assert_eq!(output.status.code(), Some(1));
    let named = format!("{}: ", pictures.display());
    assert!(text(&output.stderr).starts_with(&named), "{output:?}");
    txt.with_machine(|machine| assert_eq!(machine.exchanges(), 0));
}

#[test]
fn a_file_that_is_no_film_is_refused() {
    let (txt, folder) = (quick(), tempfile::tempdir().unwrap());
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    for output in [file, folder.path().join("picture.jpg")] {
        let refused = run(&txt, &["--count", "1"], &output);
        assert_eq!(refused.status.code(), Some(1));
        assert!(text(&refused.stderr).contains("is the name of a file"), "{refused:?}");
        assert!(!output.is_dir());
    }
    txt.with_machine(|machine| assert_eq!(machine.exchanges(), 0));
}

#[test]
fn without_a_camera_it_asks_for_the_plug() {
    let builder = SimulatedTxt::builder().camera_stall_after(2);
    let txt = builder.camera_start_up(Duration::ZERO).start().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let output = run(&txt, &["--count", "9"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert!(said.contains("2 picture(s) saved"), "{said}");
    assert!(said.contains("is the camera plugged into the TXT's USB socket?"), "{said}");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn a_controller_that_goes_away_ends_it_with_a_sentence() {
    let (txt, folder) = (quick(), tempfile::tempdir().unwrap());
    let film = folder.path().join("film.mjpeg");
    let mut command = camera(&txt.address().to_string());
    let running = start(command.arg("-o").arg(&film));
    assert!(txt.wait_until(|machine| machine.camera_acknowledges() >= 2, DEADLINE));
    drop(txt);
    let (status, said) = end(running);
    assert_eq!(status, Some(1));
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("the connection is lost"), "{said}");
    assert!(fs::read(&film).unwrap().ends_with(&[0xFF, 0xD9]));
}

/// Sends a request to the page, and returns the connection for its answer. In this version of HTTP an answer is
/// not cut into chunks.
fn ask(port: &str, path: &str, host: &str) -> BufReader<TcpStream> {
    let mut stream = TcpStream::connect(format!("127.0.0.1:{port}")).unwrap();
    stream.set_read_timeout(Some(DEADLINE)).unwrap();
    write!(stream, "GET {path} HTTP/1.0\r\nHost: {host}\r\n\r\n").unwrap();
    BufReader::new(stream)
}

/// Reads up to this line, and returns the lines before it.
fn read_until(stream: &mut impl BufRead, end: &str) -> String {
    let mut before = String::new();
    loop {
        let mut line = String::new();
        assert!(stream.read_line(&mut line).unwrap() > 0, "no {end:?} after {before}");
        if line.trim_end() == end {
            return before;
        }
        before.push_str(&line);
    }
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn a_browser_with_the_token_sees_the_pictures() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["camera", "--simulate", "--watch", "--no-browser", "--size", "64x48"]);
    let running = start(&mut command);
    let address = running.line();
    let address = address.strip_prefix("http://127.0.0.1:").unwrap();
    let (port, token) = address.split_once("/?token=").unwrap();
    let own = format!("127.0.0.1:{port}");
    let pictures = format!("/pictures?token={token}");

    let mut page = String::new();
    ask(port, &format!("/?token={token}"), &own).read_to_string(&mut page).unwrap();
    assert!(page.starts_with("HTTP/1.0 200") && page.contains(&pictures), "{page}");
    // Several browsers at the same time.
    for mut stream in [ask(port, &pictures, &own), ask(port, &pictures, &own)] {
        let head = read_until(&mut stream, "--picture");
        assert!(head.contains("multipart/x-mixed-replace; boundary=picture"), "{head}");
        for _ in 0..3 {
            let head = read_until(&mut stream, "");
            let length = head.lines().find_map(|line| line.strip_prefix("Content-Length: "));
            let length: usize = length.unwrap().parse().unwrap();
            let mut jpeg = vec![0; length];
            stream.read_exact(&mut jpeg).unwrap();
            assert_eq!(size(jpeg), (64, 48));
            read_until(&mut stream, "--picture");
        }
    }
    for (path, host) in [
        ("/", &*own),
        ("/pictures", &own),
        ("/pictures?token=", &own),
        ("/pictures?token=0123456789abcdef0123456789abcdef", &own),
        (&*pictures, "evil.example"),
        (&*pictures, "evil.example:80"),
    ] {
        let mut refused = String::new();
        ask(port, path, host).read_line(&mut refused).unwrap();
        assert!(refused.starts_with("HTTP/1.0 403"), "{path} of {host}: {refused}");
    }
    running.signal("INT");
    assert_eq!(end(running), (Some(0), String::new()));
}

#[test]
fn a_port_that_is_taken_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    let output =
        command.args(["camera", "--simulate", "--watch", "--port", &port]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains(&format!("port {port} is taken")), "{output:?}");
}

#[test]
fn options_that_do_not_fit_end_with_status_2() {
    for (options, part) in [
        (&["-o", "x"][..], "<HOST|--simulate>"),
        (&["--simulate"], "<--output <PATH>|--watch>"),
        (&["--simulate", "127.0.0.1", "--watch"], "cannot be used with"),
        (&["--simulate", "-o", "x", "--size", "640"], "a size such as 640x480 is expected"),
        (&["--simulate", "-o", "x", "--every", "0"], "seconds are expected, more than 0"),
        (&["--simulate", "-o", "x", "--count", "0"], "0 is not in 1.."),
        (&["--simulate", "-o", "x", "--watch"], "cannot be used with"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        let output = command.arg("camera").args(options).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{options:?}");
        assert!(text(&output.stderr).contains(part), "{options:?}: {output:?}");
    }
}
