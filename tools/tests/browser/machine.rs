//! The simulated machine that the panel brings, on the page.

use anyhow::{ensure, Context, Result};
use fantoccini::Client;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::TransferAreaComHandler;
use serde_json::json;

use super::driver::browse;
use super::page::{Page, Panel, LIMIT};

const I1: &str = ".input:nth-child(1)";
const I3: &str = ".input:nth-child(3)";

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn the_page_shows_the_machine_in_each_language_and_size() -> Result<()> {
    browse(|client| async move {
        operate(&client).await.context("buttons are pressed, motors and lamps are seen")?;
        speak_german_and_fit(&client).await.context("the page speaks German and fits a phone")
    })
}

async fn operate(client: &Client) -> Result<()> {
    let panel = Panel::start(&[])?;
    let page = Page::open(client, &panel).await?;
    page.wait_for_text("#role", "You drive").await?;

    page.press_mouse("[aria-label='Press I1']").await?;
    page.wait_for(&format!("{I1}[data-on]")).await?;
    page.release_mouse().await?;
    page.wait_for(&format!("{I1}:not([data-on])")).await?;
    page.hold_key('3').await?;
    page.wait_for(&format!("{I3}[data-on]")).await?;
    page.release_key('3').await?;
    page.wait_for(&format!("{I3}:not([data-on])")).await?;

    page.click("[aria-label='M1 forward']").await?;
    page.wait_for(".moving:nth-child(1)[data-turns=forward]").await?;
    page.click("[aria-label='Stop M1']").await?;
    page.wait_for(".moving:nth-child(1):not([data-turns])").await?;

    // The slide leaves I4.
    page.wait_for(".rail .end:nth-of-type(1)[data-on]").await?;
    page.click("[aria-label='M3 forward']").await?;
    page.wait_for(".rail .end:nth-of-type(1):not([data-on])").await?;

    let choose = "const kind = document.querySelector(arguments[0]);
        kind.value = 'outputs';
        kind.dispatchEvent(new Event('change'))";
    page.run(choose, json!("[aria-label='What is on M4']")).await?;
    page.wait_for(".terminal:nth-child(4)[data-kind=outputs]").await?;
    page.click("[aria-label='Switch O7']").await?;
    page.wait_for("[aria-label='Lamp O7, 31 %']").await?;
    let colours = "return [7, 8].map((output) => getComputedStyle(document.querySelector(`[aria-label='Value of O${output}']`)).getPropertyValue('--level'))";
    let colours = page.run(colours, json!(null)).await?;
    ensure!(colours[0] != colours[1], "O8 is off, but has the colour of O7: {colours}");
    page.ensure_no_console_errors().await
}

