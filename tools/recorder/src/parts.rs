//! A recording in several files, of which the oldest are deleted.

use std::collections::{BTreeMap, VecDeque};
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use ft_transfer_area::notices::leave;
use log::Level;

use crate::file::{create_alone, hold};

/// When a recording goes on in a new file, and how much of it is kept.
///
/// A recording into `run.mcap` has the files `run-0001.mcap`, `run-0002.mcap` and so on. It never replaces a file: if
/// there are some of an earlier recording, it goes on with the number after the highest one. As long as another recording
/// writes that one, it does not begin. It deletes only files that it has made itself: what somebody has put in the place
/// of one stays, unless it has the same size.
///
/// Each part can be read without the others: it begins with the name of the controller and its firmware, as
/// [`Transfer::Began`](crate::Transfer::Began). Each cycle is in exactly one part.
///
/// ```
/// use ft_transfer_area_recorder::{Options, Parts};
///
/// let parts = Parts::of_bytes(100_000_000).keep(2_000_000_000);
/// let options = Options::default().parts(parts);
/// # let _ = options;
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    bytes: u64,
    time: Duration,
    keep: u64,
}

impl Parts {
    /// A new file when one has about this size: up to a second of recording and the index come on top. 50 kB are the
    /// least: smaller files would be heads only.
    pub fn of_bytes(bytes: u64) -> Self {
        Self { bytes: bytes.max(LEAST), time: Duration::MAX, keep: u64::MAX }
    }

    /// A new file after this time, 10 ms at least.
    pub fn of_time(time: Duration) -> Self {
        Self { bytes: u64::MAX, time: time.max(SHORTEST), keep: u64::MAX }
    }

    /// Deletes the oldest files, so that all of them together stay below this size, 100 kB at least. No file gets
    /// larger than half of it, so that there is always an earlier one. Half a second of recording comes into a file at
    /// once: where that is more than 16 MiB, or than an eighth of this size, as with pictures and a small size, it may
    /// come on top.
    #[must_use]
    pub fn keep(self, bytes: u64) -> Self {
        Self { keep: bytes.max(2 * LEAST), ..self }
    }

    /// What may come into a file before it is looked at again.
    fn at_once(self) -> u64 {
        AT_ONCE.min(self.keep / 8)
    }

    /// Whether there may be a second file.
    fn are_several(self) -> bool {
        self != Self::of_bytes(u64::MAX)
    }
}

const LEAST: u64 = 50_000;
const SHORTEST: Duration = Duration::from_millis(10);

/// What may come into a file before it is looked at again: half a second with large pictures.
const AT_ONCE: u64 = 16 << 20;

/// How many that can't be deleted are tried again.
const STAY: usize = 1000;

/// The files of a recording.
pub(crate) struct Files {
    parts: Parts,
    /// As `run-` and `.mcap`.
    name: [String; 2],
    folder: PathBuf,
    /// Of the next file.
    number: u64,
    /// Those that are written and may be deleted, with their sizes; the oldest first.
    made: VecDeque<Made>,
    /// No more of them could be deleted. It is tried again with the next one.
    is_stuck: bool,
    /// Since when the newest one is written, if one is.
    since: Option<Instant>,
}

impl Files {
    /// The files beside this path, of which none is made yet.
    pub(crate) fn beside(path: &Path, parts: Parts) -> io::Result<Self> {
        let name = name_of(path).ok_or_else(|| {
            let why = "the name of a recording in parts has to be UTF-8";
            io::Error::new(ErrorKind::InvalidInput, why)
        })?;
        let there = parts_of(path)?;
        let number = there.last().map_or(1, |(number, _)| number + 1);
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let made = VecDeque::new();
        let files = Self { parts, name, folder, number, made, is_stuck: false, since: None };
        there.last().map_or(Ok(()), |(_, newest)| files.ensure_alone(newest))?;
        Ok(files)
    }

    /// Two that take their numbers in turn would be shown as one recording. One that goes on does not end for that.
    fn ensure_alone(&self, newest: &Path) -> io::Result<()> {
        match hold(newest) {
            Err(_) if self.since.is_none() && self.parts.are_several() => Err(io::Error::new(
                ErrorKind::ResourceBusy,
                "another recording with this name is being written",
            )),
            _ => Ok(()),
        }
    }

