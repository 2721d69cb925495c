//! The controller under test, which is left stopped unless this program is killed.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use crossbeam_channel::{never, Receiver};
use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::{CommandId, QueryStatusResponse};
use ft_transfer_area::FirmwareVersion;

use super::i2c::I2c;
use super::line::{pause, Line};
use super::outcome::Trouble;
use super::session::{command, packet, Session, NO_I2C};
use crate::seen;
use crate::watch::ports;

/// How long a controller may need to come back. Its program is started 2 s after its end.
const COMES_BACK: Duration = Duration::from_secs(10);

/// After this time the servers of a session that was not ended by StopOnline have ended, also on a busy controller.
const SETTLES: Duration = Duration::from_millis(100);

/// How often it is asked meanwhile.
const ASK_AGAIN: Duration = Duration::from_millis(200);

/// Whether a session holds an I2C connection, and with it the next session can begin at once.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Holds {
    I2c,
    Nothing,
}

pub(super) struct Bench {
    address: SocketAddr,
    interrupted: Receiver<()>,
    pub(super) firmware: FirmwareVersion,
    pub(super) name: String,
    /// The I2C port has accepted a connection.
    has_i2c: bool,
    /// Pictures have come.
    pub(super) has_camera: bool,
    /// How long StopCameraOnline took after the first pictures.
    pub(super) camera_stop: Option<Duration>,
    /// How long a sound plays.
    pub(super) sound: Option<Duration>,
    /// How many pulses M1 gives in a second at full duty.
    pub(super) speed: Option<f64>,
    session: Option<Session>,
    /// A session has ended without its last exchange while an output was on.
    left_moving: bool,
    /// A session has ended whose I2C server may still wait for its client.
    left_waiting: bool,
    /// A session has ended without StopOnline.
    left_online: bool,
}

impl Bench {
    /// Asks the controller what it is.
    pub(super) fn new(address: SocketAddr, interrupted: Receiver<()>) -> Result<Self, Trouble> {
        let firmware = FirmwareVersion::from_code(0);
        let mut bench = Self {
            address,
            interrupted,
            firmware,
            name: String::new(),
            has_i2c: false,
            has_camera: false,
            camera_stop: None,
            sound: None,
            speed: None,
            session: None,
            left_moving: false,
            // Another program may have been online just now.
            left_waiting: true,
            left_online: false,
        };
        let status = ask(&mut bench.main()?)?;
        (bench.firmware, bench.name) = (status.version, status.name());
        Ok(bench)
    }

    /// What the controller answers to QueryStatus, on a connection of its own.
    pub(super) fn status(&self) -> Result<QueryStatusResponse, Trouble> {
        self.main_of_the_same().map(|(_, status)| status)
    }

    /// A connection to the main port, on which the controller has said that it is still the same.
    fn main_of_the_same(&self) -> Result<(Line, QueryStatusResponse), Trouble> {
        let mut main = self.main()?;
        let status = ask(&mut main)?;
        let (name, firmware) = (status.name(), status.version);
        if name != self.name || firmware != self.firmware {
            return Err(Trouble::Another(format!("{name}, firmware {firmware}")));
        }
        Ok((main, status))
    }

    /// A connection to one of the three ports; `None` when the controller refuses.
    pub(super) fn connect(&self, port: seen::Line) -> Result<Option<Line>, Trouble> {
        Line::connect(ports::behind(self.address, port), &self.interrupted)
    }

    /// A connection to the main port.
    pub(super) fn main(&self) -> Result<Line, Trouble> {
        let line = self.connect(seen::Line::Main)?;
        line.ok_or_else(|| Trouble::Lost("the controller refuses a connection".to_owned()))
    }

    pub(super) fn pause(&self, time: Duration) -> Result<(), Trouble> {
        pause(time, &self.interrupted)
    }

    /// For a check that makes no sense without an I2C port.
    pub(super) fn needs_i2c(&self) -> Result<(), Trouble> {
        if self.has_i2c {
            Ok(())
        } else {
            Err(Trouble::NotTried(NO_I2C))
        }
    }

    /// The session that is there, or a new one with a configuration.
    pub(super) fn online(&mut self) -> Result<&mut Session, Trouble> {
        if self.session.is_none() {
            self.begin(Holds::I2c)?.configure(1, Config::default())?;
        }
        self.there()
    }

