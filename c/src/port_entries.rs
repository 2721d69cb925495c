//! The text in `FT_TXT_PORTS` and in files `ft_txt_ports`, for the library and for tx_run.

/// The entries of such a text, without its comments.
pub(crate) fn entries(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    let entries = lines.flat_map(|line| line.split([',', ';'])).map(str::trim);
    entries.filter(|entry| !entry.is_empty())
}
