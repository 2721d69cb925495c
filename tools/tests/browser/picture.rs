//! The pictures of the documents: `UPDATE_PICTURE=1 cargo test -p txt-tools --test tools browser::picture`.

use std::env;
use std::fs;
use std::path::Path;

use anyhow::{ensure, Result};
use fantoccini::Locator;
use ft_transfer_area::TransferAreaComHandler;
use serde_json::json;

use super::driver::browse;
use super::page::{Page, Panel};

const BYTES_MAX: usize = 300_000;

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn the_picture_shows_a_machine_that_moves() -> Result<()> {
    if env::var_os("UPDATE_PICTURE").is_none() {
        return Ok(());
    }
    browse(|client| async move {
        let panel = Panel::start(&[])?;
        let page = Page::open(&client, &panel).await?;
        page.prefer("light").await?;
        page.resize(1440, 926).await?;
        page.wait_for_text("#role", "You drive").await?;
        move_the_machine(&page).await?;
        save("panel.png", &client.screenshot().await?)
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn the_picture_shows_discs_on_a_belt() -> Result<()> {
    if env::var_os("UPDATE_PICTURE").is_none() {
        return Ok(());
    }
    browse(|client| async move {
        let (panel, address) = Panel::shown("sorting_line")?;
        let handler = TransferAreaComHandler::builder(&*address).build()?;
        handler.begin_transfer()?;
        let page = Page::open(&client, &panel).await?;
        page.prefer("light").await?;
        page.resize(1000, 1400).await?;
        for (colour, place) in [(1, "white storage"), (3, "blue storage"), (2, "colour sensor")] {
            page.click(&format!(".floor .chip:nth-child({colour})")).await?;
            page.click(&format!("[aria-label='{place}: empty']")).await?;
            page.wait_for(&format!(".place:not([aria-label='{place}: empty'])")).await?;
        }
        let floor = client.find(Locator::Css(".floor")).await?;
        save("sorting_line.png", &floor.screenshot().await?)
    })
}

fn save(name: &str, picture: &[u8]) -> Result<()> {
    ensure!(picture.len() < BYTES_MAX, "the picture has {} bytes", picture.len());
    fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(name), picture)?;
    Ok(())
}

/// Something for each line to show, for ten seconds.
async fn move_the_machine(page: &Page) -> Result<()> {
    let script = include_str!("picture.js");
    page.client.execute_async(script, vec![json!(null)]).await?;
    Ok(())
}
