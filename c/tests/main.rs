//! The tests in one program, so that they are linked once, and those that wait for machines wait beside each other.
//! The names decide which begin first: the stations of `examples` take longest.

mod examples;
mod headers;
mod kits;
mod tables;
#[cfg(unix)]
mod terminal;
mod tx_run;

/// Says that a test needs these compilers. A test that has checked nothing must not look like one that has passed.
fn miss_compilers(names: &str) {
    assert!(
        std::env::var_os("NO_COMPILER").is_some(),
        "there is no {names}, which this test needs; with NO_COMPILER=1 it passes without a check"
    );
    eprintln!("skipped: there is no {names}");
}

/// In place of the tests in modules that are compiled on Unix only.
#[cfg(not(unix))]
mod on_unix {
    #[test]
    #[ignore = "the tests send signals to the programs of the kits"]
    fn kits() {}

    #[test]
    #[ignore = "the tests send signals to tx_run"]
    fn tx_run() {}

    #[test]
    #[ignore = "the headers for other systems replace those of Windows"]
    fn headers_for_other_systems() {}
}
