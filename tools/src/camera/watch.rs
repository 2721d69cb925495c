//! Pictures in the browser.

use std::hash::{BuildHasher, RandomState};
use std::net::{Ipv4Addr, TcpListener};
use std::thread;

use anyhow::Context;
use axum::body::Bytes;
use axum::extract::{Query, Request, State};
use axum::http::{header, StatusCode};
use axum::middleware::{self, Next as Inner};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use axum::Router;
use crossbeam_channel::Receiver;
use serde::Deserialize;
use tokio::sync::watch;

use super::source::{Next, Source};
use crate::mjpeg;

/// A server that listens, but does not answer yet.
pub(super) struct Page {
    listener: TcpListener,
    port: u16,
    token: String,
    size: (u16, u16),
}

impl Page {
    pub(super) fn listen(port: u16, size: (u16, u16)) -> anyhow::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .with_context(|| format!("port {port} of 127.0.0.1"))?;
        listener.set_nonblocking(true)?;
        let port = listener.local_addr()?.port();
        Ok(Self { listener, port, token: token(), size })
    }

    fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token)
    }

    /// Answers browsers. Returns only if that is no longer possible.
    fn serve(self, pictures: watch::Receiver<Option<Bytes>>) -> std::io::Result<()> {
        let guard = Guard { port: self.port, token: self.token.clone() };
        let (width, height) = self.size;
        let page = include_str!("watch.html")
            .replace("{token}", &self.token)
            .replace("{width}", &width.to_string())
            .replace("{height}", &height.to_string());
        let app = Router::new()
            .route("/", get(|| async { Html(page) }))
            .route("/pictures", get(|| async move { mjpeg::response(pictures.clone()) }))
            .layer(middleware::from_fn_with_state(guard, check));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            axum::serve(listener, app).await
        })
    }
}

/// Shows the pictures until Ctrl-C.
pub(super) fn watch(
    source: &Source,
    page: Page,
    open: bool,
    interrupted: &Receiver<()>,
) -> anyhow::Result<()> {
    let (sender, pictures) = watch::channel(None);
    let address = page.address();
    thread::Builder::new().name(String::from("page")).spawn(move || {
        if let Err(error) = page.serve(pictures) {
            log::error!("the page can't be shown: {error}");
        }
    })?;
    println!("{address}");
    if open && webbrowser::open(&address).is_err() {
        eprintln!("no browser could be opened: open this address in one");
    }
    loop {
        match source.next(interrupted)? {
            Next::Picture(jpeg) => drop(sender.send_replace(Some(jpeg.into()))),
            Next::Damaged => {}
            Next::Interrupted => return source.end(),
        }
    }
}

/// What a request must know.
#[derive(Clone)]
struct Guard {
    port: u16,
    token: String,
}

#[derive(Deserialize)]
struct Asked {
    #[serde(default)]
    token: String,
}

/// Answers only those who know the token, and who mean this computer: a page of another name that leads here
/// has another host.
async fn check(
    State(guard): State<Guard>,
    Query(asked): Query<Asked>,
    request: Request,
    inner: Inner,
) -> Response {
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok());
    let own = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", guard.port));
    if !own.iter().any(|own| host == Some(own)) {
        return (StatusCode::FORBIDDEN, "this page is at 127.0.0.1 only\n").into_response();
    }
    if asked.token != guard.token {
        let hint = "the token is missing or wrong: use the address that the program has printed\n";
        return (StatusCode::FORBIDDEN, hint).into_response();
    }
    let mut response = inner.run(request).await;
    // The address has the token.
    let value = header::HeaderValue::from_static("no-referrer");
    response.headers_mut().insert(header::REFERRER_POLICY, value);
    response
}

/// 128 random bits. The standard library gets the keys of its hash maps from the operating system.
fn token() -> String {
    let part = || RandomState::new().hash_one(());
    format!("{:016x}{:016x}", part(), part())
}
