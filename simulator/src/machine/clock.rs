//! What lets time pass in a machine: steps, or the system's clock.

use std::time::{Duration, Instant};

use super::Machine;

/// The machine time of an exchange, unless it is set.
const STEP: Duration = Duration::from_millis(10);

/// What lets time pass in a machine.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    exchange: ExchangeTime,
    camera: CameraTime,
}

/// How machine time passes with exchanges.
#[derive(Clone, Debug)]
enum ExchangeTime {
    /// Each exchange is a step of this length.
    Step(Duration),
    /// Machine time follows the system's clock.
    System(Follower),
}

/// The time that the camera uses.
#[derive(Clone, Debug)]
enum CameraTime {
    /// The system's clock, since this time.
    System(Instant),
    /// Machine time.
    Machine,
}

/// Follows the system's clock while a client is online, and afterwards as long as something is on. At other times all
/// stands still.
#[derive(Clone, Debug)]
struct Follower {
    /// How long time passes after a command, until the next one.
    longest_pause: Duration,
    /// How far the machine has followed the clock; `None` while nobody is online.
    place: Option<Place>,
}

#[derive(Clone, Debug)]
struct Place {
    /// The clock time reached by the machine.
    passed: Instant,
    /// The clock time it may reach without another command.
    end: Instant,
}

impl Clock {
    /// A step for each exchange, and the system's clock for the camera.
    pub(super) fn new() -> Self {
        Self { exchange: ExchangeTime::Step(STEP), camera: CameraTime::System(Instant::now()) }
    }

    /// Begins to follow the system's clock, if it does that at all.
    pub(super) fn begin(&mut self) {
        if let ExchangeTime::System(follower) = &mut self.exchange {
            follower.begin(Instant::now());
        }
    }

    /// Begins, unless it has begun: an exchange without StartOnline takes place, too.
    pub(super) fn begin_if_still(&mut self) {
        if let ExchangeTime::System(follower) = &mut self.exchange {
            if follower.place.is_none() {
                follower.begin(Instant::now());
            }
        }
    }

    /// Ends what [`begin`](Self::begin) began.
    pub(super) fn end(&mut self) {
        if let ExchangeTime::System(follower) = &mut self.exchange {
            follower.place = None;
        }
    }

    /// Whether time passes without exchanges.
    pub(super) fn is_system(&self) -> bool {
        matches!(self.exchange, ExchangeTime::System(_))
    }

    /// Whether time passes at present without exchanges.
    pub(super) fn is_running(&self) -> bool {
        matches!(&self.exchange, ExchangeTime::System(follower) if follower.place.is_some())
    }

    /// No client is there to send a command; time goes on, but not for longer than this.
    pub(super) fn go_on(&mut self, longest: Duration) {
        if let ExchangeTime::System(Follower { place: Some(place), .. }) = &mut self.exchange {
            place.end = Instant::now() + longest;
        }
    }
}

impl Follower {
    fn begin(&mut self, now: Instant) {
        self.place = Some(Place { passed: now, end: now + self.longest_pause });
    }

    /// The time in µs that has passed by the clock and not in the machine yet.
    fn catch_up(&mut self, now: Instant) -> u64 {
        let Some(place) = &mut self.place else { return 0 };
        let passed = now.min(place.end).saturating_duration_since(place.passed);
        let micros = u64::try_from(passed.as_micros()).unwrap_or(u64::MAX);
        // Not `now`: what is less than a µs counts the next time.
        place.passed += Duration::from_micros(micros);
        micros
    }

    /// A command has come.
    fn command_came(&mut self, now: Instant) {
        let Some(place) = &mut self.place else { return };
        if now > place.end {
            place.passed = now;
        }
        place.end = now + self.longest_pause;
    }
}

impl Machine {
    /// Each exchange is a step of this length from now on.
    pub(crate) fn go_by_steps(&mut self, step: Duration) {
        self.clock.exchange = ExchangeTime::Step(step);
    }

