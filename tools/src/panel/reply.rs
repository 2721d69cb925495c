//! The answer to one message of a page.

use serde_json::{json, Value};
use tokio::sync::mpsc;

use super::problem::Problem;

/// How many answers may wait for a page that does not read them.
const WAITING: usize = 256;

/// A page's queue of answers.
#[derive(Clone, Debug)]
pub(crate) struct Answers(mpsc::Sender<String>);

/// Where the answer to one message goes.
#[derive(Debug)]
pub(crate) struct Reply {
    /// `None`: the page wants no answer.
    seq: Option<u64>,
    answers: Answers,
}

impl Answers {
    pub(crate) fn channel() -> (Self, mpsc::Receiver<String>) {
        let (sender, receiver) = mpsc::channel(WAITING);
        (Self(sender), receiver)
    }

    pub(crate) fn reply(&self, seq: Option<u64>) -> Reply {
        Reply { seq, answers: self.clone() }
    }
}

impl Reply {
    /// Answers. A page that has gone, or that reads none of so many answers, gets none.
    pub(crate) fn send(self, result: Result<Option<Value>, Problem>) {
        // A mistake is reported even if the message was too wrong to have a number.
        if self.seq.is_none() && result.is_ok() {
            return;
        }
        let mut answer = json!({"type": "answer", "seq": self.seq, "ok": result.is_ok()});
        match result {
            Ok(None) => {}
            Ok(Some(value)) => answer["value"] = value,
            Err(problem) => answer["error"] = json!(problem),
        }
        // A page that has gone needs no answer.
        let _ = self.answers.0.try_send(answer.to_string());
    }
}
