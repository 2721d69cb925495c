//! Several simulated TXTs whose worlds share workpieces.

use std::time::Instant;
use std::{fmt, io};

use ft_transfer_area::IoError;

use crate::builder::SimulatedTxtBuilder;
use crate::error::Error;
use crate::world::Factory;
use crate::{SimulatedTxt, END_LIMIT};

/// How many ports each simulated TXT has.
const PORTS: u16 = 3;

/// The greatest main port, because two more ports follow it.
const MAIN_PORT_MAX: i64 = (u16::MAX - (PORTS - 1)) as i64;

/// A simulated TXT for each controller of a [`Factory`], until it is dropped.
///
/// ```
/// use ft_transfer_area_simulator::world::{Factory, Piece};
/// use ft_transfer_area_simulator::SimulatedFactory;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let factory = Factory::shipped("factory")?;
/// let factory = SimulatedFactory::start(factory, 0, |_, builder| builder.lock_step())?;
/// let robot = factory.txt("robot").expect("it is one of them");
/// println!("the robot is at port {}", robot.port());
/// robot.with_machine(|machine| {
///     let world = machine.world_mut().expect("each has one");
///     assert!(world.put(Piece::Red, "delivery"));
/// });
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct SimulatedFactory {
    txts: Vec<(String, SimulatedTxt)>,
}

impl Drop for SimulatedFactory {
    fn drop(&mut self) {
        let deadline = Instant::now() + END_LIMIT;
        for (_, txt) in &mut self.txts {
            txt.end_by = Some(deadline);
            txt.shared.stop_until(deadline);
        }
    }
}

impl SimulatedFactory {
    /// Starts a simulated TXT for each controller, in order. Does not block.
    ///
    /// The first one has this main port, and the others follow with three ports each; with 0 each has
    /// any three free ports. Each is set up by the function, which gets the controller's name. Unless it
    /// sets another one, the name that a controller reports, and that its lines in the log begin with, is its
    /// own. A world or a main port that it sets is replaced.
    ///
    /// # Errors
    ///
    /// [`Error::World`] when the factory has a mistake, [`Error::OutOfRange`] when there is no room for all
    /// ports, and the errors of [`SimulatedTxtBuilder::start`]. Then nothing is started.
    pub fn start(
        factory: Factory,
        port: u16,
        mut set_up: impl FnMut(&str, SimulatedTxtBuilder) -> SimulatedTxtBuilder,
    ) -> Result<Self, Error> {
        let floors = factory.floors()?;
        if let Some(others @ 1..) = factory.controllers.len().checked_sub(1) {
            let others = i64::try_from(others).unwrap_or(i64::MAX);
            let most = MAIN_PORT_MAX.saturating_sub(others.saturating_mul(PORTS.into()));
            Error::check_range("main port of the first controller", port, 0..=most)?;
        }
        let mut txts = Vec::with_capacity(floors.len());
        let mut main_port = port;
        for ((name, world), floor) in factory.controllers.into_iter().zip(floors) {
            let builder = match name.as_str() {
                "" => SimulatedTxt::builder(),
                name => SimulatedTxt::builder().device_name(name).log_name(name),
            };
            let builder = set_up(&name, builder).in_factory(main_port, world, floor);
            let txt = builder.start().map_err(|error| named(&name, error))?;
            txts.push((name, txt));
            main_port = if port == 0 { 0 } else { main_port.saturating_add(PORTS) };
        }
        Ok(Self { txts })
    }

    /// The simulated TXT of the controller with this name.
    pub fn txt(&self, name: &str) -> Option<&SimulatedTxt> {
        self.txts().find(|(known, _)| *known == name).map(|(_, txt)| txt)
    }

    /// The simulated TXTs, with the names of their controllers, one by one.
    pub fn into_txts(mut self) -> Vec<(String, SimulatedTxt)> {
        std::mem::take(&mut self.txts)
    }

    /// The simulated TXTs with the names of their controllers, in order.
    pub fn txts(&self) -> impl Iterator<Item = (&str, &SimulatedTxt)> {
        self.txts.iter().map(|(name, txt)| (name.as_str(), txt))
    }
}

/// The error with the name of the controller that could not be started.
fn named(name: &str, error: Error) -> Error {
    match error {
        Error::NotStarted { cause } if !name.is_empty() => {
            let kind = cause.kind();
            let cause = io::Error::new(kind, Named { name: name.to_owned(), cause });
            Error::NotStarted { cause: cause.into() }
        }
        error => error,
    }
}

/// What the operating system said of a controller.
#[derive(Debug)]
struct Named {
    name: String,
    cause: IoError,
}

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.name, self.cause)
    }
}

impl std::error::Error for Named {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&*self.cause)
    }
}
