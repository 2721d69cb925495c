use super::*;

struct Made {
    folder: tempfile::TempDir,
    object: PathBuf,
}

fn made() -> Made {
    let folder = tempfile::tempdir().unwrap();
    let object = folder.path().join("a.o");
    fs::write(&object, [0, b'\n', 255]).unwrap();
    Made { folder, object }
}

impl Made {
    /// The cache as another run of the program finds it.
    fn cache(&self, limit: u64) -> Cache {
        Cache::in_folder(Some(&self.folder.path().join("cache")), limit)
    }

    fn add(&self, cache: &Cache, key: Key) {
        cache.add(key, &self.object, b"a\nwarning");
    }

    fn take(&self, key: Key) -> Option<Vec<u8>> {
        self.take_from(&self.cache(LIMIT), key)
    }

    fn take_from(&self, cache: &Cache, key: Key) -> Option<Vec<u8>> {
        let taken = self.folder.path().join("taken.o");
        let messages = cache.take(key, &taken)?;
        assert_eq!(fs::read(taken).unwrap(), fs::read(&self.object).unwrap());
        Some(messages)
    }
}

const KEY: Key = Key(7);

#[test]
fn what_was_added_is_taken() {
    let made = made();
    assert_eq!(made.take(KEY), None);
    made.add(&made.cache(LIMIT), KEY);
    assert_eq!(made.take(KEY).as_deref(), Some(&b"a\nwarning"[..]));
    assert_eq!(made.take(Key(8)), None);
}

#[test]
fn a_damaged_entry_is_none() {
    let made = made();
    let cache = made.cache(LIMIT);
    made.add(&cache, KEY);
    let place = cache.place(KEY).unwrap();
    let whole = fs::read(&place).unwrap();
    for length in 0..whole.len() {
        fs::write(&place, &whole[..length]).unwrap();
        assert_eq!(made.take(KEY), None, "{length}");
        let mut other = whole.clone();
        other[length] ^= 1;
        fs::write(&place, other).unwrap();
        assert_eq!(made.take(KEY), None, "{length}");
    }
    // That of another key.
    fs::write(&place, whole).unwrap();
    fs::rename(&place, cache.place(Key(8)).unwrap()).unwrap();
    assert_eq!(made.take(Key(8)), None);
    fs::create_dir(&place).unwrap();
    assert_eq!(made.take(KEY), None);
    // It can't be replaced either, which is not an error.
    made.add(&cache, KEY);
}

#[cfg(unix)]
#[test]
fn a_folder_that_others_can_change_is_not_used() {
    use std::fs::Permissions;
    use std::os::unix::fs::{chown, symlink, MetadataExt, PermissionsExt};

    let made = made();
    let place = made.folder.path().join("cache");
    let set = |path: &Path, mode| fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
    made.add(&made.cache(LIMIT), KEY);
    assert_eq!(fs::metadata(&place).unwrap().mode() & 0o777, 0o700);
    for mode in [0o770, 0o707, 0o1777] {
        set(&place, mode);
        assert_eq!(made.take(KEY), None, "{mode:o}");
        assert!(own::make(&place).unwrap_err().contains("others can write"));
    }
    set(&place, 0o755);
    assert!(made.take(KEY).is_some());
    // Also one in whose place another could be put.
    set(made.folder.path(), 0o777);
    assert_eq!(made.take(KEY), None);
    set(made.folder.path(), 0o1777);
    assert!(made.take(KEY).is_some());

    // Root could make a folder in another user's.
    if chown(&place, Some(65_534), None).is_ok() {
        for folder in [place.clone(), place.join("new"), place.join("new/one")] {
            assert!(own::make(&folder).unwrap_err().contains("belongs to another user"));
        }
        assert!(!place.join("new").exists());
    }
    let moved = made.folder.path().join("moved");
    fs::rename(&place, &moved).unwrap();
    let _ = chown(&moved, Some(fs::metadata(&made.object).unwrap().uid()), None);
    symlink(&moved, &place).unwrap();
    assert_eq!(made.take(KEY), None);
}

#[cfg(unix)]
#[test]
fn an_entry_that_another_may_have_left_is_not_taken() {
    use std::fs::Permissions;
    use std::os::unix::fs::{symlink, PermissionsExt};

    let made = made();
    let cache = made.cache(LIMIT);
    made.add(&cache, KEY);
    let (entry, other) = (cache.place(KEY).unwrap(), made.folder.path().join("other"));
    assert_eq!(fs::metadata(&entry).unwrap().permissions().mode() & 0o077, 0);
    fs::set_permissions(&entry, Permissions::from_mode(0o622)).unwrap();
    assert_eq!(made.take(KEY), None);
    fs::set_permissions(&entry, Permissions::from_mode(0o600)).unwrap();
    fs::hard_link(&entry, &other).unwrap();
    assert_eq!(made.take(KEY), None);
    fs::remove_file(&entry).unwrap();
    symlink(&other, &entry).unwrap();
    assert_eq!(made.take(KEY), None);
    // A new one takes its place, and what the link led to stays.
    made.add(&cache, KEY);
    assert!(made.take(KEY).is_some() && other.is_file());
}

#[test]
fn the_cache_keeps_what_was_used_last_and_does_not_grow_without_end() {
    let made = made();
    fs::write(&made.object, [7; 1000]).unwrap();
    for number in 0..8 {
        let mut cache = made.cache(LIMIT);
        cache.begun += Duration::from_secs(number as u64);
        made.add(&cache, Key(number));
        // Adding leaves the time of the system's clock.
        assert!(made.take_from(&cache, Key(number)).is_some());
    }
    // Each has somewhat more than 1000 bytes.
    let mut cache = made.cache(8000);
    cache.begun += Duration::from_secs(100);
    assert!(made.take_from(&cache, Key(0)).is_some());
    cache.tidy();
    let kept: Vec<u128> = (0..8).filter(|number| made.take(Key(*number)).is_some()).collect();
    assert_eq!(kept, [0, 4, 5, 6, 7]);
}

#[test]
fn a_file_of_any_time_is_abandoned_or_not() {
    let now = SystemTime::now();
    let last = SystemTime::UNIX_EPOCH.checked_add(Duration::from_secs(i64::MAX as u64));
    assert!(!is_abandoned(last.unwrap_or(now), now));
    assert!(!is_abandoned(now, now));
    assert!(is_abandoned(SystemTime::UNIX_EPOCH, now));
}

#[test]
fn without_a_folder_nothing_is_kept() {
    let made = made();
    let cache = Cache::in_folder(None, LIMIT);
    made.add(&cache, KEY);
    cache.tidy();
    assert_eq!(made.take_from(&cache, KEY), None);
}
