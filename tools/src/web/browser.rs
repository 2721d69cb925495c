//! Opens a page in the browser.
//!
//! Every user of the computer can list the programs that run, with their arguments. So the browser gets the name of a
//! file that only this user can read, and the file leads to the page with its token.

use std::io::Write;
use std::path::PathBuf;
use std::{env, fs, io, thread};

use tempfile::{Builder, TempDir};
use webbrowser::{Browser, BrowserOptions};

/// The file that leads to the page, in a folder of its own. It is removed when this is dropped.
#[derive(Default)]
#[must_use]
pub(crate) struct Opening {
    _folder: Option<TempDir>,
}

impl Opening {
    /// Opens the page at this address, or says that it can't. A browser may take its time, so this does not wait for it.
    pub(crate) fn begin(url: &str) -> Self {
        let opened = write(url).and_then(|(folder, file)| {
            let open = move || open(&file).unwrap_or_else(|_| show());
            thread::Builder::new().name("browser".to_owned()).spawn(open)?;
            Ok(folder)
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
fn write(url: &str) -> io::Result<(TempDir, PathBuf)> {
    let mut builder = Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
    let folder = builder.prefix("txt-").tempdir_in(place())?;
    let file = folder.path().join("open.html");
    let mut options = fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let text = format!(
        "<!doctype html>\n<meta charset=\"utf-8\">\n<title>txt</title>\n\
         <meta http-equiv=\"refresh\" content=\"0; url={url}\">\n<a href=\"{url}\">txt</a>\n"
    );
    options.open(&file)?.write_all(text.as_bytes())?;
    Ok((folder, file))
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
