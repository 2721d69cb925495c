//! Stacks for handlers of signals.

use std::mem::{self, zeroed};
use std::ptr;

/// A stack of its own for handlers in this thread, whose other one may be full, unless the program has given it one.
pub(crate) struct Stack(Option<Box<[u8]>>);

impl Stack {
    pub(crate) fn give() -> Self {
        const SIZE: usize = 64 << 10;
        // SAFETY: integers and pointers, for which all bits 0 are valid.
        let mut present: libc::stack_t = unsafe { zeroed() };
        // SAFETY: the place for what is there is this function's.
        let is_known = unsafe { libc::sigaltstack(ptr::null(), &raw mut present) } == 0;
        if !is_known || present.ss_flags & libc::SS_DISABLE == 0 {
            return Self(None);
        }
        let mut stack = vec![0_u8; SIZE].into_boxed_slice();
        let given = libc::stack_t { ss_sp: stack.as_mut_ptr().cast(), ss_flags: 0, ss_size: SIZE };
        // SAFETY: the stack is freed only after it was taken away. Without it a full stack ends the program at once.
        unsafe { libc::sigaltstack(&raw const given, ptr::null_mut()) };
        Self(Some(stack))
    }
}

impl Drop for Stack {
    fn drop(&mut self) {
        let Some(stack) = self.0.take() else { return };
        let none = libc::stack_t { ss_sp: ptr::null_mut(), ss_flags: libc::SS_DISABLE, ss_size: 0 };
        // SAFETY: no handler runs on it, as this is called in its thread.
        if unsafe { libc::sigaltstack(&raw const none, ptr::null_mut()) } != 0 {
            mem::forget(stack);
        }
    }
}
