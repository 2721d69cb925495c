//! Gives the fuzzers' seeds and past findings to their targets, without a fuzzer.

use std::collections::BTreeSet;
use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

mod seeds;
#[allow(unreachable_pub, reason = "it is a library for the fuzzers")]
#[path = "../../../fuzz/src/lib.rs"]
mod targets;

/// Makes a test of each target, and a list of them all.
macro_rules! replay {
    ($($target:ident),+ $(,)?) => {
        $(
            #[test]
            fn $target() {
                replay(stringify!($target), targets::$target);
            }
        )+

        const TARGETS: &[&str] = &[$(stringify!($target)),+];
    };
}

replay![
    wire,
    expansion,
    exchange,
    camera_stream,
    repair,
    decode,
    i2c_client,
    i2c_server,
    session,
    worlds,
    built_worlds,
    typed_lines,
    fault_text,
];

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz").join(name)
}

/// The files in a folder, in order; none if there is no folder.
fn entries(folder: &Path) -> BTreeSet<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return BTreeSet::new() };
    entries.map(|entry| entry.unwrap().path()).collect()
}

fn replay(name: &str, target: fn(&[u8])) {
    let seeds = entries(&folder("corpus").join(name));
    assert!(!seeds.is_empty(), "{name} has no seeds");
    let findings = entries(&folder("findings").join(name));
    let failed: Vec<_> = seeds
        .iter()
        .chain(&findings)
        .filter(|path| {
            let bytes = fs::read(path).unwrap();
            catch_unwind(|| target(&bytes)).is_err()
        })
        .collect();
    assert!(failed.is_empty(), "{name} fails with {failed:?}");
}

#[test]
fn every_fuzzer_is_replayed() {
    let names = |folder: PathBuf| -> BTreeSet<String> {
        let stem = |path: &PathBuf| path.file_stem().unwrap().to_str().unwrap().to_owned();
        entries(&folder).iter().map(stem).collect()
    };
    let targets: BTreeSet<String> = TARGETS.iter().copied().map(String::from).collect();
    assert_eq!(names(folder("fuzz_targets")), targets);
    assert_eq!(names(folder("corpus")), targets);
    assert!(names(folder("findings")).is_subset(&targets));
}
