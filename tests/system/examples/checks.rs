//! Checks of the lines that a sample prints.

use std::fs;
use std::path::Path;

use super::run::assert_in_order;

/// What the sample wifi says when the connection is lost and re-established.
pub(crate) const GAP: [&str; 7] = [
    "Lost: the connection to the controller was lost and is being re-established",
    STOPPED,
    "The connection is restored after ",
    STOPPED,
    "M3 looks for the start.",
    "M3 runs 50 pulses there.",
    "Connections that were lost and re-established: 1.",
];
const STOPPED: &str = "M3 has duty 0 and 0; its last way reads as not done.";

/// How many pulses a count may differ from its distance.
const FEW: u16 = 3;

/// How many pulses synchronised motors may differ.
const APART: u16 = 6;

/// C1 and C2 of the lines with this label, as in `arrived: C1 200, C2 0`.
fn counters(lines: &[String], label: &str) -> Vec<[u16; 2]> {
    let prefix = format!("  {label}: C1 ");
    let counters = lines.iter().filter_map(|line| line.strip_prefix(&prefix)?.split_once(", C2 "));
    counters.map(|(c1, c2)| [c1.parse().unwrap(), c2.parse().unwrap()]).collect()
}

/// The numbers before ` pulses.` in the lines that begin with this text.
fn pulses(lines: &[String], start: &str) -> Vec<u16> {
    let counts = lines.iter().filter_map(|line| line.strip_prefix(start)?.strip_suffix(" pulses."));
    let counts: Vec<u16> = counts.map(|count| count.parse().unwrap()).collect();
    assert!(!counts.is_empty(), "no {start:?} in {lines:#?}");
    counts
}

/// A distance ends within a few pulses, motors stay together, and the extended mode can be left.
pub(crate) fn distances(lines: &[String]) {
    let arrived = |pulses: u16| (150..=150 + FEW).contains(&pulses);
    let [alone, together] = counters(lines, "arrived")[..] else { panic!("{lines:#?}") };
    assert!(arrived(alone[0]) && alone[1] == 0, "{alone:?}");
    assert!(together.into_iter().all(arrived), "{together:?}");
    assert_eq!(counters(lines, "counters reset"), [[0, 0]]);
    let on_the_way = counters(lines, "on the way");
    assert_eq!(on_the_way.len(), 3);
    for [c1, c2] in on_the_way {
        assert!(c1.abs_diff(c2) <= APART, "{c1} and {c2}");
    }
    let [held, free] = counters(lines, "after half a second")[..] else { panic!("{lines:#?}") };
    assert!(held.into_iter().all(arrived), "{held:?}");
    assert!(free[0] > held[0] + 30 && free[1] > held[1] + 30, "{held:?} and {free:?}");
}

/// The gate opens for its distance and closes for the same distance.
pub(crate) fn gate(lines: &[String]) {
    let open = pulses(lines, "It is open after ")[0];
    let closed = pulses(lines, "It is closed after ")[0];
    assert!((200..=200 + FEW).contains(&open), "{open}");
    // The switch is pressed shortly before the end of the gate's way. A busy computer looks later, up to the end.
    assert!((open - 10..=200 + FEW).contains(&closed), "{closed}");
}

/// Lamps light in turn, and sounds are played one after another.
pub(crate) fn lamps_and_sounds(lines: &[String]) {
    assert_eq!(lines.last().unwrap(), "I3 is pressed.");
    let states = lines.iter().filter_map(|line| line.strip_prefix("O7 ")?.split_once("  O8 "));
    let (first, second): (Vec<&str>, Vec<(&str, &str)>) =
        states.map(|(first, rest)| (first, rest.split_once("  ").unwrap())).unzip();
    let (second, mut sounds): (Vec<&str>, Vec<&str>) = second.into_iter().unzip();
    sounds.dedup();
    assert_eq!(sounds[..3], ["Bell", "Car-horn-short", "Propeller-airplane"]);
    assert!(first.contains(&"(*)") && second.contains(&"(*)"), "{lines:#?}");
    for (first, second) in first.into_iter().zip(second) {
        assert_ne!(first, second, "{lines:#?}");
    }
}

/// The slide reverses at its end switches until the button is pressed.
pub(crate) fn slide(lines: &[String]) {
    let turns: Vec<&str> =
        lines.iter().filter_map(|line| line.split_once(", the ")).map(|turn| turn.0).collect();
    assert!(turns.len() >= 2, "{lines:#?}");
    for (turn, switch) in turns.iter().zip(["I5", "I4"].into_iter().cycle()) {
        assert_eq!(*turn, switch, "{lines:#?}");
    }
    // Each switch is pressed within a hundredth of the way from its end. A motor that is reversed may turn on for
    // that far first, and a busy computer looks later, up to the end.
    for way in pulses(lines, "I4, the start, after ") {
        assert!((380..=404).contains(&way), "{way} pulses");
    }
    assert_eq!(lines[lines.len() - 2..], ["I3 is pressed.", "0 events were lost."]);
}

