//! The simulated machine that the panel brings, on the page.

use anyhow::{ensure, Context, Result};
use fantoccini::Client;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{FishX1Transfer, TransferAreaComHandler};
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

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_key_lets_go_the_button_that_it_has_pressed() -> Result<()> {
    browse(|client| async move {
        let panel = Panel::start(&["simulated", "simulated"])?;
        let page = Page { client: client.clone() };
        client.goto(&panel.url).await?;
        let [first, second] = [2, 3].map(|place| format!("[role=tab]:nth-child({place})"));
        page.click(&first).await?;
        page.wait_for(&format!("{I3}:not([data-on])")).await?;
        page.hold_key('3').await?;
        page.wait_for(&format!("{I3}[data-on]")).await?;
        page.click(&second).await?;
        page.wait_for(&format!("{I3}:not([data-on])")).await?;
        page.release_key('3').await?;
        page.click(&first).await?;
        page.wait_for(&format!("{I3}:not([data-on])")).await
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
fn the_page_moves_a_remote() -> Result<()> {
    browse(|client| async move {
        let (panel, address) = Panel::shown("default")?;
        let handler = TransferAreaComHandler::builder(&*address).build()?;
        handler.begin_transfer()?;
        let page = Page::open(&client, &panel).await?;
        let is_on = |areas: &[FishX1Transfer]| {
            areas[LOCAL_IO].txt_inputs.ir_input.iter().any(|remote| remote.button_on != 0)
        };
        page.press_mouse(".remote .keys .key").await?;
        drop(handler.areas().wait_until(is_on, LIMIT)?);
        page.release_mouse().await?;
        drop(handler.areas().wait_until(|areas| !is_on(areas), LIMIT)?);
        page.ensure_no_console_errors().await
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_factory_is_driven_by_other_programs_and_drawn_with_its_places() -> Result<()> {
    browse(|client| async move {
        let page = Page { client: client.clone() };
        let (panel, _) = Panel::shown("factory")?;
        client.goto(&panel.url).await?;
        page_of_a_factory(&page).await?;

        let (panel, address) = Panel::shown("processing_station")?;
        client.goto(&panel.url).await?;
        carry_from_the_oven(&page, &address)
            .await
            .context("a carried piece is where its axes are")?;

        // A file from before there were drawings.
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("not_drawn.toml");
        let text = include_str!("../../../simulator/worlds/sorting_line.toml");
        let lines = text.lines().filter(|line| !line.starts_with("drawn"));
        std::fs::write(&file, lines.collect::<Vec<_>>().join("\n"))?;
        let (panel, _) = Panel::shown(file.to_str().context("its path is no text")?)?;
        client.goto(&panel.url).await?;
        names_are_at_their_belt(&page).await.context("a world that is not drawn")
    })
}

/// Drives the vacuum gripper of the processing station with a workpiece.
async fn carry_from_the_oven(page: &Page, address: &str) -> Result<()> {
    let handler = TransferAreaComHandler::builder(address).areas(2).build()?;
    handler.begin_transfer()?;
    page.wait_for("[aria-label='oven: white']").await?;
    let at_oven = || handler.areas().wait_until(|areas| areas[1].input.uni[2] == 1, LIMIT);
    let at_table = || handler.areas().wait_until(|areas| areas[LOCAL_IO].input.uni[4] == 1, LIMIT);
    handler.areas().lock()[1].output.duty[3] = 512;
    at_oven()?[1].output.duty[3] = 0;
    handler.areas().lock()[LOCAL_IO].output.duty[7] = 512;
    *handler.areas().lock()[1].output.duty = [0, 0, 0, 0, 512, 512, 0, 0];
    page.wait_for(".gripper[data-on] .piece[data-piece=white]").await?;
    let apart = "const middle = (element) => { const { x, y, width, height } = element.getBoundingClientRect(); return [x + width / 2, y + height / 2]; };
        const [a, b] = [document.querySelector('.gripper .piece[data-piece=white]'), document.querySelector(arguments[0])].map(middle);
        return Math.hypot(a[0] - b[0], a[1] - b[1])";
    let near = |apart: &serde_json::Value| apart.as_f64().is_some_and(|pixels| pixels < 40.0);
    page.wait_for_value(apart, "[aria-label^='oven:']", near).await?;
    *handler.areas().lock()[1].output.duty = [0, 0, 512, 0, 512, 0, 0, 0];
    at_table()?[1].output.duty[2] = 0;
    page.wait_for_value(apart, "[aria-label^='table:']", near).await?;
    page.wait_for("[aria-label='oven: empty']").await?;
    handler.areas().lock()[1].output.duty[3] = 512;
    at_oven()?[1].output.duty[3] = 0;
    page.click("[aria-label='oven: empty']").await?;
    page.wait_for("[aria-label='oven: white']").await?;
    handler.areas().lock()[1].output.duty[5] = 512;
    page.wait_for(".gripper[data-low]").await?;
    handler.areas().lock()[1].output.duty[4] = 0;
    let said = ".floor [role=status]";
    page.wait_for_text(said, "The white workpiece falls: oven can't take it. 1 fell.").await?;
    page.click("#language").await?;
    let german =
        "Das weiße Werkstück fällt herunter: Ofen kann nichts aufnehmen. 1 heruntergefallen.";
    page.wait_for_text(said, german).await?;
    page.click("#language").await?;
    page.ensure_no_console_errors().await
}

async fn names_are_at_their_belt(page: &Page) -> Result<()> {
    page.wait_for(".belt text").await?;
    page.wait_for(".places [aria-label='entry: empty']").await?;
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
    page.wait_for_text(".belt", "vor den Auswerfern").await?;
    page.wait_for_value(NAMES, ".belt text", |wrong| *wrong == json!([])).await?;
    page.ensure_no_console_errors().await
}

/// Names at belts and places that are too small to be read, out of their card, or over each other.
const NAMES: &str = "const place = (element) => element.getBoundingClientRect();
    const names = [...document.querySelectorAll(arguments[0])].filter((name) => name.checkVisibility());
    const over = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 4 && b.top < a.bottom - 4;
    return names.filter((name, index) => {
        const [text, card] = [place(name), place(name.closest('.card'))];
        const covered = names.some((other, at) => at !== index && over(text, place(other)));
        return covered || text.height < 11 || text.left < card.left || text.right > card.right || text.bottom > card.bottom;
    }).map((name) => name.textContent)";

async fn page_of_a_factory(page: &Page) -> Result<()> {
    page.wait_for_text("#role", "No program is connected").await?;
    page.wait_for(".drawing text").await?;
    // Shelves are in rows and columns, and nowhere else.
    let script = "const shelf = (name) => document.querySelectorAll(`[aria-label^='${name}:']`);
        const middle = (name) => { const { x, y, width, height } = shelf(name)[0].getBoundingClientRect(); return [x + width / 2, y + height / 2]; };
        const same = (numbers) => Math.max(...numbers) - Math.min(...numbers) < 1;
        const rows = ['A', 'B', 'C'].map((row) => ['1', '2', '3'].map((column) => middle(row + column)));
        const columns = [0, 1, 2].map((column) => rows.map((row) => row[column]));
        return rows.every((row) => same(row.map(([, y]) => y)) && row[0][0] + 30 < row[1][0] && row[1][0] + 30 < row[2][0])
            && columns.every((column) => same(column.map(([x]) => x)) && column[0][1] + 30 < column[1][1] && column[1][1] + 30 < column[2][1])
            && shelf('B2').length === 1";
    page.wait_for_value(script, "", |right| *right == json!(true)).await?;
    page.click("[aria-label='B2: container with red']").await?;
    page.wait_for("[aria-label='B2: empty']").await?;
    page.resize(390, 844).await?;
    page.wait_for_value(NAMES, ".drawing text", |wrong| *wrong == json!([])).await?;
    page.click("#language").await?;
    page.wait_for_text(".drawing", "Band außen").await?;
    page.wait_for_value(NAMES, ".drawing text", |wrong| *wrong == json!([])).await?;
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
