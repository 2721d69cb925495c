//! How a simulated TXT is set up and started.

use std::fmt;
use std::io;
use std::net::{IpAddr, Ipv4Addr};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crossbeam_channel::{bounded, Sender};
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::FirmwareVersion;

use crate::camera::server::{CameraServer, CameraSettings};
use crate::camera::{CameraConnection, Clients};
use crate::error::Error;
use crate::fault::{Fault, DELAYS};
use crate::i2c::server::I2cServer;
use crate::machine::journal::{notice, About, Subject};
use crate::machine::Machine;
use crate::server::faults::Faults;
use crate::server::port::{Port, WRITE_LIMIT};
use crate::server::ports::Ports;
use crate::server::protocol::{Script, Settings};
use crate::server::reserved::Reserved;
use crate::server::shared::Shared;
use crate::server::Server;
use crate::world::floor::OwnFloor;
use crate::world::World;
use crate::SimulatedTxt;

/// How much of a pause passes in the machine, if its client is not cut off before. So after hours in a debugger,
/// or on a computer that was suspended, nothing is far away from where it was, and nothing takes long to compute.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// The shortest idle limit.
const IDLE_LIMIT_MIN: Duration = Duration::from_millis(5);

/// The settings of a simulated TXT.
#[must_use = "nothing is simulated before `start`"]
pub struct SimulatedTxtBuilder {
    extensions: Option<usize>,
    firmware: FirmwareVersion,
    microphone: Option<bool>,
    device_name: String,
    subject: Subject,
    pace: Duration,
    board_watchdog: Option<Duration>,
    strict: bool,
    idle_limit: Duration,
    faults: Vec<Fault>,
    seed: u64,
    lock_step: bool,
    script: Script,
    ip: IpAddr,
    port: u16,
    camera_port: Option<u16>,
    i2c_port: Option<u16>,
    camera: CameraSettings,
    camera_connection: CameraConnection,
    world: Option<World>,
    /// For a controller of a factory: what it has in common with the others. Its world was checked.
    floor: Option<Option<OwnFloor>>,
}

impl SimulatedTxtBuilder {
    /// The defaults.
    pub(super) fn new() -> Self {
        Self {
            extensions: None,
            firmware: FirmwareVersion::new(4, 7, 0),
            microphone: None,
            device_name: String::from("TX2013"),
            subject: None,
            pace: Duration::from_millis(10),
            board_watchdog: None,
            strict: false,
            idle_limit: Duration::from_secs(5),
            faults: Vec::new(),
            seed: 0,
            lock_step: false,
            script: Box::new(|_| {}),
            ip: IpAddr::V4(Ipv4Addr::LOCALHOST),
            port: 0,
            camera_port: None,
            i2c_port: None,
            camera: CameraSettings {
                start_up: Duration::from_millis(1500),
                tables: true,
                stall_after: None,
            },
            camera_connection: CameraConnection::default(),
            world: None,
            floor: None,
        }
    }

    /// Makes it a controller of a factory, with this main port and this checked world.
    pub(super) fn in_factory(mut self, port: u16, world: World, floor: Option<OwnFloor>) -> Self {
        (self.port, self.world, self.floor) = (port, Some(world), Some(floor));
        self
    }

    /// The number of extensions, 0..=8, all alive at the start. The default is as many as the
    /// [`world`](Self::world) has, and 0 without one. If the world has more, the last ones are left
    /// out and a warning is logged.
    pub fn extensions(mut self, extensions: usize) -> Self {
        self.extensions = Some(extensions);
        self
    }

    /// The firmware version that is reported. It decides whether the compressed exchange has the
    /// microphone values, unless [`microphone`](Self::microphone) is set. The default is 4.7.0.
    pub fn firmware(mut self, firmware: FirmwareVersion) -> Self {
        self.firmware = firmware;
        self
    }

    /// Whether the compressed responses have the two microphone values of each controller. By
    /// default they do from firmware 4.2.4 on.
    ///
    /// This is for tests of a client: a response does not say how many values it has, and a client
    /// may meet a firmware that sends another number of values than its version promises.
    pub fn microphone(mut self, microphone: bool) -> Self {
        self.microphone = Some(microphone);
        self
    }

    /// The name that is reported: as many of its characters as fit into 16 bytes of UTF-8. The
    /// default is `TX2013`.
    pub fn device_name(mut self, device_name: &str) -> Self {
        device_name.clone_into(&mut self.device_name);
        self
    }

    /// What the lines that it logs begin with, before a colon, so that each says of which one of several it is. By
    /// default nothing. Those of a [factory](super::SimulatedFactory) have their names.
    pub fn log_name(mut self, name: &str) -> Self {
        self.subject = Some(name.into());
        self
    }

