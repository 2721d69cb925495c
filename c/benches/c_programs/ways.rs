//! The same program in several ways: its duty is what the input was.

use std::ffi::{c_char, c_int, c_void, CString};
use std::io::{self, BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};
use std::{env, mem, ptr, thread};

// Its functions are called as a C program calls them.
use ftMscLib as _;
use ft_transfer_area::transfer_area::{Config, Info, InputValues, OutputValues, LOCAL_IO};
use ft_transfer_area::{Error, TransferAreaComHandler};
use ft_transfer_area_simulator::SimulatedTxt;

/// The argument with which this program is the simulated TXT.
pub(crate) const TXT: &str = "simulated-txt";
const CHANGES: u64 = 1000;
/// The input counts up to this and begins again, so that no late answer looks like one in time.
const VALUES: u64 = 500;

/// Serves one program. Prints its address, and at the end of its input how many changes were answered late.
pub(crate) fn serve() {
    let (note, noted) = mpsc::channel();
    let mut exchange = 0;
    let txt = SimulatedTxt::builder().on_exchange(move |machine| {
        let controller = &mut machine.controllers[LOCAL_IO];
        // The first exchanges are made before the program is asked.
        let asked = exchange > 100 && exchange <= 100 + CHANGES;
        let in_time = i64::from(controller.outputs.duty[0]) == i64::from(controller.uni[0]);
        if asked && note.send(in_time).is_err() {
            return;
        }
        exchange += 1;
        controller.uni[0] = (exchange % VALUES) as i16;
    });
    let txt = txt.start().expect("free ports");
    println!("{}", txt.address());
    io::stdin().lines().for_each(drop);
    let answers: Vec<bool> = noted.try_iter().collect();
    println!("{} of {}", answers.iter().filter(|in_time| **in_time).count(), answers.len());
}

/// The simulated TXT in its own process.
struct Txt {
    child: Child,
    said: io::Lines<BufReader<std::process::ChildStdout>>,
    host: String,
}

impl Txt {
    fn start() -> Self {
        let mut command = Command::new(env::current_exe().expect("this program"));
        command.arg(TXT).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("this program");
        let mut said = BufReader::new(child.stdout.take().expect("a pipe")).lines();
        let host = said.next().expect("its address").expect("a text");
        Self { child, said, host }
    }

    /// How many changes were answered in the next request.
    fn end(mut self) -> String {
        drop(self.child.stdin.take());
        let answered = self.said.next().expect("its result").expect("a text");
        self.child.wait().expect("it ends");
        answered
    }
}

/// Runs a program for a host.
type Way = fn(&str) -> Used;

/// What a way has used, from its first to its last cycle.
struct Used {
    time: Duration,
    cycles: u64,
    tics: u64,
}

pub(crate) fn compare() {
    let ways: [(&str, Way); 6] = [
        ("Rust, wait_cycle", waiting),
        ("Rust, locks each ms", locking),
        ("ftMscLib, answers nothing", sleeping),
        ("ftMscLib, polls the array each ms", polling),
        ("ftMscLib, polls by calls each ms", calling),
        ("tx_run, PrgTic", downloaded),
    ];
    println!("{:<35} {:>10} {:>9}  in the next request", "way", "per cycle", "per tic");
    // Words on the command line choose ways by their names.
    let words: Vec<String> = env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    for (name, way) in ways {
        if !words.is_empty() && !words.iter().any(|word| name.contains(word)) {
            continue;
        }
        let txt = Txt::start();
        let used = way(&txt.host);
        let each = |count: u64| match count {
            0 => String::from("–"),
            _ => format!("{:.1} µs", used.time.as_secs_f64() * 1e6 / count as f64),
        };
        println!("{name:<35} {:>10} {:>9}  {}", each(used.cycles), each(used.tics), txt.end());
        io::stdout().flush().expect("a terminal or a file");
    }
}

/// The processor's time that this process has used.
fn processor_time() -> Duration {
    // SAFETY: all bits 0 are a valid `rusage`, which the call fills.
    let usage = unsafe {
        let mut usage: libc::rusage = mem::zeroed();
        assert_eq!(libc::getrusage(libc::RUSAGE_SELF, &raw mut usage), 0);
        usage
    };
    let part = |time: libc::timeval| {
        Duration::from_secs(time.tv_sec as u64) + Duration::from_micros(time.tv_usec as u64)
    };
    part(usage.ru_utime) + part(usage.ru_stime)
}

/// A Rust program, with what it does until it has had this many cycles.
fn in_rust(host: &str, work: fn(&TransferAreaComHandler, u64) -> Result<(), Error>) -> Used {
    let run = || {
        let handler = TransferAreaComHandler::builder(host).build()?;
        handler.begin_transfer()?;
        let (before, cycles) = (processor_time(), CHANGES + 200);
        work(&handler, cycles)?;
        let time = processor_time() - before;
        handler.end_transfer()?;
        Ok::<_, Error>(Used { time, cycles, tics: 0 })
    };
    run().expect("a simulated TXT")
}

fn waiting(host: &str) -> Used {
    in_rust(host, |handler, cycles| {
        for _ in 0..cycles {
            let mut areas = handler.areas().wait_cycle()?;
            areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
        }
        Ok(())
    })
}

