//! Compares the library's public interface with the stored one, `interface.txt`:
//!
//! ```text
//! cargo run --package ft-transfer-area-interface              # fails when a program may no longer compile
//! cargo run --package ft-transfer-area-interface -- --write   # stores the present interface
//! ```
//!
//! Changes that break programs are allowed if the version says so, like 0.2.0 after 0.1.9.

mod compare;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::{env, fs};

use compare::{allows_breaks, Difference};
use serde_json::Value;

/// Its rustdoc writes the format that `public-api` reads. Another compiler may write the same format.
const TOOLCHAIN: &str = "1.95.0";

const WRITE: &str = "cargo run --package ft-transfer-area-interface -- --write";

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> ExitCode {
    match run(env::args().nth(1).as_deref()) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run(option: Option<&str>) -> Result<ExitCode> {
    let Some(json) = documentation()? else {
        println!(
            "not checked: public-api reads format {} of rustdoc, which Rust {TOOLCHAIN} writes",
            rustdoc_types::FORMAT_VERSION
        );
        return Ok(ExitCode::SUCCESS);
    };
    let version = read(&json)?["crate_version"].as_str().ok_or("no version")?.to_owned();
    let now = interface(&json)?;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("interface.txt");
    match option {
        None => {
            let stored = fs::read_to_string(&path)?;
            let (stored_version, stored) = stored.split_once('\n').ok_or("an empty file")?;
            Ok(judge(stored, stored_version, &now, &version))
        }
        Some("--write") => {
            fs::write(&path, format!("{version}\n{now}"))?;
            Ok(ExitCode::SUCCESS)
        }
        Some(other) => Err(format!("there is no option {other}, only --write").into()),
    }
}

fn judge(stored: &str, stored_version: &str, now: &str, version: &str) -> ExitCode {
    let Difference { breaks, additions } = compare::compare(stored, now);
    for line in &breaks {
        println!("{line}");
    }
    if !breaks.is_empty() && !allows_breaks(stored_version, version) {
        println!(
            "\nPrograms that were written for {stored_version} may no longer compile, and {version} \
             does not say so.\nIf this is intended: {WRITE}"
        );
        return ExitCode::FAILURE;
    }
    println!("{} breaking changes since {stored_version}, {additions} additions", breaks.len());
    if !breaks.is_empty() || additions > 0 {
        println!("store this with the next version: {WRITE}");
    }
    ExitCode::SUCCESS
}

/// The documentation as JSON in the format that can be read, or `None` if no compiler writes it.
fn documentation() -> Result<Option<PathBuf>> {
    let json = document(Command::new(env::var_os("CARGO").ok_or("to be run by cargo")?))?;
    if can_be_read(&json)? {
        return Ok(Some(json));
    }
    let mut fixed = Command::new("rustup");
    fixed.args(["run", "--install", TOOLCHAIN, "cargo"]);
    match document(fixed) {
        Ok(json) => Ok(can_be_read(&json)?.then_some(json)),
        // There may be no rustup, or it can't install the compiler.
        Err(error) => {
            eprintln!("{error}");
            Ok(None)
        }
    }
}

fn document(mut cargo: Command) -> Result<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let target = root.join("target/interface");
    let status = cargo
        .args(["rustdoc", "--quiet", "--locked", "--package", "ft-transfer-area", "--lib"])
        .args(["--features", "simulator", "--target-dir"])
        .arg(&target)
        // Wrong links do not matter here.
        .args(["--", "--cap-lints", "allow", "-Z", "unstable-options", "--output-format", "json"])
        .env("RUSTC_BOOTSTRAP", "1")
        // The cargo that runs this has set its own compiler.
        .env_remove("RUSTC")
        .env_remove("RUSTDOC")
        .current_dir(root)
        .status()?;
    if !status.success() {
        return Err("there is no documentation to compare".into());
    }
    Ok(target.join("doc/ft_transfer_area.json"))
}

fn can_be_read(json: &Path) -> Result<bool> {
    Ok(read(json)?["format_version"] == rustdoc_types::FORMAT_VERSION)
}

fn read(json: &Path) -> Result<Value> {
    Ok(serde_json::from_str(&fs::read_to_string(json)?)?)
}

/// One item per line, always in the same order.
fn interface(json: &Path) -> Result<String> {
    let api = public_api::Builder::from_rustdoc_json(json).omit_blanket_impls(true).build()?;
    let mut text = String::new();
    for item in api.items() {
        let line = item.to_string();
        // Of the traits that the compiler implements by itself, only `Send` and `Sync` are kept.
        let by_itself = ["Freeze", "StructuralPartialEq", "Unpin", "UnsafeUnpin", "UnwindSafe"];
        if !by_itself.iter().any(|name| line.contains(&format!("{name} for "))) {
            text.push_str(&line);
            text.push('\n');
        }
    }
    Ok(text)
}
