//! What axe-core finds: whether everybody can use the page, with a screen reader or weak eyes too.
//!
//! It runs when `AXE_JS` names the file axe.min.js, as `.ci/run` does.

use std::{env, fs};

use anyhow::{ensure, Context, Result};
use fantoccini::key::Key;
use serde_json::{json, Value};

use super::driver::{browse, Beyond};
use super::page::{Lesson, Page, Panel};
use super::plot;
use super::txt::simulated_txt;
use crate::names;
use crate::start::Start;

/// All rules, and two that axe-core leaves out: labels begin with what is seen, and nothing is too small for a finger.
/// In the dark, only the colours are others.
const FIND: &str = "const [scheme, done] = arguments;
    const rules = { 'label-content-name-mismatch': { enabled: true }, 'target-size': { enabled: true } };
    const options = scheme === 'dark' ? { runOnly: ['color-contrast', 'link-in-text-block'] } : { rules };
    axe.run(document, options).then(({ violations, passes }) => done({
        passed: passes.length,
        found: violations.flatMap(({ id, nodes }) => nodes.map(({ html }) => `${id}: ${html}`)),
    }))";

struct Axe(String);

impl Axe {
    async fn ensure_finds_nothing(&self, page: &Page, what: &str) -> Result<()> {
        for (width, height) in [(1440, 900), (390, 844)] {
            for scheme in ["light", "dark"] {
                page.resize(width, height).await?;
                // Colours change at once.
                let features = json!([
                    { "name": "prefers-color-scheme", "value": scheme },
                    { "name": "prefers-reduced-motion", "value": "reduce" },
                ]);
                let params = json!({ "features": features });
                let set = Beyond::browser("Emulation.setEmulatedMedia", params);
                page.client.issue_cmd(set).await?;
                page.client.execute(&self.0, Vec::new()).await?;
                let result: Value = page.client.execute_async(FIND, vec![json!(scheme)]).await?;
                let (passed, rules) = (&result["passed"], if scheme == "dark" { 1 } else { 10 });
                ensure!(passed.as_u64() >= Some(rules), "axe-core did not look: {result}");
                let found = &result["found"];
                ensure!(*found == json!([]), "{what}, {width} wide, {scheme}: {found:#}");
            }
        }
        Ok(())
    }
}

/// Starts or stops a recording by the keyboard.
async fn record(page: &Page, then: &str) -> Result<()> {
    page.run("document.querySelector(arguments[0]).focus()", json!(".record")).await?;
    page.type_key(Key::Enter).await?;
    page.wait_for_text(".recording", then).await?;
    // The focus is still there.
    page.wait_for(".record:focus").await
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn axe_finds_nothing() -> Result<()> {
    let Some(file) = env::var_os("AXE_JS").filter(|file| !file.is_empty()) else {
        eprintln!("skipped: AXE_JS names no axe.min.js");
        return Ok(());
    };
    let axe = Axe(fs::read_to_string(file).context("AXE_JS can't be read")?);
    browse(|client| async move {
        let txt = simulated_txt()?;
        let folder = tempfile::tempdir()?;
        let names = names::file(folder.path());
        let names = ["--names", &names, "--names", &names];
        let host = txt.address().to_string();
        let arguments = [&["simulated", &host], &names[..]].concat();
        let panel = Panel::start_in(folder.path(), &arguments)?;
        let page = Page::open(&client, &panel).await?;
        page.wait_for_text("#role", "You drive").await?;
        record(&page, "Recording into run-0001.mcap").await?;
        axe.ensure_finds_nothing(&page, "a machine that is recorded").await?;
        record(&page, "Recorded: run-0001.mcap").await?;
        page.click("#language").await?;
        axe.ensure_finds_nothing(&page, "a machine in German").await?;
        page.click("#language").await?;
        page.click(".count").await?;
        // The page scrolls to the plotter when it has come.
        page.wait_for(".plot-chart canvas").await?;
        page.click(".input:nth-child(4) .value").await?;
        page.wait_for(".plot-chart:nth-child(2) canvas").await?;
        axe.ensure_finds_nothing(&page, "the plotter").await?;
        page.click(".chips button:last-child").await?;
        page.wait_for(".board:nth-of-type(2)").await?;
        axe.ensure_finds_nothing(&page, "all extensions").await?;
        page.click("#tabs button:first-child").await?;
        page.wait_for(".tile:nth-child(2) [data-phase=running]").await?;
        axe.ensure_finds_nothing(&page, "all controllers").await?;
        page.click("#tabs button:last-child").await?;
        page.wait_for("[data-phase=running] .board").await?;
        drop(txt);
        page.wait_for(".problem:not([hidden])").await?;
        axe.ensure_finds_nothing(&page, "a controller that is gone").await?;

        let (shown, _) = Panel::shown("sorting_line")?;
        client.goto(&shown.url).await?;
        page.wait_for(".floor").await?;
        axe.ensure_finds_nothing(&page, "a controller that others drive").await?;
        drop(shown);
        page.wait_for("#lost:not([hidden])").await?;
        axe.ensure_finds_nothing(&page, "a page without its program").await?;

        let lesson = Lesson::start()?;
        client.goto(&lesson.url).await?;
        page.wait_for("#check .buttons").await?;
        page.wait_for(".machine .world").await?;
        axe.ensure_finds_nothing(&page, "a lesson").await?;

        let start = Start::at(&lesson.program);
        client.goto(&start.url).await?;
        page.wait_for("#found li").await?;
        page.click("#drive").await?;
        page.wait_for(".board .input").await?;
        client.goto(&start.url).await?;
        page.wait_for("#running li").await?;
        page.wait_for("#found li").await?;
        axe.ensure_finds_nothing(&page, "the start page").await?;
        page.click("#quit").await?;
        page.wait_for_text("#notice", "txt has ended").await?;

        let (_folder, url) = plot::recording()?;
        client.goto(&url).await?;
        page.wait_for(".plot-chart canvas").await?;
        axe.ensure_finds_nothing(&page, "a recording").await
    })
}
