//! Text that people type for the simulated TXT.

use std::time::Duration;

use ft_transfer_area_simulator::{Fault, FaultKind, FaultPlace, Machine};

use super::everything;

#[allow(dead_code, reason = "the help is for the program")]
#[path = "../../tools/src/simulate/typed.rs"]
mod typed;

/// Types lines for the simulated TXT, with a world and without one. A refused line must change
/// nothing.
pub fn typed_lines(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let with_world = Machine::with_world(1, everything()).expect("it is shipped");
    for mut machine in [with_world, Machine::new(1)] {
        for line in text.lines() {
            let before = machine.clone();
            if let Err(sentence) = typed::carry_out(line, &mut machine) {
                assert!(!sentence.is_empty());
                assert_eq!(format!("{machine:?}"), format!("{before:?}"), "after {line:?}");
            }
            machine.step(Duration::from_millis(2));
        }
        assert!(machine.report(0).is_some());
    }
}

/// Reads a text as a fault. The text of an accepted fault must give the same fault.
pub fn fault_text(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match text.parse::<Fault>() {
        Ok(fault) => {
            let written = written(fault);
            assert_eq!(written.parse(), Ok(fault));
            let name = |text: &str| text.split([':', '@']).next().map(str::to_owned);
            assert_eq!(name(&written), name(text));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// The text of a fault, with decimal numbers.
fn written(fault: Fault) -> String {
    let place = match fault.place {
        FaultPlace::Response(number) => format!("response:{number}"),
        FaultPlace::Exchange(number) => format!("exchange:{number}"),
        FaultPlace::EachExchange => "exchange:each".to_owned(),
        place => panic!("{place:?} has no text"),
    };
    let kind = match fault.kind {
        FaultKind::Delay(delay) => format!("delay:{}", delay.as_millis()),
        FaultKind::Jitter(limit) => format!("jitter:{}", limit.as_millis()),
        FaultKind::Silence => "silence".to_owned(),
        FaultKind::Dribble => "dribble".to_owned(),
        FaultKind::WrongId => "id".to_owned(),
        FaultKind::WrongCrc => "crc".to_owned(),
        FaultKind::ExtraSize(size) => format!("size:{size}"),
        FaultKind::Mask(mask) => format!("mask:{mask}"),
        FaultKind::CutData => "cut".to_owned(),
        FaultKind::Surplus(count) => format!("surplus:{count}"),
        FaultKind::Close { after } => format!("close:{after}"),
        kind => panic!("{kind:?} has no text"),
    };
    format!("{kind}@{place}")
}
