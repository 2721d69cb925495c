//! The moving picture in the README: what the first sample prints, drawn as a terminal in which each line appears
//! at its time, and its buttons and motors as these lines describe them. To regenerate it:
//!
//! ```sh
//! UPDATE_PICTURE=1 cargo test --workspace --test system examples::picture
//! ```

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::{env, fs};

use anstyle_svg::Term;

use super::checks::columns;
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

/// What a line of the table says: when, and of each controller whether I1 is pressed and what C1 is.
struct Moment {
    seconds: f64,
    controllers: [(bool, i64); 2],
}

fn moment(line: &str) -> Option<Moment> {
    let seconds = line.split_whitespace().next()?.parse().ok()?;
    let controllers = columns(line)?.map(|(pressed, _, count)| (pressed, count));
    Some(Moment { seconds, controllers })
}

/// How long the last line is shown before all begins again, in seconds.
const REST: f64 = 2.0;

/// Pulses of C1 in a turn of the motor.
const PULSES_PER_TURN: f64 = 63.3;

/// The picture of this terminal, in motion. Where nothing is to move, all lines are there.
fn animated(still: &str, shown: &[String]) -> String {
    let moments: Vec<Option<Moment>> = shown.iter().map(|line| moment(line)).collect();
    let length = moments.iter().flatten().last().expect("a table").seconds + REST;
    let mut style = String::from(STYLE);
    let mut rows = moments.iter().enumerate();
    let mut picture = String::new();
    for line in still.lines() {
        // The first line is the command; it has no moment.
        let row = line.trim_start().starts_with("<tspan ").then(|| rows.next()).flatten();
        match row {
            Some((row, Some(Moment { seconds, .. }))) => {
                let from = 100.0 * seconds / length;
                style += &format!(
                    "      @keyframes r{row} {{ 0% {{ visibility: hidden }} {from:.1}% {{ visibility: visible }} }}\n      \
                     .r{row} {{ animation: r{row} {length:.1}s step-end infinite }}\n"
                );
                picture += &line.replacen("<tspan ", &format!("<tspan class=\"r{row}\" "), 1);
            }
            Some(_) | None => picture += line,
        }
        picture.push('\n');
    }
    let moments: Vec<&Moment> = moments.iter().flatten().collect();
    let drawn: String =
        (0..2).map(|controller| machine(controller, &moments, length, &mut style)).collect();
    style += "    }\n";
    let picture = picture.replacen("  </style>", &format!("{style}  </style>"), 1);
    picture.replacen("</svg>", &format!("{drawn}</svg>"), 1)
}

/// Some people have asked their system for less motion.
const STYLE: &str = "    .button { fill: #333333; stroke: #AAAAAA }
    .wheel { fill: none; stroke: #AAAAAA; stroke-width: 2; transform-box: fill-box; transform-origin: center }
    .name { font: 14px SFMono-Regular, Consolas, Liberation Mono, Menlo, monospace }
    @media (prefers-reduced-motion: no-preference) {
";

/// Button and motor of a controller, and how they move.
fn machine(controller: usize, moments: &[&Moment], length: f64, style: &mut String) -> String {
    let name = ["master", "extension 1"][controller];
    let (mut presses, mut turns) = (String::new(), String::new());
    for moment in moments {
        let at = 100.0 * moment.seconds / length;
        let (pressed, count) = moment.controllers[controller];
        let fill = if pressed { "#00AA00" } else { "#333333" };
        presses += &format!("{at:.1}% {{ fill: {fill} }} ");
        let angle = 360.0 * count as f64 / PULSES_PER_TURN;
        turns += &format!("{at:.1}% {{ transform: rotate({angle:.0}deg) }} ");
    }
    let last = moments.last().expect("a table").controllers[controller].1;
    let angle = 360.0 * last as f64 / PULSES_PER_TURN;
    *style += &format!(
        "      @keyframes b{controller} {{ {presses}}}\n      @keyframes m{controller} {{ {turns}100% {{ transform: \
         rotate({angle:.0}deg) }} }}\n      .b{controller} {{ animation: b{controller} {length:.1}s step-end infinite \
         }}\n      .m{controller} {{ animation: m{controller} {length:.1}s linear infinite }}\n"
    );
    let x = 420 + 165 * controller;
    format!(
        "  <g transform=\"translate({x} 130)\">
    <text class=\"fg name\" x=\"0\" y=\"6\">{name}</text>
    <circle class=\"button b{controller}\" cx=\"12\" cy=\"36\" r=\"10\" />
    <text class=\"fg name\" x=\"28\" y=\"41\">I1</text>
    <path class=\"wheel m{controller}\" d=\"M60 36a20 20 0 0 1 40 0a20 20 0 0 1 -40 0h40M80 16v20\" />
    <text class=\"fg name\" x=\"108\" y=\"41\">M1</text>
  </g>\n"
    )
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn the_picture_in_the_readme_is_what_the_first_sample_prints() {
    let mut run = Run::start("motor_on_off_switch", &[]);
    // Waits until each button has been pressed twice.
    (0..LINES).for_each(|_| run.wait_for(" cm "));
    run.interrupt();
    let printed = run.finish();
    if env::var_os("UPDATE_PICTURE").is_some() {
        let shown = [&[COMMAND.to_owned()], &printed[..LINES]].concat();
        let still = Term::new().render_svg(&shown.join("\n"));
        fs::write(path(), animated(&still, &shown)).unwrap();
    }
    let picture = fs::read_to_string(path()).unwrap();
    let drawn = text(&picture);
    assert!(drawn.len() >= LINES, "{drawn:#?}");

    // The lines before the table are the same; each line of the table is like one of today's.
    let table = printed.iter().position(|line| line.contains(" s  ")).unwrap();
    assert_eq!(drawn[..table], printed[..table]);
    let today: BTreeSet<String> = printed[table..].iter().map(|line| shape(line)).collect();
    for (row, line) in drawn.iter().enumerate().skip(table).filter(|(_, line)| !line.is_empty()) {
        assert!(today.contains(&shape(line)), "{line:?} is none of {today:#?}");
        // Each appears at its time; the command above the lines is row 0.
        let motion = format!(".r{} {{ animation: ", row + 1);
        assert!(picture.contains(&motion), "{line:?} does not appear");
    }
}
