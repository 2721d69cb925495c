//! The controller of a model, and the connection to it.

use std::cell::RefCell;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use shuttle::sync::{Mutex, MutexGuard};
use shuttle::thread;

use crate::client::{I2cAccess, Network, TimeLimits};
use crate::error::Error;
use crate::exchange::{Exchange, Inputs, Outgoing};
use crate::firmware::FirmwareVersion;
use crate::handler::sync::{now, pass};
use crate::wire::{ExchangeData, ExchangeDataResponse, QueryStatusResponse, StartCameraOnline};

/// How long an exchange takes.
const PACE: Duration = Duration::from_millis(10);

thread_local! {
    /// The controller of the model that runs in this thread of the system.
    static CONTROLLER: RefCell<Option<Arc<Controller>>> = const { RefCell::new(None) };
}

/// Answers each request, and carries out each command at once.
pub(super) struct Controller(Mutex<State>);

#[derive(Default)]
struct State {
    requests: Vec<Request>,
    connections: usize,
    /// The numbers of the requests with which the connection is lost.
    losing: Vec<usize>,
}

/// What has come in.
#[derive(Clone, Debug)]
pub(super) struct Request {
    pub(super) outputs: ExchangeData,
    /// The number of its connection, from 1 on.
    pub(super) connection: usize,
    /// When it came in.
    pub(super) at: Instant,
}

impl Controller {
    /// The controller of this model.
    pub(super) fn new() -> Arc<Self> {
        let controller = Arc::new(Self(Mutex::default()));
        CONTROLLER.set(Some(Arc::clone(&controller)));
        controller
    }

    /// The connection is lost with the requests of these numbers, from 1 on.
    pub(super) fn lose(&self, requests: &[usize]) {
        self.state().losing = requests.to_vec();
    }

    pub(super) fn requests(&self) -> Vec<Request> {
        self.state().requests.clone()
    }

    /// Waits for a request like this.
    pub(super) fn wait_for(&self, matches: impl Fn(&Request) -> bool) {
        while !self.state().requests.iter().any(&matches) {
            thread::yield_now();
        }
    }

    /// Whether a motor M1 was sent to this distance, with a command of its own.
    pub(super) fn has_driven(&self, distance: u16) -> bool {
        let requests = self.requests();
        requests.iter().any(|request| request.outputs.distance[0] == distance)
    }

    /// Whether this sound was played.
    pub(super) fn has_played(&self, sound: u16) -> bool {
        self.requests().iter().any(|request| request.outputs.sound_index == sound)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Another thread may run before the request comes in, and before the response does.
    fn exchange(&self, connection: usize, outputs: ExchangeData) -> Result<Vec<u8>, Error> {
        let number = {
            let mut state = self.state();
            state.requests.push(Request { outputs, connection, at: now() });
            state.requests.len()
        };
        pass(PACE);
        thread::yield_now();
        if self.state().losing.contains(&number) {
            return Err(Error::ConnectionClosed { command: "ExchangeData", received: 0 });
        }
        let response = ExchangeDataResponse {
            uni: [number as i16; 8],
            motor_command_id: outputs.motor_command_id,
            counter_reset_id: outputs.counter_reset_id,
            sound_command_id: outputs.sound_command_id,
            ..ExchangeDataResponse::default()
        };
        let mut bytes = Vec::new();
        response.emit(&mut bytes);
        Ok(bytes)
    }
}

/// The connection, with the calls of the library's own client that the handler uses.
pub(crate) struct TxtClient {
    controller: Arc<Controller>,
    connection: usize,
}

impl TxtClient {
    pub(crate) fn connect_within(
        _network: &'static dyn Network,
        _host: &str,
        _port: u16,
        _limits: TimeLimits,
    ) -> Result<Self, Error> {
        let controller = CONTROLLER.with_borrow(Clone::clone).expect("the model has a controller");
        let connection = {
            let mut state = controller.state();
            state.connections += 1;
            state.connections
        };
        Ok(Self { controller, connection })
    }

    pub(crate) fn address(&self) -> Option<SocketAddr> {
        None
    }

    /// The models have no I2C.
    pub(crate) fn set_i2c_access(&mut self, _access: I2cAccess) {}

    pub(crate) fn query_status(&mut self) -> Result<QueryStatusResponse, Error> {
        let version = FirmwareVersion::OLDEST_SUPPORTED;
        Ok(QueryStatusResponse { device_name: *b"ROBOTICS TXT 001", version })
    }

    pub(crate) fn start_online(&mut self) -> Result<(), Error> {
        Ok(())
    }

    pub(crate) fn update_configs(
        &mut self,
        exchange: &mut Exchange,
        areas: &[Outgoing],
        goes_on: impl Fn() -> bool,
    ) -> Result<u64, Error> {
        Ok(std::iter::from_fn(|| exchange.next_config(areas, &goes_on)).count() as u64)
    }

    pub(crate) fn exchange<'a>(
        &mut self,
        exchange: &'a mut Exchange,
        areas: &[Outgoing],
    ) -> Result<&'a Inputs, Error> {
        let mut request = Vec::new();
        exchange.request_of(areas, &mut request)?;
        let outputs = ExchangeData::parse(&request)?;
        exchange.receive(&self.controller.exchange(self.connection, outputs)?)
    }

    pub(crate) fn start_camera_online(&mut self, _start: &StartCameraOnline) -> Result<(), Error> {
        Ok(())
    }

    pub(crate) fn camera_pause(&self) -> Option<Duration> {
        Some(Duration::ZERO)
    }

    pub(crate) fn stop_camera_online(&mut self) -> Result<(), Error> {
        Ok(())
    }

    pub(crate) fn stop_online(&mut self) -> Result<(), Error> {
        Ok(())
    }

    /// The models do not follow what is sent last.
    pub(crate) fn abandon(&mut self, _last_request: &[u8]) {}
}
