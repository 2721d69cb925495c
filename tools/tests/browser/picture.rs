//! The picture of the README: `UPDATE_PICTURE=1 cargo test -p txt-tools --test browser picture`.

use std::env;
use std::fs;
use std::path::Path;

use anyhow::{ensure, Result};
use serde_json::json;

use crate::driver::browse;
use crate::page::{Page, Panel};

const BYTES_MAX: usize = 300_000;

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
        let picture = client.screenshot().await?;
        ensure!(picture.len() < BYTES_MAX, "the picture has {} bytes", picture.len());
        fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/panel.png"), picture)?;
        Ok(())
    })
}

/// Something for each line to show, for ten seconds.
async fn move_the_machine(page: &Page) -> Result<()> {
    let script = include_str!("picture.js");
    page.client.execute_async(script, vec![json!(null)]).await?;
    Ok(())
}