    /// The time from one exchange response to the next, if the client does not take longer. The
    /// default is 10 ms, the maximum an hour. A response that a busy computer sends late, by less than
    /// half of this time, does not move those that follow.
    ///
    /// The machine follows the clock then, from StartOnline until its client has left. So motors turn
    /// on while the client pauses, until the [idle limit](Self::idle_limit) ends the connection. If
    /// that is more than a minute, a minute of each pause passes in the machine, and then it stands
    /// still until the next command.
    ///
    /// With [`Duration::ZERO`] a response is sent immediately, and each exchange is a step of 10 ms
    /// in the machine, whatever the clock says.
    pub fn pace(mut self, pace: Duration) -> Self {
        self.pace = pace;
        self
    }

    /// Lets time pass in the machine only with exchanges, for tests with the same result in every run:
    /// the same requests get the same responses, even if the computer is busy or the program slow.
    ///
    /// * A response is sent immediately. Each exchange is still a step of the [`pace`](Self::pace), or
    ///   10 ms when that is zero.
    /// * There is no idle limit: a program may pause, also in a debugger, for as long as it likes.
    /// * For a fault that delays a response, that time passes in the machine, and the response is sent
    ///   immediately.
    /// * The camera uses machine time too, for its start-up and its frames. Which frame a client gets
    ///   still depends on when it acknowledges the frame before.
    ///
    /// ```
    /// use ft_transfer_area_simulator::world::World;
    /// use ft_transfer_area_simulator::SimulatedTxt;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let txt = SimulatedTxt::builder().world(World::default()).lock_step().start()?;
    /// # Ok(())
    /// # }
    /// ```
    pub fn lock_step(mut self) -> Self {
        self.lock_step = true;
        self
    }

    /// How long a connection may be without commands before it is closed. The default is 5 s. A
    /// limit of less than 5 ms is 5 ms, and [`Duration::MAX`] is none.
    pub fn idle_limit(mut self, idle_limit: Duration) -> Self {
        self.idle_limit = idle_limit.max(IDLE_LIMIT_MIN);
        self
    }

    /// After which time without an exchange the I/O board clears all its outputs. By default it never does.
    ///
    /// The program of the controller sends the board nothing when a connection ends, by StopOnline or otherwise
    /// (measured on the maker's firmware 4.7.0 under emulation). So the outputs keep their last values, unless the board
    /// has a watchdog of its own. Whether a real one has is not known; none is assumed.
    ///
    /// In [lock-step](Self::lock_step) and without a pace this time passes in the machine as soon as the client has left.
    pub fn board_watchdog(mut self, limit: Duration) -> Self {
        self.board_watchdog = Some(limit);
        self
    }

    /// Whether it does all that the maker's firmware 4.7.0 does, also what a correct client does not cause. The default
    /// is `false`: then it is kinder, and reports it as one of the [oddities](Machine::oddities) of the machine.
    ///
    /// The [guide](https://docs.rs/ft-transfer-area/latest/ft_transfer_area/guide/simulator/#compared-with-the-makers-firmware)
    /// (`docs/simulator.md`) has a table of all that differs.
    pub fn strict(mut self, strict: bool) -> Self {
        self.strict = strict;
        self
    }

    /// Injects a fault, in addition to those injected before.
    pub fn fault(mut self, fault: Fault) -> Self {
        self.faults.push(fault);
        self
    }

    /// The seed of all random numbers: the times of [jitter](super::FaultKind::Jitter). The default
    /// is 0.
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Sets a script, in place of an earlier one.
    ///
    /// It is called for each exchange: after the machine has taken over the outputs and its time has
    /// passed, and before the response is built. So it may set any input. The machine is locked, so
    /// the script must not call [`SimulatedTxt::with_machine`]. When it panics, the simulated TXT
    /// closes its connections and answers no more.
    pub fn on_exchange(mut self, script: impl FnMut(&mut Machine) + Send + 'static) -> Self {
        self.script = Box::new(script);
        self
    }

    /// The address of this computer at which it listens. The default is 127.0.0.1, for clients on this computer;
    /// with 0.0.0.0 clients on others reach it, too, and whoever reaches it can drive it.
    pub fn bind(mut self, ip: IpAddr) -> Self {
        self.ip = ip;
        self
    }

    /// The port of the main connection, 0 for any free port. The default is 0, the maximum 65533
    /// unless the other ports are set.
    ///
    /// Many clients expect the camera and I2C ports right after this one. So these are the next two
    /// ports, also with 0, unless they are set.
    pub fn port(mut self, port: u16) -> Self {
        self.port = port;
        self
    }

    /// The port of the camera connection, 0 for any free port. The default is the main
    /// [`port`](Self::port) plus 1.
    pub fn camera_port(mut self, port: u16) -> Self {
        self.camera_port = Some(port);
        self
    }

