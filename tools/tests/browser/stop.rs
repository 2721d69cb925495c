//! What a person sees from a stop on until somebody drives again.

use std::net::TcpStream;
use std::thread;

use anyhow::{ensure, Context, Result};
use fantoccini::key::Key;
use fantoccini::Client;
use serde_json::json;
use tungstenite::Message;

use super::driver::{browse, Beyond};
use super::page::{Page, Panel};
use super::txt::{all_off, ensure_seen, simulated_txt, turns, FIRST, FORWARD, STOPPED};

/// The request of the next stop waits until `letStopGo` is called. Its way by the WebSocket is free.
const HOLD_STOP: &str = "const send = window.fetch;
    window.fetch = (...request) => {
        window.fetch = send;
        return new Promise((go) => { window.letStopGo = go; }).then(() => send(...request));
    }";

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn no_click_is_lost_without_a_word_after_a_stop() -> Result<()> {
    browse(|client| async move {
        wait_grey(&client).await.context("controls are grey until the page drives again")?;
        drop_old_clicks(&client).await.context("what was set before a stop moves nothing after it")
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_page_that_looks_offers_the_wheel_all_the_time() -> Result<()> {
    browse(|client| async move { look_and_stop(&client).await })
}

async fn ensure_waits(page: &Page) -> Result<()> {
    // The plotter and a recording move nothing.
    let script = "return [document.querySelectorAll('#main :is(.board, .card:not(.plot, .recording)) :is(button, select, [type=range]):enabled').length,
        document.querySelector('#role').textContent]";
    let seen = page.run(script, json!(null)).await?;
    let wanted = json!([0, "One moment …"]);
    ensure!(seen == wanted, "how much can be clicked, and the role: {seen}");
    Ok(())
}

async fn wait_grey(client: &Client) -> Result<()> {
    let txt = simulated_txt()?;
    let panel = Panel::start(&[&txt.address().to_string()])?;
    let page = Page::open(client, &panel).await?;
    // Some controls are out of sight.
    page.resize(700, 500).await?;
    page.click(FORWARD).await?;
    ensure_seen(&txt, "M1 turns", turns)?;

    page.run(HOLD_STOP, json!(null)).await?;
    page.type_key(Key::Space).await?;
    ensure_waits(&page).await?;
    ensure_seen(&txt, "the space bar", all_off)?;
    // The page does not take control while a part of its stop can still take it away.
    page.wait_for(STOPPED).await?;
    ensure_waits(&page).await?;
    page.run("window.letStopGo()", json!(null)).await?;

    // The focus is where it was, so the keyboard goes on as the mouse does.
    page.wait_for(&format!("{FORWARD}:enabled:focus")).await?;
    page.type_key(Key::Enter).await?;
    ensure_seen(&txt, "M1 turns by keyboard", turns)?;
    for _ in 0..5 {
        page.type_key(Key::Space).await?;
        ensure_seen(&txt, "the space bar", all_off)?;
        page.click(FORWARD).await?;
        ensure_seen(&txt, "M1 turns again", turns)?;
    }
    page.ensure_not_told().await?;
    page.ensure_no_console_errors().await
}

async fn drop_old_clicks(client: &Client) -> Result<()> {
    let txt = simulated_txt()?;
    let panel = Panel::start(&[&txt.address().to_string()])?;
    let page = Page::open(client, &panel).await?;
    page.wait_for_text("#role", "You drive").await?;
    // The second speed waits to be sent when the stop comes.
    let click_and_stop =
        "const [forward, speed] = arguments[0].map((one) => document.querySelector(one));
        const setSpeed = window.setSpeed = (value) => {
            speed.value = value;
            speed.dispatchEvent(new Event('input'));
        };
        forward.click();
        setSpeed(300);
        window.dispatchEvent(new KeyboardEvent('keydown', { code: 'Space' }));
        // Longer than it would have waited.
        window.waited = new Promise((done) => setTimeout(done, 100))";
    page.run(click_and_stop, json!([FORWARD, "[aria-label='Speed of M1']"])).await?;
    page.wait_for(&format!("{FORWARD}:enabled")).await?;
    page.wait_for(STOPPED).await?;
    // The motor stands: its speed is only set for later.
    page.run("window.setSpeed(200); return window.waited", json!(null)).await?;

    page.click("[aria-label='M2 forward']").await?;
    ensure_seen(&txt, "M2 turns, and M1 does not", |machine| {
        machine.controllers[0].outputs.duty[..4] == [0, 0, FIRST, 0]
    })?;
    page.ensure_not_told().await?;
    page.ensure_no_console_errors().await
}

/// A page without a browser turns M1, and drives until somebody stops it.
fn turn_elsewhere(panel: &Panel) -> Result<()> {
    let url = panel.url.replacen("http:", "ws:", 1).replacen("/?", "/ws?", 1);
    let address = url.split('/').nth(2).context("the panel's address has no host")?;
    let (mut socket, _) = tungstenite::client(&*url, TcpStream::connect(address)?)?;
    socket.send(Message::text(r#"{"do":"drive"}"#))?;
    // The panel may not be connected yet.
    thread::spawn(move || -> tungstenite::Result<()> {
        loop {
            let running = socket.read()?.to_text()?.contains(r#""phase":"running""#);
            let turn = r#"{"do":"motor","motor":0,"duty":512}"#;
            socket.send(Message::text(if running { turn } else { r#"{"do":"alive"}"# }))?;
        }
    });
    Ok(())
}

async fn look_and_stop(client: &Client) -> Result<()> {
    let txt = simulated_txt()?;
    let panel = Panel::start(&[&txt.address().to_string()])?;
    turn_elsewhere(&panel)?;
    ensure_seen(&txt, "M1 turns by another page", turns)?;
    // A page that was just opened, however long this test takes.
    let clock_stands =
        json!({ "source": "const now = performance.now(); performance.now = () => now" });
    client
        .issue_cmd(Beyond::browser("Page.addScriptToEvaluateOnNewDocument", clock_stands))
        .await?;
    let page = Page::open(client, &panel).await?;
    page.wait_for_text("#banner:not([hidden])", "drives. Here you can look.").await?;
    let watch = "window.take = document.querySelector('#take');
        window.hidings = 0;
        new MutationObserver(() => { window.hidings += 1; })
            .observe(document.querySelector('#banner'), { attributeFilter: ['hidden'] })";
    page.run(watch, json!(null)).await?;

    page.click("#stop").await?;
    ensure_seen(&txt, "the stop of a page that looks", all_off)?;
    page.wait_for_text("#banner:not([hidden])", "Nobody drives").await?;
    let same = "return [window.hidings, document.querySelector('#take') === window.take]";
    let seen = page.run(same, json!(null)).await?;
    ensure!(
        seen == json!([0, true]),
        "how often the banner went, and whether its button stayed: {seen}"
    );

    page.click("#take").await?;
    page.wait_for_text("#role", "You drive").await?;
    page.click(FORWARD).await?;
    ensure_seen(&txt, "M1 turns by this page", turns)?;
    page.ensure_not_told().await?;
    page.ensure_no_console_errors().await
}
