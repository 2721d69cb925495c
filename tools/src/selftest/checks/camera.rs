//! The camera. The controller accepts its start without one, too; then no picture comes.

use std::time::{Duration, Instant};

use ft_transfer_area::wire::{
    CameraFrameHeader, CommandId, StartCameraOnline, CAMERA_FRAME_ACKNOWLEDGE,
};

use super::commands::closes;
use super::{Check, Found};
use crate::print::seconds;
use crate::seen;
use crate::selftest::bench::{Bench, Holds};
use crate::selftest::line::{Heard, Line, LIMIT};
use crate::selftest::outcome::{Outcome, Trouble};
use crate::selftest::session::{command, packet};

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "camera-start",
        "StartCameraOnline is answered at once, also without a camera.",
        starts,
    ),
    Check::new(
        "camera-picture",
        "A picture has the size that was requested, and says that none or one is ready.",
        picture,
    ),
    Check::new(
        "camera-acknowledge",
        "The next picture comes after an acknowledgement, and not before; one in pieces closes the connection.",
        acknowledge,
    ),
    Check::new(
        "camera-wrong-acknowledge",
        "A wrong acknowledgement closes the camera's connection.",
        wrong_acknowledge,
    ),
    Check::new(
        "camera-once",
        "When the camera's connection is closed, others are refused until the next StartCameraOnline.",
        once,
    ),
    Check::new(
        "camera-stop",
        "StopCameraOnline is answered at once when the camera's connection was closed before.",
        stops,
    ),
    Check::new(
        "camera-late",
        "More than 5 s after StartCameraOnline, the camera's port refuses a connection.",
        late,
    ),
];

const SIZE: StartCameraOnline =
    StartCameraOnline { width: 320, height: 240, framerate: 15, power_line_frequency: 50 };

/// How long the camera's port may refuse.
const OPENS: Duration = Duration::from_secs(4);

const NO_PICTURE: &str = "no picture comes, so there is no camera";
const NOT_THIS_TIME: &str = "no picture comes this time";

/// For a check that makes no sense without a camera.
pub(super) fn needs_camera(bench: &Bench) -> Result<(), Trouble> {
    if bench.has_camera {
        Ok(())
    } else {
        Err(Trouble::NotTried(NO_PICTURE))
    }
}

/// A command that starts or stops the camera in this session: how long its answer took.
fn send(bench: &mut Bench, id: CommandId) -> Result<Duration, Trouble> {
    let mut request = Vec::new();
    match id {
        CommandId::StartCameraOnline => SIZE.emit(&mut request),
        _ => request = packet(id),
    }
    let begin = Instant::now();
    command(&mut bench.online()?.main, id, &request)?;
    Ok(begin.elapsed())
}

/// The connection to a camera that is started, with its first picture; `None` when none comes.
fn connect(bench: &mut Bench) -> Result<Option<(Line, CameraFrameHeader, Vec<u8>)>, Trouble> {
    let begin = Instant::now();
    while begin.elapsed() < OPENS {
        if let Some(mut line) = bench.connect(seen::Line::Camera)? {
            let picture = frame(&mut line)?;
            return Ok(picture.map(|(header, jpeg)| (line, header, jpeg)));
        }
        bench.online()?.exchange()?;
    }
    Ok(None)
}

/// The next picture.
fn frame(line: &mut Line) -> Result<Option<(CameraFrameHeader, Vec<u8>)>, Trouble> {
    let Heard::Bytes(header) = line.hear(CameraFrameHeader::LEN, LIMIT)? else { return Ok(None) };
    let parsed = CameraFrameHeader::parse(&header);
    let parsed = parsed.map_err(|error| Trouble::Lost(error.to_string()))?;
    let jpeg = line.receive(usize::try_from(parsed.size_compressed).unwrap_or(0))?;
    Ok(Some((parsed, jpeg)))
}

/// Stops the camera: its client has to be gone by then.
fn stop(bench: &mut Bench, client: Option<Line>) -> Result<Duration, Trouble> {
    drop(client);
    bench.pause(Duration::from_millis(50))?;
    bench.online()?.exchange()?;
    send(bench, CommandId::StopCameraOnline)
}

