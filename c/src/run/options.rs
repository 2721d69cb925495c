//! The command line.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use ft_transfer_area::Error;
use lexopt::prelude::{Long, Short, Value};
use lexopt::ValueExt;

use crate::inputs::Language;

pub(crate) const HELP: &str = "\
Compiles and runs C and C++ programs that were written for the ROBO TX or the TXT, as they are.

usage: tx_run FILE|FOLDER ... [OPTIONS] [-- ARGUMENTS]

FILE is a source (.c, .cpp, .cc, .cxx), or something that is linked to the program (.o, .a, .so). FOLDER means all
sources that lie directly in it, without those in the folders below it.

  --host HOST    the TXT: its name or address, with or without a port, or auto for the only one that is found
  --world WORLD  without a host: what is plugged into the simulated TXT: a world that comes with it
                 (car, default, everything, high_bay_warehouse, kit, processing_station, slide, sorting_line),
                 the path of a .toml file, or none: no sensors, all inputs are 0, but an ideal encoder motor at
                 each of M1 to M4
  --show         without a host: show the world on a page in the browser, and press its buttons there
  -I FOLDER      look for headers in this folder, too
  -D NAME[=TEXT] define a name in all sources
  -x c, -x c++   take the sources .c for C, or for C++, which they are in a program for the TXT
  -std=STANDARD  such as c++17 for the sources in C++, or c11 for those in C
  -L FOLDER      look for libraries in this folder, too
  -l NAME        link the program to this library
  -h, --help     this text

After -- come arguments for the program. Without a host it runs on a simulated TXT. It is compiled by cc, gcc or
clang, for C++ by c++, g++ or clang++, or by what CC and CXX name. Further options for the compilers are taken from
CFLAGS and CXXFLAGS, for the linker from LDFLAGS and LDLIBS. What has not changed is not compiled again.

On a terminal the arrow keys left and right are the buttons of the display of programs with PrgTic.
";

/// What the command line says.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Options {
    /// Sources, folders with sources, and what is linked to them.
    pub(crate) files: Vec<PathBuf>,
    pub(crate) include_folders: Vec<PathBuf>,
    /// What follows `-D`.
    pub(crate) definitions: Vec<OsString>,
    /// Standards of C and of C++.
    pub(crate) standards: Vec<String>,
    /// That of the sources `.c`, if it is named.
    pub(crate) language: Option<Language>,
    pub(crate) library_folders: Vec<PathBuf>,
    /// What follows `-l`.
    pub(crate) libraries: Vec<OsString>,
    pub(crate) host: Option<String>,
    pub(crate) world: Option<OsString>,
    pub(crate) show: bool,
    pub(crate) arguments: Vec<OsString>,
}

impl Options {
    /// Reads a command line, with the command itself first; `None` when it asks for help.
    pub(crate) fn parse(
        line: impl Iterator<Item = OsString>,
    ) -> Result<Option<Self>, lexopt::Error> {
        let line: Vec<OsString> = line.collect();
        // Behind `--` nothing is an option or a source.
        let end = line.iter().position(|argument| argument == "--").unwrap_or(line.len());
        let mut parser = lexopt::Parser::from_iter(line[..end].iter());
        let arguments = line.get(end + 1..).unwrap_or_default().to_vec();
        let mut options = Self { arguments, ..Self::default() };
        while let Some(argument) = parser.next()? {
            match argument {
                Short('h') | Long("help") => return Ok(None),
                Long("host") => options.host = Some(host(parser.value()?.string()?)?),
                Long("show") => options.show = true,
                Long("world") => options.world = Some(parser.value()?),
                Short(short @ 'I') => {
                    options.include_folders.push(filled(short, parser.value()?)?.into())
                }
                Short(short @ 'D') => options.definitions.push(filled(short, parser.value()?)?),
                Short(short @ 'L') => {
                    options.library_folders.push(filled(short, parser.value()?)?.into())
                }
                Short(short @ 'l') => options.libraries.push(filled(short, parser.value()?)?),
                Short('x') => options.language = Some(language(parser.value()?)?),
                Short('s') => options.standards.push(standard(parser.optional_value())?),
                Short(other) => {
                    let rest = parser.optional_value().unwrap_or_default();
                    return Err(unknown(other, &rest));
                }
                Value(file) => options.files.push(file.into()),
                other @ Long(_) => return Err(other.unexpected()),
            }
        }
        if options.files.is_empty() {
            return Err("there is no source to compile".into());
        }
        if options.host.is_some() && options.world.is_some() {
            return Err("a world is for the simulated TXT, and a host is another one".into());
        }
        if options.host.is_some() && options.show {
            return Err(
                "only the world of the simulated TXT can be shown, and a host is another one"
                    .into(),
            );
        }
        Ok(Some(options))
    }
}

