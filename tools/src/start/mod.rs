//! `txt start`: a page that finds controllers, and starts the pages of other commands. Also what a double-click shows.

mod page;
mod running;

use std::net::Ipv4Addr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::Semaphore;

use self::running::Running;
use crate::web::access::Access;
use crate::web::Site;
use crate::{find, interrupt, print};

/// How often to look whether it should end.
const LOOK: Duration = Duration::from_millis(100);
/// How long nobody may look at the page while nothing runs. A browser that sleeps asks once a minute, or not at all.
const ALONE: Duration = Duration::from_secs(15 * 60);

const AFTER: &str = "\
The page lists the controllers that txt find finds, with a button for the panel of each, simulated
machines, and the lessons. What is started on it ends with it: by Ctrl-C, by its button, and when
nothing runs and nobody has looked at it for 15 minutes.

Example: txt start 192.168.1.17";

/// Show a page to start from: controllers, simulated machines, lessons
#[derive(clap::Args, Default)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    #[command(flatten)]
    places: find::Places,
    /// Port of the page; 0 is a free one
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    /// Do not open the browser
    #[arg(long)]
    no_browser: bool,
}

/// What the page knows and does.
struct Start {
    access: Arc<Access>,
    places: find::Places,
    running: Mutex<Vec<Running>>,
    /// One search or start at a time.
    turn: Arc<Semaphore>,
    seen: Mutex<Instant>,
    should_end: AtomicBool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver()?;
    let site = Site::listen((Ipv4Addr::LOCALHOST, args.port).into())?;
    let start = Arc::new(Start {
        access: Arc::clone(&site.access),
        places: args.places,
        running: Mutex::default(),
        turn: Arc::new(Semaphore::new(1)),
        seen: Mutex::new(Instant::now()),
        should_end: AtomicBool::new(false),
    });
    let url = site.url(Ipv4Addr::LOCALHOST.into());
    print::line(&url)?;
    print::line("Ctrl-C ends it, with all that was started on it.")?;
    let router = page::router(Arc::clone(&start))?;
    let _opening = site.serve(router, (!args.no_browser).then_some(url))?;
    while interrupted.recv_timeout(LOOK).is_err() && !start.is_over() {}
    running::end(std::mem::take(&mut *start.running()));
    Ok(())
}

impl Start {
    fn running(&self) -> MutexGuard<'_, Vec<Running>> {
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        running.retain_mut(|one| !one.has_ended());
        running
    }

    fn seen(&self) -> MutexGuard<'_, Instant> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_over(&self) -> bool {
        self.should_end.load(Ordering::Relaxed)
            || (self.seen().elapsed() > ALONE && self.running().is_empty())
    }
}

/// Whether a file manager has started this program: nobody reads what it prints, and there is a screen. A pipe has
/// somebody who reads it.
#[cfg(unix)]
pub(crate) fn is_double_click() -> bool {
    use std::io::{stdin, stdout, IsTerminal};
    use std::os::unix::fs::FileTypeExt;

    let is_pipe = std::fs::metadata("/dev/stdout").is_ok_and(|out| out.file_type().is_fifo());
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let has_screen = ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(is_set);
    has_screen && !is_pipe && !stdin().is_terminal() && !stdout().is_terminal()
}

/// Other systems open a terminal for it, as for who has typed its name.
#[cfg(not(unix))]
pub(crate) fn is_double_click() -> bool {
    false
}
