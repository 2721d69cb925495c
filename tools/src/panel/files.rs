//! The page: one document with its style and its scripts, so that it is there after one request. Its parts are files of
//! their own in the repository, and a part of the program, so it needs none at run time.

use std::io::{self, Write};

use anyhow::Context;
use axum::body::Bytes;
use flate2::write::GzEncoder;
use flate2::Compression;
use serde_json::Value;

use crate::plotter;
use crate::web::bundle::bundle;
use crate::web::document::{allowed, put, unix_lines};

const DOCUMENT: &str = include_str!("page/index.html");
const LESSON_DOCUMENT: &str = include_str!("page/lesson.html");
const LESSON_STYLE: &str = include_str!("page/lesson.css");
const STYLE: &str = include_str!("page/panel.css");
const EARLY: &str = include_str!("page/early.js");
/// It comes before the rest of a lesson, too.
const SOCKET: &str = concat!(include_str!("page/token.js"), include_str!("page/socket.js"));
/// Where the state of a lesson comes.
const STATE: &str = "<!--state-->";
/// It comes before all others, and works without them.
const STOP: &str = concat!(
    include_str!("page/token.js"),
    include_str!("page/stop.js"),
    include_str!("page/socket.js")
);
pub(super) const ICON: &str = include_str!("page/icon.svg");

macro_rules! modules {
    ($($name:literal),+ $(,)?) => {
        &[$(($name, include_str!(concat!("page/", $name)))),+]
    };
}

/// What both pages use. In each list a module comes after those that it imports.
const SHARED_MODULES: &[(&str, &str)] = modules!(
    "dom.js",
    "names.js",
    "trace.js",
    "state.js",
    "words.js",
    "connection.js",
    "joystick.js",
    "machine.js",
    "drawing.js",
    "floor.js",
    "world.js",
    "keys.js",
);
const PANEL_MODULES: &[(&str, &str)] = modules!(
    "remember.js",
    "admission.js",
    "control_lock.js",
    "inputs.js",
    "counters.js",
    "progress.js",
    "distance.js",
    "outputs.js",
    "commands.js",
    "board.js",
    "link.js",
    "sound.js",
    "camera.js",
    "i2c.js",
    "remotes.js",
    "plot.js",
    "record.js",
    "host.js",
    "overview.js",
    "tabs.js",
    "gate.js",
    "panel.js",
);
const LESSON_MODULES: &[(&str, &str)] = modules!("lesson.js");

/// A file, ready to be sent.
pub(super) struct Ready {
    pub(super) kind: &'static str,
    pub(super) plain: Bytes,
    pub(super) gzip: Bytes,
}

impl Ready {
    fn new(kind: &'static str, text: String) -> anyhow::Result<Self> {
        Ok(Self { kind, gzip: gzip(&text, Compression::best())?.into(), plain: text.into() })
    }

    /// The document with what its page would ask for first: data, which is no script.
    pub(super) fn with_state(&self, state: &Value) -> anyhow::Result<Self> {
        // In a text of JSON this sign may be written as its number, and the element does not end early.
        let state = state.to_string().replace('<', "\\u003c");
        let html = std::str::from_utf8(&self.plain)?;
        let (before, after) = html.split_once(STATE).context("the document has no place for it")?;
        let state = format!("<script type=\"application/json\" id=\"state\">{state}</script>");
        let html = format!("{before}{state}{after}");
        // This is done while the browser waits.
        let gzip = gzip(&html, Compression::default())?.into();
        Ok(Self { kind: self.kind, gzip, plain: html.into() })
    }
}

/// A page.
pub(super) struct Page {
    pub(super) document: Ready,
    /// Which scripts and styles a browser may use: those of the page, and no others.
    pub(super) policy: String,
}

impl Page {
    /// The page of the panel. It loads the files of the plotter later.
    pub(super) fn panel(plotter: &Plotter) -> anyhow::Result<Self> {
        let mut html = unix_lines(DOCUMENT);
        let style = put(&mut html, "<link rel=\"stylesheet\" href=\"panel.css\">", "style", STYLE)?;
        let stop = put(&mut html, "<script src=\"stop.js\"></script>", "script", STOP)?;
        let link = "<script type=\"module\" src=\"panel.js\"></script>";
        let panel = put(&mut html, link, "script type=\"module\"", &script(PANEL_MODULES)?)?;
        let policy = format!(
            "script-src {stop} {panel} {}; style-src {style} {}",
            plotter.script_allowed, plotter.style_allowed
        );
        Self::ready(html, policy)
    }

