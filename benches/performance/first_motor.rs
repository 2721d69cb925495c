//! How long it takes from a fresh clone to the first motor, and how large a program gets.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{bail, ensure, Context, Result};

use crate::report::{Report, Table};

pub(crate) fn measure(report: &Report) -> Result<()> {
    let clone = Clone::of_the_repository()?;
    let mut raw = report.raw("first_motor", &["what", "value", "unit"])?;
    let mut table = Table::new(["what", "value"]);
    let mut note = |what: &str, value: String, unit: &str| -> Result<()> {
        eprintln!("{what}: {value} {unit}");
        raw.write_record([what, &value, unit])?;
        table.row([what.to_owned(), format!("{value} {unit}").trim_end().to_owned()]);
        Ok(())
    };
    // In the short mode nothing is built.
    if report.times(1, 0) > 0 {
        let seconds = |time: Duration| format!("{:.1}", time.as_secs_f64());
        let first_motor = clone.time_to_first_motor()?;
        note("`git clone` of this repository from the same disk", seconds(clone.took), "s")?;
        note(
            "from there to the first motor (`cargo run --example motor_on_off_switch`)",
            seconds(first_motor),
            "s",
        )?;
        let samples = clone.time_to_build(&["--examples"])?;
        note("then all other samples (`cargo build --examples`)", seconds(samples), "s")?;
        let library = clone.time_to_build(&["--release", "--lib"])?;
        note("the library alone, optimized (`cargo build --release`)", seconds(library), "s")?;
        for program in [Program::EMPTY, Program::FIRST] {
            let size = program.size(&clone)?;
            note(program.what, format!("{:.0}", size as f64 / 1024.0), "KiB")?;
        }
    }
    for (package, what) in [
        ("ft-transfer-area", "dependencies of the library"),
        ("ft-transfer-area-simulator", "dependencies of the simulated TXT"),
    ] {
        let [direct, all] = clone.dependencies(package)?;
        note(what, format!("{direct}, with theirs {all}"), "")?;
    }
    raw.flush()?;
    report.table("first_motor", &table)
}

/// A clone of the repository, and a folder for what is built. Both go when this is dropped.
struct Clone {
    folder: tempfile::TempDir,
    took: Duration,
}

impl Clone {
    fn of_the_repository() -> Result<Self> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().context("no folder above")?;
        let folder = tempfile::tempdir()?;
        let begin = Instant::now();
        let mut git = Command::new("git");
        run(git.args(["clone", "--quiet"]).arg(root).arg(folder.path().join("clone")))?;
        Ok(Self { folder, took: begin.elapsed() })
    }

    fn sources(&self) -> PathBuf {
        self.folder.path().join("clone")
    }

    /// Cargo as a user calls it, in a folder of its own for each thing that is measured.
    fn cargo(&self, target: &str) -> Command {
        let mut cargo = Command::new("cargo");
        cargo.current_dir(self.sources()).stdin(Stdio::null());
        // Crates come from the cache: how long they take to come in depends on the network alone.
        cargo.env("CARGO_NET_OFFLINE", "true");
        cargo.env("CARGO_TARGET_DIR", self.folder.path().join(target));
        // What this program was built and started with is not for others.
        for name in ["RUSTFLAGS", "CARGO_INCREMENTAL", "CARGO_BUILD_TARGET"] {
            cargo.env_remove(name);
        }
        cargo
    }

    /// From an empty folder to the line of the first sample in which a motor runs.
    fn time_to_first_motor(&self) -> Result<Duration> {
        let begin = Instant::now();
        let mut sample = self
            .cargo("samples")
            .args(["run", "--quiet", "--example", "motor_on_off_switch"])
            .stdout(Stdio::piped())
            .spawn()?;
        let out = sample.stdout.take().context("no output")?;
        let mut lines = BufReader::new(out).lines();
        let found =
            lines.find(|line| line.as_ref().map_or(true, |line| shows_a_running_motor(line)));
        let took = begin.elapsed();
        // The sample may have ended already. Its simulated TXT ends with it.
        let _ = sample.kill();
        sample.wait()?;
        found.context("no motor has run in the sample")??;
        Ok(took)
    }

    fn time_to_build(&self, arguments: &[&str]) -> Result<Duration> {
        // The samples use what the first of them has built, as for a user.
        let target = if arguments.contains(&"--examples") { "samples" } else { "library" };
        let begin = Instant::now();
        run(self.cargo(target).args(["build", "--quiet"]).args(arguments))?;
        Ok(begin.elapsed())
    }

    /// How many packages one of them needs to run: those that it names, and all.
    fn dependencies(&self, package: &str) -> Result<[usize; 2]> {
        let count = |depth: &str| -> Result<usize> {
            let mut cargo = self.cargo("tree");
            // It may want to know packages for other systems.
            cargo.env("CARGO_NET_OFFLINE", "false");
            cargo.args(["tree", "--package", package, "--edges", "normal,build"]);
            cargo.args(["--prefix", "none", "--no-dedupe", "--format", "{p}", "--depth", depth]);
            let out = cargo.stderr(Stdio::inherit()).output()?;
            ensure!(out.status.success(), "cargo tree has failed");
            let text = String::from_utf8(out.stdout)?;
            let packages: std::collections::HashSet<&str> = text.lines().skip(1).collect();
            Ok(packages.len())
        };
        Ok([count("1")?, count("1000")?])
    }
}

