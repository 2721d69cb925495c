//! These run under Miri and AddressSanitizer, too, see `.ci/run`.

use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicI16, Ordering};
use std::sync::Arc;
use std::thread;

use ft_transfer_area::FishX1Transfer;

use super::*;

/// The first duty of an area.
fn duty<A: Area>(array: &AreaArray<A>, index: usize) -> *mut i16 {
    // SAFETY: computes an address within the area only.
    unsafe { (&raw mut (*array.places(index).output).duty).cast() }
}

fn a_program_writes_while_it_is_read<A: Area>() {
    let array = Arc::new(AreaArray::<A>::new());
    let last = duty(&array, AREAS - 1);
    let of_program = Arc::clone(&array);
    let program = thread::spawn(move || {
        let last = duty(&of_program, AREAS - 1);
        for value in 1..=50 {
            // SAFETY: the area outlives this thread. A program in C writes the same way.
            unsafe { AtomicI16::from_ptr(last) }.store(value, Ordering::Relaxed);
        }
    });
    let mut before = 0;
    while before < 50 {
        let now = array.load(last);
        assert!(now >= before, "{now} after {before}");
        before = now;
        thread::yield_now();
    }
    program.join().expect("it does not panic");
    assert_eq!(array.load(duty(&array, 0)), 0, "another area");
}

#[test]
fn a_program_writes_its_areas_at_any_time() {
    a_program_writes_while_it_is_read::<Ta>();
    a_program_writes_while_it_is_read::<FishX1Transfer>();
}

#[test]
fn only_what_lies_in_the_areas_is_reached() {
    let array = AreaArray::<Ta>::new();
    let first = array.as_ptr().cast::<i16>();
    let words = AREAS * size_of::<Ta>() / 2;
    array.store(first.wrapping_add(words - 1), 7);
    assert_eq!(array.load(first.wrapping_add(words - 1)), 7);
    let odd = first.cast::<u8>().wrapping_add(1).cast::<i16>();
    for wrong in [first.wrapping_add(words), first.wrapping_sub(1), odd] {
        let reached = catch_unwind(AssertUnwindSafe(|| array.load(wrong)));
        assert!(reached.is_err(), "{wrong:?} is reached");
    }
}
