//! What commands print on stdout.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

use anyhow::Context;

/// Prints a line. A reader that has seen enough, such as `head`, is no error.
pub(crate) fn line(text: impl Display) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
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

/// Whether a character is a command: also those that end a line or change the direction of writing.
fn is_command(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{2028}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
}

/// An error with its causes. Some errors tell their cause themselves; it is not told again.
pub(crate) fn sentence(error: &anyhow::Error) -> String {
    let mut told = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if told.is_empty() {
            told = cause;
        } else if !told.contains(&cause) {
            told = format!("{told}: {cause}");
        }
    }
    told
}

#[cfg(test)]
mod tests {
    use std::io;

    use anyhow::anyhow;

    use super::{clean, sentence};

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
    fn each_cause_of_an_error_is_told_once() {
        let cause = io::Error::other("no space");
        assert_eq!(sentence(&anyhow!(cause).context("a.mcap")), "a.mcap: no space");
        let cause = io::Error::other("no space");
        let tells_its_cause = anyhow!(cause).context("can't write a.mcap: no space");
        assert_eq!(sentence(&tells_its_cause), "can't write a.mcap: no space");
    }
}
