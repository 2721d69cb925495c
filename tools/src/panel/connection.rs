//! The connection of one page.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{Message, Utf8Bytes, WebSocket};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use tokio::sync::mpsc;
use tokio::time::{self, MissedTickBehavior};

use super::control_lock::PageId;
use super::dispatch::Panel;
use super::reply::Answers;
use super::state::STATE_PERIOD;

/// How long a page may take until it is whole. What never says anything has a place of a page that others want.
const EARLY_LIMIT: Duration = Duration::from_secs(20);

/// Leaves the panel when the connection ends, however it ends.
struct OpenPage {
    panel: Arc<Panel>,
    page: PageId,
}

impl Drop for OpenPage {
    fn drop(&mut self) {
        self.panel.leave(self.page);
    }
}

/// Talks to a page until its connection ends. One that `is_early` is not whole yet: it gets only what it begins with until
/// it says something, because more would be in the way of that and of the rest of the page.
pub(super) async fn serve(socket: WebSocket, panel: Arc<Panel>, is_early: bool) {
    let open = OpenPage { page: panel.enter(), panel };
    let (sink, stream) = socket.split();
    let (answers, waiting) = Answers::channel();
    let is_whole = AtomicBool::new(!is_early);
    tokio::select! {
        () = receive(&open, stream, answers, &is_whole) => {}
        _ = publish(&open, sink, waiting, &is_whole) => {}
    }
}

async fn receive(
    open: &OpenPage,
    mut stream: SplitStream<WebSocket>,
    answers: Answers,
    is_whole: &AtomicBool,
) {
    let OpenPage { panel, page } = open;
    let mut limit = (!is_whole.load(Ordering::Relaxed)).then_some(EARLY_LIMIT);
    loop {
        let next = stream.next();
        let message = match limit.take() {
            Some(limit) => time::timeout(limit, next).await.ok().flatten(),
            None => next.await,
        };
        let Some(Ok(message)) = message else { return };
        is_whole.store(true, Ordering::Relaxed);
        match message {
            Message::Text(text) => panel.receive(*page, &text, &answers),
            // No page of ours sends bytes. They can't be understood as a text.
            Message::Binary(_) => panel.receive(*page, "", &answers),
            Message::Ping(_) | Message::Pong(_) => {}
            Message::Close(_) => return,
        }
        // A page that sends without end does not make the others silent.
        tokio::task::yield_now().await;
    }
}

/// Sends the newest states and the answers. A page that is slow misses states, and none is kept for it.
async fn publish(
    open: &OpenPage,
    mut sink: SplitSink<WebSocket, Message>,
    mut waiting: mpsc::Receiver<String>,
    is_whole: &AtomicBool,
) -> Result<(), axum::Error> {
    let OpenPage { panel, page } = open;
    sink.send(text(panel.hello(*page))).await?;
    let mut ticks = time::interval(STATE_PERIOD);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut tick = 0_usize;
    let mut begun = vec![false; panel.hosts.len()];
    loop {
        tokio::select! {
            Some(answer) = waiting.recv() => sink.send(text(answer)).await?,
            _ = ticks.tick() => {
                for (host, has_begun) in begun.iter_mut().enumerate() {
                    let may_come = !*has_begun || is_whole.load(Ordering::Relaxed);
                    if !may_come || !panel.is_due(host, *page, tick) {
                        continue;
                    }
                    if let Some(state) = panel.state(host, *page) {
                        *has_begun = true;
                        sink.feed(text(state)).await?;
                    }
                }
                tick = tick.wrapping_add(1);
                sink.flush().await?;
            }
        }
    }
}

fn text(text: String) -> Message {
    Message::Text(Utf8Bytes::from(text))
}
