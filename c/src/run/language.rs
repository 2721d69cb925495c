//! Which language a source `.c` is in. The compiler for the TXT was g++, for which it is C++.

use std::collections::BTreeMap;
use std::env;
use std::path::Path;

use crate::inputs::{Language, Source};
use crate::kind;
use crate::options::Options;
use crate::sources::OwnFiles;

/// Has the sources `.c` in the language that the option `-x` names. Without it they are C when `CC` or `CFLAGS` is set,
/// and C++ when one of them includes a header of the TXT that no compiler for C takes: then g++ has compiled them all.
pub(crate) fn choose(
    sources: &mut [Source],
    own: &BTreeMap<Language, OwnFiles>,
    options: &Options,
) {
    let language = options.language.unwrap_or_else(|| {
        let is_set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
        let mut of_c = sources.iter().filter(|source| is_named_c(source));
        let is_cpp = |source: &Source| {
            let reached = own.values().flat_map(|own| own.reached_from(&source.path));
            reached.into_iter().any(|it| kind::is_in_cpp(&it))
        };
        if !is_set("CC") && !is_set("CFLAGS") && of_c.any(is_cpp) {
            Language::Cpp
        } else {
            Language::C
        }
    });
    sources
        .iter_mut()
        .filter(|source| is_named_c(source))
        .for_each(|source| source.language = language);
}

fn is_named_c(source: &Source) -> bool {
    // Of `.C` it was decided by the rest of the name.
    has_end(&source.path, "c") || (has_end(&source.path, "C") && source.language == Language::C)
}

fn has_end(path: &Path, end: &str) -> bool {
    path.extension().is_some_and(|extension| extension == end)
}

/// What to do about a program in which `unsigned long` stands for DWORD, as on Windows, if a compiler says that they are
/// not the same.
pub(crate) fn advice_for_longs(said: &str) -> &'static str {
    let is_long =
        |line: &str| ["long unsigned int", "unsigned long"].iter().any(|it| line.contains(it));
    let is_ours = |line: &str| ["DWORD", "UINT32", "BOOL32"].iter().any(|it| line.contains(it));
    // Of formats a compiler speaks, too, where nothing is wrong with the program.
    let is_meant = |line: &str| is_long(line) && is_ours(line) && !line.contains("format");
    match said.lines().any(is_meant) {
        true => "; unsigned long has 8 bytes here: write DWORD, which has 4 as on Windows",
        false => "",
    }
}

/// How to have a source that does not compile taken for the other language, if that may be it.
pub(crate) fn advice(source: &Source, is_for_txt: bool) -> &'static str {
    match (is_named_c(source) || has_end(&source.path, "C"), source.language) {
        (true, Language::Cpp) => {
            "; like the TXT's own compiler, tx_run takes .c for C++ here; with -x c it is C"
        }
        (true, Language::C) if is_for_txt => {
            "; it is taken for C; with -x c++ it is C++, as for the TXT's own compiler"
        }
        _ => "",
    }
}
