//! Where a recording goes, and what becomes of a file that is there already.

use std::fmt;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::thread;

use anyhow::{bail, ensure, Context};
use crossbeam_channel::{bounded, select, Receiver};
use ft_transfer_area_recorder::file::{beside, hold, is_at, place_of};
use ft_transfer_area_recorder::{Error, Recorder, Totals};

use crate::interrupt;

/// The file of a recording.
pub(crate) struct Output {
    path: PathBuf,
    /// The file that is replaced when the recording has begun: until then, there is nothing better.
    replaced: Option<PathBuf>,
    /// Not so a pipe, which may be removed when its reader has opened it.
    is_file: bool,
    /// Whether the file was made here, so that no other recording takes its name.
    is_new: bool,
    /// The single file that is recorded, held open so that the system gives no other file its number. Until then the one
    /// that is replaced, so that no other recording takes its place.
    held: Option<File>,
}

impl Output {
    /// The error says that a file is there which is not to be replaced. A recording in parts replaces none.
    pub(crate) fn new(path: PathBuf, force: bool, in_parts: bool) -> anyhow::Result<Self> {
        if in_parts {
            let (replaced, held) = (None, None);
            return Ok(Self { path, replaced, is_file: true, is_new: false, held });
        }
        // Only one of several recordings that begin at the same time can make it. Other errors are the recorder's.
        let (is_new, held) = match File::create_new(&path) {
            // Not this one: its only writer is the recorder.
            Ok(_) => (true, File::open(&path).ok()),
            Err(error) => {
                let held =
                    hold(&path).with_context(|| format!("can't write {}", path.display()))?;
                ensure!(
                    force || error.kind() != ErrorKind::AlreadyExists || !path.is_file(),
                    "{} is there already; --force replaces it",
                    path.display()
                );
                (false, held)
            }
        };
        // A pipe or a device is written to.
        let replaced = (!is_new && path.is_file()).then(|| place_of(&path));
        let is_file = path.is_file() || !path.exists();
        Ok(Self { path, replaced, is_file, is_new, held })
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
        if let Some(replaced) = self.take_replaced(recorder) {
            recorder.rename(replaced)?;
        }
        Ok(())
    }

    /// The same for who does not wait for a disk. Returns whether it is to see that the file is renamed.
    pub(crate) fn begin(&mut self, recorder: &mut Recorder) -> Result<bool, Error> {
        match self.take_replaced(recorder) {
            Some(replaced) => recorder.begin_rename(replaced).map(|()| true),
            None => Ok(false),
        }
    }

    fn take_replaced(&mut self, recorder: &Recorder) -> Option<PathBuf> {
        let replaced = self.replaced.take()?;
        self.held = File::open(recorder.path()).ok();
        Some(replaced)
    }

    /// The error says that somebody has removed what was recorded, or given it another name, or replaced it.
    pub(crate) fn ensure_is_there(&self, files: &Files) -> anyhow::Result<()> {
        let newest = &files.newest;
        ensure!(!self.is_file || newest.exists(), "{} is not there any more", newest.display());
        ensure!(
            self.held.as_ref().is_none_or(|held| is_at(held, newest)),
            "{} is another file now, so this recording is not there any more",
            newest.display()
        );
        Ok(())
    }

    /// Whether another file is still in its place.
    pub(crate) fn is_beside(&self) -> bool {
        self.replaced.is_some()
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        // What nobody has recorded into is not in the way of the next attempt.
        let is_empty = |file: &File| file.metadata().is_ok_and(|file| file.len() == 0);
        if self.is_new && hold(&self.path).is_ok_and(|file| file.as_ref().is_some_and(is_empty)) {
            let _ = std::fs::remove_file(&self.path);
        }
        // A recorder that has failed at its beginning, as on a full disk, leaves the file beside.
        if let Some(replaced) = &self.replaced {
            let _ = std::fs::remove_file(beside(replaced));
        }
    }
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
            Some(_) => return Ok(()),
            None => write!(f, " to {}", self.newest.display())?,
        }
        // As with --keep.
        if self.first.exists() {
            return Ok(());
        }
        write!(f, ", of which the oldest are not there any more")
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
    // It may be a pipe that nobody reads, or a disk that stands still.
    interrupt::in_time(move || {
        drop(recorder);
        // It may be a pipe or a device.
        if path.is_file() {
            // Without it the reason is reported all the same.
            let _ = std::fs::remove_file(path);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_parts_whose_oldest_are_deleted_it_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let [first, newest] =
            ["run-0001.mcap", "run-0006.mcap"].map(|name| folder.path().join(name));
        std::fs::write(&first, "recorded").unwrap();
        let files = Files { first, newest };
        let both = format!("{} to {}", files.first.display(), files.newest.display());
        assert_eq!(files.to_string(), both);
        std::fs::remove_file(&files.first).unwrap();
        let expected = format!("{both}, of which the oldest are not there any more");
        assert_eq!(files.to_string(), expected);
    }

    #[test]
    fn of_two_recordings_that_begin_together_one_has_the_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let first = Output::new(path.clone(), false, false).unwrap();
        let error = Output::new(path.clone(), false, false).err().unwrap();
        assert!(error.to_string().ends_with("is there already; --force replaces it"), "{error}");
        drop(first);
        assert!(!path.exists(), "what was not recorded is in nobody's way");
        drop(Output::new(path.clone(), false, false).unwrap());
        std::fs::write(&path, "recorded").unwrap();
        let again = Output::new(path.clone(), true, false).unwrap();
        std::fs::write(again.first(), "").unwrap();
        drop(again);
        assert_eq!(std::fs::read(&path).unwrap(), b"recorded");
        let files = std::fs::read_dir(folder.path()).unwrap();
        assert_eq!(files.count(), 1, "the one that could not be written is not there any more");
    }
}
