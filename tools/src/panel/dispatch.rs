//! What all pages share, and what their messages do.

use std::collections::{BTreeSet, HashMap};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_json::{json, Value};
use tokio::sync::Semaphore;

use super::common::Common;
use super::control_lock::PageId;
use super::course::Course;
use super::host::Host;
use super::order::only_looks;
use super::problem::Problem;
use super::reply::{Answers, Reply};
use super::request::{self, Held, Message, Request, Work, WorldRequest};
use crate::open_files;
use crate::web::access::Access;

/// The controllers, who drives them, and who may come in.
pub(crate) struct Panel {
    pub(crate) hosts: Vec<Host>,
    pub(crate) common: Arc<Common>,
    pub(crate) access: Arc<Access>,
    /// The lesson that goes with the first controller.
    pub(crate) course: Option<Arc<dyn Course>>,
    /// For pages that are open.
    pub(crate) places: Arc<Semaphore>,
    pages: AtomicU64,
    /// The controller that an open page shows alone.
    looks: Mutex<HashMap<PageId, usize>>,
    held: Mutex<BTreeSet<Hand>>,
}

/// A page that holds something of a controller and area.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Hand {
    host: usize,
    area: usize,
    what: Held,
    page: PageId,
}

/// How many pages of a panel among several may be open.
const PAGES_OF_ONE: usize = 20;

/// Of how many controllers that are only looked at the state is sent at once, and how seldom that of one may be.
const AT_ONCE: usize = 4;
const SELDOM: usize = 8;

impl Panel {
    pub(crate) fn new(hosts: Vec<Host>, common: Arc<Common>, access: Arc<Access>) -> Self {
        let places = Arc::new(Semaphore::new(open_files::for_pages()));
        let (pages, looks, held) = (AtomicU64::new(0), Mutex::default(), Mutex::default());
        Self { hosts, common, access, course: None, places, pages, looks, held }
    }

    /// The same beside others, for whose pages there is always room.
    pub(crate) fn beside_others(self) -> Self {
        Self { places: Arc::new(Semaphore::new(PAGES_OF_ONE)), ..self }
    }

    /// The same with a lesson.
    pub(crate) fn with_course(self, course: Option<Arc<dyn Course>>) -> Self {
        Self { course, ..self }
    }

