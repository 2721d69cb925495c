//! The program, as a user starts it.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::thread;

use ft_transfer_area_simulator::SimulatedTxt;

use crate::page::Page;
use crate::LIMIT;

/// A running panel. It is killed when it is dropped.
pub(crate) struct Panel {
    child: Child,
    /// 127.0.0.1 and the port.
    pub(crate) address: String,
    pub(crate) token: String,
}

impl Panel {
    /// A panel with these arguments, without a browser.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let mut child =
            command(arguments).arg("--no-browser").stdout(Stdio::piped()).spawn().unwrap();
        let url = first_line(child.stdout.take().unwrap());
        let (address, token) = url
            .strip_prefix("http://")
            .and_then(|rest| rest.split_once("/?token="))
            .unwrap_or_else(|| panic!("{url:?} is no address of a page"));
        let (address, token) = (address.to_owned(), token.trim().to_owned());
        Self { child, address, token }
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

    /// Sends it a signal, such as INT.
    #[cfg(unix)]
    pub(crate) fn signal(&self, signal: &str) {
        let kill = format!("kill -{signal} {}", self.child.id());
        assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    }

    /// How it ended. It has to end by itself.
    pub(crate) fn ended(&mut self) -> ExitStatus {
        self.child.wait().unwrap()
    }
}

impl Drop for Panel {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub(crate) fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.arg("panel").args(arguments).stdin(Stdio::null());
    command
}

/// The first line that the program prints. The others are read and thrown away.
fn first_line(out: impl Read + Send + 'static) -> String {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        for line in BufReader::new(out).lines().map_while(Result::ok) {
            // Only the first one is waited for.
            let _ = sender.send(line);
        }
    });
    receiver.recv_timeout(LIMIT).expect("the program prints the address of its page")
}
