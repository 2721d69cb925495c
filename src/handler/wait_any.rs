//! Waiting for the first of several controllers.

use std::time::Instant;

use super::area::TransferArea;
use super::guard::TransferAreaGuard;
use super::response_wait::Wait;
use super::sync::park;
use crate::error::Error;

impl TransferArea {
    /// Waits for the next response of any of several controllers; returns the index of its areas, and the
    /// areas locked, as [`wait_cycle`](Self::wait_cycle) does for one.
    ///
    /// This is for a loop that controls several machines, each by a handler of its own. Their responses come
    /// at independent times, so waiting for one controller while the areas of another are locked makes the
    /// reactions to the other late. With this call each response is answered in time. The newest inputs of
    /// the other controllers are read by [`lock`](Self::lock), which does not wait for a response, so it may
    /// be called while the returned guard is held; what is written there goes out with their next request.
    /// To answer a response, write under the guard that this returns for it.
    ///
    /// When there are several responses, it returns the oldest; the others keep their reaction windows until
    /// the next call. In [lock-step](crate::TransferAreaComHandlerBuilder::lock_step) it returns the areas
    /// whose transfer has had the least time, so they take turns.
    ///
    /// ```
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::{Error, TransferAreaComHandler, TransferArea};
    ///
    /// /// The belt at the second controller runs while the first one's light barrier is interrupted.
    /// fn feed(first: &TransferAreaComHandler, second: &TransferAreaComHandler) -> Result<(), Error> {
    ///     let (barrier, belt) = (first.transfer_area(), second.transfer_area());
    ///     loop {
    ///         let (which, areas) = TransferArea::wait_any(&[&barrier, &belt]);
    ///         let mut areas = areas?;
    ///         if which == 0 {
    ///             let waits = areas[LOCAL_IO].input.uni[0] == 0;
    ///             areas[LOCAL_IO].output.duty[6] = if waits { 512 } else { 0 }; // a lamp at O7
    ///         } else {
    ///             let waits = barrier.lock()[LOCAL_IO].input.uni[0] == 0;
    ///             areas[LOCAL_IO].output.duty[0] = if waits { 512 } else { 0 }; // M1
    ///         }
    ///     }
    /// }
    /// ```
    ///
    /// Blocks as `wait_cycle` does until the first of them has a response or an error. Threads that each hold
    /// guards of several controllers must lock them in the same order.
    ///
    /// # Errors
    ///
    /// As `wait_cycle`, with the index of the areas whose transfer has the error. An error comes before the
    /// responses of the others: leave areas whose transfer has ended out of the next call.
    /// [`Error::OutOfRange`] without any areas.
    ///
    /// # Panics
    ///
    /// When this thread holds a guard of any of them, as [`lock`](Self::lock).
    #[track_caller]
    pub fn wait_any<'a>(areas: &[&'a Self]) -> (usize, Result<TransferAreaGuard<'a>, Error>) {
        if let Err(error) =
            Error::check_range("number of areas", areas.len(), 1..=i64::from(u16::MAX))
        {
            return (0, Err(error));
        }
        for area in areas {
            area.shared().check_free();
        }
        if areas.iter().all(|area| area.shared().is_lock_step()) {
            let time = |index: &usize| areas[*index].shared().elapsed();
            let slowest = (0..areas.len()).min_by_key(time).unwrap_or_default();
            return (slowest, areas[slowest].wait_cycle());
        }
        let mut waits = Vec::with_capacity(areas.len());
        for (index, area) in areas.iter().enumerate() {
            match area.learn(|known| area.shared().begin_shared_wait(known)) {
                Ok(wait) => waits.push(wait),
                Err(error) => {
                    put_off(areas, &waits, None);
                    return (index, Err(error));
                }
            }
        }
        loop {
            match first_told(areas, &mut waits) {
                Some((index, Ok(()))) => {
                    put_off(areas, &waits, Some(index));
                    let area = areas[index];
                    let taken = area.learn(|known| area.shared().take_after(&waits[index], *known));
                    let guard = area.guard(taken);
                    area.note_returned(guard.window());
                    return (index, Ok(guard));
                }
                Some((index, Err(error))) => {
                    put_off(areas, &waits, Some(index));
                    return (index, Err(error));
                }
                None => park(),
            }
        }
    }
}

/// The oldest response that has come in, or an error.
fn first_told(areas: &[&TransferArea], waits: &mut [Wait]) -> Option<(usize, Result<(), Error>)> {
    let mut oldest: Option<(usize, Instant)> = None;
    for (index, (area, wait)) in areas.iter().zip(waits).enumerate() {
        match area.learn(|known| area.shared().look_after(wait, known)) {
            Ok(Some(arrived)) if oldest.is_none_or(|(_, before)| arrived < before) => {
                oldest = Some((index, arrived));
            }
            Ok(_) => {}
            Err(error) => return Some((index, Err(error))),
        }
    }
    oldest.map(|(index, _)| (index, Ok(())))
}

/// Ends the waits that have begun, except this one.
fn put_off(areas: &[&TransferArea], waits: &[Wait], except: Option<usize>) {
    for (index, (area, wait)) in areas.iter().zip(waits).enumerate() {
        if Some(index) != except {
            area.shared().put_off(wait);
        }
    }
}
