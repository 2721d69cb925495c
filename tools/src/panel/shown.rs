//! The thread of a simulated TXT that another program drives: it only looks.

use std::sync::Arc;
use std::thread;
use std::time::Instant;

use tokio::sync::watch;

use super::camera::CameraState;
use super::common::Common;
use super::histogram::Histogram;
use super::state::{self, HostState, Link, Newest, Phase, STATE_PERIOD};
use super::world::Simulated;

/// A simulated TXT that is shown.
pub(super) struct Shown {
    simulated: Arc<Simulated>,
    common: Arc<Common>,
    publish: watch::Sender<Newest>,
    /// How many exchanges there were at the last look, and when it was.
    before: (u64, Instant),
}

impl Shown {
    pub(super) fn new(
        simulated: Arc<Simulated>,
        common: Arc<Common>,
        publish: watch::Sender<Newest>,
    ) -> Self {
        Self { simulated, common, publish, before: (0, Instant::now()) }
    }

    pub(super) fn run(mut self) {
        while !self.common.is_ending() {
            self.publish();
            thread::sleep(STATE_PERIOD);
        }
    }

    fn publish(&mut self) {
        let (online, exchanges, areas) = self.simulated.look();
        let now = Instant::now();
        let (count_before, time_before) = std::mem::replace(&mut self.before, (exchanges, now));
        let count = exchanges.saturating_sub(count_before);
        let histogram = Histogram::default();
        let ms = (now - time_before).as_secs_f64() * 1000.0;
        let state = HostState {
            at: self.common.begin.elapsed().as_millis(),
            link: Link {
                phase: if online { Phase::Running } else { Phase::Idle },
                name: self.simulated.label().map(str::to_owned),
                firmware: None,
                error: None,
                cycle_ms: if count == 0 { 0.0 } else { ms / count as f64 },
                histogram: histogram.bins(),
                cycles: exchanges,
                late: 0,
                gaps: 0,
            },
            areas: state::areas(&areas, true),
            world: self.simulated.report(),
            camera: CameraState::default(),
            i2c: false,
            watched: None,
            lesson: self.simulated.course().and_then(|course| course.progress()),
            recording: None,
        };
        state.publish(&self.publish);
    }
}
