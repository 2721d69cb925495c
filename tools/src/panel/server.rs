//! The server: the page, the connection of each page, the stop, the camera.

use std::sync::Arc;

use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{FromRequestParts, Path, Query, Request, State};
use axum::http::header::{
    HeaderValue, ACCEPT_ENCODING, CONTENT_ENCODING, CONTENT_SECURITY_POLICY, CONTENT_TYPE, VARY,
};
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get, post};
use axum::{Extension, Json, Router};
use serde::Deserialize;
use serde_json::Value;
use tokio::sync::Semaphore;
use tokio::task;

use super::connection;
use super::control_lock::PageId;
use super::course::Course;
use super::dispatch::Panel;
use super::files::{Page, Plotter, Ready, ICON};
use crate::open_files;
use crate::web::access::{Asked, Refusal, TOO_MANY, WRONG_HOST};
use crate::web::connections::Kept;
use crate::web::{self, pictures};

/// How many pages may show a camera.
const VIEWERS: usize = 50;
/// How long a message of a page may be, in bytes.
const MESSAGE_MAX: usize = 16 * 1024;
/// From how many bytes on what is for a page is written at once.
const AT_ONCE: usize = 16 * 1024;
/// How much may wait for a page that reads slowly, in bytes, beside its first message, which has all names: the state of
/// a world with many parts, and answers to pings.
const TO_SEND_MAX: usize = 512 * 1024;

#[derive(Clone)]
struct Server {
    /// Each for those who have its token.
    panels: Arc<[Arc<Panel>]>,
    page: Arc<Page>,
    lesson: Arc<Page>,
    /// Whose lesson is packed.
    turn: Arc<Semaphore>,
    plotter: Arc<Plotter>,
    pages: Arc<Semaphore>,
    viewers: Arc<Semaphore>,
}

/// Serves panels at one address. The token of a request says which one it is for.
pub(super) fn router(panels: impl IntoIterator<Item = Arc<Panel>>) -> anyhow::Result<Router> {
    let plotter = Arc::new(Plotter::new()?);
    let server = Server {
        panels: panels.into_iter().collect(),
        page: Arc::new(Page::panel(&plotter)?),
        lesson: Arc::new(Page::lesson()?),
        turn: Arc::new(Semaphore::new(1)),
        plotter,
        pages: Arc::new(Semaphore::new(open_files::for_pages())),
        viewers: Arc::new(Semaphore::new(VIEWERS)),
    };
    let icon = || async { ([(CONTENT_TYPE, "image/svg+xml")], ICON) };
    let router = Router::new()
        .route("/", get(page))
        .route("/icon.svg", get(icon))
        .route("/known", get(known))
        .route("/plotter.js", get(plotter_script))
        .route("/plotter.css", get(plotter_style))
        .route("/lesson", get(lesson))
        .route("/lesson/state", get(lesson_state))
        .route("/lesson/check", post(lesson_check))
        .route("/lesson/end", post(lesson_end))
        .route("/lesson/go/{number}", post(lesson_go))
        .route("/ws", any(open_page))
        .route("/stop", post(stop))
        .route("/camera/{host}", get(camera))
        .fallback(|| async { NO_FILE })
        .layer(middleware::from_fn_with_state(server.clone(), check))
        .with_state(server);
    Ok(router)
}

impl Server {
    /// The panel that a request is for.
    fn panel(&self, headers: &HeaderMap, asked: &Asked) -> Result<&Arc<Panel>, Refusal> {
        let mut refusal = NO_FILE;
        for panel in &*self.panels {
            match panel.access.admit(headers, asked) {
                Ok(()) => return Ok(panel),
                Err(refused) => refusal = refused,
            }
        }
        Err(refusal)
    }

    /// The address that the browser used, if it is one of this server.
    fn host(&self, headers: &HeaderMap) -> Option<String> {
        self.panels.iter().find_map(|panel| panel.access.host(headers)).map(str::to_owned)
    }
}

/// The panel that a request is for, whose token it has.
struct Admitted(Arc<Panel>);

impl FromRequestParts<Server> for Admitted {
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, server: &Server) -> Result<Self, Response> {
        let Query(asked) =
            Query::from_request_parts(parts, server).await.map_err(IntoResponse::into_response)?;
        let panel = server.panel(&parts.headers, &asked).map_err(IntoResponse::into_response)?;
        Ok(Self(Arc::clone(panel)))
    }
}

/// The lesson of that panel.
struct InLesson(Arc<dyn Course>);

impl FromRequestParts<Server> for InLesson {
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, server: &Server) -> Result<Self, Response> {
        let Admitted(panel) = Admitted::from_request_parts(parts, server).await?;
        panel.course.clone().map(Self).ok_or_else(|| NO_FILE.into_response())
    }
}

const NO_FILE: Refusal = (StatusCode::NOT_FOUND, "there is nothing here; the panel is at /\n");

const ONLY_LOOKS: Refusal =
    (StatusCode::CONFLICT, "this page only looks: another program drives, and txt stop stops it\n");

