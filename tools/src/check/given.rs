//! What is wrong with the words after `txt check`, in the language of the lessons.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use super::lesson::{Lesson, LESSONS};
use super::words::{Language, Words};
use super::Args;

/// Our options, which stand before the lesson.
const OPTIONS: [&str; 5] = ["--show", "--no-browser", "--language", "--names", "--help"];

/// A sentence if there is no such lesson.
pub(super) fn lesson(text: &str, language: Language) -> Result<&'static Lesson, String> {
    Lesson::find(text).ok_or_else(|| {
        let name = |lesson: &Lesson| format!("{} {}", lesson.number, lesson.name_in(language));
        let lessons = LESSONS.iter().map(name).collect::<Vec<_>>().join(", ");
        match language {
            Language::En => format!("there is no lesson {text:?}; there are {lessons}"),
            Language::De => format!("die Lektion „{text}“ gibt es nicht; es gibt {lessons}"),
        }
    })
}

/// A sentence if this can't be the program.
pub(super) fn problem(args: &Args, language: Language) -> Option<String> {
    let words = late_option(args).or_else(|| {
        let program = Path::new(args.program.first()?);
        source(program, &args.lesson).or_else(|| missing(program))
    })?;
    Some(words.text(language).to_owned())
}

/// A sentence if the program was not built since its source was changed.
pub(super) fn older_than_source(args: &Args, language: Language) -> Option<String> {
    let program = Path::new(args.program.first()?);
    let source = sources(program).into_iter().find(|source| source.exists())?;
    let changed = |path: &Path| fs::metadata(path).and_then(|file| file.modified()).ok();
    if changed(&source)? <= changed(&with_suffix(program))? {
        return None;
    }
    let here = std::env::current_dir().unwrap_or_default();
    let source = source.strip_prefix(here).unwrap_or(&source);
    let (source, program) = (source.display(), program.display());
    Some(match language {
        Language::En => {
            format!("{source} was changed after {program} was built: run `cargo build` first.")
        }
        Language::De => format!(
            "{source} wurde geändert, nachdem {program} gebaut wurde: Ruf zuerst `cargo build` auf."
        ),
    })
}

/// An option that the program would get instead of `txt`. After `--` it is meant for the program.
fn late_option(args: &Args) -> Option<Words> {
    if std::env::args_os().any(|word| word == "--") {
        return None;
    }
    let is_ours = |word: &&str| OPTIONS.contains(&word.split('=').next().unwrap_or_default());
    let option = args.program.iter().skip(1).filter_map(|word| word.to_str()).find(is_ours)?;
    let program = Path::new(&args.program[0]).display();
    let lesson = &args.lesson;
    Some(Words::new(
        format!(
            "{option} stands after the program, which would get it; options come before the lesson: txt check {option} \
             … {lesson} {program}. If it is for the program: txt check {lesson} -- {program} {option}"
        ),
        format!(
            "{option} steht hinter dem Programm, das es also bekäme; Optionen stehen vor der Lektion: txt check {option} \
             … {lesson} {program}. Ist es für das Programm: txt check {lesson} -- {program} {option}"
        ),
    ))
}

/// What was given is the text of a program.
fn source(program: &Path, lesson: &str) -> Option<Words> {
    let extension = program.extension().and_then(OsStr::to_str)?;
    let (shown, stem) = (program.display(), program.file_stem()?.to_string_lossy());
    let (en, de) = match extension {
        "rs" => (
            format!("build it with `cargo build`, and check target/debug/{stem}"),
            format!("Bau es mit `cargo build` und prüfe target/debug/{stem}"),
        ),
        "py" => (
            format!("write: txt check {lesson} python3 {shown}"),
            format!("Schreib: txt check {lesson} python3 {shown}"),
        ),
        "c" | "cpp" => (
            "compile it, and check the program that the compiler makes".to_owned(),
            "Übersetze es und prüfe das Programm, das der Compiler macht".to_owned(),
        ),
        _ => return None,
    };
    // A script that says who runs it is a program.
    let is_script = begins_with(program, b"#!");
    (!is_script).then(|| {
        Words::new(
            format!("{shown} is the source of a program; {en}"),
            format!("{shown} ist der Quelltext eines Programms. {de}"),
        )
    })
}

/// Whether a file begins so. A pipe may never begin.
fn begins_with(path: &Path, begin: &[u8]) -> bool {
    let mut found = vec![0; begin.len()];
    let mut read = || File::open(path)?.read_exact(&mut found);
    path.is_file() && read().is_ok() && found == begin
}

