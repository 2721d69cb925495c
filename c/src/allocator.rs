//! The library's own memory. A signal handler of the program may call this library after it has interrupted the program
//! in `malloc`, so nothing here waits for the locks of that. What a program has destroyed of its heap is not used either.

use std::alloc::{GlobalAlloc, Layout};
use std::sync::Once;

use dlmalloc::GlobalDlmalloc;

use crate::exit::end_before_crash;
use crate::inside;

#[global_allocator]
static OWN: OwnMemory = OwnMemory;

/// Lets no handler interrupt it.
struct OwnMemory;

/// Without memory Rust aborts, and first writes that, which perhaps nobody reads: the motors stop before.
fn or_end(memory: *mut u8) -> *mut u8 {
    if memory.is_null() {
        end_before_crash();
    }
    memory
}

// SAFETY: all is done by another allocator.
unsafe impl GlobalAlloc for OwnMemory {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _inside = inside::enter();
        // SAFETY: as the caller promises.
        or_end(unsafe { GlobalDlmalloc.alloc(layout) })
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        let _inside = inside::enter();
        // SAFETY: as the caller promises.
        unsafe { GlobalDlmalloc.dealloc(at, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        let _inside = inside::enter();
        // SAFETY: as the caller promises.
        or_end(unsafe { GlobalDlmalloc.alloc_zeroed(layout) })
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let _inside = inside::enter();
        // SAFETY: as the caller promises.
        or_end(unsafe { GlobalDlmalloc.realloc(at, layout, size) })
    }
}

/// A child after `fork` can allocate, whatever the other threads of its parent were doing. To be called before this
/// library starts a thread.
pub(crate) fn survive_forks() {
    static ONCE: Once = Once::new();
    // SAFETY: it takes the allocator's lock.
    ONCE.call_once(|| unsafe { dlmalloc::enable_alloc_after_fork() });
}
