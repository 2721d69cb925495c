//! What a page of this program needs: a server, a browser, and nobody else.

pub(crate) mod access;
pub(crate) mod browser;
pub(crate) mod bundle;
pub(crate) mod connections;
pub(crate) mod document;
mod interfaces;
pub(crate) mod pictures;
pub(crate) mod qr;

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::thread;

use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::Router;
use tokio::net::TcpListener;
use tokio::runtime::{self, Runtime};

use self::access::{Access, Token};
use self::browser::Opening;

/// A server that listens, but does not answer yet.
pub(crate) struct Site {
    runtime: Runtime,
    listener: TcpListener,
    pub(crate) address: SocketAddr,
    pub(crate) access: Arc<Access>,
}

impl Site {
    /// Listens at an address. The error is a sentence.
    pub(crate) fn listen(address: SocketAddr) -> anyhow::Result<Self> {
        let runtime = runtime::Builder::new_current_thread().enable_all().build()?;
        let inside = runtime.enter();
        let listener = connections::listen(address).map_err(|error| refused(address, &error))?;
        drop(inside);
        let address = listener.local_addr()?;
        let access = Arc::new(Access::new(address.ip(), address.port())?);
        Ok(Self { runtime, listener, address, access })
    }

    /// What has this token may come in at the same address, to see something else there.
    pub(crate) fn access(&self, token: &Token) -> Arc<Access> {
        Arc::new(Access::with(self.address.ip(), self.address.port(), token.clone()))
    }

    /// The address of the page, with the token, for browsers that reach this computer by `ip`.
    pub(crate) fn url(&self, ip: IpAddr) -> String {
        self.url_for(ip, &self.access)
    }

    /// The same with another token.
    pub(crate) fn url_for(&self, ip: IpAddr, access: &Access) -> String {
        self.url_of("", ip, access)
    }

    /// The address of the page of a lesson.
    pub(crate) fn lesson_url(&self, ip: IpAddr, access: &Access) -> String {
        self.url_of("lesson", ip, access)
    }

    fn url_of(&self, page: &str, ip: IpAddr, access: &Access) -> String {
        let address = SocketAddr::new(ip, self.address.port());
        format!("http://{address}/{page}?token={}", access.token())
    }

    /// Answers from now on, in a thread of its own, and opens this address in the browser. What is returned has to be
    /// kept until the program ends.
    pub(crate) fn serve(self, router: Router, open: Option<String>) -> anyhow::Result<Opening> {
        let Self { runtime, listener, .. } = self;
        let serve = move || runtime.block_on(connections::serve(listener, router));
        thread::Builder::new().name("server".to_owned()).spawn(serve)?;
        Ok(open.map(|url| Opening::begin(&url)).unwrap_or_default())
    }
}

/// An address by which others reach what listens at this one.
pub(crate) fn reachable(ip: IpAddr) -> IpAddr {
    ip.is_unspecified().then(own_address).flatten().unwrap_or_else(|| local(ip))
}

/// The address by which programs on this computer reach what listens at this one.
pub(crate) fn local(ip: IpAddr) -> IpAddr {
    match ip {
        IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        ip => ip,
    }
}

/// The address by which others reach this computer: that of the default route, or of a network without one, as behind a
/// switch or in a hotspot.
pub(crate) fn own_address() -> Option<IpAddr> {
    own_addresses().into_iter().next()
}

/// All addresses by which others may reach this computer, the most likely one first.
pub(crate) fn own_addresses() -> Vec<IpAddr> {
    let routed = routed_address();
    let others = interfaces::addresses().into_iter().filter(|other| Some(*other) != routed);
    routed.into_iter().chain(others).collect()
}

/// The address by which this computer reaches others far away. Nothing is sent for it.
fn routed_address() -> Option<IpAddr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9)).ok()?;
    socket.local_addr().ok().map(|address| address.ip())
}

fn refused(address: SocketAddr, error: &io::Error) -> anyhow::Error {
    match error.kind() {
        io::ErrorKind::AddrInUse => anyhow::anyhow!(
            "port {} is taken by another program; choose another one with --port (of the pages of a class or a lesson: \
             --page-port), or leave it out for a free one",
            address.port()
        ),
        io::ErrorKind::AddrNotAvailable => {
            anyhow::anyhow!("{} is not an address of this computer; --bind needs one", address.ip())
        }
        _ => anyhow::anyhow!("the page can't be served at {address} ({error})"),
    }
}

/// A text as HTML.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Tells the browser to keep nothing, to pass the token on to nobody, and to show the page in no other one.
pub(crate) fn protect(headers: &mut HeaderMap) {
    for (name, value) in [
        (header::CACHE_CONTROL, "no-store"),
        // The address has the token.
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
}
