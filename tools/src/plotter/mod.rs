//! The plotter of pages: terminals over time, live in the pages of `txt panel` and `txt watch`, and as a file of a
//! recording. uPlot, in a folder of its own with its licence, draws.

use anyhow::Context;

use crate::web::bundle::bundle;
use crate::web::document::{put, unix_lines};

/// Its licence has to be in each copy.
const LICENCE: &str = include_str!("uplot/LICENSE");
const UPLOT: &str = include_str!("uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("uplot/uPlot.min.css");
const STYLE: &str = include_str!("plotter.css");
/// What it shares with the panel: colours and controls.
const PANEL_STYLE: &str = include_str!("../panel/page/panel.css");
const RECORDING: &str = include_str!("recording.html");

/// Each comes after those that it imports.
const MODULES: &[(&str, &str)] = &[
    ("dom.js", include_str!("../panel/page/dom.js")),
    ("plot_words.js", include_str!("page/plot_words.js")),
    ("line.js", include_str!("page/line.js")),
    ("chart.js", include_str!("page/chart.js")),
    ("plotter.js", include_str!("page/plotter.js")),
];
const LIVE: (&str, &str) = ("live.js", include_str!("page/live.js"));
const ALONE: (&str, &str) = ("recording.js", include_str!("page/recording.js"));

/// The script for a page that has values.
pub(crate) fn script() -> anyhow::Result<String> {
    script_with(LIVE)
}

pub(crate) fn style() -> String {
    unix_lines(&format!("/*!\n{LICENCE}*/\n{UPLOT_STYLE}\n{STYLE}"))
}

/// All in one function: nothing of it meets what the page has.
fn script_with(last: (&str, &str)) -> anyhow::Result<String> {
    let modules = bundle(&[MODULES, &[last]].concat())?;
    let text = format!("(() => {{\n\"use strict\";\n/*!\n{LICENCE}*/\n{UPLOT}\n{modules}}})();\n");
    Ok(unix_lines(&text))
}

/// A page with this title that shows these lines, as JSON, and needs no other file.
pub(crate) fn page(title: &str, lines: &str) -> anyhow::Result<String> {
    let mut html = unix_lines(RECORDING);
    let link = "<link rel=\"stylesheet\" href=\"plotter.css\">";
    let style = put(&mut html, link, "style", &format!("{PANEL_STYLE}{}", style()))?;
    let link = "<script src=\"plotter.js\"></script>";
    let script = put(&mut html, link, "script", &script_with(ALONE)?)?;
    let policy = format!("default-src 'none'; script-src {script}; style-src {style}");
    let (before, after) = html.split_once("POLICY").context("the policy is missing")?;
    let html = format!("{before}{policy}{after}");
    let (before, rest) = html.split_once("TITLE").context("the title is missing")?;
    let (between, after) = rest.split_once("DATA").context("the place of the lines is missing")?;
    // What is in a string of JSON would end the element or begin a comment.
    let lines = lines.replace('<', "\\u003c");
    Ok(format!("{before}{}{between}{lines}{after}", as_text(title)))
}

fn as_text(title: &str) -> String {
    title.replace('&', "&amp;").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_needs_no_other_file_and_keeps_what_looks_like_html() {
        let page = page("a<b", r#"{"title":"</script><!--"}"#).unwrap();
        assert!(page.contains("<title>a&lt;b</title>"));
        assert!(page.contains(r#"{"title":"\u003c/script>\u003c!--"}"#));
        for part in ["src=", "href=", "@import", "url("] {
            let uses = page.matches(part).count();
            // A halo of the panel's own is a part of the page.
            let own = page.matches("url(#").count();
            assert_eq!(uses, if part == "url(" { own } else { 0 }, "{part}");
        }
        assert_eq!(page.matches("Copyright (c) 2022 Leon Sorokin").count(), 2);
    }
}
