use super::*;

struct Made {
    folder: tempfile::TempDir,
    object: PathBuf,
    header: PathBuf,
}

/// A compiled file and a header that is older than what is made next.
fn made() -> Made {
    let folder = tempfile::tempdir().unwrap();
    let (object, header) = (folder.path().join("a.o"), folder.path().join("a.h"));
    fs::write(&object, [0, b'\n', 255]).unwrap();
    let made = Made { folder, object, header };
    made.write_header("int a;");
    made
}

impl Made {
    fn write_header(&self, text: &str) {
        fs::write(&self.header, text).unwrap();
        let header = File::options().write(true).open(&self.header).unwrap();
        header.set_modified(SystemTime::now() - Duration::from_secs(9)).unwrap();
    }

    /// The cache as another run of the program finds it.
    fn cache(&self, limit: u64) -> Cache {
        Cache::in_folder(Some(self.folder.path().join("cache")), limit)
    }

    fn add(&self, cache: &Cache, key: Key) {
        let read = [self.header.clone()];
        cache.add(key, &Compiled { object: &self.object, read: &read, messages: b"a\nwarning" });
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
fn what_was_added_is_taken_until_a_header_changes() {
    let made = made();
    assert_eq!(made.take(KEY), None);
    made.add(&made.cache(LIMIT), KEY);
    assert_eq!(made.take(KEY).as_deref(), Some(&b"a\nwarning"[..]));
    assert_eq!(made.take(Key(8)), None);
    made.write_header("int b;");
    assert_eq!(made.take(KEY), None);
    made.add(&made.cache(LIMIT), KEY);
    assert!(made.take(KEY).is_some());
    fs::remove_file(&made.header).unwrap();
    assert_eq!(made.take(KEY), None);
}

#[test]
fn a_header_that_has_just_changed_is_not_trusted() {
    let made = made();
    let cache = made.cache(LIMIT);
    let header = File::options().write(true).open(&made.header).unwrap();
    header.set_modified(SystemTime::now() + Duration::from_secs(9)).unwrap();
    made.add(&cache, KEY);
    assert_eq!(made.take(KEY), None);
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
    fs::remove_file(&place).unwrap();
    fs::create_dir(&place).unwrap();
    assert_eq!(made.take(KEY), None);
    // It can't be replaced either, which is not an error.
    made.add(&cache, KEY);
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
fn without_a_folder_nothing_is_kept() {
    let made = made();
    let cache = Cache::in_folder(None, LIMIT);
    made.add(&cache, KEY);
    cache.tidy();
    assert_eq!(made.take_from(&cache, KEY), None);
}

#[test]
fn dependencies_are_read_as_compilers_write_them() {
    let text = "a.o: src/a.c /usr/include/my\\ own.h \\\n  inc/$$b\\#c.h \\\n C:\\inc\\d.h\n";
    let expected = ["src/a.c", "/usr/include/my own.h", "inc/$b#c.h", "C:\\inc\\d.h"];
    assert_eq!(dependencies(text), expected.map(PathBuf::from));
    assert_eq!(dependencies(""), Vec::<PathBuf>::new());
}
