//! ftrobopy as a child process.

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::sync::Once;

use serde_json::Value;

use super::Exchange;
use crate::program::{read_all, Program};

/// A Python that has ftrobopy.
pub(crate) struct Ftrobopy {
    python: String,
}

impl Ftrobopy {
    /// `None`, with a note on stderr, when ftrobopy is not tested here.
    pub(crate) fn find() -> Option<Self> {
        let python = std::env::var("FTROBOPY_PYTHON").ok().filter(|python| !python.is_empty());
        if python.is_none() {
            static NOTE: Once = Once::new();
            // Not into the test's captured output, so that the note is always shown.
            let note =
                "SKIPPED: set FTROBOPY_PYTHON to a Python with ftrobopy for tests/system/interop";
            NOTE.call_once(|| drop(writeln!(std::io::stderr(), "{note}")));
        }
        python.map(|python| Self { python })
    }

    /// Where it is.
    pub(crate) fn python(&self) -> &str {
        &self.python
    }

    /// Runs a scenario of the script; returns what it read.
    pub(crate) fn run(&self, program: &mut Program, scenario: &str, exchange: Exchange) -> Value {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/interop/ftrobopy_scenarios.py");
        let mut child = Command::new(&self.python)
            .args(["-u", "-B", "-W", "ignore::DeprecationWarning", script])
            .args([&program.ports[0].to_string(), scenario, exchange.name()])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = read_all(child.stderr.take().unwrap());
        let mut result = None;
        for line in BufReader::new(child.stdout.take().unwrap()).lines() {
            let line = line.unwrap();
            if let Some(line) = line.strip_prefix("TYPE ") {
                program.type_line(line);
            } else if let Some(json) = line.strip_prefix("RESULT ") {
                result = Some(serde_json::from_str(json).unwrap());
            }
        }
        let status = child.wait().unwrap();
        let said = said.join().unwrap();
        assert!(status.success(), "{scenario}: {status}\n{said}");
        result.unwrap_or_else(|| panic!("{scenario} has no result:\n{said}"))
    }
}
