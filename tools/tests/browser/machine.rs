//! The simulated machine that the panel brings, on the page.

use anyhow::{ensure, Result};
use serde_json::json;

use crate::driver::browse;
use crate::page::{Page, Panel};

const I1: &str = ".input:nth-child(1)";
const I3: &str = ".input:nth-child(3)";

#[test]
fn buttons_are_pressed_and_motors_and_lamps_are_seen() -> Result<()> {
    browse(|client| async move {
        let panel = Panel::start(&[])?;
        let page = Page::open(&client, &panel).await?;
        page.wait_for_text("#role", "You drive").await?;

        page.press_mouse("[aria-label='Press I1']").await?;
        page.wait_for(&format!("{I1}[data-on]")).await?;
        page.release_mouse().await?;
        page.wait_for(&format!("{I1}:not([data-on])")).await?;
        page.hold_key('3').await?;
        page.wait_for(&format!("{I3}[data-on]")).await?;
        page.release_key('3').await?;
        page.wait_for(&format!("{I3}:not([data-on])")).await?;

        // The slide goes from I4 to I5.
        page.wait_for(".rail .end:nth-of-type(1)[data-on]").await?;
        page.click("[aria-label='M3 forward']").await?;
        page.wait_for(".moving[data-turns=forward]").await?;
        page.wait_for(".input:nth-child(5)[data-on]").await?;
        page.click("[aria-label='Stop M3']").await?;
        page.wait_for(".moving:nth-child(3):not([data-turns])").await?;

        page.run("const kind = document.querySelector(\"[aria-label='What is on M4']\"); kind.value = 'outputs'; kind.dispatchEvent(new Event('change'))", json!(null)).await?;
        page.click("[aria-label='Switch O7']").await?;
        page.wait_for("[aria-label='Lamp O7, 100 %']").await?;
        page.ensure_no_console_errors().await
    })
}

#[test]
fn the_page_speaks_german_and_fits_a_phone() -> Result<()> {
    browse(|client| async move {
        let panel = Panel::start(&["simulated", "simulated", "--extensions", "8"])?;
        let page = Page::open(&client, &panel).await?;
        page.wait_for_text("#role", "You drive").await?;
        page.click("#language").await?;
        page.wait_for_text("#role", "Du steuerst").await?;
        page.wait_for_text(".link h2", "Verbindung").await?;
        client.refresh().await?;
        page.wait_for_text("#role", "Du steuerst").await?;

        for scheme in ["light", "dark"] {
            page.prefer(scheme).await?;
            for width in [360, 700, 1000, 1440] {
                page.resize(width, 740).await?;
                ensure_no_scroll(&page, width).await?;
            }
        }
        page.resize(360, 740).await?;
        page.click(".chips button:last-child").await?;
        page.wait_for(".board:nth-of-type(9)").await?;
        ensure_no_scroll(&page, 360).await?;
        page.click("#tabs button:last-child").await?;
        page.wait_for(".tile:nth-child(2) [data-phase=running]").await?;
        ensure_no_scroll(&page, 360).await?;
        page.ensure_no_console_errors().await?;

        drop(panel);
        page.wait_for_text("#lost:not([hidden])", "Keine Verbindung zum Programm").await?;
        page.wait_for("#main[inert]").await?;
        Ok(())
    })
}

async fn ensure_no_scroll(page: &Page, width: u32) -> Result<()> {
    let script =
        "const page = document.documentElement; return page.scrollWidth - page.clientWidth";
    let hidden = page.run(script, json!(null)).await?;
    ensure!(hidden == json!(0), "at a width of {width} pixels, {hidden} pixels are out of sight");
    Ok(())
}
