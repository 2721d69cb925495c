//! The fields of the area's structs. Their layout is checked when the crate is compiled.

use std::mem::{offset_of, size_of};

use super::*;

/// The size of the field that `_field` returns.
#[allow(dead_code, reason = "Rust 1.85 does not see that the constant below uses it")]
pub(super) const fn size_of_field<T, F>(_field: fn(&T) -> &F) -> usize {
    size_of::<F>()
}

/// Checks that each field begins where the one before it ends, so that the compiler has left no gaps, and
/// neither the list nor a struct has a field that the other has not. Where each field is follows from the
/// types; the tests compare this with what a C compiler makes of the controller's header.
macro_rules! without_gaps {
    ($($name:ident { $($field:ident)+ })+) => {$(
        let end = 0;
        $(
            assert!(offset_of!($name, $field) == end, stringify!($name.$field));
            let end = end + size_of_field(|part: &$name| &part.$field);
        )+
        assert!(size_of::<$name>() == end, concat!("end of ", stringify!($name)));
    )+};
}

const _: () = {
    assert!(size_of::<FishX1Transfer>() == FishX1Transfer::LEN);
    transfer_area_structs!(without_gaps);
};
