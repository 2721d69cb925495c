//! ftrobopy from the Python registry, for comparison.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{ensure, Result};

use crate::report::Report;

const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

/// A Python that has ftrobopy.
pub(crate) struct Ftrobopy {
    python: PathBuf,
}

impl Ftrobopy {
    /// The Python that FTROBOPY_PYTHON names, or else one in the folder of results, which is made if it is not
    /// there. `None`, with a note, if ftrobopy can't be installed.
    pub(crate) fn find(report: &Report) -> Result<Option<Self>> {
        if let Some(python) =
            std::env::var_os("FTROBOPY_PYTHON").filter(|python| !python.is_empty())
        {
            return Ok(Some(Self { python: python.into() }));
        }
        let folder = report.raw_folder().join("venv");
        let python = folder.join("bin/python");
        if !python.exists() && !install(&folder, &python)? {
            eprintln!("ftrobopy is not measured: it can't be installed here");
            return Ok(None);
        }
        Ok(Some(Self { python }))
    }

    /// Runs the script to its end; returns what it prints.
    pub(crate) fn run(&self, what: &str, port: u16, cycles: usize) -> Result<String> {
        let script = Path::new(FOLDER).join("performance/ftrobopy_client.py");
        let output = Command::new(&self.python)
            .args(["-B", "-W", "ignore"])
            .arg(script)
            .args([what, &port.to_string(), &cycles.to_string()])
            .stdin(Stdio::null())
            .stderr(Stdio::inherit())
            .output()?;
        ensure!(output.status.success(), "ftrobopy failed: {}", output.status);
        Ok(String::from_utf8(output.stdout)?)
    }
}

fn install(folder: &Path, python: &Path) -> Result<bool> {
    let requirements = Path::new(FOLDER).with_file_name("tests/system/interop/requirements.txt");
    let made = Command::new("python3").args(["-m", "venv"]).arg(folder).status();
    if !made.is_ok_and(|status| status.success()) {
        return Ok(false);
    }
    let pip = Command::new(python)
        .args(["-m", "pip", "install", "--quiet", "--requirement"])
        .arg(requirements)
        .status()?;
    Ok(pip.success())
}
