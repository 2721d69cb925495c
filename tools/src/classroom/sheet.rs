//! A page to print, with a part for each pupil to cut out: name, link and QR code.

use std::fmt::Write as _;

use crate::web::{escaped, qr};

/// What one pupil gets.
pub(super) struct Part<'a> {
    pub(super) name: &'a str,
    /// Where programs connect to.
    pub(super) program: String,
    pub(super) page: String,
}

const STYLE: &str = "
body { margin: 12mm; font: 12pt system-ui, sans-serif; color: #000; background: #fff }
main { display: grid; grid-template-columns: 1fr 1fr; gap: 6mm }
section { display: grid; grid-template-columns: 38mm 1fr; gap: 5mm; align-items: center; padding: 5mm;
  border: 1px dashed #888; break-inside: avoid }
svg { width: 38mm; height: 38mm }
h2 { margin: 0 0 2mm; font-size: 16pt; overflow-wrap: anywhere }
p { margin: 1mm 0; font-size: 9pt; overflow-wrap: anywhere }
code { font-size: 10pt }
@media (max-width: 700px) { main { grid-template-columns: 1fr } }
";

/// The document. It needs nothing else.
pub(super) fn html(parts: &[Part]) -> anyhow::Result<String> {
    let mut html = format!(
        "<!doctype html>\n<html>\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width\">\n<title>txt classroom</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n"
    );
    for Part { name, program, page } in parts {
        let (name, code) = (escaped(name), qr::svg(page)?);
        let _ = writeln!(
            html,
            "<section>{code}<div><h2>{name}</h2><p>Programs / Programme: <code>{program}</code></p>\
             <p>Page / Seite: <code>{}</code></p></div></section>",
            in_lines(page)
        );
    }
    html += "</main>\n</body>\n</html>\n";
    Ok(html)
}

/// A link as HTML that breaks where nobody takes the end of a line for a part of it: people may have to type it.
fn in_lines(link: &str) -> String {
    let (place, token) = link.split_once("token=").unwrap_or((link, ""));
    let (first, second) = token.split_at_checked(token.len() / 2).unwrap_or((token, ""));
    let name = if token.is_empty() { "" } else { "<wbr>token=" };
    format!("{}{name}<wbr>{}<wbr>{}", escaped(place), escaped(first), escaped(second))
        .replace("/lesson?", "/<wbr>lesson?")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pupil_has_a_part_and_a_name_is_no_markup() {
        let part = |name| Part {
            name,
            program: "192.168.1.5:65000".into(),
            page: "http://192.168.1.5:8000/?token=0".into(),
        };
        let html = html(&[part("Zoë"), part("<script>")]).unwrap();
        assert_eq!((html.matches("<svg").count(), html.matches("<section>").count()), (2, 2));
        assert!(html.contains("<h2>Zoë</h2>") && html.contains("&lt;script&gt;"), "{html}");
        assert!(!html.contains("<script"));
        let link = format!("http://192.168.1.5:8000/lesson?token={}", "0123456789abcdef".repeat(2));
        let lines = "http://192.168.1.5:8000/<wbr>lesson?<wbr>token=<wbr>0123456789abcdef<wbr>0123456789abcdef";
        assert_eq!(in_lines(&link), lines);
    }
}