    /// A new session without a configuration.
    pub(super) fn begin(&mut self, holds: Holds) -> Result<&mut Session, Trouble> {
        self.end()?;
        // Without this, StartOnline could end the firmware.
        if self.left_waiting {
            // A client that comes and goes ends that server.
            drop(self.connect(seen::Line::I2c)?);
        }
        if self.left_waiting || self.left_online {
            self.pause(SETTLES)?;
        }
        let (main, _) = self.main_of_the_same()?;
        self.left_waiting = true;
        self.left_online = true;
        let session = Session::begin(main, self.firmware)?;
        // StartOnline has cleared all outputs.
        self.left_moving = false;
        let session = self.session.insert(session);
        if holds == Holds::I2c {
            let address = ports::behind(self.address, seen::Line::I2c);
            session.i2c = Line::connect(address, &self.interrupted)?.map(I2c::new);
            self.left_waiting = session.i2c.is_none();
            self.has_i2c |= session.i2c.is_some();
        }
        Ok(session)
    }

    /// A session that begins and ends without care, so the firmware's program may end.
    pub(super) fn dare_a_session(&mut self) -> Result<(), Trouble> {
        self.end()?;
        self.left_waiting = true;
        Session::begin(self.main()?, self.firmware)?.end()?;
        Ok(())
    }

    fn there(&mut self) -> Result<&mut Session, Trouble> {
        self.session.as_mut().ok_or_else(|| Trouble::Lost("no session".to_owned()))
    }

    /// Ends the session, if there is one: how long StopOnline took, and its connection, which goes on.
    pub(super) fn end(&mut self) -> Result<Option<(Duration, Line)>, Trouble> {
        let Some(session) = self.session.take() else { return Ok(None) };
        self.left_moving = session.is_moving;
        let ended = session.end()?;
        self.left_moving = false;
        self.left_online = false;
        Ok(Some(ended))
    }

    /// Closes the connections of the session, as a killed program does.
    pub(super) fn drop_session(&mut self) {
        if let Some(session) = self.session.take() {
            self.left_moving |= session.is_moving;
        }
    }

    /// The same, but what still arrives stops the motors.
    fn give_up_session(&mut self) {
        if let Some(session) = self.session.take() {
            self.left_moving |= session.is_moving;
            session.abandon();
        }
    }

    /// Waits until the controller answers again, and stops it if an output may be on: how long that took, `None`
    /// when it does not.
    pub(super) fn comes_back(&mut self) -> Result<Option<Duration>, Trouble> {
        self.give_up_session();
        let begin = Instant::now();
        while begin.elapsed() < COMES_BACK {
            match self.status() {
                Ok(_) => break,
                Err(trouble @ (Trouble::Interrupted | Trouble::Another(_))) => return Err(trouble),
                Err(_) => self.pause(ASK_AGAIN)?,
            }
        }
        let took = begin.elapsed();
        if took >= COMES_BACK {
            return Ok(None);
        }
        if self.left_moving {
            self.begin(Holds::I2c)?;
            self.end()?;
        }
        Ok(Some(took))
    }

    /// Stops the controller, whatever the checks have left: whether it has answered.
    pub(super) fn leave(&mut self) -> bool {
        self.interrupted = never();
        let ended = self.end().is_ok();
        if self.left_moving {
            return self.clear();
        }
        if self.left_waiting {
            // The next program can then begin at once. There may be no such port.
            drop(self.connect(seen::Line::I2c));
        }
        ended
    }

    /// Stops the motors of a session that is gone: StartOnline and an exchange of zeros.
    fn clear(&mut self) -> bool {
        let begin = Instant::now();
        while begin.elapsed() < COMES_BACK {
            if self.begin(Holds::I2c).is_ok() && self.end().is_ok() {
                return true;
            }
            self.give_up_session();
            // This pause can't be interrupted.
            let _ = self.pause(ASK_AGAIN);
        }
        false
    }
}

fn ask(main: &mut Line) -> Result<QueryStatusResponse, Trouble> {
    let answer = command(main, CommandId::QueryStatus, &packet(CommandId::QueryStatus))?;
    QueryStatusResponse::parse(&answer).map_err(|error| Trouble::Lost(error.to_string()))
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.leave();
    }
}
