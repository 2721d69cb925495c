//! The answer to one message of a page.

use serde::Serialize;
use serde_json::Value;
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

#[derive(Serialize)]
struct Answer<'a> {
    r#type: &'static str,
    seq: Option<u64>,
    ok: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<&'a Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<&'a Problem>,
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
        // A mistake is told even if the message was too wrong to have a number.
        if self.seq.is_none() && result.is_ok() {
            return;
        }
        let (value, error) = match &result {
            Ok(value) => (value.as_ref(), None),
            Err(problem) => (None, Some(problem)),
        };
        let answer = Answer { r#type: "answer", seq: self.seq, ok: error.is_none(), value, error };
        match serde_json::to_string(&answer) {
            Ok(text) => drop(self.answers.0.try_send(text)),
            Err(error) => log::error!("an answer can't be written: {error}"),
        }
    }
}