    /// Time follows the system's clock from now on, while a client is online: after each command for this long at
    /// most.
    pub(crate) fn follow_system_clock(&mut self, longest_pause: Duration) {
        self.clock.exchange = ExchangeTime::System(Follower { longest_pause, place: None });
    }

    /// Lets the camera use machine time too.
    pub(crate) fn take_pictures_by_machine_time(&mut self) {
        self.clock.camera = CameraTime::Machine;
    }

    /// Lets the time pass that has passed by the clock, if the machine follows it.
    pub(crate) fn catch_up(&mut self) {
        if let ExchangeTime::System(follower) = &mut self.clock.exchange {
            let micros = follower.catch_up(Instant::now());
            if micros > 0 {
                self.move_on(micros);
            }
        }
    }

    /// A command has come. The machine has caught up.
    pub(crate) fn command_came(&mut self) {
        if let ExchangeTime::System(follower) = &mut self.clock.exchange {
            follower.command_came(Instant::now());
        }
    }

    /// Lets the time of an exchange pass, after its outputs were taken over.
    pub(crate) fn pass_exchange(&mut self) {
        let passed = match &mut self.clock.exchange {
            ExchangeTime::Step(step) => *step,
            ExchangeTime::System(follower) => {
                Duration::from_micros(follower.catch_up(Instant::now()))
            }
        };
        self.step(passed);
    }

    /// The camera's time, if it is started and only exchanges let its time pass.
    pub(crate) fn camera_time(&self) -> Option<Duration> {
        let goes_by_exchanges = matches!(self.clock.camera, CameraTime::Machine);
        self.camera.run().filter(|_| goes_by_exchanges).map(|_| self.time())
    }

    /// How long it is by the system's clock until this time of the camera; `None` when that has come. It is
    /// forever when only exchanges let it come.
    pub(crate) fn time_until(&self, due: Duration) -> Option<Duration> {
        let left = due.saturating_sub(self.now());
        let goes_by_exchanges = matches!(self.clock.camera, CameraTime::Machine);
        let waits = if goes_by_exchanges { Duration::MAX } else { left };
        (!left.is_zero()).then_some(waits)
    }

    /// The present time of the camera.
    pub(crate) fn now(&self) -> Duration {
        match self.clock.camera {
            CameraTime::System(begin) => begin.elapsed(),
            CameraTime::Machine => self.time(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONGEST_PAUSE: Duration = Duration::from_secs(5);

    /// A follower that has begun, and when it began.
    fn follower() -> (Follower, Instant) {
        let mut follower = Follower { longest_pause: LONGEST_PAUSE, place: None };
        let begin = Instant::now();
        follower.begin(begin);
        (follower, begin)
    }

    #[test]
    fn all_time_passes_once_however_often_it_is_asked_for() {
        let (mut follower, begin) = follower();
        let passed: u64 = (1..=1_000_000)
            .map(|time| {
                let now = begin + Duration::from_nanos(1500 * time);
                follower.command_came(now);
                follower.catch_up(now)
            })
            .sum();
        assert_eq!(passed, 1_500_000);
    }

    #[test]
    fn a_pause_counts_up_to_the_longest() {
        let (mut follower, begin) = follower();
        let at = |seconds| begin + Duration::from_secs(seconds);
        assert_eq!(follower.catch_up(at(4)), 4_000_000);
        follower.command_came(at(4));
        assert_eq!(follower.catch_up(at(8)), 4_000_000);
        // It does not matter whether the time is asked for in between.
        assert_eq!(follower.catch_up(at(3600)), 1_000_000);
        follower.command_came(at(3600));
        assert_eq!(follower.catch_up(at(3601)), 1_000_000);
    }

    #[test]
    fn nothing_passes_while_nobody_is_online() {
        let (mut follower, begin) = follower();
        let hour = begin + Duration::from_secs(3600);
        follower.place = None;
        follower.command_came(hour);
        assert_eq!(follower.catch_up(hour), 0);
        follower.begin(hour);
        assert_eq!(follower.catch_up(hour + Duration::from_secs(1)), 1_000_000);
    }
}
