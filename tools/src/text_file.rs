//! Small files that people write.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read as _};
use std::path::Path;

/// The text of a file of at most so many bytes. A device may have no end, and a pipe may never have one, so both are
/// refused before they are opened.
pub(crate) fn read(path: &Path, most: u64) -> io::Result<String> {
    let found = fs::metadata(path)?;
    if !found.is_file() && !found.is_dir() {
        let why = "it is a device or a pipe, and a file is expected";
        return Err(io::Error::new(ErrorKind::InvalidInput, why));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let why = format!("the file is too long: it may have {most} bytes");
        return Err(io::Error::new(ErrorKind::FileTooLarge, why));
    }
    String::from_utf8(bytes).map_err(|error| {
        let line = line_at(error.as_bytes(), error.utf8_error().valid_up_to());
        let why = format!("line {line} is not in UTF-8; save the file with that encoding");
        io::Error::new(ErrorKind::InvalidData, why)
    })
}

/// The line of the byte with this index, counted from 1.
pub(crate) fn line_at(text: &[u8], index: usize) -> usize {
    1 + text.iter().take(index).filter(|byte| **byte == b'\n').count()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_a_few_bytes_in_utf_8_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
        fs::write(at("long"), "#".repeat(11)).unwrap();
        fs::write(at("latin"), b"a\nT\xFCr").unwrap();
        fs::write(at("right"), "#".repeat(10)).unwrap();
        for (path, part) in [
            (Path::new("/dev/zero"), "it is a device or a pipe"),
            (&at("pipe"), "it is a device or a pipe"),
            (&at("long"), "too long: it may have 10 bytes"),
            (&at("latin"), "line 2 is not in UTF-8"),
        ] {
            let error = read(path, 10).unwrap_err().to_string();
            assert!(error.contains(part), "{path:?}: {error}");
        }
        assert_eq!(read(&at("right"), 10).unwrap().len(), 10);
    }
}