    /// The port of the I2C connection, 0 for any free port. The default is the main
    /// [`port`](Self::port) plus 2.
    pub fn i2c_port(mut self, port: u16) -> Self {
        self.i2c_port = Some(port);
        self
    }

    /// The time from StartCameraOnline until the camera serves, by the clock. The default is 1.5 s.
    /// With [`Duration::MAX`] it never serves.
    pub fn camera_start_up(mut self, start_up: Duration) -> Self {
        self.camera.start_up = start_up;
        self
    }

    /// Whether the camera's frames have their Huffman tables (DHT), which are those of Annex K of
    /// the JPEG standard. USB cameras often leave them out. The default is `true`.
    pub fn camera_tables(mut self, tables: bool) -> Self {
        self.camera.tables = tables;
        self
    }

    /// After how many frames each camera connection sends nothing more, but stays open. By default
    /// none stops.
    pub fn camera_stall_after(mut self, frames: u64) -> Self {
        self.camera.stall_after = Some(frames);
        self
    }

    /// When the camera accepts connections. The default is [`CameraConnection::Waits`].
    ///
    /// ```
    /// use ft_transfer_area_simulator::{CameraConnection, SimulatedTxt};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let txt = SimulatedTxt::builder().camera_connection(CameraConnection::Txt40).start()?;
    /// # Ok(())
    /// # }
    /// ```
    pub fn camera_connection(mut self, connection: CameraConnection) -> Self {
        self.camera_connection = connection;
        self
    }

    /// Plugs in a world, in place of an earlier one. [`World::default`], for example, has something for
    /// each sample of this crate.
    ///
    /// Without a world, the program sets the inputs, and each motor output has a motor that turns
    /// exactly as far as it is commanded. So a test decides everything that its program sees.
    pub fn world(mut self, world: World) -> Self {
        self.world = Some(world);
        self
    }

    /// Starts to listen on all three ports. Does not block.
    ///
    /// # Errors
    ///
    /// [`Error::TooManyExtensions`] when more than 8 extensions are asked for, [`Error::World`] when the
    /// world has a mistake, [`Error::OutOfRange`] when there is no room for the other ports after
    /// the main one, or the pace or a fault's delay is more than an hour, [`Error::NotStarted`]
    /// when a port is taken or the operating system refuses a socket or a thread.
    pub fn start(mut self) -> Result<SimulatedTxt, Error> {
        let machine = self.machine()?;
        let (ip, main) = (self.ip, self.port);
        let ports = Ports { ip, main, camera: self.camera_port, i2c: self.i2c_port };
        ports.check()?;
        Error::check_millis("pace in ms", self.pace, DELAYS)?;
        self.faults.iter().try_for_each(Fault::check)?;
        self.listen(ports, machine).map_err(|error| Error::NotStarted { cause: error.into() })
    }

    fn machine(&mut self) -> Result<Machine, Error> {
        let world = self.world.take();
        let in_world = world.as_ref().map_or(0, |world| world.extensions.len());
        let extensions = self.extensions.unwrap_or(in_world);
        if self.extensions.is_some_and(|asked_for| asked_for > MAX_EXTENSIONS) {
            return Err(Error::TooManyExtensions { given: extensions });
        }
        if extensions < in_world {
            let first = extensions + 1;
            let _about = About::begin(self.subject.clone());
            notice!(Warn, "the world's extensions from {first} on are left out");
        }
        match (world, self.floor.take()) {
            (Some(world), Some(floor)) => Ok(Machine::on_floor(extensions, &world, floor)),
            (Some(world), None) => Machine::with_world(extensions, world),
            (None, _) => Ok(Machine::new(extensions)),
        }
    }

