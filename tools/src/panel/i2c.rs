//! I2C devices, over a connection of their own and in a thread of its own, so that nothing waits for them.

use std::sync::Arc;

use crossbeam_channel::{bounded, Receiver, Sender};
use ft_transfer_area::{Error, I2cClient, TransferAreaComHandler};
use serde_json::{json, Value};

use super::host::{spawn, stopped, Common, Ordered};
use super::reply::Reply;
use super::trouble::Trouble;
use super::wish::I2cWish;

/// How many requests may wait.
const WAITING: usize = 8;
/// The addresses of 7 bits that the I2C standard leaves to devices.
const ADDRESSES: std::ops::RangeInclusive<u8> = 0x08..=0x77;
/// How many bytes are read at once: all registers of a device.
const READ_MAX: usize = 256;

pub(super) struct I2cOrder {
    pub(super) turn: u64,
    pub(super) wish: I2cWish,
    pub(super) reply: Reply,
}

impl Ordered for I2cOrder {
    fn reply(self) -> Reply {
        self.reply
    }
}

/// A thread that carries out one request after another.
pub(super) fn start(
    handler: Arc<TransferAreaComHandler>,
    common: Arc<Common>,
) -> Result<Sender<I2cOrder>, Error> {
    let (orders, receiver) = bounded(WAITING);
    spawn("i2c", move || work(&handler, &common, &receiver))?;
    Ok(orders)
}

fn work(handler: &TransferAreaComHandler, common: &Common, orders: &Receiver<I2cOrder>) {
    let mut client = None;
    for order in orders {
        // A write that waited behind a scan must not come after the driver has gone.
        let result = if order.turn == common.wheel.look().1 {
            carry_out(handler, &mut client, &order.wish)
        } else {
            Err(stopped())
        };
        order.reply.send(result.map(Some));
    }
}

fn carry_out(
    handler: &TransferAreaComHandler,
    client: &mut Option<I2cClient>,
    wish: &I2cWish,
) -> Result<Value, Trouble> {
    let client = match client {
        Some(client) => client,
        None => client.insert(handler.i2c()?),
    };
    match wish {
        I2cWish::Scan => Ok(json!(scan(client)?)),
        I2cWish::Read { address, register, count } => {
            if !(1..=READ_MAX).contains(count) {
                let given = i64::try_from(*count).unwrap_or(i64::MAX);
                return Err(Trouble::out_of_range("number of bytes to read", given, 1, 256));
            }
            let mut bytes = vec![0; *count];
            client.read(*address, *register, &mut bytes)?;
            Ok(json!(bytes))
        }
        I2cWish::Write { address, register, values } => {
            client.write(*address, *register, values)?;
            Ok(Value::Null)
        }
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