    /// The page of a lesson.
    pub(super) fn lesson() -> anyhow::Result<Self> {
        let mut html = unix_lines(LESSON_DOCUMENT);
        let style = put(&mut html, "<link rel=\"stylesheet\" href=\"panel.css\">", "style", STYLE)?;
        let link = "<link rel=\"stylesheet\" href=\"lesson.css\">";
        let own_style = put(&mut html, link, "style", LESSON_STYLE)?;
        let link = "<script type=\"module\" src=\"lesson.js\"></script>";
        let script = put(&mut html, link, "script type=\"module\"", &script(LESSON_MODULES)?)?;
        let early = put(&mut html, "<script src=\"early.js\"></script>", "script", EARLY)?;
        let socket = put(&mut html, "<script src=\"socket.js\"></script>", "script", SOCKET)?;
        let policy = format!("script-src {socket} {early} {script}; style-src {style} {own_style}");
        Self::ready(html, policy)
    }

    fn ready(html: String, policy: String) -> anyhow::Result<Self> {
        Ok(Self { document: Ready::new("text/html; charset=utf-8", html)?, policy })
    }
}

/// The files of the plotter, and how a Content-Security-Policy allows them.
pub(super) struct Plotter {
    pub(super) script: Ready,
    pub(super) style: Ready,
    script_allowed: String,
    style_allowed: String,
}

impl Plotter {
    pub(super) fn new() -> anyhow::Result<Self> {
        let (script, style) = (plotter::script()?, plotter::style());
        Ok(Self {
            script_allowed: allowed(&script),
            style_allowed: allowed(&style),
            script: Ready::new("text/javascript; charset=utf-8", script)?,
            style: Ready::new("text/css; charset=utf-8", style)?,
        })
    }
}

/// One script of the modules that both pages use, and these.
fn script(own: &[(&str, &str)]) -> anyhow::Result<String> {
    bundle(&[SHARED_MODULES, own].concat())
}

fn gzip(text: &str, level: Compression) -> io::Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), level);
    encoder.write_all(text.as_bytes())?;
    encoder.finish()
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::transfer_area::InputMode;

    use super::*;

    #[test]
    fn the_page_is_whole_and_loads_only_its_icon() {
        let page = Page::panel(&Plotter::new().unwrap()).unwrap().document;
        let html = std::str::from_utf8(&page.plain).unwrap();
        assert_eq!((html.matches("<script").count(), html.matches("<style").count()), (2, 1));
        let loaded: Vec<_> = html
            .lines()
            .filter(|line| [" src=\"", "href=\""].iter().any(|link| line.contains(link)))
            .collect();
        assert!(loaded.iter().all(|line| line.contains("icon.svg")), "{loaded:?}");
        assert!(page.gzip.len() < 46_000, "{} bytes", page.gzip.len());
    }

    #[test]
    fn the_state_in_a_document_ends_nothing() {
        let page = Page::lesson().unwrap().document;
        let state = serde_json::json!({ "task": "</script><b>" });
        let page = page.with_state(&state).unwrap();
        let html = std::str::from_utf8(&page.plain).unwrap();
        let (_, rest) = html.split_once("id=\"state\">").unwrap();
        let (text, _) = rest.split_once("</script>").unwrap();
        assert_eq!(serde_json::from_str::<Value>(text).unwrap(), state);
    }

    #[test]
    fn the_page_has_words_for_each_input_mode_in_both_languages() {
        let (_, words) = SHARED_MODULES.iter().find(|(name, _)| *name == "words.js").unwrap();
        for mode in InputMode::ALL {
            for digital in [0, 1] {
                let key = format!("\"{}/{digital}\": ", mode.name());
                assert_eq!(words.matches(&key).count(), 2, "{key}");
            }
        }
    }
}
