//! I2C devices, over a connection of their own and in a thread of its own, so that nothing waits for them.

use std::sync::Arc;

use crossbeam_channel::Receiver;
use ft_transfer_area::{Error, I2cClient, TransferAreaComHandler};
use serde_json::{json, Value};

use super::common::{spawn, Common};
use super::order::{not_connected, stopped, Order};
use super::problem::Problem;
use super::request::I2cRequest;

/// How many requests may wait.
pub(super) const WAITING: usize = 8;
/// The addresses of 7 bits that the I2C standard leaves to devices.
const ADDRESSES: std::ops::RangeInclusive<u8> = 0x08..=0x77;
/// How many bytes are read at once: all registers of a device.
const READ_MAX: usize = 256;

/// A thread that carries out one request after another.
pub(super) fn start(
    handler: Arc<TransferAreaComHandler>,
    common: Arc<Common>,
    orders: Receiver<Order<I2cRequest>>,
) -> Result<(), Error> {
    spawn("i2c", move || work(&handler, &common, &orders))
}

fn work(handler: &TransferAreaComHandler, common: &Common, orders: &Receiver<Order<I2cRequest>>) {
    let mut client = None;
    for order in orders {
        // A write that waited behind a scan must not come after the driver has gone.
        let result = if order.lease == common.control.lease() {
            carry_out(handler, &mut client, &order.request)
        } else {
            Err(stopped())
        };
        order.reply.send(result.map(Some));
    }
}

fn carry_out(
    handler: &TransferAreaComHandler,
    client: &mut Option<I2cClient>,
    request: &I2cRequest,
) -> Result<Value, Problem> {
    let client = match client {
        Some(client) => client,
        None => client.insert(handler.i2c().map_err(problem)?),
    };
    match request {
        I2cRequest::Scan {} => Ok(json!(scan(client).map_err(problem)?)),
        I2cRequest::Read { address, register, count } => {
            if !(1..=READ_MAX).contains(count) {
                let given = i64::try_from(*count).unwrap_or(i64::MAX);
                return Err(Problem::out_of_range("number of bytes to read", given, 1, 256));
            }
            let mut bytes = vec![0; *count];
            client.read(*address, *register, &mut bytes).map_err(problem)?;
            Ok(json!(bytes))
        }
        I2cRequest::Write { address, register, values } => {
            client.write(*address, *register, values).map_err(problem)?;
            Ok(Value::Null)
        }
    }
}

/// An error in the words of the page, which knows nothing of a transfer.
fn problem(error: Error) -> Problem {
    match error {
        Error::NotOnline { .. } => not_connected(),
        other => other.into(),
    }
}

/// The addresses at which a device answers.
fn scan(client: &mut I2cClient) -> Result<Vec<u8>, Error> {
    let mut found = Vec::new();
    for address in ADDRESSES {
        match client.read(address, 0, &mut [0]) {
            Ok(()) => found.push(address),
            Err(Error::I2cNoDevice { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(found)
}
