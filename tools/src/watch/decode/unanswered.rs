//! The commands of a main connection that have no response yet.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CommandId, ResponseId};

use super::outgoing::Sent;
use crate::seen::{Happened, KEPT_MAX, NO_ANSWER};

/// The commands without a response. Older ones that have no room are forgotten and counted, because their responses
/// come first.
#[derive(Default)]
pub(super) struct Unanswered {
    kept: VecDeque<Waiting>,
    /// How many older ones there are, by their response. There are as many kinds as commands.
    forgotten: Vec<(ResponseId, u64)>,
    /// The oldest of these, and when the newest was sent.
    oldest: Option<Waiting>,
    newest: Option<Instant>,
}

/// A command without a response.
pub(super) struct Waiting {
    pub(super) command: CommandId,
    pub(super) since: Instant,
    /// The time from the response before.
    pub(super) answer: Option<Duration>,
    /// What an exchange has sent.
    pub(super) sent: Option<Sent>,
    /// By the relay, after the program has gone.
    pub(super) is_relays: bool,
    /// A missing response was reported. One may still come, until the program goes on without it.
    is_told: bool,
}

/// The command of a response.
pub(super) enum Answered {
    Known(Box<Waiting>),
    /// What it has sent was forgotten.
    Forgotten,
}

impl Waiting {
    pub(super) fn new(command: CommandId, since: Instant) -> Self {
        Self { command, since, answer: None, sent: None, is_relays: false, is_told: false }
    }

    fn report(&mut self, report: &mut dyn FnMut(Happened)) {
        if !std::mem::replace(&mut self.is_told, true) {
            report(Happened::NoAnswer { command: self.command, since: self.since });
        }
    }

    fn is_late(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.since) >= NO_ANSWER
    }
}

impl Unanswered {
    /// The program goes on without the responses of which it was reported that they are missing.
    pub(super) fn go_on(&mut self, now: Instant) {
        let is_over = |newest| now.saturating_duration_since(newest) >= NO_ANSWER;
        if self.newest.is_some_and(is_over) {
            self.clear_forgotten();
        }
        self.kept.retain(|one| !one.is_told);
    }

    /// A command was sent. Returns whether an exchange was forgotten for it.
    pub(super) fn add(&mut self, waiting: Waiting) -> bool {
        let old = if self.kept.len() < KEPT_MAX { None } else { self.kept.pop_front() };
        self.kept.push_back(waiting);
        let Some(mut old) = old else { return false };
        let response = old.command.response();
        match self.forgotten.iter_mut().find(|(of, _)| *of == response) {
            Some((_, count)) => *count += 1,
            None => self.forgotten.push((response, 1)),
        }
        self.newest = Some(old.since);
        let is_exchange = old.sent.take().is_some();
        self.oldest.get_or_insert(old);
        is_exchange
    }

    /// Takes out the command to which this is the response. Those before it get none.
    pub(super) fn take(
        &mut self,
        at: Instant,
        response: ResponseId,
        report: &mut dyn FnMut(Happened),
    ) -> Option<Answered> {
        let place = self.forgotten.iter().position(|(of, _)| *of == response);
        if let Some(place) = place {
            self.forgotten[place].1 -= 1;
            if self.forgotten[place].1 == 0 {
                self.forgotten.swap_remove(place);
            }
            // When the next one was sent is forgotten, too.
            let oldest = self.oldest.take().filter(|_| !self.forgotten.is_empty());
            self.oldest = oldest.map(|old| Waiting::new(old.command, at));
            return Some(Answered::Forgotten);
        }
        let place = self.kept.iter().position(|one| one.command.response() == response)?;
        if let Some(mut oldest) = self.oldest.take() {
            oldest.report(report);
        }
        self.clear_forgotten();
        self.kept.drain(..place).for_each(|mut one| one.report(report));
        self.kept.pop_front().map(|waiting| Answered::Known(Box::new(waiting)))
    }