    /// Makes the next file.
    pub(crate) fn make(&mut self) -> io::Result<(PathBuf, File)> {
        loop {
            let [stem, end] = &self.name;
            let path = self.folder.join(format!("{stem}{:04}{end}", self.number));
            self.number += 1;
            match create_alone(&path) {
                Ok(file) => {
                    self.since = Some(Instant::now());
                    return Ok((path, file));
                }
                // Somebody else has made it meanwhile.
                Err(error)
                    if matches!(
                        error.kind(),
                        ErrorKind::AlreadyExists | ErrorKind::ResourceBusy
                    ) =>
                {
                    self.ensure_alone(&path)?
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Whether the next one is to begin when the newest has this size.
    pub(crate) fn is_full(&self, bytes: u64) -> bool {
        bytes >= self.parts.bytes.min(self.parts.keep / 2 - self.parts.at_once())
            || self.since.is_some_and(|since| since.elapsed() >= self.parts.time)
    }

    /// This file is written.
    pub(crate) fn done(&mut self, path: PathBuf, bytes: u64) {
        // Without a limit for all of them, a recording may have any number of parts.
        if self.parts.keep < u64::MAX {
            self.made.push_back(Made { path, bytes, is_told: false });
            self.is_stuck = false;
        }
    }

    /// Deletes the oldest ones, as long as there is too much, when the newest has this size.
    pub(crate) fn delete_oldest(&mut self, bytes: u64) {
        let keep = self.parts.keep - self.parts.at_once();
        let mut all = self.made.iter().map(|made| made.bytes).sum::<u64>();
        // How many of the oldest ones stay.
        let mut stay = 0;
        while all.saturating_add(bytes) > keep && !self.is_stuck {
            let Some(oldest) = self.made.get_mut(stay) else {
                self.is_stuck = true;
                return;
            };
            if !oldest.delete() && stay < STAY {
                stay += 1;
                continue;
            }
            all -= oldest.bytes;
            self.made.remove(stay);
        }
    }
}

/// A part that is written.
struct Made {
    path: PathBuf,
    bytes: u64,
    /// It could not be deleted, and that was told.
    is_told: bool,
}

impl Made {
    /// Deletes it, and says once why that can't be. Returns whether nothing is left to do.
    fn delete(&mut self) -> bool {
        // Somebody has moved it away, and one of another size has its name by now: another recording, or a link.
        let deleted =
            fs::symlink_metadata(&self.path).and_then(|file| match file.len() == self.bytes {
                true => fs::remove_file(&self.path),
                false => Err(io::Error::other("it is another file now")),
            });
        let Err(error) = deleted else { return true };
        if error.kind() == ErrorKind::NotFound {
            return true;
        }
        if !std::mem::replace(&mut self.is_told, true) {
            let text = format_args!("{} can't be deleted: {error}", self.path.display());
            leave(Level::Warn, module_path!(), text);
        }
        error.kind() == ErrorKind::Other
    }
}

/// The parts that are there of recordings into this file, with their numbers, the lowest first; for `txt`, too.
pub fn parts_of(path: &Path) -> io::Result<Vec<(u64, PathBuf)>> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let Some(name) = name_of(path) else { return Ok(Vec::new()) };
    let mut there = BTreeMap::new();
    for entry in fs::read_dir(folder.unwrap_or(Path::new(".")))? {
        let file = entry?.file_name();
        if let Some(number) = file.to_str().and_then(|file| number_in(file, &name)) {
            there.insert(number, path.with_file_name(file));
        }
    }
    // Counting has come to a longer number by the one before it. A date, such as 20250702, stands alone.
    let is_part = |number: u64| {
        number < FIRST_LONGER
            || [number - 1, number + 1].iter().any(|beside| there.contains_key(beside))
    };
    let parts = there.iter().filter(|(number, _)| is_part(**number));
    Ok(parts.map(|(number, file)| (*number, file.clone())).collect())
}

/// The first number with more than four digits.
const FIRST_LONGER: u64 = 10_000;

/// What is before and behind the number; `None` for a name that is not UTF-8, which others could be taken for.
fn name_of(path: &Path) -> Option<[String; 2]> {
    let stem = path.file_stem().unwrap_or_default().to_str()?;
    let end = path.extension().map(|end| end.to_str().map(|end| format!(".{end}")));
    Some([format!("{stem}-"), end.unwrap_or(Some(String::new()))?])
}

/// The number in the name of a file, if it is written as that of a part with this name.
fn number_in(file: &str, [stem, end]: &[String; 2]) -> Option<u64> {
    let digits = file.strip_prefix(&**stem)?.strip_suffix(&**end)?;
    // Nobody makes more of them, and the next numbers have room.
    let number = digits.parse().ok().filter(|number| *number < u64::MAX / 2);
    number.filter(|number| format!("{number:04}") == digits)
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{sync_channel, Receiver, SyncSender};
    use std::sync::Mutex;
    use std::thread;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// A logger that blocks at the line of the test below.
    struct Blocking(Mutex<Receiver<()>>, SyncSender<()>);

    impl log::Log for Blocking {
        fn enabled(&self, _: &log::Metadata<'_>) -> bool {
            true
        }

        fn log(&self, record: &log::Record<'_>) {
            if record
                .args()
                .to_string()
                .contains("run-0001.mcap can't be deleted: it is another file")
            {
                self.1.send(()).unwrap();
                let _ = self.0.lock().unwrap().recv();
            }
        }

        fn flush(&self) {}
    }

    #[test]
    fn a_logger_that_blocks_does_not_stop_who_tells_what_can_t_be_deleted() {
        let ((go_on, goes_on), (tells, told)) = (sync_channel(1), sync_channel(1));
        log::set_logger(Box::leak(Box::new(Blocking(Mutex::new(goes_on), tells)))).unwrap();
        log::set_max_level(log::LevelFilter::Warn);
        let folder = tempfile::tempdir().unwrap();
        let parts = Parts::of_bytes(1 << 40).keep(100_000);
        let mut files = Files::beside(&folder.path().join("run.mcap"), parts).unwrap();
        let (path, _) = files.make().unwrap();
        // Of another size than what was made.
        files.done(path, 100_000);
        let (done, is_done) = sync_channel(1);
        thread::spawn(move || {
            files.delete_oldest(100_000);
            done.send(()).unwrap();
        });
        let limit = Duration::from_secs(30);
        told.recv_timeout(limit).unwrap();
        is_done.recv_timeout(limit).unwrap();
        drop(go_on);
    }

    #[test]
    fn files_go_on_after_the_highest_number_and_only_own_ones_are_deleted() {
        let folder = tempfile::tempdir().unwrap();
        for other in ["run-0007.mcap", "run.mcap", "run-x.mcap", "other-0009.mcap"] {
            fs::write(folder.path().join(other), [0; 3000]).unwrap();
        }
        let parts = Parts::of_bytes(1 << 40).keep(320_000);
        let mut files = Files::beside(&folder.path().join("run.mcap"), parts).unwrap();
        for _ in 0..5 {
            let (path, file) = files.make().unwrap();
            file.set_len(100_000).unwrap();
            assert!(!files.is_full(119_999) && files.is_full(120_000), "with room up to the half");
            files.done(path, 100_000);
            files.delete_oldest(50_000);
            assert!(files.made.len() <= 2);
        }
        let own = ["run-0011.mcap", "run-0012.mcap"];
        let others = ["other-0009.mcap", "run-0007.mcap"];
        let expected = [&others[..], &own, &["run-x.mcap", "run.mcap"]].concat();
        assert_eq!(names(folder.path()), expected);
    }

    #[test]
    fn only_a_number_that_counting_has_come_to_is_one_of_a_part() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let next_with = |files: &[&str]| {
            files.iter().for_each(|file| fs::write(folder.path().join(file), "").unwrap());
            let mut files = Files::beside(&path, Parts::of_bytes(1000)).unwrap();
            files.make().unwrap().0.file_name().unwrap().to_str().unwrap().to_owned()
        };
        let others = ["run-20250702.mcap", "run-7.mcap", "run-00041.mcap", "run-+100.mcap"];
        assert_eq!(next_with(&others), "run-0001.mcap");
        assert_eq!(next_with(&["run-9999.mcap"]), "run-10000.mcap");
        assert_eq!(next_with(&[]), "run-10001.mcap");
        // The oldest ones are deleted.
        fs::remove_file(folder.path().join("run-9999.mcap")).unwrap();
        assert_eq!(next_with(&[]), "run-10002.mcap");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_name_that_is_not_a_text_has_no_parts() {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;

        let folder = tempfile::tempdir().unwrap();
        let [name, other] = [&b"r\xfe.mcap"[..], b"r\xff-0001.mcap"]
            .map(|name| folder.path().join(OsStr::from_bytes(name)));
        fs::write(other, "").unwrap();
        assert!(parts_of(&name).unwrap().is_empty());
        let error = Files::beside(&name, Parts::of_bytes(1000)).err().unwrap();
        assert!(error.to_string().contains("has to be UTF-8"), "{error}");
        assert!(parts_of(&folder.path().join("r\u{fffd}.mcap")).unwrap().is_empty());
    }

    #[test]
    fn what_has_the_name_of_a_part_that_was_moved_away_stays() {
        let folder = tempfile::tempdir().unwrap();
        let parts = Parts::of_bytes(1 << 40).keep(100_000);
        let mut files = Files::beside(&folder.path().join("run.mcap"), parts).unwrap();
        let made = [(); 3].map(|()| {
            let (path, file) = files.make().unwrap();
            file.set_len(100_000).unwrap();
            files.done(path.clone(), 100_000);
            path
        });
        fs::rename(&made[1], folder.path().join("kept.mcap")).unwrap();
        fs::write(&made[1], "another recording").unwrap();
        files.delete_oldest(0);
        assert_eq!(names(folder.path()), ["kept.mcap", "run-0002.mcap"]);
    }

    /// As on a share where somebody reads it.
    #[test]
    fn what_can_not_be_deleted_counts_and_is_tried_again_with_the_next_part() {
        let folder = tempfile::tempdir().unwrap();
        let parts = Parts::of_bytes(1 << 40).keep(320_000);
        let mut files = Files::beside(&folder.path().join("run.mcap"), parts).unwrap();
        let make = |files: &mut Files| {
            let (path, file) = files.make().unwrap();
            file.set_len(100_000).unwrap();
            files.done(path.clone(), 100_000);
            files.delete_oldest(50_000);
            path
        };
        let first = make(&mut files);
        // A folder in its place can't be removed as a file.
        fs::remove_file(&first).unwrap();
        fs::create_dir(&first).unwrap();
        files.made[0].bytes = fs::symlink_metadata(&first).unwrap().len();
        (0..4).for_each(|_| drop(make(&mut files)));
        assert_eq!(names(folder.path()), ["run-0001.mcap", "run-0004.mcap", "run-0005.mcap"]);
        fs::remove_dir(&first).unwrap();
        fs::write(&first, vec![0; files.made[0].bytes as usize]).unwrap();
        make(&mut files);
        assert_eq!(names(folder.path()), ["run-0005.mcap", "run-0006.mcap"]);
    }

    #[test]
    fn a_size_or_a_time_of_nothing_makes_no_file_for_each_cycle() {
        let folder = tempfile::tempdir().unwrap();
        let of_time = Parts::of_time(Duration::ZERO);
        for parts in [Parts::of_bytes(0), Parts::of_time(Duration::MAX).keep(0)] {
            let mut files = Files::beside(&folder.path().join("run.mcap"), parts).unwrap();
            files.make().unwrap();
            assert!(!files.is_full(1000), "{parts:?}");
        }
        assert_eq!(of_time, Parts::of_time(SHORTEST));
    }

    #[test]
    fn files_that_all_stay_are_not_remembered() {
        let parts = Parts::of_bytes(1000);
        let folder = tempfile::tempdir().unwrap();
        let mut files = Files::beside(&folder.path().join("run.mcap"), parts).unwrap();
        files.done("run-0001.mcap".into(), 1000);
        files.delete_oldest(500);
        assert!(files.made.is_empty());
    }
}
