//! Headers can be included together, in any order, with those of the C library and of the system.

use super::alone::{HEADERS, POSIX};
use super::compilers::{self, Language};

fn source(headers: &[&str], rest: &str) -> String {
    let headers: String = headers.iter().map(|header| format!("#include <{header}>\n")).collect();
    format!("{headers}{rest}\nint main(void) {{ return 0; }}\n")
}

/// Each header comes before each other one in one of the sources.
#[cfg_attr(windows, ignore = "zig takes too long for many small sources under Wine")]
#[test]
fn every_pair_goes_together_in_either_order() {
    let system = ["windows.h", "stdint.h", "string.h", "stdlib.h", "math.h"];
    let all: Vec<_> = HEADERS.into_iter().chain(system).collect();
    // What differs between compilers and standards is tested with each header alone.
    for compiler in [compilers::of(Language::C), compilers::of(Language::Cpp)].into_iter().flatten()
    {
        let Some(standard) = compiler.standards.first() else { continue };
        for first in &all {
            let source = source(&[&[*first], &all[..]].concat(), "");
            compiler.check(standard, &[], &source).unwrap_or_else(|said| panic!("{said}"));
        }
    }
}

#[cfg_attr(windows, ignore = "zig takes too long for many small sources under Wine")]
#[test]
fn all_go_together_with_the_c_library_around_them() {
    let before = ["stdio.h", "stdlib.h", "string.h", "time.h", "unistd.h", "pthread.h"];
    let posix = POSIX.into_iter().filter(|_| cfg!(not(windows)));
    let all: Vec<_> = posix.chain(HEADERS).collect();
    for compiler in compilers::all() {
        compiler.check_all(&source(&[&before[..], &all].concat(), ""));
        let backwards: Vec<_> = all.iter().rev().copied().collect();
        compiler.check_all(&source(&[&backwards[..], &before].concat(), ""));
    }
}

/// `bool` is there once, whoever brings it.
#[cfg_attr(windows, ignore = "zig takes too long for many small sources under Wine")]
#[test]
fn bool_does_not_clash() {
    let uses = "extern bool flag;\nbool flag = (bool) 1;\n";
    let values = "extern int sum;\nint sum = false + true;";
    for compiler in compilers::all() {
        for headers in [
            &["ROBO_TX_PRG.h"][..],
            &["ftMscLib.h"],
            &["ROBO_TX_PRG.h", "ftMscLib.h"],
            &["ftMscLib.h", "ROBO_TX_PRG.h"],
        ] {
            let has_values = headers.contains(&"ROBO_TX_PRG.h");
            let rest = if has_values { [uses, values].concat() } else { uses.to_owned() };
            compiler.check_ends(&source(headers, &rest));
            // C89 has no stdbool.h; what compilers have in its place is not C89 either.
            for standard in ["c99", "c2x"].iter().filter(|one| compiler.standards.contains(one)) {
                for headers in
                    [&[&["stdbool.h"], headers].concat(), &[headers, &["stdbool.h"]].concat()]
                {
                    let source = source(headers, uses);
                    compiler.check(standard, &[], &source).unwrap_or_else(|said| panic!("{said}"));
                }
            }
        }
    }
}

/// With the headers of Windows itself, where a compiler for it is here.
#[cfg_attr(windows, ignore = "it is checked on Linux, with MinGW")]
#[test]
fn headers_go_together_with_those_of_windows() {
    let compilers = [
        ("x86_64-w64-mingw32-gcc", Language::C),
        ("i686-w64-mingw32-gcc", Language::C),
        ("x86_64-w64-mingw32-g++", Language::Cpp),
    ];
    for (program, language) in compilers {
        let compiler = compilers::Compiler { program, language, standards: Vec::new() };
        if compiler.command().arg("--version").output().is_err() {
            eprintln!("not checked with {program}, which is not here");
            continue;
        }
        let standard = if language == Language::C { "c11" } else { "c++11" };
        let windows = ["windows.h"];
        for headers in [[&windows[..], &HEADERS].concat(), [&HEADERS[..], &windows].concat()] {
            let file = compilers::write(&source(&headers, ""), language);
            let folder = concat!("-I", env!("CARGO_MANIFEST_DIR"), "/include");
            let mut command = compiler.command();
            command.arg(format!("-std={standard}"));
            command.args(["-Wall", "-Wextra", "-Werror", "-fsyntax-only", folder]);
            let said = command.arg(&file).output().unwrap();
            let text = String::from_utf8_lossy(&said.stderr);
            assert!(said.status.success(), "{program} {headers:?}: {text}");
        }
    }
}
