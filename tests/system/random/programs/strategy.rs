//! How random programs are made.

use ft_transfer_area::tx::{Counter, Motor};
use ft_transfer_area_simulator::FaultKind;
use proptest::collection::vec;
use proptest::option::weighted;
use proptest::prelude::*;
use proptest::strategy::{BoxedStrategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::time::Duration;

use super::plan::*;
use crate::proxy::fault::{Fault as Net, Strike};
use crate::proxy::packets::Place;

/// The program of this seed.
pub(crate) fn plan_of(seed: u64) -> Plan {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let mut runner = TestRunner::new_with_rng(Config::default(), rng);
    plan().new_tree(&mut runner).expect("no strategy refuses").current()
}

fn plan() -> impl Strategy<Value = Plan> {
    // One handler is what most programs have.
    prop_oneof![3 => Just(1), 1 => Just(2)].prop_flat_map(|count: usize| {
        let groups = vec(vec(op(count), 1..6), 1..7);
        (vec(setup(), count), vec(groups, 1..=THREADS_MAX))
            .prop_map(|(setups, threads)| Plan { setups, threads })
    })
}

fn setup() -> impl Strategy<Value = Setup> {
    let kind = (weighted(0.2, Just(())), weighted(0.3, Just(())), weighted(0.2, Just(())));
    let limits = (0..6_u64, weighted(0.5, 60..150_u64), weighted(0.5, 150..400_u64), 0..4_u64);
    let faults = (vec((0..60_u64, fault()), 0..3), weighted(0.15, network()));
    let flags = (prop::bool::weighted(0.8), prop::bool::weighted(0.7));
    (kind, limits, flags, faults).prop_map(|(kind, limits, (begun, listens), (faults, network))| {
        let (window_ms, watchdog_ms, reconnect_ms, pace_ms) = limits;
        Setup {
            begun,
            extension: kind.0.is_some(),
            simple: kind.1.is_some(),
            lock_step: kind.2.is_some(),
            window_ms,
            watchdog_ms,
            reconnect_ms,
            pace_ms,
            listens,
            faults,
            network,
        }
    })
}

fn fault() -> impl Strategy<Value = FaultKind> {
    prop_oneof![
        3 => (0..200_usize).prop_map(|after| FaultKind::Close { after }),
        2 => (1..80_u64).prop_map(|ms| FaultKind::Delay(Duration::from_millis(ms))),
        1 => Just(FaultKind::Silence),
        1 => Just(FaultKind::Dribble),
        1 => Just(FaultKind::WrongId),
        1 => Just(FaultKind::WrongCrc),
        1 => Just(FaultKind::CutData),
        1 => (1..9_usize).prop_map(FaultKind::Surplus),
    ]
}

fn network() -> impl Strategy<Value = Strike> {
    let places = [Place::HANDSHAKE, Place::RUNNING, &[Place::LastExchange, Place::StopOnline]];
    let place = prop::sample::select(places.concat());
    let asked = [Net::Fin, Net::Rst, Net::Cut, Net::Half, Net::Drip];
    let answered = [
        Net::Fin,
        Net::Rst,
        Net::Cut,
        Net::HalfClose,
        Net::Silence,
        Net::Half,
        Net::HalfThenFin,
        Net::Drip,
        Net::SlowDrip,
        Net::WrongId,
        Net::Surplus,
    ];
    let strike = |in_request| move |(place, fault)| Strike { place, in_request, fault };
    prop_oneof![
        (place.clone(), prop::sample::select(asked.to_vec())).prop_map(strike(true)),
        (place, prop::sample::select(answered.to_vec())).prop_map(strike(false)),
    ]
}

fn op(count: usize) -> BoxedStrategy<Op> {
    let which = 0..count;
    let on = |make: fn(usize) -> Op| which.clone().prop_map(make);
    let by = |make: fn(usize, By) -> Op| {
        (which.clone(), whose()).prop_map(move |(which, by)| make(which, by))
    };
    prop_oneof![
        30 => (which.clone(), whose(), get(), under())
            .prop_map(|(which, by, get, under)| Op::Guard(which, by, get, under)),
        8 => on(Op::Begin),
        4 => on(Op::End),
        1 => on(Op::BeginPanicking),
        1 => on(Op::DropHandler),
        3 => any::<bool>().prop_map(|newest| Op::DropKept { newest }),
        2 => by(Op::UpdateConfig),
        3 => by(Op::Feed),
        2 => by(Op::IsRunning),
        2 => by(Op::Error),
        1 => on(Op::Statistics),
        1 => on(Op::Subscribe),
        2 => (which.clone(), 0..20_u64).prop_map(|(which, ms)| Op::Receive(which, ms)),
        1 => on(Op::Unsubscribe),
        2 => (which.clone(), disk()).prop_map(|(which, disk)| Op::Record(which, disk)),
        2 => (which.clone(), end_recording())
            .prop_map(|(which, how)| Op::EndRecording(which, how)),
        3 => prop_oneof![4 => 0..10_u64, 1 => 10..200_u64].prop_map(Op::Sleep),
        1 => on(Op::PanicAsOwner),
        2 => on(Op::StartCamera),
        2 => on(Op::StopCamera),
        2 => on(Op::CameraState),
        1 => on(Op::I2c),
        4 => (which.clone(), hook(count)).prop_map(|(which, hook)| Op::SetHook(which, hook)),
        1 => on(Op::ClearHook),
        2 => (which.clone(), fault()).prop_map(|(which, kind)| Op::Disturb(which, kind)),
        1 => (which.clone(), 1..250_u64).prop_map(|(which, ms)| Op::Absent(which, ms)),
    ]
    .boxed()
}

/// To wait for a disk that stands still takes long.
fn disk() -> impl Strategy<Value = Disk> {
    prop_oneof![30 => Just(Disk::Works), 1 => Just(Disk::StandsStill)]
}

fn end_recording() -> impl Strategy<Value = EndRecording> {
    prop_oneof![
        2 => Just(EndRecording::Finish),
        1 => Just(EndRecording::Drop),
        1 => Just(EndRecording::Panic),
    ]
}

/// What a cycle hook does, and what it calls when it has no areas any more.
fn hook(count: usize) -> impl Strategy<Value = Hook> {
    let which = 0..count;
    let called = prop_oneof![
        2 => which.clone().prop_map(Op::End),
        1 => which.clone().prop_map(Op::Begin),
        2 => (which.clone(), whose()).prop_map(|(which, by)| Op::Feed(which, by)),
        1 => which.clone().prop_map(Op::StartCamera),
        1 => which.clone().prop_map(Op::StopCamera),
        1 => which.clone().prop_map(Op::CameraState),
        1 => which.clone().prop_map(Op::ClearHook),
        1 => which.clone().prop_map(Op::Subscribe),
        1 => which.clone().prop_map(Op::DropHandler),
        1 => which.clone().prop_map(Op::Statistics),
    ];
    let then = prop_oneof![
        4 => Just(Then::Nothing),
        1 => (1..6_u64).prop_map(Then::Slow),
        3 => (20..400_u64).prop_map(Then::SlowOnce),
        3 => Just(Then::Hang),
        2 => Just(Then::Panic),
        2 => Just(Then::Break),
        4 => called.prop_map(|op| Then::Call(Box::new(op))),
    ];
    (vec(act(), 0..2), 0..12_u32, then).prop_map(|(acts, after, then)| Hook { acts, after, then })
}

fn whose() -> impl Strategy<Value = By> {
    prop_oneof![3 => Just(By::Own), 1 => Just(By::Shared), 2 => Just(By::Handler)]
}

fn get() -> impl Strategy<Value = Get> {
    let limit = || 5..80_u64;
    prop_oneof![
        6 => Just(Get::Lock),
        8 => Just(Get::Cycle),
        3 => (0..40_u64).prop_map(Get::CycleFor),
        2 => (1..6_u32, limit()).prop_map(|(checks, ms)| Get::Until(checks, ms)),
        4 => (motor(), limit()).prop_map(|(motor, ms)| Get::Motor(motor, ms)),
        2 => (counter(), limit()).prop_map(|(counter, ms)| Get::Counter(counter, ms)),
        2 => limit().prop_map(Get::Sound),
        1 => limit().prop_map(Get::Input),
    ]
}

fn under() -> impl Strategy<Value = Under> {
    let hold = prop_oneof![12 => Just(0), 3 => 1..8_u64, 1 => 8..120_u64];
    let leave =
        prop_oneof![16 => Just(Leave::Drop), 1 => Just(Leave::Panic), 2 => Just(Leave::Keep)];
    (vec(act(), 0..3), hold, leave).prop_map(|(acts, hold_ms, leave)| Under {
        acts,
        hold_ms,
        leave,
    })
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        10 => Just(Act::Write),
        2 => Just(Act::Zero),
        4 => (motor(), prop_oneof![3 => 1..5_u16, 1 => Just(3000)])
            .prop_map(|(motor, pulses)| Act::Drive(motor, pulses)),
        1 => motor().prop_map(Act::Halt),
        2 => counter().prop_map(Act::Reset),
        2 => Just(Act::Sound),
        1 => Just(Act::Config),
    ]
}

/// M1 and M2 have the duties that say which guard has written them.
fn motor() -> impl Strategy<Value = Motor> {
    prop_oneof![Just(Motor::M3), Just(Motor::M4)]
}

fn counter() -> impl Strategy<Value = Counter> {
    prop_oneof![Just(Counter::C1), Just(Counter::C2)]
}
