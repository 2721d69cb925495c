//! Pages where another program drives.

use anyhow::{ensure, Context, Result};
use fantoccini::key::Key;
use fantoccini::Client;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::TransferAreaComHandler;
use serde_json::json;

use super::driver::browse;
use super::page::{Page, Panel};
use super::txt::{all_off, ensure_seen, simulated_txt, turns};
use crate::names;

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn who_looks_sees_the_machine_first_and_no_dead_controls() -> Result<()> {
    browse(|client| async move {
        for world in ["default", "sorting_line", "factory"] {
            let (panel, _) = Panel::shown(world)?;
            client.goto(&panel.url).await?;
            let page = Page { client: client.clone() };
            page.wait_for(".board .input").await?;
            ensure_machine_first(&page).await.with_context(|| world.to_owned())?;
        }
        Ok(())
    })
}

async fn ensure_machine_first(page: &Page) -> Result<()> {
    for (width, height) in [(1366, 650), (390, 844)] {
        page.resize(width, height).await?;
        let tops = "return ['.world', '.board'].map((name) => document.querySelector(name).getBoundingClientRect().top)";
        let tops = page.run(tops, json!(null)).await?;
        let [machine, board] = [0, 1].map(|index| tops[index].as_f64().unwrap_or(f64::NAN));
        ensure!(
            machine < board && machine < f64::from(height) / 4.0,
            "the machine is at {machine} of {height}, the board at {board}"
        );
    }
    let dead = "return [...document.querySelectorAll('#main :is(button, select, input)')]
        .filter((one) => one.checkVisibility() && one.matches(':disabled')).map((one) => one.ariaLabel)";
    let dead = page.run(dead, json!(null)).await?;
    ensure!(dead == json!([]), "nobody can use {dead}");
    Ok(())
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn each_page_has_a_title_of_its_own() -> Result<()> {
    browse(|client| async move {
        let txt = simulated_txt()?;
        let address = txt.address().to_string();
        let panel = Panel::start(&[&address])?;
        let page = Page::open(&client, &panel).await?;
        let title = "return document.title";
        page.wait_for_value(title, "", |title| *title == json!("TX2013 – txt panel")).await?;
        let (watch, _) = Panel::watching(&address, &[])?;
        client.goto(&watch.url).await?;
        let watched = format!("{address} – txt watch");
        page.wait_for_value(title, "", |title| *title == json!(watched)).await?;
        page.wait_for_text(".brand", "watch").await
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn the_page_of_watch_disconnects_the_program_after_a_question() -> Result<()> {
    browse(|client| async move { disconnect(&client).await })
}

async fn disconnect(client: &Client) -> Result<()> {
    let txt = simulated_txt()?;
    let folder = tempfile::tempdir()?;
    let names = names::file(folder.path());
    let (watch, address) = Panel::watching(&txt.address().to_string(), &["--names", &names])?;
    let handler = TransferAreaComHandler::builder(&*address).build()?;
    handler.begin_transfer()?;
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
    ensure_seen(&txt, "M1 turns", turns)?;

    client.goto(&watch.url).await?;
    let page = Page { client: client.clone() };
    let motor = "[aria-label='M1 (slide with a rather long name to be read)']";
    page.wait_for_text(&format!(".shown .command{motor}"), "forward 512").await?;
    page.wait_for_text("#disconnect", "Disconnect the program").await?;
    // The question alone does nothing, and the space bar does not answer it when it is let go.
    page.type_key(Key::Space).await?;
    page.wait_for("#ask[open]").await?;
    page.type_key(Key::Escape).await?;
    page.wait_for("#ask:not([open])").await?;
    ensure!(txt.with_machine(|machine| turns(machine)), "a question has stopped M1");

    page.click("#disconnect").await?;
    page.click("#ask .danger").await?;
    ensure_seen(&txt, "the program is disconnected", all_off)?;
    page.wait_for_text("#disconnect", "Let programs in").await?;
    page.wait_for_text(".problem:not([hidden])", "Until you let programs in").await?;
    page.click("#disconnect").await?;
    page.wait_for_text("#disconnect", "Disconnect the program").await
}