    /// A number for one more page.
    pub(crate) fn enter(&self) -> PageId {
        self.pages.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// This page is gone. If it drove, all motors stop. It holds no button any more.
    pub(crate) fn leave(&self, page: PageId) {
        self.looks().remove(&page);
        if self.common.control.release(page) {
            self.stop_hosts();
        }
        let mut held = self.held();
        let of_page: Vec<_> = held.iter().filter(|one| one.page == page).copied().collect();
        for one in of_page {
            held.remove(&one);
            if !has_hand(&held, one) {
                let let_go = one.what.let_go();
                // Something else may be plugged in by now.
                let _ = self.host(one.host).and_then(|host| host.change_world(one.area, &let_go));
            }
        }
    }

    fn looks(&self) -> MutexGuard<'_, HashMap<PageId, usize>> {
        self.looks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the state of a controller is for this page at this tick. A page of many that it only looks at gets each
    /// a few times a second, which a computer with a whole class in it can afford, and more of one that it shows alone.
    pub(crate) fn is_due(&self, host: usize, page: PageId, tick: usize) -> bool {
        let drives = self.hosts.iter().any(Host::is_driven);
        let every = if drives { 1 } else { self.hosts.len().div_ceil(AT_ONCE).clamp(1, SELDOM) };
        tick == 0 || tick.wrapping_add(host) % every == 0 || self.looks().get(&page) == Some(&host)
    }

    /// Stops all motors of all controllers.
    pub(crate) fn stop(&self) {
        self.common.control.stop();
        self.stop_hosts();
    }

    /// The same for a page. The error says that there is nothing to stop from here: another program drives.
    pub(crate) fn stop_by_page(&self) -> Result<(), Problem> {
        self.stop();
        if self.hosts.iter().any(Host::is_driven) {
            return Ok(());
        }
        Err(only_looks())
    }

    fn stop_hosts(&self) {
        self.hosts.iter().for_each(Host::stop);
    }

    /// The first message for a page.
    pub(crate) fn hello(&self, page: PageId) -> String {
        let host = |(id, host): (usize, &Host)| json!({"id": id, "address": host.address, "simulated": host.is_simulated(), "driven": host.is_driven(), "hands": host.has_hands(), "watched": host.is_watched(), "names": host.names()});
        let hosts: Vec<_> = self.hosts.iter().enumerate().map(host).collect();
        let version = env!("CARGO_PKG_VERSION");
        let began = self.common.began;
        json!({"type": "hello", "version": version, "began": began, "page": page, "hosts": hosts})
            .to_string()
    }

    /// The newest state of a controller, for this page; `None` before the first.
    pub(crate) fn state(&self, id: usize, page: PageId) -> Option<String> {
        let state = self.hosts.get(id)?.state.borrow().clone()?;
        let (driver, freed) = match self.common.control.driver() {
            Ok(driver) => (json!(driver), Value::Null),
            Err(freed) => (Value::Null, json!(freed)),
        };
        let drives = driver == json!(page);
        Some(format!(
            r#"{{"type":"state","host":{id},"driver":{driver},"freed":{freed},"you_drive":{drives},{state}}}"#
        ))
    }

    /// Does what a message of this page says.
    pub(crate) fn receive(&self, page: PageId, text: &str, answers: &Answers) {
        self.common.control.sign_of_life(page);
        let (seq, message) = request::read(text);
        let reply = answers.reply(seq);
        match message {
            Ok(message) => self.obey(page, message, reply),
            Err(problem) => {
                // A page that talks nonsense may not know what it drives.
                if self.common.control.lease_of(page).is_ok() {
                    self.stop();
                }
                reply.send(Err(problem));
            }
        }
    }

    fn obey(&self, page: PageId, message: Message, reply: Reply) {
        let Message { host, area, request } = message;
        let control = &self.common.control;
        let result = match request {
            Request::Alive => Ok(()),
            Request::Look(only) => {
                match only {
                    Some(host) => self.looks().insert(page, host),
                    None => self.looks().remove(&page),
                };
                Ok(())
            }
            Request::Drive => control.drive(page),
            Request::Take => {
                control.take(page);
                self.stop_hosts();
                Ok(())
            }
            Request::Release => {
                self.leave(page);
                Ok(())
            }
            Request::Stop => self.stop_by_page(),
            Request::Disconnect => self.host(host).and_then(|host| host.gate(false)),
            Request::Admit => self.host(host).and_then(|host| host.gate(true)),
            // It moves nothing, so each page may.
            Request::Record(starts) => self.host(host).and_then(|host| host.record(starts)),
            Request::World(request) => self.change_world(page, host, area, &request),
            Request::Work(work) => return self.order(page, host, area, work, reply),
        };
        reply.send(result.map(|()| None));
    }

    /// Passes work on to its controller, if this page drives.
    fn order(&self, page: PageId, host: usize, area: usize, work: Work, reply: Reply) {
        let lease = match self.common.control.lease_of(page) {
            Ok(lease) => lease,
            Err(problem) => return reply.send(Err(problem)),
        };
        match self.host(host) {
            Ok(host) => host.order(lease, area, work, reply),
            Err(problem) => reply.send(Err(problem)),
        }
    }

    /// Changes the world of a simulated TXT, as hands do. If this program drives it, only for the page that
    /// drives.
    fn change_world(
        &self,
        page: PageId,
        host: usize,
        area: usize,
        request: &WorldRequest,
    ) -> Result<(), Problem> {
        let driven = self.host(host)?;
        if driven.is_driven() {
            self.common.control.lease_of(page)?;
        }
        let Some((what, is_held)) = Held::by(request) else {
            return driven.change_world(area, request);
        };
        let (one, mut held) = (Hand { host, area, what, page }, self.held());
        if is_held {
            driven.change_world(area, request)?;
            held.insert(one);
        } else {
            held.remove(&one);
            // A remote does what was set last.
            if matches!(what, Held::Remote(_)) || !has_hand(&held, one) {
                driven.change_world(area, request)?;
            }
        }
        Ok(())
    }

    fn held(&self) -> MutexGuard<'_, BTreeSet<Hand>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn host(&self, host: usize) -> Result<&Host, Problem> {
        let text = || format!("there is no controller {host}");
        self.hosts.get(host).ok_or_else(|| Problem::new("no_host", text()))
    }
}

/// Whether another page holds this, too.
fn has_hand(held: &BTreeSet<Hand>, hand: Hand) -> bool {
    let same = |one: &Hand| (one.host, one.area, one.what) == (hand.host, hand.area, hand.what);
    held.iter().any(same)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_that_leaves_drives_no_more() {
        let access = Access::new([127, 0, 0, 1].into(), 8000).unwrap();
        let panel = Panel::new(Vec::new(), Arc::new(Common::new()), Arc::new(access));
        let (drives, looks) = (panel.enter(), panel.enter());
        panel.common.control.drive(drives).unwrap();
        panel.leave(looks);
        assert_eq!(panel.common.control.driver(), Ok(drives));
        panel.leave(drives);
        assert!(panel.common.control.driver().is_err());
    }
}
