//! The terminals of a controller, by the names that are printed on its case.

use std::fmt;

/// Declares the terminals of one kind: an enum, all of them in order, their indices and names.
macro_rules! terminals {
    ($(#[$about:meta])* $name:ident: $($terminal:ident),+; $index:literal) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[allow(missing_docs, reason = "the names are those on the controller")]
        pub enum $name {
            $($terminal),+
        }

        impl $name {
            /// All of them, in order.
            pub const ALL: [Self; [$(Self::$terminal),+].len()] = [$(Self::$terminal),+];

            #[doc = $index]
            pub const fn index(self) -> usize {
                self as usize
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Debug::fmt(self, f)
            }
        }
    };
}

terminals! {
    /// A universal input. Closed on purpose: a controller has these eight.
    #[doc(alias = "idxIO")]
    Input: I1, I2, I3, I4, I5, I6, I7, I8;
    "Its index in [`InputValues::uni`](crate::transfer_area::InputValues::uni), 0..=7."
}

terminals! {
    /// A counter input. The encoder of a motor is plugged into the counter with the motor's number.
    /// Closed on purpose: a controller has these four.
    Counter: C1, C2, C3, C4;
    "Its index in [`InputValues::counter`](crate::transfer_area::InputValues::counter), 0..=3."
}

terminals! {
    /// A motor output: a pair of outputs, O1 and O2 for M1. Its encoder is plugged into the counter with
    /// the same number. Closed on purpose: a controller has these four.
    Motor: M1, M2, M3, M4;
    "Its index in [`OutputValues::distance`](crate::transfer_area::OutputValues::distance), 0..=3."
}

terminals! {
    /// A single output. O1 and O2 are the terminals of M1, O3 and O4 those of M2, and so on. Closed on
    /// purpose: a controller has these eight.
    Output: O1, O2, O3, O4, O5, O6, O7, O8;
    "Its index in [`OutputValues::duty`](crate::transfer_area::OutputValues::duty), 0..=7."
}

impl Motor {
    /// The counter for its encoder.
    pub const fn counter(self) -> Counter {
        Counter::ALL[self.index()]
    }

    /// Its two outputs: the one for clockwise, the one for counterclockwise.
    pub const fn outputs(self) -> [Output; 2] {
        [Output::ALL[2 * self.index()], Output::ALL[2 * self.index() + 1]]
    }
}

impl Output {
    /// The motor output that this terminal belongs to.
    pub const fn motor(self) -> Motor {
        Motor::ALL[self.index() / 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motors_outputs_and_counters_belong_together() {
        assert_eq!(Motor::M3.outputs(), [Output::O5, Output::O6]);
        assert_eq!(Motor::M3.counter(), Counter::C3);
        for output in Output::ALL {
            assert!(output.motor().outputs().contains(&output), "{output}");
        }
    }

    #[test]
    fn names_and_indices_are_those_of_the_box() {
        let names: Vec<String> = Input::ALL.iter().map(ToString::to_string).collect();
        assert_eq!(names, ["I1", "I2", "I3", "I4", "I5", "I6", "I7", "I8"]);
        assert_eq!(Counter::ALL.map(Counter::index), [0, 1, 2, 3]);
        assert_eq!(Output::ALL.map(Output::index), [0, 1, 2, 3, 4, 5, 6, 7]);
    }
}
