//! What a page of this program needs: a server, a browser, and nobody else.

pub(crate) mod access;
pub(crate) mod connections;
pub(crate) mod pictures;

use std::io;
use std::net::SocketAddr;

use tokio::net::TcpListener;
use tokio::runtime::Runtime;
use webbrowser::{Browser, BrowserOptions};

/// Listens at an address. The error is a sentence.
pub(crate) fn listen(runtime: &Runtime, address: SocketAddr) -> anyhow::Result<TcpListener> {
    let _inside = runtime.enter();
    connections::listen(address).map_err(|error| match error.kind() {
        io::ErrorKind::AddrInUse => anyhow::anyhow!(
            "port {} is taken by another program; choose another one with --port, or leave it out for a free one",
            address.port()
        ),
        io::ErrorKind::AddrNotAvailable => {
            anyhow::anyhow!("{} is no address of this computer; --bind needs one", address.ip())
        }
        _ => anyhow::anyhow!("the page can't be served at {address} ({error})"),
    })
}

/// Opens the page at this address, or says that it can't.
pub(crate) fn open_browser(url: &str) {
    let mut options = BrowserOptions::new();
    options.with_suppress_output(true);
    if webbrowser::open_browser_with_options(Browser::Default, url, &options).is_err() {
        eprintln!("no browser could be opened; open the address above in one");
    }
}
