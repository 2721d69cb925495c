//! The command line.

use std::ffi::OsString;
use std::path::PathBuf;

use lexopt::prelude::{Long, Short, Value};

pub(crate) const HELP: &str = "\
Compiles and runs C and C++ programs that were written for the ROBO TX or the TXT, as they are.

usage: tx_run SOURCE.c [MORE.c|MORE.cpp ...] [--host HOST[:PORT]|auto] [--world WORLD] [-- ARGUMENTS]

  --host HOST    the TXT: its name or address, with or without a port, or auto for the only one that is found
  --world WORLD  without a host: what is plugged into the simulated TXT. none, a world that comes with it
                 (default, car, everything, kit, slide), or the path of a .toml file
  -h, --help     this text

After -- come arguments for the program. Without a host it runs on a simulated TXT. It is compiled by cc, gcc or
clang, for C++ by c++, g++ or clang++, or by what CC and CXX name, with the options in CFLAGS and CXXFLAGS.

On a terminal the arrow keys left and right are the buttons of the display of programs with PrgTic.
";

/// What the command line says.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Options {
    pub(crate) sources: Vec<PathBuf>,
    pub(crate) host: Option<String>,
    pub(crate) world: Option<OsString>,
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
                Long("host") => options.host = Some(parser.value()?.string()?),
                Long("world") => options.world = Some(parser.value()?),
                Value(source) => options.sources.push(source.into()),
                other => return Err(other.unexpected()),
            }
        }
        if options.sources.is_empty() {
            return Err("there is no source to compile".into());
        }
        if options.host.is_some() && options.world.is_some() {
            return Err("a world is for the simulated TXT, and a host is another one".into());
        }
        Ok(Some(options))
    }
}

use lexopt::ValueExt;

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &[&str]) -> Result<Option<Options>, String> {
        let line = ["tx_run"].iter().chain(line).map(OsString::from);
        Options::parse(line).map_err(|error| error.to_string())
    }

    #[test]
    fn sources_options_and_arguments_are_told_apart() {
        let options = parse(&["a.c", "--world", "car", "b.cpp", "--", "--host", "c.c"]);
        let expected = Options {
            sources: vec!["a.c".into(), "b.cpp".into()],
            host: None,
            world: Some("car".into()),
            arguments: vec!["--host".into(), "c.c".into()],
        };
        assert_eq!(options, Ok(Some(expected)));
        assert_eq!(parse(&["--help"]), Ok(None));
    }

    #[test]
    fn a_wrong_line_is_answered_with_a_sentence() {
        assert!(parse(&[]).unwrap_err().contains("no source"));
        assert!(parse(&["a.c", "--wrld", "car"]).unwrap_err().contains("--wrld"));
        assert!(parse(&["a.c", "--host", "h", "--world", "car"]).unwrap_err().contains("world"));
    }
}
