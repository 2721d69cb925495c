//! What `--help` shows.

use std::fs;
use std::process::Command;

pub(crate) const COMMANDS: [&str; 17] = [
    "bridge",
    "camera",
    "check",
    "classroom",
    "compare",
    "csv",
    "find",
    "info",
    "panel",
    "plot",
    "record",
    "replay",
    "selftest",
    "simulate",
    "start",
    "stop",
    "watch",
];

#[test]
fn the_help_of_each_command_fits_on_a_screen_and_ends_with_an_example() {
    for command in COMMANDS {
        let output =
            Command::new(env!("CARGO_BIN_EXE_txt")).args([command, "--help"]).output().unwrap();
        assert!(output.status.success(), "{command}");
        let help = String::from_utf8(output.stdout).unwrap();
        assert!(help.lines().count() <= 42, "{command}: {} lines", help.lines().count());
        for line in help.lines() {
            assert!(line.chars().count() <= 100, "{command}: {line:?} is too long");
        }
        let end = help.trim_end().rsplit("\n\n").next().unwrap();
        assert!(end.starts_with("Example"), "{command}: {end:?} is not an example");
        assert!(end.contains(&format!("txt {command} ")), "{command}: {end:?}");
    }
}

#[test]
fn completions_and_manual_pages_have_each_command() {
    let folder = tempfile::tempdir().unwrap();
    let mut txt = Command::new(env!("CARGO_BIN_EXE_txt"));
    assert!(txt.arg("shell-files").arg(folder.path()).status().unwrap().success());
    for name in ["txt.bash", "_txt", "txt.fish", "_txt.ps1"] {
        let text = fs::read_to_string(folder.path().join("completions").join(name)).unwrap();
        for command in COMMANDS {
            assert!(text.contains(command), "{name}: {command}");
        }
        assert!(!text.contains("shell-files"), "{name} has a command that is not for users");
    }
    for command in COMMANDS {
        let page = folder.path().join(format!("man/txt-{command}.1"));
        let text = fs::read_to_string(&page).unwrap();
        assert!(text.contains(&format!("txt {command} ")), "{command} has no example");
    }
}

#[test]
fn without_a_command_the_help_comes_and_that_is_no_error() {
    // On a desktop, too, when somebody reads it.
    let mut txt = Command::new(env!("CARGO_BIN_EXE_txt"));
    let output = txt.env("DISPLAY", ":none").output().unwrap();
    assert!(output.status.success(), "{}", output.status);
    let help = String::from_utf8(output.stdout).unwrap();
    assert!(help.contains("panel") && help.contains("Example: txt panel"), "{help}");
    assert!(output.stderr.is_empty(), "{:?}", output.stderr);
}
