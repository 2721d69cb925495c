//! The topics of one controller.

use std::borrow::Cow;
use std::collections::HashSet;

use ft_transfer_area::transfer_area::MAX_EXTENSIONS;

use super::value::values_of;
use crate::print::beginning;

/// Topics of one controller that are not about a single terminal.
pub(crate) const STATE: &str = "state";
pub(crate) const MASTER: &str = "master";
pub(crate) const EVENT: &str = "event";
pub(crate) const ERROR: &str = "error";
pub(crate) const HEARTBEAT: &str = "heartbeat";
pub(crate) const STOP: &str = "stop";

/// No command has more characters behind prefix and name.
const TAIL: usize = 60;

/// The topics of one controller: all begin with the prefix and its name.
#[derive(Clone, Debug)]
pub(crate) struct Topics {
    prefix: String,
    name: String,
}

/// What an incoming message is for.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Addressed<'a> {
    /// A command: the topic without prefix and name. Commands for all controllers have it, too.
    Command(&'a str),
    /// The state that a bridge of this name has published.
    State,
}

impl Topics {
    pub(crate) fn new(prefix: &str, name: &str) -> Self {
        Self { prefix: prefix.to_owned(), name: name.to_owned() }
    }

    /// The whole topic for what follows prefix and name.
    pub(crate) fn of(&self, tail: &str) -> String {
        format!("{}/{}/{tail}", self.prefix, self.name)
    }

    /// The topics to subscribe to: also those that are not commands, so that a wrong one is answered. Those of inputs
    /// and motors are not among them, because the bridge would get each of its own values back. No topic matches two.
    pub(crate) fn filters(&self) -> Vec<String> {
        let own = ["+/+", "+/+/+", STOP, HEARTBEAT, STATE].map(|tail| self.of(tail));
        let of_all = [STOP, HEARTBEAT].map(|tail| format!("{}/{tail}", self.prefix));
        own.into_iter().chain(of_all).collect()
    }

    /// The topics of all values that a bridge of this name publishes, or has published with more extensions.
    pub(crate) fn values(&self) -> HashSet<String> {
        let tails = (0..=MAX_EXTENSIONS).flat_map(values_of);
        tails.map(|(tail, _)| self.of(&tail)).collect()
    }

    /// A topic in an answer: those of commands are whole. Others may be 64 KiB long.
    pub(crate) fn reported<'a>(&self, topic: &'a str) -> Cow<'a, str> {
        beginning(topic, self.of("").len() + TAIL)
    }

    /// What a message on this topic is for; `None` for a topic that was not subscribed to.
    pub(crate) fn addressed<'a>(&self, topic: &'a str) -> Option<Addressed<'a>> {
        let behind_prefix = topic.strip_prefix(&*self.prefix)?.strip_prefix('/')?;
        if [STOP, HEARTBEAT].contains(&behind_prefix) {
            return Some(Addressed::Command(behind_prefix));
        }
        let tail = behind_prefix.strip_prefix(&*self.name)?.strip_prefix('/')?;
        Some(if tail == STATE { Addressed::State } else { Addressed::Command(tail) })
    }
}

/// Whether an extension is called so.
pub(crate) fn is_extension(name: &str) -> bool {
    (1..=MAX_EXTENSIONS).any(|extension| name == format!("ext{extension}"))
}

/// A name as one level of a topic: what has a meaning in topics, and what is hard to type, becomes `-`.
pub(crate) fn level(name: &str) -> String {
    let allowed = |c: char| c.is_alphanumeric() || "._:-[]".contains(c);
    name.chars().map(|c| if allowed(c) { c } else { '-' }).collect()
}

/// Whether a prefix can be the first levels of a topic.
pub(crate) fn is_prefix(prefix: &str) -> bool {
    prefix.len() <= 1000 && prefix.split('/').all(|part| !part.is_empty() && level(part) == part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_for_one_controller_or_for_all() {
        let topics = Topics::new("hall/ft", "press");
        assert_eq!(topics.of("I1"), "hall/ft/press/I1");
        let command = |tail| Some(Addressed::Command(tail));
        assert_eq!(topics.addressed("hall/ft/press/M1/set"), command("M1/set"));
        assert_eq!(topics.addressed("hall/ft/press/ext2/M1/set"), command("ext2/M1/set"));
        assert_eq!(topics.addressed("hall/ft/stop"), command("stop"));
        assert_eq!(topics.addressed("hall/ft/heartbeat"), command("heartbeat"));
        assert_eq!(topics.addressed("hall/ft/press/state"), Some(Addressed::State));
        for other in ["hall/ft/press2/M1/set", "hall/ft/press", "hall/ftpress/M1/set", "", "stop"] {
            assert_eq!(topics.addressed(other), None, "{other}");
        }
    }

    #[test]
    fn own_values_are_not_subscribed_to_or_not_read() {
        let topics = Topics::new("ft", "press");
        let filters = topics.filters();
        assert!(filters.contains(&"ft/press/+/+".to_owned()));
        assert!(filters.contains(&"ft/stop".to_owned()));
        assert!(!filters.contains(&"ft/press/+".to_owned()), "each change of an input comes back");
        let unread = topics.values();
        for topic in ["ft/press/I1/config", "ft/press/ext1/I1", "ft/press/ext8/remote/any"] {
            assert!(unread.contains(topic), "{topic}");
        }
        for topic in ["ft/press/M1/set", "ft/press/ext1/M1/set", "ft/press/state", "ft/stop"] {
            assert!(!unread.contains(topic), "{topic}");
        }
    }

    #[test]
    fn an_answer_has_the_topic_of_a_command_and_the_beginning_of_a_long_one() {
        let topics = Topics::new("hall/ft", "press");
        for topic in ["hall/ft/press/ext1/remote5/set", "hall/ft/stop", "hall/ft/press/+"] {
            assert_eq!(topics.reported(topic), topic);
        }
        let reported =
            topics.reported(&format!("hall/ft/press/{}/set", "x".repeat(60_000))).into_owned();
        assert!(reported.starts_with("hall/ft/press/xxx") && reported.len() < 100, "{reported}");
    }

    #[test]
    fn names_become_one_level_and_prefixes_are_checked() {
        assert_eq!(level("192.168.7.2:65000"), "192.168.7.2:65000");
        assert_eq!(level("my press/#1 +x"), "my-press--1--x");
        assert!(is_prefix("ft") && is_prefix("hall-2/ft"));
        for wrong in ["", "/ft", "ft/", "a//b", "a/#", "+", "a b", &"a".repeat(1001)] {
            assert!(!is_prefix(wrong), "{wrong}");
        }
    }
}