fn starts(bench: &mut Bench) -> Found {
    bench.begin(Holds::I2c)?;
    let took = send(bench, CommandId::StartCameraOnline)?;
    let there = connect(bench)?;
    bench.has_camera = there.is_some();
    let stopped = stop(bench, there.map(|(line, ..)| line))?;
    bench.camera_stop = bench.has_camera.then_some(stopped);
    bench.end()?;
    let camera = if bench.has_camera { "with a camera" } else { "without a camera" };
    let seen = format!("{}, {camera}", seconds(took));
    let outcome = Outcome::same_if(took < Duration::from_millis(500), seen).with_time("ms", took);
    Ok(outcome.with("camera", bench.has_camera))
}

/// Does something with the first picture of a camera and its connection, which may be kept.
fn with_picture(
    bench: &mut Bench,
    check: impl FnOnce(&mut Bench, &mut Option<Line>, CameraFrameHeader, &[u8]) -> Found,
) -> Found {
    needs_camera(bench)?;
    bench.begin(Holds::I2c)?;
    send(bench, CommandId::StartCameraOnline)?;
    let Some((line, header, jpeg)) = connect(bench)? else {
        stop(bench, None)?;
        bench.end()?;
        return Ok(Outcome::differs(NOT_THIS_TIME));
    };
    let mut line = Some(line);
    let outcome = check(bench, &mut line, header, &jpeg)?;
    stop(bench, line)?;
    bench.end()?;
    Ok(outcome)
}

fn picture(bench: &mut Bench) -> Found {
    with_picture(bench, |_, _, header, jpeg| {
        let CameraFrameHeader { frames_ready, width, height, size_raw, size_compressed } = header;
        let is_same = (i32::from(width), i32::from(height)) == (SIZE.width, SIZE.height)
            && size_raw == 2 * SIZE.width * SIZE.height
            && matches!(frames_ready, 0 | 1)
            && jpeg.starts_with(&[0xFF, 0xD8]);
        let seen = format!("{width}×{height}, {size_compressed} bytes, {frames_ready} ready");
        Ok(Outcome::same_if(is_same, seen).with("bytes", size_compressed))
    })
}

fn acknowledge(bench: &mut Bench) -> Found {
    with_picture(bench, |bench, line, _, _| {
        let line = line.as_mut().ok_or(Trouble::NotTried(NO_PICTURE))?;
        if !matches!(line.hear(1, Duration::from_millis(500))?, Heard::Silence) {
            return Ok(Outcome::differs("something comes before"));
        }
        bench.online()?.exchange()?;
        line.send(&CAMERA_FRAME_ACKNOWLEDGE)?;
        if frame(line)?.is_none() {
            return Ok(Outcome::differs("none comes"));
        }
        let (start, rest) = CAMERA_FRAME_ACKNOWLEDGE.split_at(2);
        line.send(start)?;
        bench.pause(Duration::from_millis(100))?;
        line.send(rest)?;
        closes(line)
    })
}

fn wrong_acknowledge(bench: &mut Bench) -> Found {
    with_picture(bench, |_, line, _, _| {
        let line = line.as_mut().ok_or(Trouble::NotTried(NO_PICTURE))?;
        line.send(&[1, 2, 3, 4])?;
        closes(line)
    })
}

fn once(bench: &mut Bench) -> Found {
    with_picture(bench, |bench, line, _, _| {
        *line = None;
        bench.online()?.exchanges(5)?;
        let again = bench.connect(seen::Line::Camera)?;
        let seen = if again.is_some() { "it accepts another one" } else { "" };
        Ok(Outcome::same_if(again.is_none(), seen))
    })
}

fn stops(bench: &mut Bench) -> Found {
    let took = bench.camera_stop.ok_or(Trouble::NotTried(NO_PICTURE))?;
    Ok(Outcome::same_if(took < Duration::from_millis(400), seconds(took)).with_time("ms", took))
}

/// Starts the camera, gets a picture and stops it: whether one came.
pub(super) fn start_and_stop(bench: &mut Bench) -> Result<bool, Trouble> {
    send(bench, CommandId::StartCameraOnline)?;
    let there = connect(bench)?.map(|(line, ..)| line);
    let is_there = there.is_some();
    stop(bench, there)?;
    Ok(is_there)
}

fn late(bench: &mut Bench) -> Found {
    needs_camera(bench)?;
    bench.begin(Holds::I2c)?;
    send(bench, CommandId::StartCameraOnline)?;
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_millis(5_600) {
        bench.online()?.exchange()?;
    }
    let late = bench.connect(seen::Line::Camera)?;
    let seen = if late.is_some() { "it accepts one" } else { "" };
    let outcome = Outcome::same_if(late.is_none(), seen);
    stop(bench, late)?;
    bench.end()?;
    Ok(outcome)
}
