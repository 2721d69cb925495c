//! The marks of inputs that have changed, in `change` of an area.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{Change, InputValues};

/// So long a mark stays at least. A published program with ftMscLib looks at the marks every 20 ms, and in its recordings
/// with a ROBO TX over Bluetooth, where an exchange took about 25 ms, no change is missing. Here one takes 10 ms.
const STAY: Duration = Duration::from_millis(30);

/// When each input changed last.
#[derive(Clone, Copy, Default)]
pub(super) struct Marks {
    uni: [Option<Instant>; 8],
    cnt_in: [Option<Instant>; 4],
    counter: [Option<Instant>; 4],
}

impl Marks {
    /// What to mark at this moment, at which a change has come.
    pub(super) fn at(&mut self, now: Instant, change: &Change) -> Change {
        marked(
            marks(&mut self.uni, change.change_uni, now),
            marks(&mut self.cnt_in, change.change_cnt_in, now),
            marks(&mut self.counter, change.change_counter, now),
        )
    }
}

/// The inputs that have changed now or not long ago, as bits.
fn marks(last: &mut [Option<Instant>], changed: u8, now: Instant) -> u8 {
    bits(last.iter_mut().enumerate().map(|(index, last)| {
        if changed & 1 << index != 0 {
            *last = Some(now);
        }
        last.is_some_and(|last| now.saturating_duration_since(last) < STAY)
    }))
}

/// What differs between the program's inputs and those of a response.
pub(super) fn change(before: &InputValues, now: &InputValues) -> Change {
    marked(
        bits(before.uni.iter().zip(now.uni).map(|(a, b)| *a != b)),
        bits(before.cnt_in.iter().zip(now.cnt_in).map(|(a, b)| *a != b)),
        bits(before.counter.iter().zip(now.counter).map(|(a, b)| *a != b)),
    )
}

fn marked(change_uni: u8, change_cnt_in: u8, change_counter: u8) -> Change {
    let change_status = u8::from(change_uni | change_cnt_in | change_counter != 0);
    Change { change_status, change_uni, change_cnt_in, change_counter, ..Change::default() }
}

fn bits(set: impl Iterator<Item = bool>) -> u8 {
    set.enumerate().fold(0, |bits, (index, set)| bits | u8::from(set) << index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_stays_for_30_ms_after_the_last_change() {
        let (mut marks, begun) = (Marks::default(), Instant::now());
        let none = Change::default();
        let mut at = |ms, change: &Change| marks.at(begun + Duration::from_millis(ms), change);
        let i3 = marked(0b100, 0, 0);
        let c1 = marked(0, 0b1, 0b1);
        assert_eq!(at(0, &none), none);
        assert_eq!(at(10, &i3), i3);
        assert_eq!(at(20, &c1), marked(0b100, 0b1, 0b1));
        assert_eq!(at(39, &none), marked(0b100, 0b1, 0b1));
        assert_eq!(at(40, &none), c1);
        assert_eq!(at(45, &c1), c1);
        assert_eq!(at(74, &none), c1);
        assert_eq!(at(75, &none), none);
    }
}
