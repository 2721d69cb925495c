//! The maker's program under emulation, which is begun again when it has ended, as on the controller.

use std::fs::{self, File};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::Machine;
use jpeg_encoder::{ColorType, Encoder};

use crate::board::Board;

/// As on the controller, after each end.
const PAUSE: Duration = Duration::from_secs(2);

/// Longer than it takes until the program listens.
const DEADLINE: Duration = Duration::from_secs(30);

/// The user of the program, and its group.
const USER: u32 = 47_000;

/// The controller, at 127.0.0.1:65000.
pub(crate) struct Controller {
    pub(crate) board: Board,
    keeper: Arc<Mutex<Keeper>>,
}

/// Begins the program again.
struct Keeper {
    root: PathBuf,
    log: PathBuf,
    child: Option<Child>,
    /// How it has ended, by itself.
    ends: Vec<String>,
    /// The next end is ours.
    ordered: bool,
}

impl Controller {
    /// Starts the program in this folder, which `.ci/firmware` has made. What it says goes into the file `log`.
    pub(crate) fn start(root: &Path, log: &Path) -> std::io::Result<Self> {
        let socket = root.join("tmp/board");
        // It is there when the last run was killed.
        let _ = fs::remove_file(&socket);
        let board = Board::listen(&socket)?;
        fs::set_permissions(&socket, fs::Permissions::from_mode(0o666))?;
        File::create(log)?;
        fs::write(root.join("tmp/picture.jpg"), picture())?;
        let keeper = Keeper {
            root: root.to_owned(),
            log: log.to_owned(),
            child: None,
            ends: Vec::new(),
            ordered: false,
        };
        let controller = Self { board, keeper: Arc::new(Mutex::new(keeper)) };
        controller.keeper.lock().unwrap().begin()?;
        let keeper = Arc::clone(&controller.keeper);
        thread::spawn(move || loop {
            thread::sleep(Duration::from_millis(10));
            let ended = keeper.lock().unwrap().note_end();
            if ended {
                thread::sleep(PAUSE);
                keeper.lock().unwrap().begin().unwrap();
            }
        });
        controller.wait_for_port();
        Ok(controller)
    }

    /// The times that the program has ended by itself: its status.
    pub(crate) fn ends(&self) -> Vec<String> {
        self.keeper.lock().unwrap().ends.clone()
    }

    /// Forgets the newest of these ends, which there must be.
    pub(crate) fn expect_end(&self) {
        let end = self.keeper.lock().unwrap().ends.pop();
        assert!(end.is_some(), "the program has not ended");
    }

    /// Kills the program, which is back after two seconds.
    pub(crate) fn kill(&self) {
        let mut keeper = self.keeper.lock().unwrap();
        keeper.ordered = true;
        keeper.child.as_mut().unwrap().kill().unwrap();
    }

    /// Waits until the program listens; without a connection, because it serves one client after the other.
    pub(crate) fn wait_for_port(&self) {
        let begin = Instant::now();
        // 65000, and the state LISTEN.
        let listens = |line: &str| line.contains(":FDE8 00000000:0000 0A");
        while !fs::read_to_string("/proc/net/tcp").unwrap().lines().any(listens) {
            assert!(begin.elapsed() < DEADLINE, "the program does not listen: {:?}", self.ends());
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Plugs in a world that moves by the clock.
    pub(crate) fn plug_in(&self, world: World) {
        self.board.plug_in(machine(world), true);
    }

    /// Plugs in a world that moves 10 ms with each exchange, of which there are as many as the program can.
    pub(crate) fn plug_in_unpaced(&self, world: World) {
        self.board.plug_in(machine(world), false);
    }
}

fn machine(world: World) -> Machine {
    let extensions = world.extensions.len();
    Machine::with_world(extensions, world).expect("a right world")
}

impl Keeper {
    fn begin(&mut self) -> std::io::Result<()> {
        let said = File::options().append(true).open(&self.log)?;
        let child = Command::new("chroot")
            .arg(format!("--userspec={USER}:{USER}"))
            .args([self.root.as_os_str(), "/usr/bin/qemu-arm-static".as_ref()])
            .args(["-E", "LD_LIBRARY_PATH=/usr/lib:/usr/lib/arm-linux-gnueabihf"])
            .args(["-E", "LD_PRELOAD=/usr/lib/libdevices.so"])
            .args(["-E", "BOARD=/tmp/board", "-E", "HOME=/tmp"])
            .args(["-E", "SDL_VIDEODRIVER=dummy", "-E", "SDL_AUDIODRIVER=dummy"])
            .args(["/opt/knobloch/TxtControlMain", "/dev/ttyO2", "65000", "1"])
            .stdin(Stdio::null())
            .stdout(said.try_clone()?)
            .stderr(said)
            .spawn()?;
        self.child = Some(child);
        Ok(())
    }

    /// Whether the program has just ended.
    fn note_end(&mut self) -> bool {
        let status = self.child.as_mut().and_then(|child| child.try_wait().unwrap());
        let Some(status) = status else { return false };
        if !std::mem::take(&mut self.ordered) {
            self.ends.push(status.to_string());
        }
        self.child = None;
        true
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        if let Some(child) = &mut self.keeper.lock().unwrap().child {
            // It may have ended just now.
            let _ = child.kill();
        }
    }
}

/// What the camera shows: grey stripes, with a few bytes after the end that the stand-in numbers.
fn picture() -> Vec<u8> {
    let (width, height) = (320, 240);
    let pixels: Vec<u8> = (0..width * height).map(|pixel| (pixel % width) as u8).collect();
    let mut jpeg = Vec::new();
    let encoder = Encoder::new(&mut jpeg, 90);
    encoder.encode(&pixels, width as u16, height as u16, ColorType::Luma).expect("a small picture");
    jpeg.extend([0; 4]);
    jpeg
}
