//! Puts the files of a page into its document.

use anyhow::{ensure, Context};
use base64::prelude::{Engine, BASE64_STANDARD};
use sha2::{Digest, Sha256};

/// Puts a file where the document names it. Returns how a Content-Security-Policy allows it.
pub(crate) fn put(html: &mut String, link: &str, tag: &str, text: &str) -> anyhow::Result<String> {
    let name = tag.split(' ').next().unwrap_or(tag);
    let text = unix_lines(text);
    ensure!(!text.contains(&format!("</{name}")), "the text of {link} would end its element");
    let (before, after) = html.split_once(link).with_context(|| format!("{link} is missing"))?;
    *html = format!("{before}<{tag}>{text}</{name}>{after}");
    Ok(allowed(&text))
}

/// How a Content-Security-Policy allows a script or a style.
pub(crate) fn allowed(text: &str) -> String {
    format!("'sha256-{}'", BASE64_STANDARD.encode(Sha256::digest(text)))
}

/// As browsers read it, however the files were checked out.
pub(crate) fn unix_lines(text: &str) -> String {
    text.replace("\r\n", "\n")
}