/// A line of the sample's table in which M1 runs.
fn shows_a_running_motor(line: &str) -> bool {
    line.contains('│') && line.contains(" runs ")
}

/// A program in a project of its own.
struct Program {
    what: &'static str,
    name: &'static str,
    /// Its source, or `None` for the first program of the README.
    source: Option<&'static str>,
}

impl Program {
    const EMPTY: Self = Self {
        what: "a program that does nothing, without the library, optimized and stripped",
        name: "empty",
        source: Some("fn main() {}\n"),
    };
    const FIRST: Self = Self {
        what: "the README's first program, optimized and stripped",
        name: "first",
        source: None,
    };

    /// Its size in bytes, optimized and stripped.
    fn size(&self, clone: &Clone) -> Result<u64> {
        let project = clone.folder.path().join(self.name);
        fs::create_dir_all(project.join("src"))?;
        let (source, dependency) = match self.source {
            Some(source) => (source.to_owned(), ""),
            None => {
                let readme = fs::read_to_string(clone.sources().join("README.md"))?;
                (first_program(&readme)?, "ft-transfer-area = { path = \"../clone\" }\n")
            }
        };
        fs::write(project.join("src/main.rs"), source)?;
        let manifest = format!(
            "[package]\nname = \"{}\"\nedition = \"2021\"\n\n[dependencies]\n{dependency}\n\
             [profile.release]\nstrip = true\n",
            self.name
        );
        fs::write(project.join("Cargo.toml"), manifest)?;
        // The versions that are in the cache.
        fs::copy(clone.sources().join("Cargo.lock"), project.join("Cargo.lock"))?;
        let mut cargo = clone.cargo(self.name);
        run(cargo.current_dir(&project).args(["build", "--quiet", "--release"]))?;
        let file = format!("{}{}", self.name, std::env::consts::EXE_SUFFIX);
        let built = clone.folder.path().join(self.name).join("release").join(file);
        Ok(fs::metadata(built)?.len())
    }
}

/// The first Rust program in a text.
fn first_program(text: &str) -> Result<String> {
    let program = text.split_once("```rust").and_then(|(_, rest)| rest.split_once('\n'));
    let program = program.and_then(|(_, rest)| rest.split_once("```"));
    let (program, _) = program.context("the README has no program")?;
    Ok(program.to_owned())
}

fn run(command: &mut Command) -> Result<()> {
    let status = command.status()?;
    if !status.success() {
        bail!("{} has failed", command.get_program().to_string_lossy());
    }
    Ok(())
}
