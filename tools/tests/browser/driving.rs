//! What the TXT gets from the page: this process is the TXT.

use anyhow::{Context, Result};
use fantoccini::key::Key;
use fantoccini::Client;
use serde_json::json;

use super::driver::browse;
use super::page::{Page, Panel};
use super::txt::{all_off, ensure_seen, simulated_txt, turns, FIRST, FORWARD, STOPPED};

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn the_txt_gets_what_the_page_tells_it() -> Result<()> {
    browse(|client| async move {
        turn_and_stop(&client)
            .await
            .context("a motor turns by mouse and keyboard, each stop stops it")?;
        load_again_and_close(&client).await.context("a page is loaded again, and closed")?;
        take_over(&client).await.context("a second page looks until it takes over")
    })
}

async fn turn_and_stop(client: &Client) -> Result<()> {
    let txt = simulated_txt()?;
    let panel = Panel::start(&[&txt.address().to_string()])?;
    let page = Page::open(client, &panel).await?;
    page.wait_for_text("#role", "You drive").await?;

    page.click(FORWARD).await?;
    ensure_seen(&txt, "M1 turns by mouse", turns)?;
    page.click("#stop").await?;
    ensure_seen(&txt, "the stop button", all_off)?;
    page.wait_for(STOPPED).await?;
    page.wait_for_text("#role", "You drive").await?;
    page.ensure_not_told().await?;

    page.tab_to("[aria-label='What is on M1']", FORWARD).await?;
    page.type_key(Key::Enter).await?;
    ensure_seen(&txt, "M1 turns by keyboard", turns)?;
    // The focus is still on the button that starts the motor.
    page.type_key(Key::Space).await?;
    ensure_seen(&txt, "the space bar", all_off)?;
    page.wait_for(STOPPED).await?;

    page.click(FORWARD).await?;
    ensure_seen(&txt, "M1 turns again", turns)?;
    // The stop needs nothing from the rest of the page: neither its connection nor its scripts.
    let broken = "window.panelSocket = null;
        document.getElementById = requestAnimationFrame = () => { throw new Error('broken on purpose') }";
    page.run(broken, json!(null)).await?;
    page.click("#stop").await?;
    ensure_seen(&txt, "the stop button of a broken page", all_off)
}

async fn load_again_and_close(client: &Client) -> Result<()> {
    let txt = simulated_txt()?;
    let panel = Panel::start(&[&txt.address().to_string()])?;
    let page = Page::open(client, &panel).await?;
    page.click(FORWARD).await?;
    ensure_seen(&txt, "M1 turns", turns)?;

    client.refresh().await?;
    ensure_seen(&txt, "the page is loaded again", all_off)?;
    page.wait_for_text("#role", "You drive").await?;
    page.click(FORWARD).await?;
    ensure_seen(&txt, "M1 turns after a reload", turns)?;
    txt.with_machine(|machine| machine.controllers[0].mic_lin = 4711);
    page.wait_for_text(".microphone", "4,711").await?;
    let elsewhere = "fetch('/stop?token=' + window.panelToken, { method: 'POST' })";
    page.run(elsewhere, json!(null)).await?;
    ensure_seen(&txt, "a stop from elsewhere", all_off)?;
    page.wait_for_text(".toast", "Somebody else has stopped the motors.").await?;
    page.ensure_no_console_errors().await?;

    let elsewhere = client.new_window(true).await?;
    client.close_window().await?;
    client.switch_to_window(elsewhere.handle).await?;
    ensure_seen(&txt, "the page is closed", all_off)
}

async fn take_over(client: &Client) -> Result<()> {
    let txt = simulated_txt()?;
    let panel = Panel::start(&[&txt.address().to_string()])?;
    let page = Page::open(client, &panel).await?;
    page.wait_for_text("#role", "You drive").await?;
    let first = client.window().await?;
    page.click(FORWARD).await?;
    ensure_seen(&txt, "M1 turns", turns)?;

    let second = client.new_window(false).await?.handle;
    client.switch_to_window(second).await?;
    let page = Page::open(client, &panel).await?;
    page.wait_for_text("#banner", "drives. Here you can look.").await?;
    page.wait_for(&format!("{FORWARD}:disabled")).await?;
    // Anybody may stop.
    page.click("#stop").await?;
    ensure_seen(&txt, "the stop of a page that looks", all_off)?;

    page.click("#take").await?;
    page.wait_for_text("#role", "You drive").await?;
    page.click(FORWARD).await?;
    ensure_seen(&txt, "M1 turns by the second page", turns)?;
    let against =
        "const [motor, pulses] = arguments[0].map((label) => document.querySelector(label));
        motor.value = '1/against';
        motor.dispatchEvent(new Event('change'));
        pulses.value = 0";
    let fields =
        ["[aria-label='Motor that runs together with M1']", "[aria-label='Pulses for M1']"];
    page.run(against, json!(fields)).await?;
    page.click("[aria-label='Go this distance with M1']").await?;
    ensure_seen(&txt, "M2 turns the other way", |machine| {
        machine.controllers[0].outputs.duty[..4] == [FIRST, 0, 0, FIRST]
    })?;
    page.ensure_no_console_errors().await?;

    client.switch_to_window(first).await?;
    page.wait_for_text("#banner", "drives. Here you can look.").await?;
    page.wait_for(".board[aria-disabled=true]").await?;

    drop(txt);
    page.wait_for_text(".problem:not([hidden])", "The connection is lost").await?;
    page.click("#language").await?;
    // With its cause.
    page.wait_for_text(".problem:not([hidden])", "danach sind sie aus: D").await?;
    page.ensure_no_console_errors().await
}
