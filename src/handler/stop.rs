//! Stops a controller that another program has left.

use std::thread;
use std::time::Instant;

use crate::client::{TimeLimits, TxtClient};
use crate::error::Error;
use crate::exchange::{Exchange, TransferMode};
use crate::handler::transfer::handshake::{supported, Link, RESTART_PAUSE};
use crate::transfer_area::MAX_AREAS;
use crate::wire::QueryStatusResponse;

/// Switches off what another program has left on when it was killed or its connection was lost: all outputs and sounds of
/// a controller and its extensions. Returns the controller's name and version.
///
/// It goes online, sends an exchange with all outputs off, and goes offline. `address` is as for
/// [`TxtClient::connect`]. Blocks until the controller has answered five times, each as long as `limits` allow: it hands
/// over no configurations, so a controller behind a slow network is stopped soon, too. When the controller closes the
/// connection at StartOnline, it tries again for `limits.connect`, because the maker's firmware 4.7.0 (measured under
/// emulation) may end there, and is started again.
///
/// ```
/// use ft_transfer_area::{stop_controller, TimeLimits};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // A real TXT is at 192.168.7.2 (USB). This one is simulated.
/// let txt = ft_transfer_area_simulator::SimulatedTxt::builder().start()?;
/// let stopped = stop_controller(txt.address(), TimeLimits::default())?;
/// println!("all outputs of {} are off", stopped.name());
/// # Ok(())
/// # }
/// ```
///
/// # Errors
///
/// Those of [`TxtClient::connect`], [`Error::FirmwareTooOld`], and any error of talking to the controller: a program that
/// is still online with it keeps it.
pub fn stop_controller(
    address: impl ToString,
    limits: TimeLimits,
) -> Result<QueryStatusResponse, Error> {
    let address = address.to_string();
    let mut closed: Option<(Error, Instant)> = None;
    loop {
        let error = match stop(&address, limits) {
            Ok(status) => return Ok(status),
            Err(error) => error,
        };
        match (&closed, &error) {
            (None, Error::ConnectionClosed { command: "StartOnline", received: 0 }) => {
                closed = Some((error, Instant::now()));
            }
            (None, _) | (_, Error::FirmwareTooOld { .. }) => return Err(error),
            (Some((first, since)), _) if since.elapsed() >= limits.connect => {
                return Err(first.clone());
            }
            (Some(_), _) => {}
        }
        thread::sleep(RESTART_PAUSE);
    }
}

fn stop(address: &str, limits: TimeLimits) -> Result<QueryStatusResponse, Error> {
    let mut client = TxtClient::connect(address, limits)?;
    let status = client.query_status()?;
    let version = supported(status.version)?;
    client.start_online()?;
    let exchange = Exchange::new(TransferMode::Compressed, version);
    Link { client, exchange }.leave(MAX_AREAS)?;
    Ok(status)
}
