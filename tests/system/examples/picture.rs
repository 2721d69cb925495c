//! The picture in the README: what the first sample prints, drawn as a terminal. This makes it again:
//!
//! ```sh
//! UPDATE_PICTURE=1 cargo test --workspace --test system examples::picture
//! ```

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::{env, fs};

use anstyle_svg::Term;

use super::run::Run;

/// How many lines of the sample are in the picture.
const LINES: usize = 26;

/// The command that one types: a green prompt, and the rest in bold.
const COMMAND: &str =
    "\u{1b}[32m$\u{1b}[0m \u{1b}[1mcargo run --example motor_on_off_switch\u{1b}[0m";

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/motor_on_off_switch.svg")
}

/// The text in a picture, line by line, without the command.
fn text(svg: &str) -> Vec<String> {
    let lines = svg.lines().filter(|line| line.trim_start().starts_with("<tspan "));
    let text = lines.map(|line| {
        line.split('<').filter_map(|part| part.split_once('>')).map(|(_, text)| text).collect()
    });
    text.skip(1).collect()
}

/// A line without its figures, which are different in each run.
fn shape(line: &str) -> String {
    let words = line
        .split_whitespace()
        .map(|word| word.trim_matches(|c: char| c.is_ascii_digit() || c == '.'));
    words.collect::<Vec<_>>().join(" ")
}

#[cfg_attr(not(unix), ignore = "a single program can't be told Ctrl-C there")]
#[test]
fn the_picture_in_the_readme_is_what_the_first_sample_prints() {
    let mut run = Run::start("motor_on_off_switch", &[]);
    // Waits until each button has been pressed twice.
    (0..LINES).for_each(|_| run.wait_for(" cm "));
    run.interrupt();
    let printed = run.finish();
    if env::var_os("UPDATE_PICTURE").is_some() {
        let shown = [&[COMMAND.to_owned()], &printed[..LINES]].concat().join("\n");
        fs::write(path(), Term::new().render_svg(&shown)).unwrap();
    }
    let drawn = text(&fs::read_to_string(path()).unwrap());
    assert!(drawn.len() >= LINES, "{drawn:#?}");

    // The lines before the table are the same; each line of the table is like one of today's.
    let table = printed.iter().position(|line| line.contains(" s  ")).unwrap();
    assert_eq!(drawn[..table], printed[..table]);
    let today: BTreeSet<String> = printed[table..].iter().map(|line| shape(line)).collect();
    for line in drawn[table..].iter().filter(|line| !line.is_empty()) {
        assert!(today.contains(&shape(line)), "{line:?} is none of {today:#?}");
    }
}
