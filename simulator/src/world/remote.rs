//! Infrared remotes.

use ft_transfer_area::wire::IrRemote;
use toml::de::DeValue;

use super::mistake::{at, expect, Checked};
use super::read::{truth, whole, Keys, Read};

const REMOTE: &str = "expected a remote, as in { dip1 = true }";

/// The number of different switch settings of remotes.
const REMOTES: usize = 4;

/// How far a joystick moves from its middle.
const AXIS_MAX: i8 = 15;

/// An infrared remote and what it sends at present. Every controller receives it.
///
/// It has all that the protocol sends of a remote, so it is closed on purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Remote {
    /// The first DIP switch.
    pub dip1: bool,
    /// The second DIP switch.
    pub dip2: bool,
    /// Left joystick, left to right: −15..=15.
    pub left_x: i8,
    /// Left joystick, backwards to forward: −15..=15.
    pub left_y: i8,
    /// Right joystick, left to right: −15..=15.
    pub right_x: i8,
    /// Right joystick, backwards to forward: −15..=15.
    pub right_y: i8,
    /// The ON button.
    pub on: bool,
    /// The OFF button.
    pub off: bool,
}

impl Remote {
    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let known = ["dip1", "dip2", "left_x", "left_y", "right_x", "right_y", "on", "off"];
        let keys = Keys::of(value, REMOTE, &known)?;
        let axis = |key| keys.or(key, 0, whole(-i64::from(AXIS_MAX)..=AXIS_MAX.into()));
        let bit = |key| keys.or(key, false, truth);
        Ok(Self {
            dip1: bit("dip1")?,
            dip2: bit("dip2")?,
            left_x: axis("left_x")?,
            left_y: axis("left_y")?,
            right_x: axis("right_x")?,
            right_y: axis("right_y")?,
            on: bit("on")?,
            off: bit("off")?,
        })
    }

    pub(super) fn check(&self) -> Checked {
        self.axes().into_iter().try_for_each(|(axis, value)| {
            let right = (-AXIS_MAX..=AXIS_MAX).contains(&value);
            at(axis, expect(right, || format!("expected -{AXIS_MAX} to {AXIS_MAX}, not {value}")))
        })
    }

    /// Whether both have the same switch setting, so that a controller can't tell them apart.
    pub(super) fn is_set_like(&self, other: &Self) -> bool {
        self.index() == other.index()
    }

    /// The axes of its joysticks with their names.
    pub(super) fn axes(&self) -> [(&'static str, i8); 4] {
        [
            ("left_x", self.left_x),
            ("left_y", self.left_y),
            ("right_x", self.right_x),
            ("right_y", self.right_y),
        ]
    }

    /// The index of its values in a controller's inputs, 1..=4.
    fn index(&self) -> usize {
        1 + usize::from(self.dip1) + 2 * usize::from(self.dip2)
    }

    /// Whether somebody moves a joystick or presses a button.
    fn is_used(&self) -> bool {
        self.on || self.off || self.axes().iter().any(|(_, value)| *value != 0)
    }

    fn values(&self) -> IrRemote {
        let axis = |value: i8| value.clamp(-AXIS_MAX, AXIS_MAX);
        let bits = [self.on, self.off, self.dip1, self.dip2];
        IrRemote {
            left_x: axis(self.left_x),
            left_y: axis(self.left_y),
            right_x: axis(self.right_x),
            right_y: axis(self.right_y),
            bits: (0..).zip(bits).fold(0, |all, (place, bit)| all | u8::from(bit) << place),
        }
    }
}

/// What a controller receives: “any remote” (the first that is in use, or else the first), then the
/// four switch settings.
pub(super) fn seen(remotes: &[Remote]) -> [IrRemote; 5] {
    let mut seen = [IrRemote::default(); 5];
    for remote in remotes {
        seen[remote.index()] = remote.values();
    }
    let any = remotes.iter().find(|remote| remote.is_used()).or(remotes.first());
    seen[0] = any.map(Remote::values).unwrap_or_default();
    seen
}

/// Checks that each remote has a switch setting of its own.
pub(super) fn check_settings(remotes: &[Remote]) -> Checked {
    for (number, remote) in remotes.iter().enumerate() {
        let taken = remotes.iter().take(number).any(|other| other.is_set_like(remote));
        let reason = || {
            format!("expected a different switch setting (dip1, dip2); there are only {REMOTES}")
        };
        at(number, expect(!taken, reason))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_switches_choose_the_place_of_a_remote() {
        for (dip1, dip2, index) in
            [(false, false, 1), (true, false, 2), (false, true, 3), (true, true, 4)]
        {
            let remote = Remote { dip1, dip2, left_x: -15, on: true, ..Remote::default() };
            let seen = seen(&[remote]);
            let bits = 1 | u8::from(dip1) << 2 | u8::from(dip2) << 3;
            let values = IrRemote { left_x: -15, bits, ..IrRemote::default() };
            assert_eq!((seen[index], seen[0]), (values, values));
            let others = (1..5).filter(|other| *other != index);
            assert!(others.into_iter().all(|other| seen[other] == IrRemote::default()));
        }
    }

    #[test]
    fn any_remote_is_the_first_that_is_used() {
        let idle = Remote { dip1: true, ..Remote::default() };
        let used = Remote { dip2: true, right_y: 7, ..Remote::default() };
        assert_eq!(seen(&[idle, used])[0].right_y, 7);
        assert_eq!(seen(&[idle])[0].bits, 0b100);
        assert_eq!(seen(&[]), [IrRemote::default(); 5]);
    }
}
