//! The way of a frame from the socket to the program.

use std::net::TcpListener;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{ensure, Context, Result};
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::JpegDecoder;

use super::clients::{transfer, Channel, Client, Plain};
use super::peer::{packet, serve_and_tell};
use crate::child::{self, Server};
use crate::pictures::{Format, Motif};
use crate::process::Usage;
use crate::report::{Report, Table};
use crate::stats::Sorted;

const FORMATS: [Format; 3] = [
    Format::new(Motif::TestCard, 320, 240),
    Format::new(Motif::TestCard, 640, 480),
    Format::new(Motif::Texture, 640, 480),
];

/// The controller that the camera belongs to, in another process, at a controller's pace.
pub(crate) struct Controller {
    _server: Server,
    pub(crate) port: u16,
}

impl Controller {
    pub(crate) fn start() -> Result<Self> {
        let mut server = Server::start(&child::arguments([&"peer", &"--pace", &10_000]))?;
        let port = server.number()?;
        Ok(Self { _server: server, port })
    }
}

/// A camera in another process.
fn camera(format: Format, rate: u32) -> Result<(Server, u16)> {
    let mut arguments = child::arguments([&"camera-peer", &"--rate", &rate]);
    arguments.extend(format.arguments());
    let mut server = Server::start(&arguments)?;
    let port = server.number()?;
    Ok((server, port))
}

/// How many frames come in when the camera sends the next one as soon as one is acknowledged.
pub(crate) fn measure_throughput(report: &Report, controller: &Controller) -> Result<()> {
    let time = Duration::from_millis(report.times(300, 50) as u64);
    let mut raw = report.raw(
        "camera_throughput",
        &["picture", "round", "read alone, frames/s", "channel, frames/s", "dropped"],
    )?;
    let mut table = Table::new([
        "picture",
        "size of a frame, KiB",
        "a program that reads the socket itself, frames/s",
        "the channel, frames/s",
        "the channel, MiB/s",
        "channel of reading alone",
    ]);
    for &format in report.some(&FORMATS) {
        let (_camera, port) = camera(format, 0)?;
        let (mut size, mut rates, mut ratios, mut mibs) = (0, [vec![], vec![]], vec![], vec![]);
        for round in 0..report.times(8, 1) {
            let plain = per_second(time, Plain::connect(port)?.count(time)?.0);
            let mut channel = Channel::connect(controller.port, port)?;
            size = channel.frame()?;
            let (frames, bytes) = channel.count(time)?;
            let dropped = channel.dropped();
            let frames = per_second(time, frames);
            raw.write_record([
                format.name(),
                round.to_string(),
                plain.to_string(),
                frames.to_string(),
                dropped.to_string(),
            ])?;
            rates[0].push(plain);
            rates[1].push(frames);
            ratios.push(frames / plain);
            mibs.push(per_second(time, bytes) / f64::from(1 << 20));
        }
        let [plain, channel] = rates.map(|rates| Sorted::of(rates).with_spread(0));
        table.row([
            format.name(),
            format!("{:.0}", size as f64 / 1024.0),
            plain,
            channel,
            Sorted::of(mibs).with_spread(0),
            Sorted::of(ratios).with_spread(2),
        ]);
    }
    raw.flush()?;
    report.table("camera_throughput", &table)
}

fn per_second(time: Duration, count: usize) -> f64 {
    count as f64 / time.as_secs_f64()
}

/// How long after its last byte was sent a frame is with the program. All in this process, so that there is
/// one clock.
pub(crate) fn measure_latency(report: &Report, controller: &Controller) -> Result<()> {
    let frames = report.times(150, 10);
    let packet = packet(FORMATS[1])?;
    let mut raw = report.raw("camera_latency", &["client", "round", "µs"])?;
    let mut note = |client: &str, round: usize, times: &[f64]| {
        times
            .iter()
            .try_for_each(|time| raw.write_record([client, &round.to_string(), &time.to_string()]))
    };
    let mut all = [vec![], vec![], vec![]];
    for round in 0..report.times(8, 1) {
        let plain = latency(&packet, frames, |port| {
            let mut plain = Plain::connect(port)?;
            let mut sequence = 0;
            Ok(move || {
                plain.frame()?;
                sequence += 1;
                Ok((sequence - 1, [Instant::now(); 2]))
            })
        })?;
        let channel = latency(&packet, frames, |port| {
            let mut channel = Channel::connect(controller.port, port)?;
            Ok(move || {
                let frame = channel.next()?;
                Ok((frame.sequence, [frame.arrived, Instant::now()]))
            })
        })?;
        note("reads alone", round, &plain[1])?;
        note("channel, arrived", round, &channel[0])?;
        note("channel, received", round, &channel[1])?;
        let [arrived, received] = channel;
        let [_, plain] = plain;
        for (all, times) in all.iter_mut().zip([plain, arrived, received]) {
            all.extend(times);
        }
    }
    raw.flush()?;
    let mut table = Table::new(["from the last byte until", "median", "p99", "p99.9"]);
    let names = [
        "a program that reads the socket itself has the frame",
        "the library's thread has the frame (`arrived`)",
        "the program has received it from the channel",
    ];
    for (name, times) in names.into_iter().zip(all) {
        let times = Sorted::of(times);
        let [median, p99, p999] = [0.5, 0.99, 0.999].map(|share| times.quantile(share));
        table.row([
            name.to_owned(),
            format!("{median:.0} µs"),
            format!("{p99:.0} µs"),
            format!("{p999:.0} µs"),
        ]);
    }
    report.table("camera_latency", &table)
}

