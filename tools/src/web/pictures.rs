//! Pictures in a browser: one HTTP response in which each picture replaces the last one.

use std::convert::Infallible;
use std::sync::Arc;

use axum::body::{Body, Bytes};
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use futures_util::stream::{self, StreamExt};
use tokio::sync::watch;

/// What stands between two pictures.
const BOUNDARY: &str = "--picture\r\n";

/// A response with each new JPEG picture, which ends when the sender is dropped. An empty one means no picture yet.
///
/// A slow browser gets fewer pictures, but always the newest one. `held` is dropped when the response has ended.
pub(crate) fn response(
    mut pictures: watch::Receiver<Arc<[u8]>>,
    held: impl Send + 'static,
) -> Response {
    // The one that is there already comes at once.
    pictures.mark_changed();
    let pictures = stream::unfold((pictures, held), |(mut pictures, held)| async move {
        loop {
            pictures.changed().await.ok()?;
            let newest = Arc::clone(&pictures.borrow_and_update());
            if !newest.is_empty() {
                return Some((part(&newest), (pictures, held)));
            }
        }
    });
    let start = stream::iter([Bytes::from_static(BOUNDARY.as_bytes())]);
    let body = Body::from_stream(start.chain(pictures).map(Ok::<_, Infallible>));
    ([(CONTENT_TYPE, "multipart/x-mixed-replace; boundary=picture")], body).into_response()
}

/// A picture with the boundary after it: browsers show a picture when they have seen its end.
fn part(jpeg: &[u8]) -> Bytes {
    let head = format!("Content-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n", jpeg.len());
    [head.as_bytes(), jpeg, b"\r\n", BOUNDARY.as_bytes()].concat().into()
}
