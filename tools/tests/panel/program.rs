//! The program, as a user starts it.

use std::process::{Command, Stdio};

use ft_transfer_area_simulator::SimulatedTxt;

use super::page::Page;
use crate::running::Running;

/// A running panel.
pub(crate) struct Panel {
    pub(crate) running: Running,
    /// 127.0.0.1 and the port.
    pub(crate) address: String,
    pub(crate) token: String,
}

impl Panel {
    /// A panel with these arguments, without a browser.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        Self::by(&mut command(arguments))
    }

    /// A panel that this command starts, without a browser.
    pub(crate) fn by(command: &mut Command) -> Self {
        let running = Running::start(command.arg("--no-browser"));
        let url = running.line();
        let (address, token) = url
            .strip_prefix("http://")
            .and_then(|rest| rest.split_once("/?token="))
            .unwrap_or_else(|| panic!("{url:?} is not the address of a page"));
        let (address, token) = (address.to_owned(), token.trim().to_owned());
        Self { running, address, token }
    }

    /// A panel for these simulated TXTs.
    pub(crate) fn of(txts: &[&SimulatedTxt]) -> Self {
        let hosts: Vec<_> = txts.iter().map(|txt| txt.address().to_string()).collect();
        Self::start(&hosts.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// A page of it, as the browser opens one.
    pub(crate) fn page(&self) -> Page {
        Page::open(&self.address, &self.token)
    }

    /// A page that drives, with the first controller connected.
    pub(crate) fn driver(&self) -> Page {
        let mut page = self.page();
        page.wait_until_running();
        page.done(serde_json::json!({"do": "drive"}));
        page
    }
}

pub(crate) fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.arg("panel").args(arguments).stdin(Stdio::null());
    command
}