/// Times in µs from the last byte of each frame until the two moments that the client reports, with the number
/// of the frame.
fn latency<F: FnMut() -> Result<(u64, [Instant; 2])>>(
    packet: &[u8],
    frames: usize,
    connect: impl FnOnce(u16) -> Result<F>,
) -> Result<[Vec<f64>; 2]> {
    /// Long enough for all threads to sleep again.
    const PERIOD: Duration = Duration::from_millis(2);
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let port = listener.local_addr()?.port();
    let (tell, reported) = mpsc::channel();
    thread::scope(|scope| {
        // It ends with an error when the client has left.
        scope.spawn(move || serve_and_tell(&listener, packet, PERIOD, &tell));
        let mut next = connect(port)?;
        // Those that came in while the camera was started may have waited, or be lost.
        while next()?.1[0].elapsed() > PERIOD / 2 {}
        let mut times = [vec![], vec![]];
        let mut sent = reported.iter().enumerate();
        for _ in 0..frames {
            let (sequence, moments) = next()?;
            let (_, sent) = sent
                .find(|(number, _)| *number as u64 == sequence)
                .context("the camera has ended")?;
            for (times, moment) in times.iter_mut().zip(moments) {
                times.push(moment.duration_since(sent).as_secs_f64() * 1e6);
            }
        }
        Ok(times)
    })
}

/// What a program does with each frame.
type Use = fn(&mut Channel) -> Result<()>;

/// What a picture of 640×480 costs, 30 times a second.
pub(crate) fn measure_load(report: &Report, controller: &Controller) -> Result<()> {
    const RATE: u32 = 30;
    let time = Duration::from_millis(report.times(2000, 200) as u64);
    let uses: [(&str, Use); 4] = [
        ("received", |channel| channel.next().map(drop)),
        ("received and repaired (`jpeg`)", |channel| {
            channel.next()?.jpeg()?;
            Ok(())
        }),
        ("received and decoded (`to_rgb`)", |channel| {
            channel.next()?.to_rgb()?;
            Ok(())
        }),
        ("received and decoded by zune-jpeg", |channel| {
            let frame = channel.next()?;
            let decoded = JpegDecoder::new(ZCursor::new(&frame.jpeg()?)).decode();
            decoded.map(drop).context("zune-jpeg refuses the picture")
        }),
    ];
    let mut raw =
        report.raw("camera_load", &["picture", "use", "round", "frames/s", "processor time, %"])?;
    let mut table = Table::new([
        "picture",
        "each frame is",
        "frames/s",
        "processor time of the process, % of a core",
    ]);
    for format in report.some(&FORMATS[1..]) {
        let (_camera, port) = camera(*format, RATE)?;
        let mut results = vec![[vec![], vec![]]; uses.len() + 1];
        for round in 0..report.times(2, 1) {
            let idle = idle_load(controller, port, time)?;
            let mut loads = vec![[0.0, idle]];
            for (_, with) in uses {
                loads.push(load(Channel::connect(controller.port, port)?, with, time)?);
            }
            let names = ["no camera"].into_iter().chain(uses.map(|(name, _)| name));
            for ((name, load), results) in names.zip(loads).zip(&mut results) {
                let mut row = vec![format.name(), name.to_owned(), round.to_string()];
                row.extend(load.map(|value| value.to_string()));
                raw.write_record(row)?;
                for (results, value) in results.iter_mut().zip(load) {
                    results.push(value);
                }
            }
        }
        let names = ["not there: only the exchange"].into_iter().chain(uses.map(|(name, _)| name));
        for (name, results) in names.zip(results) {
            let [frames, processor] = results.map(|values| Sorted::of(values).median());
            table.row([
                format.name(),
                name.to_owned(),
                format!("{frames:.1}"),
                format!("{processor:.1}"),
            ]);
        }
    }
    raw.flush()?;
    report.table("camera_load", &table)
}

/// The processor time of a transfer without a camera, in % of a core.
fn idle_load(controller: &Controller, camera_port: u16, time: Duration) -> Result<f64> {
    let handler = transfer(controller.port, camera_port)?;
    let (begin, before) = (Instant::now(), Usage::now()?.time());
    thread::sleep(time);
    let share = share_since(begin, before)?;
    ensure!(handler.areas().statistics().cycles > 0, "the exchange does not go on");
    Ok(share)
}

/// Frames per second, and the processor time in % of a core.
fn load(mut channel: Channel, with: Use, time: Duration) -> Result<[f64; 2]> {
    with(&mut channel)?;
    let (begin, before) = (Instant::now(), Usage::now()?.time());
    let mut frames = 0;
    while begin.elapsed() < time {
        with(&mut channel)?;
        frames += 1;
    }
    Ok([f64::from(frames) / begin.elapsed().as_secs_f64(), share_since(begin, before)?])
}

fn share_since(begin: Instant, before: Duration) -> Result<f64> {
    let taken = Usage::now()?.time().saturating_sub(before);
    Ok(100.0 * taken.as_secs_f64() / begin.elapsed().as_secs_f64())
}
