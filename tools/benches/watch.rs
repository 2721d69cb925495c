//! How much time `txt watch` adds to a cycle, beside a direct connection.
//!
//! A controller that answers at once, and a program that asks: the time from the request to the response is all that
//! there is. A simulated TXT answers 10 ms after its last response, as a controller. Both ways take turns, so that what
//! else the computer does disturbs both alike.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CmprHeader, CommandId, Compressor, ResponseId, StartOnline};
use ft_transfer_area_simulator::SimulatedTxt;

/// How often the ways take turns.
const TURNS: usize = 10;
/// A controller that answers at once, asked without a pause and with that of a cycle; and how often in a turn.
const PACES: [(&str, Duration, usize); 2] =
    [("at once", Duration::ZERO, 1000), ("at once, asked at 10 ms", Duration::from_millis(10), 50)];

/// `txt watch`, which ends with the measurement.
struct Watch(Child, SocketAddr);

impl Drop for Watch {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn main() {
    println!(
        "from request to response, in microseconds\n\
         controller               way       median    99 %  longest"
    );
    let at_once = controller();
    for (name, pause, count) in PACES {
        for with_page in [false, true] {
            compare(name, [at_once; 2], with_page, pause, count);
        }
    }
    // Each serves one program.
    let txts = [(); 2].map(|()| SimulatedTxt::builder().start().expect("ports are free"));
    let addresses = txts.each_ref().map(SimulatedTxt::address);
    compare("simulated TXT", addresses, true, Duration::ZERO, 100);
}

/// Measures both ways, in turns: the first controller directly, the second one through `txt watch`.
fn compare(
    name: &str,
    controllers: [SocketAddr; 2],
    with_page: bool,
    pause: Duration,
    count: usize,
) {
    let watch = watch(controllers[1], with_page);
    let mut direct = Program::online(controllers[0]);
    let mut watched = Program::online(watch.1);
    let (mut without, mut with) = (Vec::new(), Vec::new());
    // The first ones are slower.
    direct.cycles(50, Duration::ZERO);
    watched.cycles(50, Duration::ZERO);
    for _ in 0..TURNS {
        without.extend(direct.cycles(count, pause));
        with.extend(watched.cycles(count, pause));
    }
    let way = if with_page { "page" } else { "no page" };
    let direct = print_row(name, "direct", &mut without);
    let watched = print_row(name, way, &mut with);
    println!("{:>41.1} added in the median", watched - direct);
}

fn print_row(name: &str, way: &str, times: &mut [Duration]) -> f64 {
    times.sort_unstable();
    let micros = |part: f64| {
        let index = ((times.len() - 1) as f64 * part) as usize;
        times[index].as_secs_f64() * 1e6
    };
    let [median, most, longest] = [0.5, 0.99, 1.0].map(micros);
    println!("{name:<24} {way:<8} {median:>7.1} {most:>7.1} {longest:>8.1}");
    median
}

/// A controller that answers each command at once, as often as somebody connects.
fn controller() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = listener.local_addr().expect("it has one");
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            // It ends with the program.
            thread::spawn(move || drop(answer(stream)));
        }
    });
    address
}

fn answer(mut stream: TcpStream) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let (mut compressor, mut value) = (Compressor::new(), 0_u16);
    loop {
        let mut id = [0; 4];
        stream.read_exact(&mut id)?;
        let mut response = Vec::new();
        if CommandId::from_id(u32::from_le_bytes(id)) == Some(CommandId::StartOnline) {
            stream.read_exact(&mut [0; StartOnline::LEN - 4])?;
            ResponseId::StartOnline.emit(&mut response);
        } else {
            let mut header = [0; CmprHeader::LEN];
            header[..4].copy_from_slice(&id);
            stream.read_exact(&mut header[4..])?;
            let header = CmprHeader::parse_command(&header).map_err(std::io::Error::other)?;
            stream.read_exact(&mut vec![0; header.extra_size as usize])?;
            value = value.wrapping_add(1);
            let mut data = Vec::new();
            let crc = compressor.compress(&[value; 52], &mut data);
            let extra_size = data.len() as u32;
            CmprHeader { extra_size, crc, active_extensions: 0 }.emit_response(&mut response);
            response.extend(data);
        }
        stream.write_all(&response)?;
    }
}

fn watch(controller: SocketAddr, with_page: bool) -> Watch {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["watch", &controller.to_string(), "--port", "0", "--no-browser"]);
    if !with_page {
        command.arg("--no-page");
    }
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
    let mut child = child.expect("the program is built");
    let mut line = String::new();
    let out = child.stdout.take().expect("it is piped");
    BufReader::new(out).read_line(&mut line).expect("it says its port");
    let address = line.trim().strip_prefix("main ").and_then(|address| address.parse().ok());
    Watch(child, address.unwrap_or_else(|| panic!("{line:?} is not an address")))
}

/// A program that is online.
struct Program {
    stream: TcpStream,
    compressor: Compressor,
    duty: u16,
}

impl Program {
    fn online(to: SocketAddr) -> Self {
        let mut stream = TcpStream::connect(to).expect("somebody listens");
        stream.set_nodelay(true).expect("it is connected");
        let mut request = Vec::new();
        StartOnline::new().emit(&mut request);
        stream.write_all(&request).expect("it is connected");
        stream.read_exact(&mut [0; 4]).expect("it answers");
        Self { stream, compressor: Compressor::new(), duty: 0 }
    }

    /// How long each of these cycles takes, with such a pause before it.
    fn cycles(&mut self, count: usize, pause: Duration) -> Vec<Duration> {
        (0..count)
            .map(|_| {
                thread::sleep(pause);
                self.cycle().expect("the connection goes on")
            })
            .collect()
    }

    fn cycle(&mut self) -> std::io::Result<Duration> {
        self.duty = (self.duty + 1) % 512;
        let (mut data, mut request) = (Vec::new(), Vec::new());
        let crc = self.compressor.compress(&[self.duty; 27], &mut data);
        let extra_size = data.len() as u32;
        CmprHeader { extra_size, crc, active_extensions: 0 }.emit_command(&mut request);
        request.extend(data);
        let begin = Instant::now();
        self.stream.write_all(&request)?;
        let mut header = [0; CmprHeader::LEN];
        self.stream.read_exact(&mut header)?;
        let header = CmprHeader::parse_response(&header).map_err(std::io::Error::other)?;
        self.stream.read_exact(&mut vec![0; header.extra_size as usize])?;
        Ok(begin.elapsed())
    }
}
