//! Puts the files of a page into its document.

use anyhow::{ensure, Context};
use base64::prelude::{Engine, BASE64_STANDARD};
use sha2::{Digest, Sha256};

/// Puts a file where the document names it, without what is only for people. Returns how a Content-Security-Policy allows it.
pub(crate) fn put(html: &mut String, link: &str, tag: &str, text: &str) -> anyhow::Result<String> {
    let name = tag.split(' ').next().unwrap_or(tag);
    let text = squeezed(&unix_lines(text));
    ensure!(!text.contains(&format!("</{name}")), "the text of {link} would end its element");
    let (before, after) = html.split_once(link).with_context(|| format!("{link} is missing"))?;
    *html = format!("{before}<{tag}>{text}</{name}>{after}");
    Ok(allowed(&text))
}

/// A script or a style without indentation, empty lines and lines that are a comment, unless it names a licence. A
/// network with a long way sends the first bytes of a page in a few rounds, so each that is not sent may save one.
fn squeezed(text: &str) -> String {
    let mut lines = Vec::new();
    let mut is_comment = false;
    for line in text.lines().map(str::trim) {
        let begins = is_comment || (line.starts_with("/*") && !line.starts_with("/*!"));
        is_comment = begins && !line.contains("*/");
        let is_whole = begins && (is_comment || line.ends_with("*/"));
        if !is_whole && !line.is_empty() && !line.starts_with("//") {
            lines.push(line);
        }
    }
    lines.join("\n")
}

/// How a Content-Security-Policy allows a script or a style.
pub(crate) fn allowed(text: &str) -> String {
    format!("'sha256-{}'", BASE64_STANDARD.encode(Sha256::digest(text)))
}

/// As browsers read it, however the files were checked out.
pub(crate) fn unix_lines(text: &str) -> String {
    text.replace("\r\n", "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_only_for_people_is_not_sent() {
        let text = "// A script.\n\nlet a = 1; // one\n  /** Two. */\n  /* Many\n     lines. */\n  /* b */ let b = \"//\";\n";
        let text = &format!("/*! MIT */\n{text}");
        assert_eq!(squeezed(text), "/*! MIT */\nlet a = 1; // one\n/* b */ let b = \"//\";");
    }
}
