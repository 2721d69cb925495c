//! The page, and what it asks for.

use std::sync::atomic::Ordering;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{bail, ensure};
use axum::extract::{Query, Request, State};
use axum::http::header::{HeaderValue, CONTENT_SECURITY_POLICY, CONTENT_TYPE};
use axum::http::StatusCode;
use axum::middleware::{self, Next};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use ft_transfer_area_simulator::world::World;
use serde::{Deserialize, Serialize};
use serde_json::{json, Value};

use super::running::{self, Running};
use super::Start;
use crate::web::access::{Asked, WRONG_HOST};
use crate::web::bundle::bundle;
use crate::web::document::{put, unix_lines};
use crate::{check, print, web};

/// How many commands may run at a time.
const MOST: usize = 16;
/// How long an address may be.
const NAME: usize = 200;

const ICON: &str = include_str!("../panel/page/icon.svg");
const MODULES: &[(&str, &str)] = &[
    ("dom.js", include_str!("../panel/page/dom.js")),
    ("start.js", include_str!("page/start.js")),
];

/// What to start.
#[derive(Clone, Deserialize, PartialEq)]
pub(super) struct Wanted {
    pub(super) kind: Kind,
    /// An address, a world or a lesson.
    pub(super) name: String,
}

#[derive(Clone, Copy, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Kind {
    /// The panel of a controller.
    Panel,
    /// The panel of a simulated TXT.
    World,
    /// A simulated TXT for a program.
    Simulate,
    Lesson,
}

impl Wanted {
    /// The words of the command.
    pub(super) fn words(&self) -> anyhow::Result<Vec<String>> {
        let name = &self.name;
        let words = match self.kind {
            Kind::Panel => {
                ensure!(!name.is_empty() && name.len() <= NAME, "this is no address");
                vec!["panel", "--no-browser", "--", name]
            }
            Kind::Lesson => vec!["lesson", "--no-browser", "--", name],
            Kind::World | Kind::Simulate if !World::SHIPPED.contains(&&**name) => {
                bail!("there is no such world")
            }
            Kind::World => vec!["panel", "--no-browser", "--world", name],
            Kind::Simulate => vec!["simulate", "--show", "--no-browser", "--world", name],
        };
        Ok(words.into_iter().map(str::to_owned).collect())
    }
}

pub(super) fn router(start: Arc<Start>) -> anyhow::Result<Router> {
    let (html, policy) = document()?;
    let router = Router::new()
        .route("/", get(|| async { Html(html) }))
        .route("/icon.svg", get(|| async { ([(CONTENT_TYPE, "image/svg+xml")], ICON) }))
        .route("/state", get(state))
        .route("/find", post(find))
        .route("/open", post(open))
        .route("/end", post(end))
        .route("/quit", post(quit))
        .layer(middleware::from_fn_with_state((Arc::clone(&start), policy), admit))
        .with_state(start);
    Ok(router)
}

/// The document, and what a browser may use for it.
fn document() -> anyhow::Result<(String, HeaderValue)> {
    let mut html = unix_lines(include_str!("page/start.html"));
    let link = "<link rel=\"stylesheet\" href=\"panel.css\">";
    let style = put(&mut html, link, "style", include_str!("../panel/page/panel.css"))?;
    let link = "<link rel=\"stylesheet\" href=\"start.css\">";
    let own_style = put(&mut html, link, "style", include_str!("page/start.css"))?;
    let text = format!("{}{}", include_str!("../panel/page/token.js"), bundle(MODULES)?);
    let link = "<script type=\"module\" src=\"start.js\"></script>";
    let script = put(&mut html, link, "script type=\"module\"", &text)?;
    let policy = format!(
        "default-src 'none'; script-src {script}; style-src {style} {own_style}; img-src 'self'; \
         connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    Ok((html, HeaderValue::try_from(policy)?))
}

/// Answers only those who mean this computer; and but for the empty page, come from no other page and know the token.
async fn admit(
    State((start, policy)): State<(Arc<Start>, HeaderValue)>,
    Query(asked): Query<Asked>,
    request: Request,
    next: Next,
) -> Response {
    if start.access.host(request.headers()).is_none() {
        return WRONG_HOST.into_response();
    }
    if !["/", "/icon.svg"].contains(&request.uri().path()) {
        if let Err(refusal) = start.access.admit(request.headers(), &asked) {
            return refusal.into_response();
        }
    }
    let mut response = next.run(request).await;
    response.headers_mut().insert(CONTENT_SECURITY_POLICY, policy);
    web::protect(response.headers_mut());
    response
}

async fn state(State(start): State<Arc<Start>>) -> Json<Value> {
    *start.seen() = Instant::now();
    let running: Vec<_> = start.running().iter().map(Running::json).collect();
    Json(json!({ "running": running, "worlds": World::SHIPPED, "lessons": check::lessons() }))
}

/// A sentence for the page.
type Problem = (StatusCode, String);

fn problem(error: impl Into<anyhow::Error>) -> Problem {
    (StatusCode::CONFLICT, print::sentence(&error.into()))
}

/// Does what takes its time, one after the other, also when nobody waits for it any more.
async fn in_turn<T: Send + 'static>(
    start: &Arc<Start>,
    work: impl FnOnce(&Start) -> anyhow::Result<T> + Send + 'static,
) -> Result<T, Problem> {
    let turn = Arc::clone(&start.turn).acquire_owned().await.map_err(problem)?;
    let start = Arc::clone(start);
    let work = move || {
        let _turn = turn;
        work(&start)
    };
    tokio::task::spawn_blocking(work).await.map_err(problem)?.map_err(problem)
}

async fn find(State(start): State<Arc<Start>>) -> Result<Json<Value>, Problem> {
    in_turn(&start, |start| Ok(start.places.search()?.json())).await.map(Json)
}

async fn open(
    State(start): State<Arc<Start>>,
    Query(wanted): Query<Wanted>,
) -> Result<Json<Value>, Problem> {
    let url = in_turn(&start, |start| {
        // The page of one that ends is gone in a moment.
        let is_in_the_way = |one: &Running| one.ends() && one.excludes(&wanted);
        running::wait(|| !start.running().iter().any(is_in_the_way));
        let same = |one: &&Running| one.is(&wanted) && !one.ends();
        if let Some(one) = start.running().iter().find(same) {
            return Ok(one.url.clone());
        }
        ensure!(
            wanted.kind != Kind::Lesson || !start.running().iter().any(|one| one.excludes(&wanted)),
            "the lessons are open already: choose one on their page, or end them first"
        );
        ensure!(start.running().len() < MOST, "too much runs already; end some of it");
        let running = Running::start(wanted)?;
        let url = running.url.clone();
        start.running().push(running);
        Ok(url)
    });
    Ok(Json(json!({ "url": url.await? })))
}

#[derive(Deserialize)]
struct Which {
    id: u64,
}

async fn end(State(start): State<Arc<Start>>, Query(Which { id }): Query<Which>) -> StatusCode {
    if let Some(one) = start.running().iter_mut().find(|one| one.id == id) {
        one.ask_to_end();
    }
    StatusCode::NO_CONTENT
}

async fn quit(State(start): State<Arc<Start>>) -> StatusCode {
    start.should_end.store(true, Ordering::Relaxed);
    StatusCode::NO_CONTENT
}
