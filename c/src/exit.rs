//! What happens when a program ends without ending its transfers.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Once, Weak};
use std::thread;
use std::time::Duration;

use ft_transfer_area::Error;
use parking_lot::Mutex;

use crate::ffi::guarded;
use crate::{process, sentences};

#[cfg(unix)]
#[path = "exit/unix.rs"]
mod system;
#[cfg(not(unix))]
#[path = "exit/windows.rs"]
mod system;

#[cfg(unix)]
#[path = "exit/stack.rs"]
mod stack;

#[cfg(unix)]
pub(crate) use stack::Stack;
pub(crate) use system::{at_exit, threads_are_gone};
#[cfg(unix)]
pub(crate) use system::{
    end_before_crash, ends, ends_by_ctrl_c, handler_of, on_end, take_over, SUSPENDS,
};

/// How long the end of a program waits for a lock that another thread has.
pub(crate) const LOCK_LIMIT: Duration = Duration::from_secs(1);

/// How long it waits for an answer of the controller that is under way: longer than that may take.
pub(crate) const ANSWER_LIMIT: Duration = Duration::from_millis(2500);

/// A transfer that ends with the program.
pub(crate) trait Transfer: Send + Sync {
    /// Ends it with all outputs off, if it runs.
    fn end(&self);

    /// Has a thread that exchanges, if there is one, end it soon. Allocates nothing and waits for nothing.
    fn ask(&self) {}
}

/// The transfers that were begun, each with the process that has begun it: a child after `fork` has the list,
/// but the connections are its parent's.
static WATCHED: Mutex<Vec<(u32, Weak<dyn Transfer>)>> = Mutex::new(Vec::new());

/// Set from when all transfers end: a thread of the program that goes on meanwhile must not begin one again.
static ENDING: AtomicBool = AtomicBool::new(false);

/// An error when the program is ending.
pub(crate) fn check_goes_on() -> Result<(), Error> {
    if ENDING.load(Ordering::SeqCst) {
        return Err(Error::NotStarted);
    }
    Ok(())
}

/// The program goes on after its transfers have ended.
#[cfg(unix)]
fn goes_on() {
    ENDING.store(false, Ordering::SeqCst);
}

/// From now on the end that a signal asks for is seen, also while a thread of the program is in a call.
pub(crate) fn watch_signals() {
    system::watch();
    sentences::begin();
}

/// Ends this transfer when the program returns from `main` or calls `exit`: before what the program destroys
/// then, such as what its callbacks use. So it does when the program is asked to end, as by Ctrl-C, unless the
/// program itself does something then. A program that ends otherwise only closes the connection, at which a TXT's
/// motors may go on.
///
/// It is called before the transfer begins, so that none is missed by an end that comes meanwhile.
pub(crate) fn watch<T: Transfer + 'static>(transfer: &Arc<T>) {
    static REGISTER: Once = Once::new();
    REGISTER.call_once(|| {
        at_exit(end_at_exit);
        #[cfg(unix)]
        system::at_exit_of_python(ft_end_transfers);
    });
    watch_signals();
    let own = std::process::id();
    let transfer: Weak<dyn Transfer> = Arc::<T>::downgrade(transfer);
    let mut watched = WATCHED.lock();
    watched.retain(|(_, other)| other.strong_count() > 0 && !other.ptr_eq(&transfer));
    watched.push((own, transfer));
}

extern "C" fn end_at_exit() {
    ft_end_transfers();
    if !process::is_forked() && !threads_are_gone() {
        guarded((), sentences::flush);
        system::end_as_asked();
    }
}

/// Ends all transfers with all outputs off, and lets none begin: the program ends. `end_first.c` calls it.
#[no_mangle]
pub(crate) extern "C" fn ft_end_transfers() {
    if !process::is_forked() && !threads_are_gone() {
        guarded((), end_all);
    }
}

/// Ends all transfers of this process, side by side: one that does not answer does not keep the others moving.
fn end_all() {
    ENDING.store(true, Ordering::SeqCst);
    let own = std::process::id();
    let Some(watched) = WATCHED.try_lock_for(LOCK_LIMIT) else { return };
    let own = watched.iter().filter(|(process, _)| *process == own);
    let transfers = own.filter_map(|(_, transfer)| transfer.upgrade());
    // A handler that calls `exit` may have interrupted the program where it has the allocator's lock.
    transfers.clone().for_each(|transfer| transfer.ask());
    let transfers: Vec<_> = transfers.collect();
    drop(watched);
    side_by_side(&transfers, |transfer| transfer.end());
}

/// Ends all of these at once. One alone needs no thread: in a handler there may be no memory for one.
pub(crate) fn side_by_side<T: Sync>(all: &[T], end: impl Fn(&T) + Sync) {
    let Some((last, others)) = all.split_last() else { return };
    thread::scope(|scope| {
        for one in others {
            if thread::Builder::new().spawn_scoped(scope, || end(one)).is_err() {
                end(one);
            }
        }
        end(last);
    });
}
