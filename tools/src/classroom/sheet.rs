//! A page to print, with a part for each pupil to cut out: name, link and QR code.

use std::fmt::Write as _;

use crate::web::qr;

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
             <p>Page / Seite: <code>{page}</code></p></div></section>"
        );
    }
    html += "</main>\n</body>\n</html>\n";
    Ok(html)
}

/// A text as HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
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
    }
}