/// Refuses what was sent to another host, and tells the browser what the page may do.
async fn check(State(server): State<Server>, request: Request, next: Next) -> Response {
    let Some(host) = server.host(request.headers()) else {
        return WRONG_HOST.into_response();
    };
    let is_lesson = request.uri().path() == "/lesson";
    let policy = if is_lesson { &server.lesson.policy } else { &server.page.policy };
    let mut response = next.run(request).await;
    let policy = format!(
        "default-src 'none'; {policy}; img-src 'self'; connect-src 'self' ws://{host}; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'"
    );
    let headers = response.headers_mut();
    if let Ok(policy) = HeaderValue::try_from(policy) {
        headers.insert(CONTENT_SECURITY_POLICY, policy);
    }
    web::protect(headers);
    response
}

async fn page(State(Server { page, .. }): State<Server>, headers: HeaderMap) -> Response {
    file(&page.document, &headers)
}

/// Who has the token gets the state with the document, and need not ask for it over a slow network.
async fn lesson(
    State(server): State<Server>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
) -> Response {
    let course = server.panel(&headers, &asked).ok().and_then(|panel| panel.course.clone());
    let with_state = match course {
        Some(course) => with_state(&server, course).await,
        None => None,
    };
    file(with_state.as_ref().unwrap_or(&server.lesson.document), &headers)
}

/// The document with the state of this lesson. It is packed in another thread, one after the other: all pages wait for
/// this one.
async fn with_state(server: &Server, course: Arc<dyn Course>) -> Option<Ready> {
    let turn = Arc::clone(&server.turn).acquire_owned().await.ok()?;
    let page = Arc::clone(&server.lesson);
    let packed = task::spawn_blocking(move || {
        let _turn = turn;
        page.document.with_state(&course.state())
    });
    packed.await.ok()?.ok()
}

async fn plotter_script(State(server): State<Server>, headers: HeaderMap) -> Response {
    file(&server.plotter.script, &headers)
}

async fn plotter_style(State(server): State<Server>, headers: HeaderMap) -> Response {
    file(&server.plotter.style, &headers)
}

/// Whether the token of a page is one of this program: a browser does not tell a page why its connection was refused.
async fn known(_: Admitted) -> StatusCode {
    StatusCode::NO_CONTENT
}

async fn lesson_state(InLesson(course): InLesson) -> Json<Value> {
    Json(course.state())
}

async fn lesson_check(InLesson(course): InLesson) -> Result<StatusCode, Refusal> {
    done(course.check(true))
}

async fn lesson_end(InLesson(course): InLesson) -> Result<StatusCode, Refusal> {
    done(course.check(false))
}

async fn lesson_go(
    Path(number): Path<u8>,
    InLesson(course): InLesson,
) -> Result<StatusCode, Refusal> {
    done(course.go_to(number))
}

fn done(result: Result<(), &'static str>) -> Result<StatusCode, Refusal> {
    result.map(|()| StatusCode::NO_CONTENT).map_err(|sentence| (StatusCode::CONFLICT, sentence))
}

fn file(file: &Ready, headers: &HeaderMap) -> Response {
    let accepts = headers.get(ACCEPT_ENCODING).and_then(|accepts| accepts.to_str().ok());
    let kind = [(CONTENT_TYPE, file.kind), (VARY, "accept-encoding")];
    if accepts.is_some_and(|accepts| accepts.split(',').any(|one| one.trim() == "gzip")) {
        return (kind, [(CONTENT_ENCODING, "gzip")], file.gzip.clone()).into_response();
    }
    (kind, file.plain.clone()).into_response()
}

/// How a page opens its connection.
#[derive(Deserialize)]
struct Opening {
    /// Before it is whole.
    #[serde(default)]
    early: bool,
}

async fn open_page(
    State(server): State<Server>,
    Extension(kept): Extension<Kept>,
    Query(Opening { early }): Query<Opening>,
    upgrade: WebSocketUpgrade,
    Admitted(panel): Admitted,
) -> Result<Response, Refusal> {
    let place = Arc::clone(&server.pages).try_acquire_owned().map_err(|_| TOO_MANY)?;
    let own_place = Arc::clone(&panel.places).try_acquire_owned().map_err(|_| TOO_MANY)?;
    let keeping = kept.keep();
    let upgrade = upgrade
        .max_message_size(MESSAGE_MAX)
        .max_frame_size(MESSAGE_MAX)
        .write_buffer_size(AT_ONCE)
        .max_write_buffer_size(panel.hello(PageId::MAX).len() + TO_SEND_MAX);
    Ok(upgrade.on_upgrade(move |socket| async move {
        connection::serve(socket, panel, early).await;
        drop((place, own_place, keeping));
    }))
}

async fn stop(Admitted(panel): Admitted) -> Result<StatusCode, Refusal> {
    match panel.stop_by_page() {
        Ok(()) => Ok(StatusCode::NO_CONTENT),
        Err(_) => Err(ONLY_LOOKS),
    }
}

/// The camera's pictures, one after the other, as long as the browser takes them.
async fn camera(
    State(server): State<Server>,
    Extension(kept): Extension<Kept>,
    Path(host): Path<usize>,
    Admitted(panel): Admitted,
) -> Result<Response, Refusal> {
    let host = panel.hosts.get(host).ok_or(NO_FILE)?;
    let place = Arc::clone(&server.viewers).try_acquire_owned().map_err(|_| TOO_MANY)?;
    Ok(pictures::response(host.pictures(), (place, kept.keep())))
}