    /// Reports the responses that have not come in time.
    pub(super) fn look(&mut self, now: Instant, report: &mut dyn FnMut(Happened)) {
        let all = self.oldest.iter_mut().chain(&mut self.kept);
        all.take_while(|one| one.is_late(now)).for_each(|one| one.report(report));
    }

    /// How many exchanges of the program there are, and when the oldest was sent, as far as it is known.
    pub(super) fn exchanges(&self) -> Option<(u64, Instant)> {
        let exchanges = [ResponseId::ExchangeData, ResponseId::ExchangeDataCmpr];
        let forgotten = self.forgotten.iter().filter(|(of, _)| exchanges.contains(of));
        let kept = || self.kept.iter().filter(|one| one.sent.is_some() && !one.is_relays);
        let since = self.oldest.iter().chain(kept()).next()?.since;
        let count = forgotten.map(|(_, count)| count).sum::<u64>() + kept().count() as u64;
        (count > 0).then_some((count, since))
    }

    fn clear_forgotten(&mut self) {
        self.forgotten.clear();
        (self.oldest, self.newest) = (None, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn add(unanswered: &mut Unanswered, command: CommandId, at: Instant) -> bool {
        let mut waiting = Waiting::new(command, at);
        waiting.sent = (command == CommandId::ExchangeData).then(Sent::default);
        unanswered.add(waiting)
    }

    #[test]
    fn responses_to_forgotten_commands_come_first_and_are_counted() {
        let (mut unanswered, at) = (Unanswered::default(), Instant::now());
        assert!(!add(&mut unanswered, CommandId::StartOnline, at));
        for number in 0..100 {
            let forgets = add(&mut unanswered, CommandId::ExchangeData, at);
            assert_eq!(forgets, number >= KEPT_MAX, "{number}");
        }
        assert_eq!(unanswered.exchanges(), Some((100, at)));
        let mut told = 0;
        let mut take = |response| unanswered.take(at, response, &mut |_| told += 1);
        assert!(matches!(take(ResponseId::StartOnline), Some(Answered::Forgotten)));
        for number in 0..100 {
            let taken = take(ResponseId::ExchangeData);
            let is_known = matches!(taken, Some(Answered::Known(_)));
            assert!(taken.is_some() && is_known == (number >= 36), "{number}");
        }
        assert!(take(ResponseId::ExchangeData).is_none());
        assert_eq!((told, unanswered.exchanges()), (0, None));
    }

    /// With so many, none of those that are kept gets old enough.
    #[test]
    fn silence_is_reported_once_however_many_commands_are_sent_in_it() {
        let (mut unanswered, begin) = (Unanswered::default(), Instant::now());
        let mut told = Vec::new();
        for number in 0..300 {
            let at = begin + Duration::from_millis(10 * number);
            unanswered.look(at, &mut |what| told.push((number, what)));
            unanswered.go_on(at);
            add(&mut unanswered, CommandId::ExchangeData, at);
        }
        assert!(
            matches!(told[..], [(200, Happened::NoAnswer { since, .. })] if since == begin),
            "{told:?}"
        );
        assert_eq!(unanswered.exchanges(), Some((300, begin)));
    }

    #[test]
    fn a_program_that_goes_on_after_a_silence_gets_no_answer_to_what_was_before() {
        let (mut unanswered, begin) = (Unanswered::default(), Instant::now());
        for _ in 0..100 {
            add(&mut unanswered, CommandId::ExchangeData, begin);
        }
        let later = begin + NO_ANSWER;
        unanswered.look(later, &mut |_| {});
        unanswered.go_on(later);
        add(&mut unanswered, CommandId::ExchangeData, later);
        assert_eq!(unanswered.exchanges(), Some((1, later)));
        let taken = unanswered.take(later, ResponseId::ExchangeData, &mut |_| {});
        assert!(matches!(taken, Some(Answered::Known(_))));
    }
}
