//! What commands print.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{self, ErrorKind, Write};
use std::time::Duration;

use anyhow::Context;
#[cfg(unix)]
use nix::errno::Errno;
use serde::Serialize;

use crate::interrupt;

/// Prints a line, or several. A reader that has seen enough, such as `head`, is not an error; nor is one that reads no
/// last words.
pub(crate) fn line(text: impl Display) -> anyhow::Result<()> {
    let text = clean_lines(&text.to_string());
    let write = move || {
        let mut out = io::stdout().lock();
        writeln!(out, "{text}").and_then(|()| out.flush())
    };
    match interrupt::say(write).unwrap_or(Ok(())) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => done.context("can't write the output"),
    }
}

/// A text that comes from elsewhere, such as a name from a controller. To a terminal some characters are commands,
/// some would change the order of what stands beside them, and in a picture most of them are not allowed.
pub(crate) fn clean(text: &str) -> Cow<'_, str> {
    if text.contains(is_command) {
        text.replace(is_command, "\u{FFFD}").into()
    } else {
        text.into()
    }
}

/// The same for a text of several lines, which stay.
pub(crate) fn clean_lines(text: &str) -> String {
    text.split('\n').map(clean).collect::<Vec<_>>().join("\n")
}

/// The beginning of a text from outside, which may have any length.
pub(crate) fn beginning(text: &str, characters: usize) -> Cow<'_, str> {
    match text.char_indices().nth(characters) {
        Some((end, _)) => format!("{}…", &text[..end]).into(),
        None => text.into(),
    }
}

/// A time for people.
pub(crate) fn seconds(time: Duration) -> String {
    if time < Duration::from_millis(100) {
        format!("{:.1} ms", time.as_secs_f64() * 1e3)
    } else {
        format!("{:.2} s", time.as_secs_f64())
    }
}

/// A value as JSON. What would be a command is written as its number, so it stays the same for a script.
pub(crate) fn json(value: &impl Serialize) -> anyhow::Result<String> {
    Ok(escaped(&serde_json::to_string_pretty(value)?))
}

/// The same on one line.
pub(crate) fn json_line(value: &serde_json::Value) -> String {
    escaped(&value.to_string())
}

/// JSON in which no character is a command for a terminal.
fn escaped(json: &str) -> String {
    let mut text = String::new();
    for character in json.chars() {
        if is_command(character) && character != '\n' {
            text += &format!("\\u{:04x}", u32::from(character));
        } else {
            text.push(character);
        }
    }
    text
}

/// Whether a character is a command: also those that end a line or change the direction of writing.
fn is_command(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{2028}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
}

/// An error with its causes, and with what to do if something is used up. Some errors name their cause themselves;
/// it is not repeated.
pub(crate) fn sentence(error: &anyhow::Error) -> String {
    let mut reported = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if reported.is_empty() {
            reported = cause;
        } else if !reported.contains(&cause) {
            reported = format!("{reported}: {cause}");
        }
    }
    if let Some(remedy) = error.chain().find_map(remedy) {
        reported = format!("{reported}; {remedy}");
    }
    clean_lines(&reported)
}

/// What to do when descriptors, threads, memory or the disk are used up.
fn remedy(cause: &(dyn std::error::Error + 'static)) -> Option<&'static str> {
    /// What the operating system says for too many files and connections of this program, and of all programs.
    #[cfg(unix)]
    const FILES: [i32; 2] = [Errno::EMFILE as i32, Errno::ENFILE as i32];
    #[cfg(not(unix))]
    const FILES: [i32; 2] = [4, 10024];

    let cause = cause.downcast_ref::<io::Error>()?;
    // Other packages wrap the number.
    #[cfg(unix)]
    if let Some(code) = cause.get_ref().and_then(|inner| inner.downcast_ref::<Errno>()) {
        return remedy(&io::Error::from(*code));
    }
    match cause.kind() {
        ErrorKind::StorageFull => Some("the disk is full, so make room or use another one"),
        ErrorKind::QuotaExceeded => {
            Some("your disk quota is used up, so make room or use another disk")
        }
        ErrorKind::OutOfMemory => Some("the memory is used up, so end other programs"),
        // Only the start of a thread ends with this; a connection would wait.
        ErrorKind::WouldBlock => Some(
            "no more threads can be started, so raise the limits for threads and memory or end other programs",
        ),
        _ if cause.raw_os_error().is_some_and(|code| FILES.contains(&code)) => Some(
            "no more files and connections can be opened, so raise the limit (ulimit -n) or end other programs",
        ),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::time::Duration;

    use anyhow::anyhow;

    use super::{clean, clean_lines, json, json_line, seconds, sentence};

    #[test]
    fn a_text_from_elsewhere_has_no_commands() {
        for text in ["TX2013", "", "Größe 5 µm, 東京", "\u{5E9}\u{5DC}"] {
            assert!(
                matches!(clean(text), std::borrow::Cow::Borrowed(same) if same == text),
                "{text:?}"
            );
        }
        assert_eq!(
            clean("\u{1B}[31mred\u{7}\r\nI1\t"),
            "\u{FFFD}[31mred\u{FFFD}\u{FFFD}\u{FFFD}I1\u{FFFD}"
        );
        assert_eq!(clean("\u{9B}2J"), "\u{FFFD}2J");
        for turned in ['\u{61C}', '\u{200F}', '\u{202E}', '\u{2028}', '\u{2067}', '\u{2069}'] {
            assert_eq!(clean(&format!("a{turned}b")), "a\u{FFFD}b");
        }
    }

    #[test]
    fn lines_stay_and_json_stays_the_same() {
        assert_eq!(clean_lines("a\u{7}\nb\r\n"), "a\u{FFFD}\nb\u{FFFD}\n");
        let name = "\u{9B}2J\u{202E}\n\"";
        let text = json(&[name]).unwrap();
        assert!(text.is_ascii() && text.lines().count() == 3, "{text}");
        assert_eq!(serde_json::from_str::<[String; 1]>(&text).unwrap(), [name]);
        let line = json_line(&[name].into());
        assert!(line.is_ascii() && !line.contains('\n'), "{line}");
        assert_eq!(serde_json::from_str::<[String; 1]>(&line).unwrap(), [name]);
    }

    #[test]
    fn a_time_has_a_unit_that_fits() {
        assert_eq!(seconds(Duration::from_micros(1_240)), "1.2 ms");
        assert_eq!(seconds(Duration::from_millis(5_226)), "5.23 s");
    }

    #[test]
    fn what_is_used_up_has_a_remedy() {
        let error = |kind: io::ErrorKind| anyhow!(io::Error::from(kind)).context("a.mcap");
        for (kind, part) in [
            (io::ErrorKind::StorageFull, "the disk is full"),
            (io::ErrorKind::QuotaExceeded, "your disk quota"),
            (io::ErrorKind::WouldBlock, "no more threads"),
        ] {
            let reported = sentence(&error(kind));
            assert!(reported.starts_with("a.mcap: ") && reported.contains(part), "{reported}");
        }
        assert!(!sentence(&error(io::ErrorKind::NotFound)).contains("; "));
    }

    #[test]
    fn each_cause_of_an_error_is_told_once() {
        let cause = io::Error::other("no space");
        assert_eq!(sentence(&anyhow!(cause).context("a.mcap")), "a.mcap: no space");
        let cause = io::Error::other("no space");
        let tells_its_cause = anyhow!(cause).context("can't write a.mcap: no space");
        assert_eq!(sentence(&tells_its_cause), "can't write a.mcap: no space");
    }
}