/// There is no such file. A name alone is looked up by the system.
fn missing(program: &Path) -> Option<Words> {
    if program.components().count() < 2 || with_suffix(program).exists() || program.exists() {
        return None;
    }
    let shown = program.display();
    let what = |en: String, de: String| {
        Some(Words::new(
            format!("can't start the program {shown}: there is no such file; {en}"),
            format!("Das Programm {shown} lässt sich nicht starten, es gibt die Datei nicht. {de}"),
        ))
    };
    if !program.starts_with("target") {
        return what("check the path".to_owned(), "Prüfe den Pfad".to_owned());
    }
    if !Path::new("Cargo.toml").exists() {
        return what(
            "go to the folder with the Cargo.toml of your programs first".to_owned(),
            "Geh zuerst in den Ordner, in dem die Cargo.toml deiner Programme liegt".to_owned(),
        );
    }
    if sources(program).iter().any(|source| source.exists()) {
        return what(
            "run `cargo build` first".to_owned(),
            "Ruf zuerst `cargo build` auf".to_owned(),
        );
    }
    let names = sources_there();
    if names.is_empty() {
        return what(
            "its source would be a file in src/bin".to_owned(),
            "Sein Quelltext wäre eine Datei in src/bin".to_owned(),
        );
    }
    what(format!("the sources in src/bin are {names}"), format!("In src/bin liegen {names}"))
}

/// The file with the ending that programs have on this system.
fn with_suffix(program: &Path) -> PathBuf {
    let suffix = std::env::consts::EXE_SUFFIX;
    if suffix.is_empty() || program.extension().is_some() {
        return program.to_owned();
    }
    let mut name = program.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// Where the source of a program of Cargo may be.
fn sources(program: &Path) -> Vec<PathBuf> {
    let of = |program: &Path| {
        let stem = program.file_stem()?.to_str()?;
        let path = std::path::absolute(program).ok()?;
        let target = path.ancestors().find(|folder| folder.ends_with("target"))?;
        let package = target.parent()?;
        if path.parent()?.ends_with("examples") {
            return Some(vec![
                package.join(format!("examples/{stem}.rs")),
                package.join(format!("examples/{stem}/main.rs")),
            ]);
        }
        let mut sources = vec![
            package.join(format!("src/bin/{stem}.rs")),
            package.join(format!("src/bin/{stem}/main.rs")),
        ];
        let about = fs::read_to_string(package.join("Cargo.toml")).unwrap_or_default();
        let is_main = about.lines().any(|line| line.replace(' ', "") == format!("name=\"{stem}\""));
        sources.extend(is_main.then(|| package.join("src/main.rs")));
        Some(sources)
    };
    of(program).unwrap_or_default()
}

/// The names of the files in `src/bin`, or nothing.
fn sources_there() -> String {
    let files = fs::read_dir("src/bin").into_iter().flatten().flatten();
    let mut names: Vec<_> =
        files.map(|file| file.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names.truncate(20);
    names.join(", ")
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn only_a_file_says_who_runs_it() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(at("a.py")).status().unwrap().success());
        fs::write(at("b.py"), "#!/usr/bin/python3\n").unwrap();
        fs::write(at("c.py"), "#").unwrap();
        let is_source = |name: &str| source(&at(name), "1").is_some();
        assert_eq!(["a.py", "b.py", "c.py"].map(is_source), [true, false, true]);
    }

    #[test]
    fn the_source_of_a_program_of_cargo_is_found_however_it_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let package = folder.path();
        fs::write(package.join("Cargo.toml"), "[package]\nname = \"first\"\n").unwrap();
        for (program, source) in [
            ("target/debug/lamp", "src/bin/lamp.rs"),
            ("src/../target/debug/lamp", "src/bin/lamp/main.rs"),
            ("target/release/examples/lamp", "examples/lamp.rs"),
            ("target/debug/first", "src/main.rs"),
        ] {
            let of = sources(&package.join(program));
            let is_source = |one: &PathBuf| one.ends_with(source);
            assert!(of.iter().any(is_source), "{program}: {of:?}");
        }
        assert!(!sources(&package.join("target/debug/lamp")).contains(&package.join("src/main.rs")));
        let of_example = sources(&package.join("target/debug/examples/lamp"));
        assert!(!of_example.contains(&package.join("src/bin/lamp.rs")));
        assert!(sources(&package.join("debug/lamp")).is_empty());
    }
}
