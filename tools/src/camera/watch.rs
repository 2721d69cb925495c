//! Pictures in the browser.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Query, Request, State};
use axum::middleware::{self, Next as Inner};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use axum::{Extension, Router};
use crossbeam_channel::Receiver;
use tokio::sync::{watch, Semaphore};

use super::source::{Next, Source};
use crate::print;
use crate::web::access::{Access, Asked, Refusal, TOO_MANY, WRONG_HOST};
use crate::web::connections::Kept;
use crate::web::{self, pictures, Site};

/// How many browsers may show the pictures.
const VIEWERS: usize = 50;

/// The page with pictures of this size, which is not served yet.
pub(super) struct Page {
    site: Site,
    size: (u16, u16),
}

impl Page {
    pub(super) fn listen(port: u16, size: (u16, u16)) -> anyhow::Result<Self> {
        Ok(Self { site: Site::listen(SocketAddr::from((Ipv4Addr::LOCALHOST, port)))?, size })
    }

    fn router(&self, title: &str, newest: watch::Receiver<Arc<[u8]>>) -> Router {
        let (width, height) = self.size;
        let page = include_str!("watch.html")
            .replace("{token}", self.site.access.token())
            .replace("{width}", &width.to_string())
            .replace("{height}", &height.to_string())
            // Last: a controller may have any name.
            .replace("{title}", &web::escaped(title));
        let viewers = Arc::new(Semaphore::new(VIEWERS));
        let pictures = |Extension(kept): Extension<Kept>| async move {
            let place = viewers.try_acquire_owned().map_err(|_| TOO_MANY)?;
            Ok::<_, Refusal>(pictures::response(newest, (place, kept.keep())))
        };
        Router::new()
            .route("/", get(|| async { Html(page) }))
            .route("/pictures", get(pictures))
            .layer(middleware::from_fn_with_state(Arc::clone(&self.site.access), check))
    }
}

/// Shows the pictures until Ctrl-C.
pub(super) fn watch(
    source: &Source,
    page: Page,
    open: bool,
    interrupted: &Receiver<()>,
) -> anyhow::Result<()> {
    let (sender, newest) = watch::channel(Arc::from([]));
    let router = page.router(&source.title(), newest);
    let url = page.site.url(page.site.address.ip());
    print::line(&url)?;
    let _opening = page.site.serve(router, open.then_some(url))?;
    loop {
        match source.next(interrupted)? {
            Next::Picture(jpeg) => drop(sender.send_replace(jpeg.into())),
            Next::Damaged => {}
            Next::Interrupted => return source.end(),
        }
    }
}

/// Answers only those who mean this computer, come from no other page, and know the token.
async fn check(
    State(access): State<Arc<Access>>,
    Query(asked): Query<Asked>,
    request: Request,
    inner: Inner,
) -> Response {
    if access.host(request.headers()).is_none() {
        return WRONG_HOST.into_response();
    }
    if let Err(refusal) = access.admit(request.headers(), &asked) {
        return refusal.into_response();
    }
    let mut response = inner.run(request).await;
    web::protect(response.headers_mut());
    response
}
