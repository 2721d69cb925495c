//! Where a recording goes, and what becomes of a file that is there already.

use std::fmt;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::thread;

use anyhow::{bail, ensure, Context};
use crossbeam_channel::{bounded, select, Receiver};
use ft_transfer_area_recorder::{Error, Recorder, Totals};

use crate::interrupt;

/// The file of a recording.
pub(crate) struct Output {
    path: PathBuf,
    /// The file that is replaced when the recording has begun: until then, there is nothing better.
    replaced: Option<PathBuf>,
    /// Not so a pipe, which may be removed when its reader has opened it.
    is_file: bool,
}

impl Output {
    /// The error says that a file is there which is not to be replaced. A recording in parts replaces none.
    pub(crate) fn new(path: PathBuf, force: bool, in_parts: bool) -> anyhow::Result<Self> {
        if in_parts {
            return Ok(Self { path, replaced: None, is_file: true });
        }
        ensure!(
            force || !path.is_file(),
            "{} is there already; --force replaces it",
            path.display()
        );
        let replaced = replaced(&path)?;
        let is_file = path.is_file() || !path.exists();
        Ok(Self { path, replaced, is_file })
    }

    /// What the user calls it.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Waits until a pipe has a reader, or for Ctrl-C. What it returns keeps the reader until the recorder has come.
    pub(crate) fn wait_for_reader(
        &self,
        interrupted: &Receiver<()>,
    ) -> anyhow::Result<Option<File>> {
        if self.is_file {
            return Ok(None);
        }
        let (opened, pipe) = bounded(1);
        let path = self.path.clone();
        let open = move || drop(opened.send(File::options().write(true).open(path)));
        thread::Builder::new().name("pipe".to_owned()).spawn(open)?;
        let path = self.path.display();
        select! {
            recv(pipe) -> pipe => pipe?.map(Some).with_context(|| path.to_string()),
            recv(interrupted) -> _ => bail!("nobody reads {path}"),
        }
    }

    /// Where the recorder starts.
    pub(crate) fn first(&self) -> PathBuf {
        self.replaced.as_deref().map_or_else(|| self.path.clone(), beside)
    }

    /// The recording has begun, so the file takes its place.
    pub(crate) fn begun(&mut self, recorder: &mut Recorder) -> anyhow::Result<()> {
        match self.replaced.take() {
            Some(replaced) => Ok(recorder.rename(replaced)?),
            None => Ok(()),
        }
    }

    /// The error says that somebody has removed what was recorded, or given it another name.
    pub(crate) fn ensure_is_there(&self, files: &Files) -> anyhow::Result<()> {
        let newest = &files.newest;
        ensure!(!self.is_file || newest.exists(), "{} is not there any more", newest.display());
        Ok(())
    }

    /// Whether another file is still in its place.
    pub(crate) fn is_beside(&self) -> bool {
        self.replaced.is_some()
    }
}

/// A link stays a link, and a pipe or a device is written to.
fn replaced(output: &Path) -> anyhow::Result<Option<PathBuf>> {
    if !output.is_file() {
        return Ok(None);
    }
    if output.is_symlink() {
        let file = output.canonicalize().with_context(|| output.display().to_string())?;
        return Ok(Some(file));
    }
    Ok(Some(output.to_owned()))
}

/// A name beside this file, of which no other recording makes use.
fn beside(file: &Path) -> PathBuf {
    let mut name = file.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.new", std::process::id()));
    file.with_file_name(name)
}

/// The first file of a recording and the newest one, which may be the same.
pub(crate) struct Files {
    first: PathBuf,
    newest: PathBuf,
}

impl Files {
    pub(crate) fn of(recorder: &Recorder) -> Self {
        Self { first: recorder.path().to_owned(), newest: recorder.newest() }
    }

    /// The file, if there is one only.
    pub(crate) fn only(&self) -> Option<&Path> {
        (self.first == self.newest).then_some(&self.newest)
    }
}

impl fmt::Display for Files {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.first.display())?;
        match self.only() {
            Some(_) => Ok(()),
            None => write!(f, " to {}", self.newest.display()),
        }
    }
}

/// Ends a recording. The error says that a file has not taken all in time.
pub(crate) fn finish(recorder: Recorder) -> anyhow::Result<Result<(Files, Totals), Error>> {
    let path = recorder.newest().display().to_string();
    interrupt::in_time(move || end(recorder)).with_context(|| incomplete(&path))
}

/// The same for who waits for it.
pub(crate) fn end(recorder: Recorder) -> Result<(Files, Totals), Error> {
    let first = recorder.path().to_owned();
    // A last one may begin now.
    let (totals, newest) = recorder.finish_with_newest()?;
    Ok((Files { first, newest }, totals))
}

/// What is wrong when a disk or a pipe takes nothing.
pub(crate) fn incomplete(path: &str) -> String {
    format!("{path} takes nothing any more, so the recording is incomplete")
}

/// Removes a file that has no cycle, so that it is not in the way of the next attempt.
pub(crate) fn discard(recorder: Recorder) {
    let path = recorder.path().to_owned();
    // It may be a pipe that nobody reads.
    interrupt::in_time(move || drop(recorder));
    // It may be a pipe or a device.
    if path.is_file() {
        // Without it the reason is reported all the same.
        let _ = std::fs::remove_file(path);
    }
}
