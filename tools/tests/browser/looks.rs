//! What a person sees at first sight, on each kind of screen.

use anyhow::{ensure, Context, Result};
use fantoccini::Client;
use serde_json::{json, Value};

use super::driver::{browse, Beyond};
use super::page::{Page, Panel};
use super::txt::{ensure_seen, simulated_txt, turns, FIRST, FORWARD};
use crate::names;

const SPEED: &str = "[aria-label='Speed of M1']";
/// Where the values of the first controller are.
const VALUES: &str = ".input .value b, .count, .pace b";

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_first_click_is_slow_and_each_motor_keeps_its_speed() -> Result<()> {
    browse(|client| async move {
        let txt = simulated_txt()?;
        let panel = Panel::start(&[&txt.address().to_string()])?;
        let page = Page::open(&client, &panel).await?;
        page.click(FORWARD).await?;
        ensure_seen(&txt, "M1 turns slowly", |machine| {
            machine.controllers[0].outputs.duty[0] == FIRST
        })?;
        page.click("#stop").await?;
        page.wait_for(&format!("{FORWARD}:enabled")).await?;
        let set = "const speed = document.querySelector(arguments[0]);
            speed.value = 300;
            speed.dispatchEvent(new Event('input'))";
        page.run(set, json!(SPEED)).await?;

        // Everything is made anew, by another language and by loading it again.
        page.click("#language").await?;
        page.wait_for("[aria-label='M1 vorwärts']:enabled").await?;
        page.click("#language").await?;
        client.refresh().await?;
        page.wait_for(&format!("{FORWARD}:enabled")).await?;
        page.click(FORWARD).await?;
        ensure_seen(&txt, "M1 turns as it was set", |machine| {
            machine.controllers[0].outputs.duty[0] == 300
        })?;
        page.click("[aria-label='M2 forward']").await?;
        ensure_seen(&txt, "M2 turns slowly", |machine| {
            machine.controllers[0].outputs.duty[2] == FIRST
        })?;
        page.ensure_no_console_errors().await
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_controller_that_is_not_there_has_no_values() -> Result<()> {
    browse(|client| async move {
        let txt = simulated_txt()?;
        let panel = Panel::start(&[&txt.address().to_string()])?;
        let page = Page::open(&client, &panel).await?;
        let values =
            "return [...document.querySelectorAll(arguments[0])].map((one) => one.textContent)";
        let all = page.run(values, json!(VALUES)).await?;
        ensure!(!all.to_string().contains('–'), "values are missing: {all}");
        // I4 is pressed by the slide.
        page.wait_for(".input:nth-child(4)[data-on]").await?;
        drop(txt);
        page.wait_for_text(".problem:not([hidden])", "The connection is lost").await?;
        page.wait_for(".input:nth-child(4):not([data-on])").await?;
        ensure_dashes(&page).await.context("of a controller that is gone")?;
        let gap = "const line = document.querySelector(arguments[0]);
            const copy = Object.assign(document.createElement('canvas'), { width: line.width, height: line.height })
                .getContext('2d', { willReadFrequently: true });
            copy.drawImage(line, 0, 0);
            const part = (from, to) => copy.getImageData(from * line.width, 0, (to - from) * line.width, line.height / 2);
            return [part(0, 0.9), part(0.96, 1)].map(({ data }) => data.some((one) => one > 0)).join()";
        page.wait_for_value(gap, ".input:nth-child(4) .trace", |line| *line == "true,false")
            .await?;
        page.ensure_no_console_errors().await?;

        let panel = Panel::start(&["127.0.0.1:9"])?;
        let page = Page { client };
        page.client.goto(&panel.url).await?;
        page.wait_for_text(".problem:not([hidden])", "127.0.0.1:9").await?;
        ensure_dashes(&page).await.context("of a controller that never was there")?;
        let facts = page.run(values, json!(".link dl > :not(:first-child) dd")).await?;
        ensure!(facts == json!(["–", "– ms", "–", "–", "–"]), "{facts}");
        page.ensure_no_console_errors().await
    })
}

async fn ensure_dashes(page: &Page) -> Result<()> {
    let others = "return [...document.querySelectorAll(arguments[0])].map((one) => one.textContent).filter((text) => text !== '–')";
    let others = page.run(others, json!(VALUES)).await?;
    ensure!(others == json!([]), "there are values: {others}");
    page.wait_for_text(".microphone", "Microphone: –").await
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn cards_stay_in_their_columns_when_the_camera_starts() -> Result<()> {
    browse(|client| async move {
        let panel = Panel::start(&[])?;
        let page = Page::open(&client, &panel).await?;
        for width in [1440, 1024] {
            page.resize(width, 900).await?;
            let columns = "return [...document.querySelectorAll('.cards .card')].map((card) => [card.className, card.getBoundingClientRect().left])";
            let before = page.run(columns, json!(null)).await?;
            page.click(".camera .primary").await?;
            page.wait_for(".camera img:not([hidden])").await?;
            let with_pictures = page.run(columns, json!(null)).await?;
            ensure!(before == with_pictures, "{before} has become {with_pictures}");
            page.click(".camera .primary").await?;
            page.wait_for(".camera img[hidden]").await?;
        }
        page.ensure_no_console_errors().await
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn twelve_controllers_fit() -> Result<()> {
    browse(|client| async move {
        let panel = Panel::start(&["simulated"; 12])?;
        let page = Page::open(&client, &panel).await?;
        page.wait_for_text("#tabs button:first-child", "All").await?;
        // As many controllers have the same name.
        page.wait_for_text("#tabs button:nth-child(13)", "127.0.0.1:").await?;
        let seen = "const tabs = document.querySelector('#tabs');
            const { left, right } = tabs.getBoundingClientRect();
            return [...tabs.children].filter((tab) => tab.getBoundingClientRect().left >= left && tab.getBoundingClientRect().right <= right).length";
        for (width, all) in [(1440, true), (1024, true), (390, false)] {
            page.resize(width, 844).await?;
            let count = page.run(seen, json!(null)).await?;
            ensure!((count == json!(13)) == all, "{count} tabs at a width of {width}");
            let hint = if all { "#tabs:not([data-after])" } else { "#tabs[data-after]" };
            page.wait_for(hint).await?;
        }
        page.run("document.querySelector('#tabs').scrollLeft = 1e6", json!(null)).await?;
        page.wait_for("#tabs[data-before]:not([data-after])").await?;
        page.click("#tabs button:first-child").await?;
        page.wait_for(".tile:nth-child(12) [data-phase=running]").await?;
        page.click(".tile:nth-child(12) button").await?;
        page.wait_for("#tabs button:nth-child(13)[aria-selected=true]").await?;
        page.wait_for(".board").await?;
        page.ensure_no_console_errors().await
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_phone_shows_the_motors_and_the_stop_at_once_and_german_labels_are_whole() -> Result<()> {
    browse(|client| async move {
        let folder = tempfile::tempdir()?;
        let names = names::file(folder.path());
        let names = ["--names", &names, "--names", &names];
        let controllers = ["simulated", "simulated", "--extensions", "1"];
        let panel = Panel::start(&[&controllers[..], &names].concat())?;
        let page = Page::open(&client, &panel).await?;
        page.wait_for_text("#role", "You drive").await?;
        ensure_named(&page).await?;
        let choose = "const mode = document.querySelector(arguments[0]);
            mode.value = 'voltage/0';
            mode.dispatchEvent(new Event('change'))";
        page.run(choose, json!("[aria-label='Mode of I3']")).await?;
        page.wait_for_text(".input:nth-child(3) .value", "mV").await?;
        for language in ["Du steuerst", "You drive"] {
            for font in FONTS {
                page.run(SET_FONT, json!(font)).await?;
                ensure_fits(&page).await.with_context(|| format!("with {font:?}"))?;
            }
            page.click("#language").await?;
            page.wait_for_text("#role", language).await?;
        }
        page.ensure_no_console_errors().await
    })
}

/// Names are beside the terminals, for a screen reader, too.
async fn ensure_named(page: &Page) -> Result<()> {
    page.resize(390, 844).await?;
    let name = "slide with a rather long name to be read";
    page.wait_for(&format!("[aria-label='Speed of M1 ({name})']")).await?;
    page.wait_for("output[aria-label='I2 (barrier, at the gate)']").await?;
    page.wait_for("[aria-label='Reset C1 (pulses of the slide)']").await?;
    page.wait_for_text(".input:first-child", "I1<door>").await?;
    // What is cut is whole in its title.
    let motor = "const called = document.querySelector('.terminal:first-child .called');
        return [called.title, getComputedStyle(called).textOverflow, called.scrollWidth > called.clientWidth]";
    let motor = page.run(motor, json!(null)).await?;
    ensure!(motor == json!([name, "ellipsis", true]), "{motor}");
    let wide = page.run("return document.documentElement.scrollWidth", json!(null)).await?;
    ensure!(wide == json!(390), "the page is {wide} pixels wide");
    Ok(())
}

/// Letters that are wide, narrow and of another kind, whatever fonts are installed.
const FONTS: [&str; 5] = [
    "",
    "* { font-family: monospace !important }",
    "* { font-family: serif !important }",
    "* { font-family: sans-serif !important; letter-spacing: 0.05em !important }",
    "* { font-family: sans-serif !important; letter-spacing: -0.05em !important }",
];

const SET_FONT: &str = "const style = new CSSStyleSheet();
    style.replaceSync(arguments[0]);
    document.adoptedStyleSheets = [style]";

/// The motors and the stop are on a phone's first screen, and nothing is cut.
async fn ensure_fits(page: &Page) -> Result<()> {
    page.resize(390, 664).await?;
    let hidden = "const top = document.querySelector('#stop').getBoundingClientRect().top;
        return [...document.querySelectorAll('.terminal[data-kind=motor] button, .terminal [type=range]')]
            .filter((one) => one.checkVisibility() && one.getBoundingClientRect().bottom > top)
            .map((one) => one.ariaLabel)";
    let hidden = page.run(hidden, json!(null)).await?;
    ensure!(hidden == json!([]), "out of sight: {hidden}");
    for width in [1440, 1024, 390, 360] {
        page.resize(width, 800).await?;
        let cut = page.run(CUT, json!(null)).await?;
        ensure!(cut == json!([]), "at a width of {width} pixels are cut: {cut}");
    }
    Ok(())
}

/// Texts that are longer than their place. What a select offers is measured, because a browser only shows what fits.
const CUT: &str = "const pen = document.createElement('canvas').getContext('2d');
    const visible = [...document.querySelectorAll('#main *, .top *')].filter((one) => one.checkVisibility());
    const room = (one) => {
        const { paddingLeft, paddingRight, font } = getComputedStyle(one);
        pen.font = font;
        return one.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight);
    };
    // The sounds have long names; the one that is chosen is to be read.
    const offered = (select) => select.closest('.sound') ? [...select.selectedOptions] : [...select.options];
    const selects = visible.filter((one) => one.matches('select')).flatMap((select) => {
        const most = room(select);
        return offered(select).map(({ text }) => text).filter((text) => pen.measureText(text).width > most + 1);
    });
    const others = visible.filter((one) => one.matches('button, .label, dt, dd, h2, .phase, .display span, .hint, .unit') && one.clientWidth > 0)
        .filter((one) => one.scrollWidth > one.clientWidth + 1).map((one) => one.textContent);
    // What has a fixed size hides what does not fit.
    const inside = (one) => {
        const range = document.createRange();
        range.selectNodeContents(one);
        const [text, place] = [range.getBoundingClientRect(), one.getBoundingClientRect()];
        return text.left > place.left - 1 && text.right < place.right + 1;
    };
    const broken = (one) => one.matches('button') && !one.firstElementChild && one.clientHeight > 3 * parseFloat(getComputedStyle(one).fontSize) + 10;
    const fixed = visible.filter((one) => one.matches('.value, .count, .duty, .pace, button') && one.textContent.trim())
        .filter((one) => !inside(one) || broken(one)).map((one) => one.textContent);
    return [...selects, ...others, ...fixed]";

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn the_page_comes_as_one_file_and_says_what_it_waits_for() -> Result<()> {
    browse(|client| async move {
        let panel = Panel::start(&[])?;
        let page = Page::open(&client, &panel).await?;
        let files = "return performance.getEntriesByType('resource').map(({ name }) => new URL(name).pathname)
            .filter((path) => path !== '/icon.svg')";
        let files = page.run(files, json!(null)).await?;
        ensure!(files == json!([]), "it needs more files: {files}");

        // The token is not in the address, but the page can be loaded again.
        let address = page.run("return location.href", json!(null)).await?;
        let (plain, _) = panel.url.split_once("?token=").context("the address has a token")?;
        ensure!(address == json!(plain), "the address is {address}");
        client.refresh().await?;
        page.wait_for("[data-phase=running] .board .input").await?;
        page.ensure_no_console_errors().await?;

        let script = "const now = performance.now.bind(performance);
            [window.later, window.givenUp] = [0, 0];
            performance.now = () => now() + window.later;
            window.WebSocket = class extends EventTarget { readyState = 0; close() { window.givenUp += 1; } }";
        let never_open = json!({ "source": script });
        client
            .issue_cmd(Beyond::browser("Page.addScriptToEvaluateOnNewDocument", never_open))
            .await?;
        client.refresh().await?;
        page.wait_for_text(".waiting", "Waiting for the program").await?;
        // A slow network may need some seconds for a connection, but not forever.
        let closed = "window.later = Number(arguments[0]);
            return new Promise((done) => setTimeout(() => done(window.givenUp), 600))";
        let early = page.run(closed, json!(5000)).await?;
        ensure!(early == json!(0), "it has given up {early} times");
        page.wait_for_value(closed, "20000", |closed| *closed != 0).await?;

        let elsewhere = client.new_window(true).await?;
        client.switch_to_window(elsewhere.handle).await?;
        client.goto(plain).await?;
        page.wait_for_text(".waiting", "This address has no token.").await
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_space_in_a_text_stops_and_the_text_goes_on() -> Result<()> {
    browse(|client| async move { write_and_stop(&client).await })
}

async fn write_and_stop(client: &Client) -> Result<()> {
    let txt = simulated_txt()?;
    let panel = Panel::start(&[&txt.address().to_string()])?;
    let page = Page::open(client, &panel).await?;
    page.click(FORWARD).await?;
    ensure_seen(&txt, "M1 turns", turns)?;
    let write =
        "const field = document.querySelector(arguments[0]); field.value = ''; field.focus()";
    page.run(write, json!("[aria-label='Device']")).await?;
    for key in ['a', ' ', 'b', 'C'] {
        page.hold_key(key).await?;
        page.release_key(key).await?;
    }
    ensure_seen(&txt, "a space in a text", super::txt::all_off)?;
    let there = "const field = document.activeElement; return [field.ariaLabel, field.value]";
    let there: Value = page.run(there, json!(null)).await?;
    ensure!(there == json!(["Device", "abC"]), "{there}");
    page.wait_for(&format!("{FORWARD}:enabled")).await?;
    page.click(".i2c .primary + *, .i2c .row:nth-child(2) button").await?;
    page.wait_for_text(".i2c .result", "“abC” is not a number from 0 to 127.").await?;
    page.ensure_no_console_errors().await
}