fn locking(host: &str) -> Used {
    in_rust(host, |handler, cycles| {
        while handler.areas().statistics().cycles < cycles {
            let mut areas = handler.areas().lock();
            areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
            drop(areas);
            thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    })
}

/// `PGM_INFO`.
#[repr(C)]
struct Program {
    name: *const c_char,
    state: [u8; 4],
}

/// The beginning of `TA`.
#[repr(C)]
struct Ta {
    info: Info,
    state: [u8; 92],
    program: Program,
    config: Config,
    input: InputValues,
    output: OutputValues,
}

extern "C" {
    fn ftxInitLib() -> u32;
    fn ftxCloseLib() -> u32;
    fn ftxOpenComDevice(port: *const c_char, baud: u32, error: *mut u32) -> *mut c_void;
    fn ftxCloseDevice(device: *mut c_void) -> u32;
    fn ftxStartTransferArea(device: *mut c_void) -> u32;
    fn ftxStopTransferArea(device: *mut c_void) -> u32;
    fn GetTransferAreasArrayAddr(device: *mut c_void) -> *mut Ta;
    fn GetInIOValue(
        device: *mut c_void,
        area: c_int,
        input: c_int,
        value: *mut i16,
        overrun: *mut u32,
    ) -> u32;
    fn SetOutMotorValues(
        device: *mut c_void,
        area: c_int,
        motor: c_int,
        plus: c_int,
        minus: c_int,
    ) -> u32;
    fn ft_tx_run(
        init: extern "C" fn(*mut Ta, c_int),
        tic: extern "C" fn(*mut Ta, c_int) -> c_int,
    ) -> c_int;
}

/// What a program of the library does each millisecond. It gets its device and its areas.
type Work = unsafe fn(*mut c_void, *mut Ta);

fn sleeping(host: &str) -> Used {
    with_library(host, None)
}

fn polling(host: &str) -> Used {
    /// # Safety
    ///
    /// The areas are those of an open device.
    unsafe fn work(_: *mut c_void, areas: *mut Ta) {
        // SAFETY: as the caller promises; volatile, because the library reads and writes them, too.
        unsafe {
            let value = (&raw const (*areas).input.uni).cast::<i16>().read_volatile();
            (&raw mut (*areas).output.duty).cast::<i16>().write_volatile(value);
        }
    }
    with_library(host, Some(work))
}

fn calling(host: &str) -> Used {
    /// # Safety
    ///
    /// The device is open.
    unsafe fn work(device: *mut c_void, _: *mut Ta) {
        let (mut value, mut overrun) = (0, 0);
        // SAFETY: the device is open, and both places are there during the call.
        unsafe {
            GetInIOValue(device, 0, 0, &raw mut value, &raw mut overrun);
            SetOutMotorValues(device, 0, 0, value.into(), 0);
        }
    }
    with_library(host, Some(work))
}

fn with_library(host: &str, work: Option<Work>) -> Used {
    let host = CString::new(host).expect("no 0 in it");
    // SAFETY: the calls of a program, in their order, with places that are there during each call.
    unsafe {
        assert_eq!(ftxInitLib(), 0);
        let device = ftxOpenComDevice(host.as_ptr(), 38_400, ptr::null_mut());
        assert!(!device.is_null());
        assert_eq!(ftxStartTransferArea(device), 0);
        let areas = GetTransferAreasArrayAddr(device);
        let (before, begun) = (processor_time(), Instant::now());
        let whole = Duration::from_millis(10 * (CHANGES + 200));
        while begun.elapsed() < whole {
            match work {
                Some(work) => {
                    work(device, areas);
                    thread::sleep(Duration::from_millis(1));
                }
                None => thread::sleep(whole),
            }
        }
        let time = processor_time() - before;
        let cycles = begun.elapsed().as_millis() as u64 / 10;
        ftxStopTransferArea(device);
        ftxCloseDevice(device);
        ftxCloseLib();
        Used { time, cycles, tics: 0 }
    }
}

const TICS: u32 = 10 * (CHANGES as u32 + 200);
static TIC: AtomicU32 = AtomicU32::new(0);
static BEFORE: AtomicU64 = AtomicU64::new(0);
static AFTER: AtomicU64 = AtomicU64::new(0);

extern "C" fn init(_: *mut Ta, _: c_int) {}

extern "C" fn tic(areas: *mut Ta, _: c_int) -> c_int {
    let now = || processor_time().as_micros() as u64;
    // SAFETY: during a call the areas are the program's.
    unsafe {
        *(&raw mut (*areas).output.duty).cast() = *(&raw const (*areas).input.uni).cast::<i16>()
    };
    match TIC.fetch_add(1, Ordering::Relaxed) {
        0 => BEFORE.store(now(), Ordering::Relaxed),
        TICS => {
            AFTER.store(now(), Ordering::Relaxed);
            return 0;
        }
        _ => {}
    }
    0x7FFF
}

fn downloaded(host: &str) -> Used {
    env::set_var("FT_TXT_HOST", host);
    // SAFETY: both are functions of a program as it expects them.
    assert_eq!(unsafe { ft_tx_run(init, tic) }, 0);
    let used = AFTER.load(Ordering::Relaxed) - BEFORE.load(Ordering::Relaxed);
    let time = Duration::from_micros(used);
    Used { time, cycles: u64::from(TICS) / 10, tics: TICS.into() }
}