/// A host that is named. An empty one, such as that of a variable that is not set, would be like none.
fn host(given: String) -> Result<String, lexopt::Error> {
    match given.trim() {
        "" => Err(Error::BadAddress { given }.to_string().into()),
        host => Ok(host.to_owned()),
    }
}

/// What follows an option. An empty text would be glued to it, and a compiler take the next option for the text.
fn filled(option: char, text: OsString) -> Result<OsString, lexopt::Error> {
    match text.is_empty() {
        true => Err(format!("what follows the option -{option} is empty").into()),
        false => Ok(text),
    }
}

fn language(named: OsString) -> Result<Language, lexopt::Error> {
    match named.to_str() {
        Some("c") => Ok(Language::C),
        Some("c++") => Ok(Language::Cpp),
        _ => Err(format!("the language {} is not known: c or c++", named.to_string_lossy()).into()),
    }
}

/// The standard in `-std=c++17`, of which the beginning was read.
fn standard(rest: Option<OsString>) -> Result<String, lexopt::Error> {
    let rest = rest.unwrap_or_default();
    let named = rest.to_str().and_then(|rest| rest.strip_prefix("td=")).unwrap_or_default();
    if named.is_empty() {
        return Err(unknown('s', &rest));
    }
    Ok(named.to_owned())
}

fn unknown(option: char, rest: &OsStr) -> lexopt::Error {
    let option = format!("-{option}{}", rest.to_string_lossy());
    format!(
        "the option {option} is not known. Options that are for the compiler alone belong in CFLAGS and \
         CXXFLAGS, those for the linker in LDFLAGS"
    )
    .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &[&str]) -> Result<Option<Options>, String> {
        let line = ["tx_run"].iter().chain(line).map(OsString::from);
        Options::parse(line).map_err(|error| error.to_string())
    }

    #[test]
    fn files_options_and_arguments_are_told_apart() {
        let options = parse(&["a.c", "--world", "car", "b.cpp", "--", "--host", "c.c"]);
        let expected = Options {
            files: vec!["a.c".into(), "b.cpp".into()],
            world: Some("car".into()),
            arguments: vec!["--host".into(), "c.c".into()],
            ..Options::default()
        };
        assert_eq!(options, Ok(Some(expected)));
        assert!(parse(&["a.c", "--show"]).unwrap().unwrap().show);
        assert_eq!(parse(&["--help"]), Ok(None));
    }

    #[test]
    fn options_of_compilers_are_taken_as_compilers_take_them() {
        let line =
            "-Iinc -I more -DA=1 -D B -std=c++17 -std=c11 -x c++ -Llibs -L far -lone -l two a.c";
        let options = parse(&line.split(' ').collect::<Vec<_>>());
        let expected = Options {
            files: vec!["a.c".into()],
            include_folders: vec!["inc".into(), "more".into()],
            definitions: vec!["A=1".into(), "B".into()],
            standards: vec!["c++17".into(), "c11".into()],
            language: Some(Language::Cpp),
            library_folders: vec!["libs".into(), "far".into()],
            libraries: vec!["one".into(), "two".into()],
            ..Options::default()
        };
        assert_eq!(options, Ok(Some(expected)));
    }

    #[test]
    fn a_wrong_line_is_answered_with_a_sentence() {
        assert!(parse(&[]).unwrap_err().contains("no source"));
        assert!(parse(&["a.c", "--wrld", "car"]).unwrap_err().contains("--wrld"));
        assert!(parse(&["a.c", "--host", "h", "--world", "car"]).unwrap_err().contains("world"));
        for blank in ["", " "] {
            let sentence = parse(&["a.c", "--host", blank]).unwrap_err();
            assert!(sentence.contains("is not a controller's address"), "{sentence}");
        }
        assert!(parse(&["a.c", "--host", "h", "--show"]).unwrap_err().contains("shown"));
        for option in ["-O2", "-Wall", "-s", "-std", "-std=", "-static"] {
            let sentence = parse(&["a.c", option]).unwrap_err();
            assert!(sentence.contains(option) && sentence.contains("CFLAGS"), "{sentence}");
        }
        assert!(parse(&["a.c", "-x", "f77"]).unwrap_err().contains("f77"));
        assert!(parse(&["a.c", "-I"]).unwrap_err().contains("-I"));
        for option in ["-I", "-D", "-L", "-l"] {
            let sentence = parse(&["a.c", option, ""]).unwrap_err();
            assert!(sentence.contains(&format!("{option} is empty")), "{sentence}");
        }
    }
}
