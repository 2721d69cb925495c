//! Opens a page in the browser.
//!
//! Every user of the computer can list the programs that run, with their arguments. So the browser gets the name of a
//! file that only this user can read, and the file leads to the page with its token. What a process that was
//! killed has left of it, the next one removes.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::{env, fs, io, thread};

#[cfg(unix)]
use ft_transfer_area_recorder::file::open_alone;
use tempfile::{Builder, TempDir};
use webbrowser::{Browser, BrowserOptions};

const PREFIX: &str = "txt-";
const NAME: &str = "open.html";
const HEAD: &str = "<!doctype html>\n<meta charset=\"utf-8\">\n<title>txt</title>\n";

/// The file that leads to the page, in a folder of its own. It is removed when this is dropped.
#[derive(Default)]
#[must_use]
pub(crate) struct Opening {
    /// The open file is locked as long as this process lives, on Unix.
    _folder: Option<(TempDir, Option<fs::File>)>,
}

impl Opening {
    /// Opens the page at this address, or says that it can't. A browser may take its time, so this does not wait for it.
    pub(crate) fn begin(url: &str) -> Self {
        let opened = write(url, &place()).and_then(|(folder, lock)| {
            let file = folder.path().join(NAME);
            let open = move || open(&file).unwrap_or_else(|_| show());
            thread::Builder::new().name("browser".to_owned()).spawn(open)?;
            Ok((folder, lock))
        });
        if opened.is_err() {
            show();
        }
        Self { _folder: opened.ok() }
    }
}

fn show() {
    eprintln!("no browser could be opened; open the address above in one");
}

/// A file that leads to this address.
fn write(url: &str, place: &Path) -> io::Result<(TempDir, Option<fs::File>)> {
    let mut builder = Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
    let folder = builder.prefix(PREFIX).tempdir_in(place)?;
    #[cfg(unix)]
    remove_left(place, folder.path());
    let mut options = fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let text = format!(
        "{HEAD}<meta http-equiv=\"refresh\" content=\"0; url={url}\">\n<a href=\"{url}\">txt</a>\n"
    );
    let path = folder.path().join(NAME);
    // As long as it is empty, nobody removes it.
    #[cfg(unix)]
    let mut file = open_alone(&options, &path)?;
    #[cfg(not(unix))]
    let mut file = options.open(path)?;
    file.write_all(text.as_bytes())?;
    Ok((folder, cfg!(unix).then_some(file)))
}

/// Removes what others of the user who has this new folder have left. Nothing depends on it, so errors do not matter.
#[cfg(unix)]
fn remove_left(place: &Path, new: &Path) {
    use std::os::unix::fs::MetadataExt;
    let Ok(entries) = fs::read_dir(place) else { return };
    let user = new.metadata().map_or(u32::MAX, |new| new.uid());
    for folder in entries.flatten() {
        let (name, file) = (folder.file_name(), folder.path().join(NAME));
        // Of the entry itself, not of what a link leads to.
        let is_own = name.as_encoded_bytes().starts_with(PREFIX.as_bytes())
            && folder.metadata().is_ok_and(|it| it.is_dir() && it.uid() == user)
            && fs::read_dir(folder.path()).is_ok_and(|files| files.count() == 1)
            && fs::symlink_metadata(&file).is_ok_and(|file| file.is_file())
            && fs::read(&file).is_ok_and(|text| text.starts_with(HEAD.as_bytes()));
        let open = || open_alone(fs::OpenOptions::new().read(true), &file);
        let Some(Ok(_open)) = is_own.then(open) else { continue };
        let _ = fs::remove_file(file);
        let _ = fs::remove_dir(folder.path());
    }
}

/// Where files can be read by the browser. One that is a snap sees no temporary files, but those in the user's folder.
fn place() -> PathBuf {
    let home = env::var_os("HOME").map(PathBuf::from);
    home.filter(|home| home.join("snap").is_dir()).unwrap_or_else(env::temp_dir)
}

fn open(file: &std::path::Path) -> io::Result<()> {
    let mut options = BrowserOptions::new();
    options.with_suppress_output(true);
    webbrowser::open_browser_with_options(Browser::Default, &file.to_string_lossy(), &options)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn what_a_process_that_was_killed_has_left_is_removed_and_nothing_else() {
        let place = tempfile::tempdir().unwrap();
        let (living, _lock) = write("http://127.0.0.1:1/", place.path()).unwrap();
        let (left, lock) = write("http://127.0.0.1:2/", place.path()).unwrap();
        let left = left.keep();
        // The system does that.
        drop(lock);
        let others = [("txt-others", ""), ("txt-more", HEAD), ("other", HEAD)];
        let others = others.map(|(folder, text)| {
            let folder = place.path().join(folder);
            fs::create_dir(&folder).unwrap();
            fs::write(folder.join(NAME), text).unwrap();
            folder
        });
        fs::write(others[1].join("more"), "").unwrap();
        std::os::unix::fs::symlink(&others[2], place.path().join("txt-link")).unwrap();
        let (next, _lock) = write("http://127.0.0.1:3/", place.path()).unwrap();
        assert!(!left.exists());
        let kept = others.iter().map(PathBuf::as_path).chain([living.path(), next.path()]);
        assert!(kept.into_iter().all(|folder| folder.join(NAME).exists()));
        assert!(others[1].join("more").exists());
    }
}
