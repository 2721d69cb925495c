//! Where results go: CSV files, and the tables of the document.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

pub(crate) struct Report {
    short: bool,
    /// The folder of the CSV files.
    raw: PathBuf,
    /// The document whose tables are replaced.
    document: PathBuf,
}

impl Report {
    /// A report into the document of the repository, or, if `short`, into a copy of it.
    pub(crate) fn new(short: bool) -> Result<Self> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().context("no folder above")?;
        let document = root.join("docs/measurements.md");
        let raw = root.join("target/performance");
        if !short {
            fs::create_dir_all(&raw)?;
            return Ok(Self { short, raw, document });
        }
        let raw = raw.join("short");
        fs::create_dir_all(&raw)?;
        let copy = raw.join("measurements.md");
        fs::copy(document, &copy)?;
        Ok(Self { short, raw, document: copy })
    }

    pub(crate) fn document(&self) -> &Path {
        &self.document
    }

    /// All of these, or in the short mode the last one, which does most.
    pub(crate) fn some<'a, T>(&self, all: &'a [T]) -> &'a [T] {
        &all[self.times(0, all.len() - 1)..]
    }

    /// How often something is repeated: `usual` times, or `short` times.
    pub(crate) fn times(&self, usual: usize, short: usize) -> usize {
        if self.short {
            short
        } else {
            usual
        }
    }

    /// The folder for what is made on the way.
    pub(crate) fn raw_folder(&self) -> &Path {
        &self.raw
    }

    /// A file for the results of each single measurement.
    pub(crate) fn raw(&self, name: &str, header: &[&str]) -> Result<csv::Writer<fs::File>> {
        let mut writer = csv::Writer::from_path(self.raw.join(format!("{name}.csv")))?;
        writer.write_record(header)?;
        Ok(writer)
    }

    /// Where a picture of the document goes.
    pub(crate) fn picture(&self, name: &str) -> PathBuf {
        self.document.with_file_name(format!("performance_{name}.svg"))
    }

    /// Replaces a table of the document.
    pub(crate) fn table(&self, name: &str, table: &Table) -> Result<()> {
        let text = fs::read_to_string(&self.document)?;
        let [begin, end] = ["", "/"].map(|slash| format!("<!-- {slash}{name} -->\n"));
        let place = text
            .split_once(&begin)
            .and_then(|(before, rest)| rest.split_once(&end).map(|(_, after)| (before, after)));
        let (before, after) =
            place.with_context(|| format!("the document has no place for {name:?}"))?;
        let rows = table.markdown();
        println!("{rows}");
        fs::write(&self.document, format!("{before}{begin}{rows}{end}{after}"))?;
        Ok(())
    }
}

/// A table of the document.
pub(crate) struct Table(Vec<Vec<String>>);

impl Table {
    pub(crate) fn new<const N: usize>(header: [&str; N]) -> Self {
        Self(vec![header.map(str::to_owned).to_vec()])
    }

    pub(crate) fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.0.push(cells.to_vec());
    }

    fn markdown(&self) -> String {
        let mut text = String::new();
        for (index, row) in self.0.iter().enumerate() {
            text += &format!("| {} |\n", row.join(" | "));
            if index == 0 {
                text += &format!("|{}\n", "---|".repeat(row.len()));
            }
        }
        text
    }
}
