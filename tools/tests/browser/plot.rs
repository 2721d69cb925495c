//! The plotter: in the panel, and as the page of a recording.

use std::process::Command;

use anyhow::{ensure, Result};
use fantoccini::key::Key;
use serde_json::json;
use tempfile::TempDir;

use super::driver::browse;
use super::page::{Page, Panel};
use crate::{names, plot};

/// The number of points of a colour of the first chart.
const DRAWN: &str = "const { width, height } = document.querySelector('.plot-chart canvas');
    const copy = Object.assign(document.createElement('canvas'), { width, height }).getContext('2d');
    copy.drawImage(document.querySelector('.plot-chart canvas'), 0, 0);
    const wanted = getComputedStyle(document.querySelector(arguments[0])).backgroundColor.match(/\\d+/g).map(Number);
    const { data } = copy.getImageData(0, 0, width, height);
    let count = 0;
    for (let at = 0; at < data.length; at += 4) if (wanted.every((one, index) => Math.abs(data[at + index] - one) < 9)) count += 1;
    return count";

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn the_plotter_shows_terminals_over_time_in_the_panel_and_of_a_recording() -> Result<()> {
    browse(|client| async move {
        let folder = tempfile::tempdir()?;
        let panel = Panel::start(&["--names", &names::file(folder.path())])?;
        let page = Page::open(&client, &panel).await?;
        // By a click, without a mouse, and what was chosen goes on in another language.
        page.click(".input:nth-child(2) .value").await?;
        page.wait_for_text(".plot-line", "I2 (barrier, at the gate)").await?;
        page.tab_to(".plot-moves button:last-child", ".plot-close").await?;
        page.tab_to(".plot-close", ".plot-chips button").await?;
        page.type_key(Key::Enter).await?;
        page.wait_for(".plot-chips button:first-child[aria-pressed=true]").await?;
        page.click("#language").await?;
        page.wait_for_text(".plot-pause", "Pause").await?;
        page.wait_for(".plot-chips button:nth-child(2)[aria-pressed=true]").await?;
        page.wait_for_value(DRAWN, ".plot-line .plot-colour", |count| count.as_u64() > Some(20))
            .await?;
        ensure_stands(&page).await?;
        page.click(".plot-close").await?;
        page.wait_for(".plot [aria-expanded=false]").await?;
        page.ensure_no_console_errors().await?;

        let (_folder, url) = recording()?;
        client.goto(&url).await?;
        page.wait_for_value(DRAWN, ".plot-line .plot-colour", |count| count.as_u64() > Some(200))
            .await?;
        ensure_cursor_shows_values(&page).await?;
        ensure_goes_to_a_moment(&page).await?;
        page.ensure_no_console_errors().await
    })
}

/// A folder with the page of a recording, and the page's address.
pub(super) fn recording() -> Result<(TempDir, String)> {
    let (folder, recording) = plot::recording();
    let html = recording.with_extension("html");
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.arg("plot").arg(recording).arg("--html").arg(&html);
    ensure!(command.output()?.status.success(), "txt plot has failed");
    Ok((folder, format!("file://{}", html.display())))
}

/// While it is paused, a moment can be looked at.
async fn ensure_stands(page: &Page) -> Result<()> {
    page.click(".plot-pause").await?;
    page.wait_for(".plot-pause[data-paused]").await?;
    page.press_mouse(".plot-chart .u-over").await?;
    page.release_mouse().await?;
    page.wait_for_text(".plot-time", "−").await?;
    page.click(".plot-pause").await?;
    page.wait_for_text(".plot-time", "jetzt").await
}

/// A click in the list shows when the connection was lost, with a yellow line and the time of day.
async fn ensure_goes_to_a_moment(page: &Page) -> Result<()> {
    page.resize(390, 844).await?;
    let find = "[...document.querySelectorAll('.plot-moment')].find((one) => one.textContent.includes('was lost')).id = 'lost'";
    page.run(find, json!(null)).await?;
    page.click("#lost").await?;
    page.wait_for("#lost[aria-current=true]").await?;
    page.wait_for_text(".plot-time", "the connection was lost: ").await?;
    let time = page.run("return document.querySelector('.plot-time').textContent", json!(null));
    let time = time.await?;
    let parts: Vec<_> = time.as_str().unwrap_or_default().split(" · ").collect();
    ensure!(parts.len() == 3 && parts[1].len() == "03:12:14".len(), "{time}");
    let mark = "document.body.append(Object.assign(document.createElement('i'), { id: 'mark', style: 'background: var(--plot-mark)' }))";
    page.run(mark, json!(null)).await?;
    page.wait_for_value(DRAWN, "#mark", |count| count.as_u64() > Some(20)).await?;
    page.click(".plot-language").await?;
    page.wait_for_text(".plot-moments", "Lücke").await?;
    page.wait_for_text(".plot-moments", "die Verbindung riss ab: ").await
}

/// The value at the cursor is the recorded one.
async fn ensure_cursor_shows_values(page: &Page) -> Result<()> {
    page.press_mouse(".plot-chart:last-child .u-over").await?;
    page.release_mouse().await?;
    let values = "const { lines } = JSON.parse(document.getElementById('recording').textContent);
        const seconds = parseFloat(document.querySelector('.plot-time').textContent);
        const { times, values } = lines.find(({ id }) => id === 'M1');
        let time = 0;
        const known = times.map((step) => (time += step)).filter((time) => time / 1000 <= seconds).length;
        const shown = [...document.querySelectorAll('.plot-line')].find((line) => line.textContent.startsWith('M1'));
        return [seconds > 0, shown.querySelector('b').textContent, String(values[known - 1] ?? '–').replace('-', '−')]";
    let values = page.run(values, json!(null)).await?;
    ensure!(values[0] == json!(true) && values[1] == values[2], "{values}");
    Ok(())
}
