//! An area as its 1024 bytes, and back.
//!
//! The crate has no unsafe code, so the bytes are written and read field by field, without gaps.

use std::array;
use std::slice;

use super::*;

/// A value in the controller's memory.
trait Bytes {
    /// Writes the value to the next bytes, and takes no more of them.
    fn write<'a>(&self, to: &mut impl Iterator<Item = &'a mut u8>);

    /// Reads a value from the next bytes.
    fn read(from: &mut slice::Iter<'_, u8>) -> Self;
}

macro_rules! integers {
    ($($integer:ty)+) => {$(
        impl Bytes for $integer {
            fn write<'a>(&self, to: &mut impl Iterator<Item = &'a mut u8>) {
                // The value's bytes first: their end takes no place from the next value.
                self.to_le_bytes().into_iter().zip(to).for_each(|(byte, place)| *place = byte);
            }

            fn read(from: &mut slice::Iter<'_, u8>) -> Self {
                Self::from_le_bytes(array::from_fn(|_| from.next().copied().unwrap_or_default()))
            }
        }
    )+};
}

impl<T: Bytes, const N: usize> Bytes for [T; N] {
    fn write<'a>(&self, to: &mut impl Iterator<Item = &'a mut u8>) {
        self.iter().for_each(|element| element.write(to));
    }

    fn read(from: &mut slice::Iter<'_, u8>) -> Self {
        array::from_fn(|_| T::read(from))
    }
}

/// Implements [`Bytes`] for structs, by all their fields in the order of their declaration.
macro_rules! structs {
    ($($name:ident { $($field:ident)+ })+) => {$(
        impl Bytes for $name {
            fn write<'a>(&self, to: &mut impl Iterator<Item = &'a mut u8>) {
                // Does not compile when a field is missing.
                let Self { $($field),+ } = self;
                $($field.write(to);)+
            }

            fn read(from: &mut slice::Iter<'_, u8>) -> Self {
                $(let $field = Bytes::read(from);)+
                Self { $($field),+ }
            }
        }
    )+};
}

/// Implements [`Bytes`] as for the array of the same layout.
macro_rules! per_terminal {
    ($($name:ident: $n:ident)+) => {$(
        impl<T: Bytes> Bytes for $name<T> {
            fn write<'a>(&self, to: &mut impl Iterator<Item = &'a mut u8>) {
                (**self).write(to);
            }

            fn read(from: &mut slice::Iter<'_, u8>) -> Self {
                let values: [T; $n] = Bytes::read(from);
                values.into()
            }
        }
    )+};
}

integers! { u8 i16 u16 u32 }

per_terminal! { PerInput: IZ_UNI_INPUT PerCounter: IZ_COUNTER PerMotor: IZ_MOTOR PerOutput: IZ_PWM_CHAN }

transfer_area_structs!(structs);

impl FishX1Transfer {
    /// Its size in bytes, as on the controller.
    pub const LEN: usize = 1024;

    /// The area as its bytes in the controller's memory, which is little-endian. C programs get them by
    /// `memcpy`, to store, send or compare them.
    ///
    /// ```
    /// use ft_transfer_area::prelude::*;
    ///
    /// let mut area = FishX1Transfer::default();
    /// area.output.duty[O1] = 512;
    /// let bytes = area.to_bytes();
    /// assert_eq!(bytes[332..334], [0, 2]); // where the controller has it
    /// assert_eq!(FishX1Transfer::from_bytes(&bytes), area);
    /// ```
    #[doc(alias = "memcpy")]
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::LEN] {
        let mut bytes = [0; Self::LEN];
        self.write(&mut bytes.iter_mut());
        bytes
    }

    /// The area that has these bytes in the controller's memory. Every value is allowed for each byte.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; Self::LEN]) -> Self {
        Self::read(&mut bytes.iter())
    }
}

#[cfg(test)]
mod tests {
    use std::mem::{offset_of, size_of};

    use super::super::layout::size_of_field;
    use super::*;

    /// A byte that differs from those of the places around it.
    fn mark(place: usize) -> u8 {
        (place % 251 + 1) as u8
    }

    fn bytes_of(value: &impl Bytes, size: usize) -> Vec<u8> {
        let mut bytes = vec![0; size];
        value.write(&mut bytes.iter_mut());
        bytes
    }

    /// Checks for each field that it is read from its place in memory, and from nowhere else.
    macro_rules! check {
        ($($name:ident { $($field:ident)+ })+) => {
            $($({
                let size = size_of_field(|part: &$name| &part.$field);
                let places = offset_of!($name, $field)..offset_of!($name, $field) + size;
                let mut bytes = [0; size_of::<$name>()];
                places.clone().for_each(|place| bytes[place] = mark(place));
                let part = $name::read(&mut bytes.iter());
                let name = stringify!($name.$field);
                assert_eq!(bytes_of(&part.$field, size), bytes[places], "{name} is read from elsewhere");
                assert_eq!(bytes_of(&part, bytes.len()), bytes, "{name} is written elsewhere");
            })+)+
        };
    }

    #[test]
    fn every_field_lies_where_it_is_in_memory() {
        transfer_area_structs!(check);
    }

    #[test]
    fn integers_are_little_endian_and_signed_as_in_c() {
        let mut bytes = [0; FishX1Transfer::LEN];
        bytes[36..40].copy_from_slice(&[0x78, 0x56, 0x34, 0x12]);
        bytes[252..254].copy_from_slice(&[0xFE, 0xFF]);
        bytes[348..350].copy_from_slice(&[0xFE, 0xFF]);
        let area = FishX1Transfer::from_bytes(&bytes);
        assert_eq!(area.info.shared_memory_start, 0x1234_5678);
        assert_eq!((area.input.uni[0], area.output.distance[0]), (-2, 65_534));
    }

    #[test]
    fn writing_takes_no_byte_of_the_next_value() {
        let area = FishX1Transfer::from_bytes(&array::from_fn(mark));
        let mut bytes = [0; FishX1Transfer::LEN];
        // One of which the standard library does not know how many bytes are left.
        area.write(&mut bytes.iter_mut().filter(|_| true));
        assert_eq!(bytes, area.to_bytes());
    }

    #[test]
    fn every_byte_comes_back() {
        let bytes = array::from_fn(mark);
        let area = FishX1Transfer::from_bytes(&bytes);
        assert_eq!(area.to_bytes(), bytes);
        assert_eq!(
            (area.reserved[157], area.hook_table[34]),
            (mark(1023), { u32::from_le_bytes([660, 661, 662, 663].map(mark)) })
        );
    }
}
