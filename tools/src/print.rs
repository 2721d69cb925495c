//! What commands print on stdout.

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

    use super::sentence;

    #[test]
    fn each_cause_of_an_error_is_told_once() {
        let cause = io::Error::other("no space");
        assert_eq!(sentence(&anyhow!(cause).context("a.mcap")), "a.mcap: no space");
        let cause = io::Error::other("no space");
        let tells_its_cause = anyhow!(cause).context("can't write a.mcap: no space");
        assert_eq!(sentence(&tells_its_cause), "can't write a.mcap: no space");
    }
}
