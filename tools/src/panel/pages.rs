//! What all pages share, and what their messages do.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;

use serde_json::{json, Value};

use super::host::{Common, Host};
use super::reply::{Answers, Reply};
use super::trouble::Trouble;
use super::wheel::Page;
use super::wish::{self, Message, Wish};
use crate::web::access::Access;

/// The controllers, the wheel, and who may come in.
pub(crate) struct Panel {
    pub(crate) hosts: Vec<Host>,
    pub(crate) common: Arc<Common>,
    pub(crate) access: Access,
    pages: AtomicU64,
}

impl Panel {
    pub(crate) fn new(hosts: Vec<Host>, common: Arc<Common>, access: Access) -> Self {
        Self { hosts, common, access, pages: AtomicU64::new(0) }
    }

    /// A number for one more page.
    pub(crate) fn enter(&self) -> Page {
        self.pages.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// This page is gone. If it drove, all motors stop.
    pub(crate) fn leave(&self, page: Page) {
        if self.common.wheel.release(page) {
            self.stop_hosts();
        }
    }

    /// Stops all motors of all controllers.
    pub(crate) fn stop(&self) {
        self.common.wheel.stop();
        self.stop_hosts();
    }

    fn stop_hosts(&self) {
        self.hosts.iter().for_each(Host::stop);
    }

    /// The first message for a page.
    pub(crate) fn hello(&self, page: Page) -> String {
        let host = |(id, host): (usize, &Host)| json!({"id": id, "address": host.address, "simulated": host.is_simulated()});
        let hosts: Vec<_> = self.hosts.iter().enumerate().map(host).collect();
        let version = env!("CARGO_PKG_VERSION");
        json!({"type": "hello", "version": version, "page": page, "hosts": hosts}).to_string()
    }

    /// The newest state of a controller, for this page.
    pub(crate) fn state(&self, id: usize, page: Page) -> Option<String> {
        let state = self.hosts.get(id)?.state.borrow().clone();
        let (driver, freed) = match self.common.wheel.driver() {
            Ok(driver) => (json!(driver), Value::Null),
            Err(freed) => (Value::Null, json!(freed)),
        };
        let drives = driver == json!(page);
        Some(format!(
            r#"{{"type":"state","host":{id},"driver":{driver},"freed":{freed},"you_drive":{drives},{state}}}"#
        ))
    }

    /// Does what a message of this page says.
    pub(crate) fn hear(&self, page: Page, text: &str, answers: &Answers) {
        self.common.wheel.sign_of_life(page);
        let (seq, message) = wish::read(text);
        let reply = answers.reply(seq);
        match message {
            Ok(message) => self.obey(page, message, reply),
            Err(trouble) => {
                // A page that talks nonsense may not know what it drives.
                if self.common.wheel.turn_of(page).is_ok() {
                    self.stop();
                }
                reply.send(Err(trouble));
            }
        }
    }

    fn obey(&self, page: Page, message: Message, reply: Reply) {
        let Message { host, area, wish } = message;
        let wheel = &self.common.wheel;
        let result = match wish {
            Wish::Alive => Ok(()),
            Wish::Drive => wheel.drive(page),
            Wish::Take => {
                wheel.take(page);
                self.stop_hosts();
                Ok(())
            }
            Wish::Release => {
                self.leave(page);
                Ok(())
            }
            Wish::Stop => {
                self.stop();
                Ok(())
            }
            wish => return self.order(page, host, area, wish, reply),
        };
        reply.send(result.map(|()| None));
    }

    /// Passes a command on to its controller, if this page drives.
    fn order(&self, page: Page, host: usize, area: usize, wish: Wish, reply: Reply) {
        let turn = match self.common.wheel.turn_of(page) {
            Ok(turn) => turn,
            Err(trouble) => return reply.send(Err(trouble)),
        };
        let Some(host) = self.hosts.get(host) else {
            let text = format!("there is no controller {host}");
            return reply.send(Err(Trouble::new("no_host", text)));
        };
        match wish {
            Wish::Area(wish) => host.order(turn, area, wish, reply),
            Wish::I2c(wish) => host.order_i2c(turn, wish, reply),
            Wish::Camera(wish) => host.order_camera(wish, reply),
            Wish::World(wish) => host.change_world(area, &wish, reply),
            Wish::Alive | Wish::Drive | Wish::Take | Wish::Release | Wish::Stop => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_that_leaves_drives_no_more() {
        let access = Access::new([127, 0, 0, 1].into(), 8000).unwrap();
        let panel = Panel::new(Vec::new(), Arc::new(Common::new()), access);
        let (drives, looks) = (panel.enter(), panel.enter());
        panel.common.wheel.drive(drives).unwrap();
        panel.leave(looks);
        assert_eq!(panel.common.wheel.look().0, Some(drives));
        panel.leave(drives);
        assert_eq!(panel.common.wheel.look().0, None);
    }
}
