//! Batches of programs, each in a process of its own.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};

use super::name::Name;

/// The argument that makes this program carry out a batch.
pub(crate) const CHILD: &str = "--child";
/// The one with a logger that blocks.
pub(crate) const BLOCKS: &str = "--blocks";

/// What came of a program.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub(crate) name: Name,
    /// What was wrong, in words; empty for a program that passed.
    pub(crate) said: String,
    /// All that happened, if it failed.
    pub(crate) timeline: String,
}

impl Outcome {
    pub(crate) fn failed(&self) -> bool {
        !self.said.is_empty()
    }
}

/// Runs these programs, which all have the same kind of logger. Each outcome goes to `tell` as it comes.
pub(crate) fn run(names: &[Name], tell: &mut dyn FnMut(Outcome)) {
    let mut left: Vec<Name> = names.to_vec();
    while !left.is_empty() {
        let before = left.len();
        let whole = left.clone();
        let last = run_once(&mut left, tell);
        if let Some(said) = last.filter(|_| left.is_empty()) {
            find_who_left(&whole, said, tell);
        } else if left.len() == before {
            let said = "the process of its batch has crashed".to_owned();
            tell(Outcome { name: left.remove(0), said, timeline: String::new() });
        }
    }
}

/// Runs as many of them as one process can; returns what they have left over.
fn run_once(left: &mut Vec<Name>, tell: &mut dyn FnMut(Outcome)) -> Option<String> {
    let mut child = start(left[0].blocks());
    let mut stdin = child.stdin.take().expect("its input is piped");
    for name in &*left {
        // A process that has crashed reads nothing, which is seen below.
        let _ = writeln!(stdin, "{name}");
    }
    drop(stdin);
    let mut remains = None;
    let stdout = child.stdout.take().expect("its output is piped");
    for line in BufReader::new(stdout).lines().map_while(Result::ok) {
        if let Some((name, said)) = line.strip_prefix("done ").and_then(|rest| rest.split_once(' '))
        {
            let Some(index) = left.iter().position(|left| left.to_string() == name) else {
                continue;
            };
            let (said, timeline) = said.split_once('\t').unwrap_or((said, ""));
            let said = if said == "[]" { String::new() } else { said.to_owned() };
            let timeline = timeline.trim_matches('"').replace("\\n", "\n");
            tell(Outcome { name: left.remove(index), said, timeline });
        } else if line.starts_with("left ") {
            remains = Some(line);
        }
    }
    let _ = child.wait();
    remains
}

/// A batch has left something over: one of its programs, which now runs alone, or several.
fn find_who_left(names: &[Name], said: String, tell: &mut dyn FnMut(Outcome)) {
    let alone = names.iter().filter(|_| names.len() > 1).find_map(|name| {
        let said = run_once(&mut vec![name.clone()], &mut |_| {})?;
        Some(Outcome { name: name.clone(), said, timeline: String::new() })
    });
    tell(alone.unwrap_or_else(|| {
        let together: Vec<String> = names.iter().map(Name::to_string).collect();
        let said = format!("{said}, of {}", together.join(" "));
        Outcome { name: names[0].clone(), said, timeline: String::new() }
    }));
}

fn start(blocks: bool) -> Child {
    let program = std::env::current_exe().expect("this program has a path");
    let mut command = Command::new(program);
    command.arg(CHILD).args(blocks.then_some(BLOCKS));
    command.stdin(Stdio::piped()).stdout(Stdio::piped());
    command.spawn().expect("this program starts")
}
