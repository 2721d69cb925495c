//! A program that hangs, or that can't be reached any more; and a controller in whose place another one comes.

use std::time::Duration;

use anyhow::{ensure, Result};
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::json;

use super::driver::browse;
use super::page::{Lesson, Page, Panel};
use super::txt::{simulated_txt, FORWARD};
use crate::watch::away::started;

/// The browser itself notices that only after a minute.
#[cfg_attr(not(unix), ignore = "only Unix can pause another program")]
#[test]
fn a_program_that_hangs_is_shown_as_lost_and_its_values_as_old() -> Result<()> {
    browse(|client| async move {
        let txt = simulated_txt()?;
        let panel = Panel::start(&[&txt.address().to_string()])?;
        let page = Page::open(&client, &panel).await?;
        page.wait_for_text("#role", "You drive").await?;
        page.wait_for(&format!("{FORWARD}:enabled")).await?;
        // Whatever the browser says later is too late.
        let deaf = "window.panelSocket.addEventListener('close', (event) => event.stopImmediatePropagation(), true);
            window.closes = 0;
            window.panelSocket.addEventListener('close', () => { window.closes += 1; })";
        page.run(deaf, json!(null)).await?;

        panel.signal("STOP");
        page.wait_for("#lost:not([hidden])").await?;
        page.wait_for_text("#role", "No connection").await?;
        page.wait_for_text(".phase", "No connection").await?;
        page.wait_for(&format!("#main[inert] {FORWARD}:disabled")).await?;
        let grey = "return getComputedStyle(document.querySelector('#main')).filter";
        let grey = page.run(grey, json!(null)).await?;
        ensure!(grey == json!("grayscale(1)"), "the values look new: {grey}");
        let title = page.run("return document.title", json!(null)).await?;
        ensure!(title.to_string().contains("No connection"), "the title is {title}");

        panel.signal("CONT");
        page.wait_for_text("#role", "You drive").await?;
        page.wait_for(&format!("#main:not([inert]) {FORWARD}:enabled")).await
    })
}

#[cfg_attr(not(unix), ignore = "only Unix can pause another program")]
#[test]
fn the_page_of_a_lesson_shows_that_its_program_hangs() -> Result<()> {
    browse(|client| async move {
        let lesson = Lesson::start()?;
        let page = Page { client: client.clone() };
        client.goto(&lesson.url).await?;
        page.wait_for_text("#role", "No program is connected").await?;
        page.wait_for("#check:not([inert]) [data-what=check]").await?;

        lesson.signal("STOP");
        page.wait_for_text("#role", "No connection").await?;
        page.wait_for("#machine[inert] .values").await?;
        page.wait_for("#check[inert]").await?;
        let grey = "return getComputedStyle(document.querySelector('#machine')).filter";
        let grey = page.run(grey, json!(null)).await?;
        ensure!(grey == json!("grayscale(1)"), "the values look new: {grey}");
        // Another language does not make it new.
        page.click("#language").await?;
        page.wait_for_text("#role", "Keine Verbindung").await?;
        page.click("#language").await?;

        lesson.signal("CONT");
        page.wait_for_text("#role", "No program is connected").await?;
        page.wait_for("#machine:not([inert]) .values").await
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn nothing_of_a_controller_is_shown_as_of_the_next_one() -> Result<()> {
    browse(|client| async move {
        let builder = || SimulatedTxt::builder().camera_start_up(Duration::ZERO);
        let txt = builder().start()?;
        txt.with_machine(|machine| machine.i2c_device(0x18)[0] = 1);
        let port = txt.port();
        let panel = Panel::start(&[&txt.address().to_string()])?;
        let page = Page::open(&client, &panel).await?;
        page.wait_for_text("#role", "You drive").await?;
        page.click(".camera .primary").await?;
        page.click(".i2c .primary").await?;
        page.wait_for(".camera img[src]:not([hidden])").await?;
        page.wait_for_text(".i2c .result", "Devices: 0x18").await?;

        drop(txt);
        page.wait_for("[data-phase=gap]").await?;
        page.wait_for(".camera img[hidden]:not([src])").await?;
        page.wait_for_text(".camera .idle:not([hidden])", "No picture yet").await?;
        page.wait_for_text(".camera .primary", "Stop").await?;
        page.wait_for_text(".i2c .result", "values with commas").await?;

        let _next = started(|| builder().port(port).device_name("BETA"));
        page.wait_for("[data-phase=running]").await?;
        let title = "return document.title";
        page.wait_for_value(title, "", |title| title.to_string().contains("BETA")).await?;
        page.wait_for(".camera img[src]:not([hidden])").await?;
        page.wait_for_text(".i2c .result", "values with commas").await?;
        page.ensure_no_console_errors().await?;
        // While the controller is there.
        drop(panel);
        Ok(())
    })
}
