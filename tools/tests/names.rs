//! Names for terminals, in what commands write.

use std::fs;
use std::path::Path;

use crate::plot::recording;
use crate::recording::{run, said};

pub(crate) const NAMES: &str = "\
[master]
I1 = \"<door>\"
I2 = \"barrier, at the gate\"
I4 = \"distance to the slide in the middle\"
C1 = \"pulses of the slide\"
M1 = \"slide with a rather long name to be read\"
O8 = \"lamp\"

[ext1]
I2 = \"button of the operator, at the door\"
";

/// Writes the names into a folder, and returns the path.
pub(crate) fn file(folder: &Path) -> String {
    let path = folder.join("machine.toml");
    fs::write(&path, NAMES).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn tables_and_pictures_have_the_names_beside_the_terminals() {
    let (folder, path) = recording();
    let (names, path) = (file(folder.path()), path.to_str().unwrap());
    let table = run(&["csv", path, "I2", "C2", "E1.I2", "--names", &names]);
    let table = String::from_utf8(table.stdout).unwrap();
    let head = table.lines().next().unwrap();
    let named = "time,cycle,\"I2 (barrier, at the gate)\",C2,\"E1.I2 (button of the operator, at the door)\",local_time";
    assert_eq!(head, named);

    let both = folder.path().join("both.svg");
    let both = both.to_str().unwrap();
    let terminals = ["I1", "I2", "I3", "E1.I2", "M1"];
    for command in [
        &["plot", path, "-o", both, "--names", &names][..],
        &["compare", path, path, "--plot", both, "--names", &names],
    ] {
        let output = run(&[command, &terminals].concat());
        assert!(output.status.success(), "{}", said(&output));
        let svg = fs::read_to_string(both).unwrap();
        let svg: Vec<&str> = svg.lines().map(str::trim).collect();
        // Of each name, where it begins and in which line.
        let place = |name: &str| {
            let at = svg.iter().position(|line| *line == name).unwrap_or_else(|| panic!("{name}"));
            let number = |name: &str| {
                let (_, value) = svg[at - 1].split_once(&format!(" {name}=\"")).unwrap();
                value.split_once('"').unwrap().0.parse::<u32>().unwrap()
            };
            (number("x"), number("y"))
        };
        let [door, barrier, button] = [
            "I1 (&lt;door&gt;)",
            "I2 (barrier, at the gate)",
            "E1.I2 (button of the operator, at the door)",
        ]
        .map(place);
        assert_eq!(door.1, barrier.1);
        // It does not fit beside the others.
        assert!(button.1 > door.1 && button.0 < barrier.0, "{door:?} {barrier:?} {button:?}");
        place("M1 (slide with a rather long name to be read)");
        place("I3");
    }
}

#[test]
fn a_wrong_file_of_names_ends_with_its_line() {
    let (folder, path) = recording();
    let names = folder.path().join("machine.toml");
    fs::write(&names, "[master]\nI9 = \"door\"\n").unwrap();
    let names = names.to_str().unwrap();
    let panel = ["panel", "simulated", "simulated", "--no-browser"];
    for (command, part) in [
        (&["csv", path.to_str().unwrap()][..], "line 2 of the names is wrong: master.I9: there is"),
        (&panel, "there are 2 controllers, but 1 times --names"),
    ] {
        let output = run(&[command, &["--names", names]].concat());
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains(part), "{}", said(&output));
    }
}
