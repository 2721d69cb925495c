//! What happens when a program ends without ending its transfers.

use std::sync::{Arc, Once, Weak};

use ft_transfer_area::transfer_area::FishX1Transfer;
use parking_lot::Mutex;

use crate::ffi::guarded;
use crate::session::ProgramSession;

type Watched = ProgramSession<FishX1Transfer>;

static WATCHED: Mutex<Vec<Weak<Watched>>> = Mutex::new(Vec::new());

/// Ends this session when the program returns from `main` or calls `exit`: before what the program destroys
/// then, such as what its callbacks use. A program that ends otherwise closes the connection, so the
/// controller stops its motors, too.
pub(crate) fn watch(session: &Arc<Watched>) {
    static REGISTER: Once = Once::new();
    REGISTER.call_once(|| {
        // SAFETY: the function lives as long as this library, and does not unwind.
        unsafe { libc::atexit(end_all) };
    });
    let mut watched = WATCHED.lock();
    watched.retain(|other| other.strong_count() > 0);
    watched.push(Arc::downgrade(session));
}

extern "C" fn end_all() {
    guarded((), || {
        let watched = std::mem::take(&mut *WATCHED.lock());
        for session in watched.iter().filter_map(Weak::upgrade) {
            if session.is_running() {
                // There is nobody left to be told.
                let _ = session.stop();
            }
        }
    });
}