    fn listen(mut self, ports: Ports, mut machine: Machine) -> io::Result<SimulatedTxt> {
        if self.lock_step {
            machine.take_pictures_by_machine_time();
            self.idle_limit = Duration::MAX;
        }
        if self.lock_step && !self.pace.is_zero() {
            machine.go_by_steps(self.pace);
        } else if !self.pace.is_zero() {
            // A client may be silent from a response on, which comes up to a pace after its command.
            machine.follow_system_clock(self.pace + self.idle_limit.min(LONGEST_PAUSE));
        }
        machine.set_watchdog(self.board_watchdog);
        if self.strict {
            machine.be_strict();
            self.camera_connection = CameraConnection::Txt;
        }
        let [listener, camera_listener, i2c_listener] = ports.listen()?;
        let (lives, alive) = bounded(0);
        let txt = SimulatedTxt {
            address: listener.local_addr()?,
            camera_port: camera_listener.local_addr()?.port(),
            i2c_port: i2c_listener.local_addr()?.port(),
            shared: Arc::new(Shared::new(machine, self.subject.clone())),
            alive,
            end_by: None,
        };
        let port = |name, is_camera| Port::new(Arc::clone(&txt.shared), name, is_camera);
        let mut camera_port = port("camera", true)?;
        let (clients, camera_client_finder) =
            Clients::of(self.camera_connection, camera_listener, &mut camera_port)?;
        let camera = CameraServer { clients, port: camera_port, settings: self.camera };
        let mut i2c_port = port("I2C", true)?;
        let reserved = if self.strict {
            Some(Reserved::instead_of(i2c_listener)?)
        } else {
            i2c_port.listen(i2c_listener)?;
            None
        };
        let (idle_limit, write_limit) = (self.idle_limit, WRITE_LIMIT);
        let i2c = I2cServer { port: i2c_port, idle_limit, write_limit, missing: None, reserved };
        let mut main_port = port("main", false)?;
        main_port.listen(listener)?;
        let server = Server {
            port: main_port,
            settings: self.settings(),
            pace: if self.lock_step { Duration::ZERO } else { self.pace },
            lock_step: self.lock_step,
            idle_limit: self.idle_limit,
            faults: Faults::new(self.faults, self.seed),
            script: self.script,
            camera_client_finder,
            reserved: self.strict.then(|| Reserved::open(txt.address)),
            takes_its_time: self.strict && !self.lock_step && !self.pace.is_zero(),
        };
        // If a thread can't be spawned, dropping `txt` ends the earlier ones.
        let subject = &self.subject;
        spawn("simulated-txt", subject, &lives, move || server.run())?;
        spawn("simulated-camera", subject, &lives, move || camera.run())?;
        spawn("simulated-i2c", subject, &lives, move || i2c.run())?;
        Ok(txt)
    }

    fn settings(&self) -> Settings {
        let device_name = name_bytes(&self.device_name);
        let answers_as = match self.microphone {
            None => self.firmware,
            Some(false) => FirmwareVersion::OLDEST_SUPPORTED,
            Some(true) => self.firmware.max(FirmwareVersion::WITH_MICROPHONE),
        };
        Settings { device_name, firmware: self.firmware, words: answers_as.response_words() }
    }
}

/// The characters of a name that fit, padded with NUL.
fn name_bytes(name: &str) -> [u8; 16] {
    let mut bytes = [0; 16];
    let ends = name.char_indices().map(|(start, character)| start + character.len_utf8());
    let end = ends.take_while(|end| *end <= bytes.len()).last().unwrap_or(0);
    for (byte, given) in bytes.iter_mut().zip(name.bytes().take(end)) {
        *byte = given;
    }
    bytes
}

/// Starts a thread whose lines are about this simulated TXT. The sender ends with it.
fn spawn(
    name: &str,
    subject: &Subject,
    lives: &Sender<()>,
    run: impl FnOnce() + Send + 'static,
) -> io::Result<()> {
    let (subject, lives) = (subject.clone(), lives.clone());
    let run = move || {
        let _lives = lives;
        let _about = About::begin(subject);
        if catch_unwind(AssertUnwindSafe(run)).is_err() {
            notice!(Error, "a thread of the simulated TXT panicked, perhaps in its script");
        }
    };
    thread::Builder::new().name(String::from(name)).spawn(run).map(drop)
}

impl fmt::Debug for SimulatedTxtBuilder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedTxtBuilder")
            .field("extensions", &self.extensions)
            .field("firmware", &self.firmware)
            .field("microphone", &self.microphone)
            .field("device_name", &self.device_name)
            .field("pace", &self.pace)
            .field("faults", &self.faults)
            .field("seed", &self.seed)
            .field("lock_step", &self.lock_step)
            .field("camera", &self.camera)
            .field("world", &self.world)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_cut_between_its_characters() {
        for (name, reported) in [
            ("", ""),
            ("ROBOTICS TXT 001", "ROBOTICS TXT 001"),
            ("ROBOTICS TXT 0012", "ROBOTICS TXT 001"),
            ("ROBOTICS TXT 00ä", "ROBOTICS TXT 00"),
            ("ROBOTICS TXT 0🤖", "ROBOTICS TXT 0"),
            ("ROBOTICS TXT ä0x", "ROBOTICS TXT ä0"),
        ] {
            let bytes = name_bytes(name);
            assert_eq!(std::str::from_utf8(&bytes).unwrap().trim_end_matches('\0'), reported);
        }
    }

    #[test]
    fn the_microphone_is_as_the_firmware_promises_or_as_asked_for() {
        for (patch, promised) in [(3, 50), (4, 52)] {
            let builder = || SimulatedTxtBuilder::new().firmware(FirmwareVersion::new(4, 2, patch));
            assert_eq!(builder().settings().words, promised);
            for (asked_for, words) in [(false, 50), (true, 52)] {
                assert_eq!(builder().microphone(asked_for).settings().words, words);
            }
        }
    }
}
