//! Values of all terminals of one kind, by the terminal or its number.

use std::fmt;
use std::ops::{Deref, DerefMut, Index, IndexMut};
use std::slice::SliceIndex;

use crate::terminals::{Counter, Input, Motor, Output};

/// Declares the values of all terminals of one kind.
macro_rules! per_terminal {
    ($(#[$about:meta])* $name:ident: $terminal:ident) => {
        $(#[$about])*
        ///
        /// An array with the same layout, which has a place for each terminal: `iter`, `map`, `len` and all else
        /// are the array's. A number or a range is an index as well, and counts from 0. One beyond the array
        /// panics.
        #[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
        #[repr(transparent)]
        pub struct $name<T>([T; $terminal::ALL.len()]);

        impl<T> Deref for $name<T> {
            type Target = [T; $terminal::ALL.len()];

            fn deref(&self) -> &Self::Target {
                &self.0
            }
        }

        impl<T> DerefMut for $name<T> {
            fn deref_mut(&mut self) -> &mut Self::Target {
                &mut self.0
            }
        }

        impl<T> Index<$terminal> for $name<T> {
            type Output = T;

            fn index(&self, terminal: $terminal) -> &T {
                &self.0[terminal.index()]
            }
        }

        impl<T> IndexMut<$terminal> for $name<T> {
            fn index_mut(&mut self, terminal: $terminal) -> &mut T {
                &mut self.0[terminal.index()]
            }
        }

        /// As for an array, with a panic that says what to write instead.
        impl<T, I: SliceIndex<[T]> + Clone + fmt::Debug> Index<I> for $name<T> {
            type Output = I::Output;

            #[track_caller]
            fn index(&self, index: I) -> &I::Output {
                // No closure, so that the panic shows the caller's line.
                match self.0.get(index.clone()) {
                    Some(values) => values,
                    None => no_terminal(&index, &$terminal::ALL),
                }
            }
        }

        impl<T, I: SliceIndex<[T]> + Clone + fmt::Debug> IndexMut<I> for $name<T> {
            #[track_caller]
            fn index_mut(&mut self, index: I) -> &mut I::Output {
                match self.0.get_mut(index.clone()) {
                    Some(values) => values,
                    None => no_terminal(&index, &$terminal::ALL),
                }
            }
        }

        impl<T> From<[T; $terminal::ALL.len()]> for $name<T> {
            fn from(values: [T; $terminal::ALL.len()]) -> Self {
                Self(values)
            }
        }

        impl<T> From<$name<T>> for [T; $terminal::ALL.len()] {
            fn from(values: $name<T>) -> Self {
                values.0
            }
        }

        impl<T: PartialEq> PartialEq<[T; $terminal::ALL.len()]> for $name<T> {
            fn eq(&self, other: &[T; $terminal::ALL.len()]) -> bool {
                self.0 == *other
            }
        }

        impl<T: PartialEq> PartialEq<$name<T>> for [T; $terminal::ALL.len()] {
            fn eq(&self, other: &$name<T>) -> bool {
                *self == other.0
            }
        }

        impl<T> IntoIterator for $name<T> {
            type Item = T;
            type IntoIter = std::array::IntoIter<T, { $terminal::ALL.len() }>;

            fn into_iter(self) -> Self::IntoIter {
                self.0.into_iter()
            }
        }

        impl<'a, T> IntoIterator for &'a $name<T> {
            type Item = &'a T;
            type IntoIter = std::slice::Iter<'a, T>;

            fn into_iter(self) -> Self::IntoIter {
                self.0.iter()
            }
        }

        impl<'a, T> IntoIterator for &'a mut $name<T> {
            type Item = &'a mut T;
            type IntoIter = std::slice::IterMut<'a, T>;

            fn into_iter(self) -> Self::IntoIter {
                self.0.iter_mut()
            }
        }

        /// As the array.
        impl<T: fmt::Debug> fmt::Debug for $name<T> {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

per_terminal! {
    /// A value of each universal input: `uni[I1]` to `uni[I8]`.
    PerInput: Input
}

per_terminal! {
    /// A value of each counter input: `counter[C1]` to `counter[C4]`.
    PerCounter: Counter
}

per_terminal! {
    /// A value of each motor output: `distance[M1]` to `distance[M4]`.
    PerMotor: Motor
}

per_terminal! {
    /// A value of each single output: `duty[O1]` to `duty[O8]`.
    PerOutput: Output
}

#[cold]
#[track_caller]
fn no_terminal(index: &dyn fmt::Debug, all: &[impl fmt::Display]) -> ! {
    let (first, last) = (&all[0], &all[all.len() - 1]);
    panic!(
        "there is no terminal with the index {index:?}: numbers count from 0, {first}, to {}, {last}; \
         write the terminal's name instead, such as [{last}]",
        all.len() - 1
    )
}

#[cfg(test)]
mod tests {
    use std::panic::catch_unwind;

    use super::*;
    use crate::prelude::*;

    #[test]
    fn a_terminal_and_its_number_are_the_same_place() {
        let mut area = FishX1Transfer::default();
        area.input.uni[I8] = -3;
        area.input.counter[C2] = 7;
        area.output.duty[O7] = 512;
        area.output.distance[M4] = 1000;
        assert_eq!(area.input.uni, [0, 0, 0, 0, 0, 0, 0, -3]);
        assert_eq!(area.input.counter[1..], [7, 0, 0]);
        assert_eq!((area.output.duty[6], area.output.distance[3]), (512, 1000));
        area.output.duty[0] = 1;
        assert_eq!((area.output.duty[O1], area.output.duty[O7]), (1, 512));
        assert_eq!((area.input.uni[I8], area.input.counter[C2]), (-3, 7));
        assert_eq!(area.output.distance[M4], 1000);
    }

    #[test]
    fn the_values_are_those_of_an_array() {
        let mut values = PerMotor::from([3, 1, 2, 0]);
        for value in &mut values {
            *value += 1;
        }
        assert_eq!(values, [4, 2, 3, 1]);
        assert_eq!([4, 2, 3, 1], values);
        assert_eq!(<[i32; 4]>::from(values), [4, 2, 3, 1]);
        assert_eq!(format!("{values:?}"), "[4, 2, 3, 1]");
        assert_eq!((values.len(), values.map(|value| value * 2)), (4, [8, 4, 6, 2]));
        assert!((&values).into_iter().eq(&[4, 2, 3, 1]) && values.into_iter().sum::<i32>() == 10);
        *values = [0; 4];
        assert_eq!(values, PerMotor::default());
    }

    #[test]
    fn an_index_beyond_the_terminals_panics_with_what_to_write_instead() {
        let said = |index: fn()| {
            let panic = catch_unwind(index).unwrap_err();
            panic.downcast_ref::<String>().cloned().unwrap_or_default()
        };
        let number = said(|| PerInput::<i16>::default()[8] = 1);
        assert!(number.contains("index 8: numbers count from 0, I1, to 7, I8"), "{number}");
        let range = said(|| assert_eq!(PerCounter::<u16>::default()[3..5], []));
        assert!(range.contains("index 3..5: numbers count from 0, C1, to 3, C4"), "{range}");
    }
}
