//! Pages where another program drives.

use std::process::{Command, Stdio};

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
use crate::running::Running;
use crate::watch::support::KitClient;

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

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_teacher_sees_who_has_no_program_and_what_it_left_on() -> Result<()> {
    browse(|client| async move {
        let folder = tempfile::tempdir()?;
        let class = folder.path().join("7b.toml");
        // As many letters as a name has at most, without a place to break it.
        let long = "Großschönhausen-Oberlößnitz-Unterlößnitz";
        let pupils = [long, "Zoë"].map(|name| format!("[[pupils]]\nname = \"{name}\"\n"));
        std::fs::write(&class, pupils.concat())?;
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(["classroom", "--port", "0", "--world", "slide", "--class"]).arg(&class);
        let running = Running::start(command.stdin(Stdio::null()));
        let all = running.line();
        let pupil = running.line();
        let (_, address) = pupil.split_once("program ").context("no program")?;
        let (address, _) = address.split_once(',').context("no page")?;
        let page = Page { client: client.clone() };
        client.goto(all.strip_prefix("all ").context("no page of all")?).await?;

        page.wait_for_text("#role", "No program is connected").await?;
        let outside = "const tile = document.querySelector('.tile').getBoundingClientRect();
            return [...document.querySelectorAll('.tile:first-child *')].filter((one) =>
                one.getBoundingClientRect().right > tile.right + 1).length";
        for width in [1440, 1024, 390] {
            page.resize(width, 844).await?;
            let count = page.run(outside, json!(null)).await?;
            ensure!(count == json!(0), "{count} parts are beyond their card at {width}");
            // The long name ends in an ellipsis, so that all of the top is on one line.
            let top =
                page.run("return document.querySelector('.top').clientHeight", json!(null)).await?;
            ensure!(
                width < 800 || top.as_u64().is_some_and(|top| top < 75),
                "the top has {top} pixels at {width}"
            );
        }
        let mut program = KitClient::online(address.parse()?);
        program.exchange_all(&[[512, 0, 0, 0, 0, 0, 0, 0]]);
        page.wait_for_text(".tile:first-child .phase", "Connected").await?;
        page.wait_for_text("#role", "Another program drives").await?;
        // It sends no last exchange, as one that is killed.
        drop(program);
        page.wait_for_text(".tile:first-child .phase", "outputs are still on").await?;
        page.wait_for_text("#role", "outputs are still on").await?;
        page.ensure_no_console_errors().await
    })
}
