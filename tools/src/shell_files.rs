//! Completions for shells and manual pages. The archives of a release have them, so only `.ci/archives` calls this.

use std::fs;
use std::path::PathBuf;

use anyhow::Context;
use clap::{Command, ValueEnum};
use clap_complete::Shell;

/// Write completions for shells and manual pages into the folders `completions` and `man` of a folder
#[derive(clap::Args)]
pub(crate) struct Args {
    folder: PathBuf,
}

pub(crate) fn run(args: Args, mut command: Command) -> anyhow::Result<()> {
    let name = command.get_name().to_owned();
    let made = |folder: &str| {
        let folder = args.folder.join(folder);
        fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        anyhow::Ok(folder)
    };
    // Otherwise the help of each command has a page, too.
    let without_help = command.clone().disable_help_subcommand(true);
    clap_mangen::generate_to(without_help, made("man")?)?;
    let completions = made("completions")?;
    for shell in Shell::value_variants() {
        clap_complete::generate_to(*shell, &mut command, &name, &completions)?;
    }
    Ok(())
}