async fn speak_german_and_fit(client: &Client) -> Result<()> {
    let panel = Panel::start(&["simulated", "simulated", "--extensions", "8"])?;
    let page = Page::open(client, &panel).await?;
    page.wait_for_text("#role", "You drive").await?;
    page.click("#language").await?;
    page.wait_for_text("#role", "Du steuerst").await?;
    page.wait_for_text(".link h2", "Verbindung").await?;
    client.refresh().await?;
    page.wait_for_text("#role", "Du steuerst").await?;

    for width in [360, 700, 1000, 1440] {
        page.resize(width, 740).await?;
        ensure_no_scroll(&page, width).await?;
    }
    page.prefer("dark").await?;
    page.resize(360, 740).await?;
    page.click(".chips button:last-child").await?;
    page.wait_for(".board:nth-of-type(9)").await?;
    ensure_no_scroll(&page, 360).await?;
    page.click("#tabs button:first-child").await?;
    page.wait_for(".tile:nth-child(2) [data-phase=running]").await?;
    ensure_no_scroll(&page, 360).await?;
    page.ensure_no_console_errors().await?;

    drop(panel);
    page.wait_for_text("#lost:not([hidden])", "Keine Verbindung zum Programm").await?;
    page.wait_for("#main[inert]").await?;
    Ok(())
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn the_page_looks_and_presses_while_a_program_drives() -> Result<()> {
    browse(|client| async move {
        let (panel, address) = Panel::shown("slide")?;
        let handler = TransferAreaComHandler::builder(&*address).build()?;
        handler.begin_transfer()?;
        let page = Page::open(&client, &panel).await?;
        page.wait_for_text("#role", "Another program drives").await?;
        page.wait_for("#stop[hidden]").await?;
        // There is nothing to click that would move nothing.
        page.wait_for_text(".shown .command", "stands").await?;
        page.wait_for("body:not(:has([aria-label='M1 forward']))").await?;

        handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
        page.wait_for(".moving[data-turns=forward]").await?;
        page.wait_for_text(".shown .command", "forward 512").await?;
        page.press_mouse("[aria-label='Press I3']").await?;
        drop(handler.areas().wait_until(|areas| areas[LOCAL_IO].input.uni[2] == 1, LIMIT)?);
        page.release_mouse().await?;
        drop(handler.areas().wait_until(|areas| areas[LOCAL_IO].input.uni[2] == 0, LIMIT)?);
        page.ensure_no_console_errors().await
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_factory_is_driven_by_other_programs_and_names_of_places_are_at_their_belt() -> Result<()> {
    browse(|client| async move {
        let (panel, _) = Panel::shown("factory")?;
        client.goto(&panel.url).await?;
        page_of_a_factory(&Page { client: client.clone() }).await
    })
}

/// Names at belts that are too small to be read, out of their card, or over each other.
const NAMES: &str = "const place = (element) => element.getBoundingClientRect();
    const names = [...document.querySelectorAll(arguments[0])].filter((name) => name.checkVisibility());
    const over = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 4 && b.top < a.bottom - 4;
    return names.filter((name, index) => {
        const [text, card] = [place(name), place(name.closest('.card'))];
        const covered = names.some((other, at) => at !== index && over(text, place(other)));
        return covered || text.height < 11 || text.left < card.left || text.right > card.right || text.bottom > card.bottom;
    }).map((name) => name.textContent)";

async fn page_of_a_factory(page: &Page) -> Result<()> {
    page.wait_for_text("#role", "Another program drives").await?;
    page.wait_for(".belt text").await?;
    let script = "const outside = ([text, bed]) => text.left < bed.left - 6 || text.right > bed.right + 6;
        const place = (element) => element.getBoundingClientRect();
        return [...document.querySelectorAll('.belt')].flatMap((belt) =>
            [...belt.querySelectorAll('text')].filter((text) =>
                outside([place(text), place(belt.querySelector('.bed'))])).map((text) => text.textContent))";
    let outside = page.run(script, json!(null)).await?;
    ensure!(outside == json!([]), "{outside} is beyond its belt");
    page.resize(390, 844).await?;
    page.wait_for_value(NAMES, ".belt text", |wrong| *wrong == json!([])).await?;
    page.click("#language").await?;
    page.wait_for_text(".belt", "Band außen").await?;
    page.wait_for_value(NAMES, ".belt text", |wrong| *wrong == json!([])).await?;
    page.click("#language").await?;
    page.resize(1280, 900).await?;

    page.click("#tabs button:first-child").await?;
    page.wait_for(".tile:nth-child(4)").await?;
    page.wait_for_text(".tile .note", " ms").await?;
    let script = "return [...document.querySelectorAll('.tile > .note')].map((note) => note.textContent).join()";
    let said = page.run(script, json!(null)).await?;
    ensure!(!said.to_string().contains("drives"), "{said}");
    page.ensure_no_console_errors().await
}

async fn ensure_no_scroll(page: &Page, width: u32) -> Result<()> {
    let script =
        "const page = document.documentElement; return page.scrollWidth - page.clientWidth";
    let hidden = page.run(script, json!(null)).await?;
    ensure!(hidden == json!(0), "at a width of {width} pixels, {hidden} pixels are out of sight");
    Ok(())
}