/// Motors stand before ON and after OFF, and count in between.
pub(crate) fn remote(lines: &[String]) {
    assert!(lines.iter().any(|line| line.contains("ON ") && !line.ends_with("C1    0, C2    0")));
    for line in lines.iter().filter(|line| line.contains("OFF")) {
        assert!(line.contains("M1    0, M2    0"), "{line}");
    }
}

/// Each motor follows the button of the other controller, but not while the extension is unplugged.
pub(crate) fn extension(lines: &[String]) {
    let of = |text: &str| (text.contains("I1 pressed"), text.contains("M1 runs"));
    for line in lines.iter().filter(|line| line.starts_with("master: ")) {
        let (master, extension) = line.split_once("extension: ").unwrap();
        let ((pressed, runs), (other_pressed, other_runs)) = (of(master), of(extension));
        assert_eq!(runs, other_pressed, "{line}");
        assert!(other_runs == pressed || extension == "not plugged in", "{line}");
    }
    // On the sample's own simulated TXT it is unplugged, and plugged in again.
    if lines[0].starts_with("No address") {
        assert_in_order(lines, &["not plugged in", "I1 open   , M1 runs"]);
    }
}

/// The sensor is a device with 1 g and a temperature.
pub(crate) fn sensor(lines: &[String]) {
    let lines: Vec<Vec<f64>> = lines
        .iter()
        .filter(|line| line.starts_with("x "))
        .map(|line| line.split_whitespace().filter_map(|word| word.parse().ok()).collect())
        .collect();
    assert!(lines.len() >= 3);
    // After some time it is turned on its side.
    assert!(lines.len() < 20 || lines.iter().any(|line| line[0] > 0.9), "{lines:?}");
    assert!(lines[0][2] > 0.9, "{lines:?}");
    for line in &lines {
        let [x, y, z, temperature] = line[..] else { panic!("{line:?}") };
        assert!((x.hypot(z) - 1.0).abs() < 0.02 && y == 0.0, "{line:?}");
        assert!((23.0..=33.0).contains(&temperature), "{line:?}");
    }
}

/// All pictures are there. Removes them.
pub(crate) fn pictures(lines: &[String]) {
    let folder = lines.iter().find_map(|line| line.strip_prefix("The pictures are in "));
    let folder = Path::new(folder.unwrap().strip_suffix('.').unwrap());
    for number in 0..20 {
        let path = folder.join(format!("frame_{number:02}"));
        let jpeg = fs::read(path.with_extension("jpg")).unwrap();
        assert!(jpeg.starts_with(&[0xFF, 0xD8]) && jpeg.ends_with(&[0xFF, 0xD9]));
        let yuv = fs::read(path.with_extension("yuv")).unwrap();
        assert_eq!(yuv.len(), 320 * 240 * 2);
    }
    fs::remove_dir_all(folder).unwrap();
}

/// The ways of the slide end within a few pulses.
pub(crate) fn ways(lines: &[String]) {
    let short = pulses(lines, "  done after ")[0];
    assert!((50..=50 + FEW).contains(&short), "{lines:#?}");
    let long = pulses(lines, "  done after ")[1];
    assert!((250..=250 + FEW).contains(&long), "{lines:#?}");
    // The sample's own simulated TXT is switched off for a while.
    if lines[0].starts_with("No address") {
        assert_in_order(lines, &GAP);
    }
}

/// I1, M1 and C1 of both controllers in a line of the sample's table: pressed, runs, count.
pub(crate) fn columns(line: &str) -> Option<[(bool, bool, i64); 2]> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [_, "s", i1, _, "cm", m1, c1, "│", e_i1, _, "cm", e_m1, e_c1] = words[..] else {
        return None;
    };
    let state =
        |button, motor, count: &str| (button == "pressed", motor == "runs", count.parse().unwrap());
    Some([state(i1, m1, c1), state(e_i1, e_m1, e_c1)])
}

/// The motor follows the switch on master and extension, and its counter goes up while it runs.
pub(crate) fn switches(lines: &[String]) {
    assert!(lines.last().unwrap().starts_with("The motors are stopped"), "{lines:#?}");
    let rows: Vec<_> = lines.iter().filter_map(|line| columns(line)).collect();
    for controller in 0..2 {
        let states: Vec<_> = rows.iter().map(|row| row[controller]).collect();
        assert!(states.iter().all(|(pressed, runs, _)| pressed == runs), "{lines:#?}");
        let counted = |while_pressed: bool| -> i64 {
            let pairs = states.windows(2);
            let pairs = pairs.filter(|pair| pair.iter().all(|state| state.0 == while_pressed));
            pairs.map(|pair| pair[1].2 - pair[0].2).sum()
        };
        // After it is switched off it runs on a little.
        assert!(counted(true) > 2 * counted(false) && counted(true) > 50, "{lines:#?}");
    }
}

/// Three discs, each in one storage.
pub(crate) fn discs(lines: &[String]) {
    let stored: Vec<&String> = lines.iter().filter(|line| line.contains("storage")).collect();
    assert_eq!(stored.len(), 3, "{lines:?}");
    for (line, input) in stored.iter().zip(["I6.", "I7.", "I8."]) {
        assert!(line.ends_with(input), "{lines:?}");
    }
}
