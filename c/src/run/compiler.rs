//! The system's compilers, and their options.

use std::env;
use std::ffi::{OsStr, OsString};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::inputs::Language;
use crate::key;
use crate::options::Options;
use crate::search::Folders;
use crate::signals;
use crate::Sentence;

/// The environment variables with folders for headers.
const FOLDERS: [&str; 3] = ["CPATH", "C_INCLUDE_PATH", "CPLUS_INCLUDE_PATH"];

/// Has the compiler add no checks to the program.
pub(crate) const NO_CHECKS: &str = "-fno-sanitize=undefined";

impl Language {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::C => "C",
            Self::Cpp => "C++",
        }
    }

    /// What follows the option -x.
    fn option(self) -> &'static str {
        match self {
            Self::C => "c",
            Self::Cpp => "c++",
        }
    }

    /// The environment variables with the compiler and with options for it.
    fn variables(self) -> [&'static str; 2] {
        match self {
            Self::C => ["CC", "CFLAGS"],
            Self::Cpp => ["CXX", "CXXFLAGS"],
        }
    }

    /// The commands that are tried, in this order. The last ones are Python's package `ziglang`, which is a whole
    /// compiler for those who have none.
    fn compilers(self) -> [&'static str; 6] {
        match self {
            Self::C => {
                ["cc", "gcc", "clang", "zig cc", "python3 -m ziglang cc", "python -m ziglang cc"]
            }
            Self::Cpp => [
                "c++",
                "g++",
                "clang++",
                "zig c++",
                "python3 -m ziglang c++",
                "python -m ziglang c++",
            ],
        }
    }

    /// Options that let compilers of today take programs of that time. Without optimization, because programs
    /// wait in loops for fields that are not volatile. `-fno-sanitize=undefined` is for zig, which otherwise has programs
    /// end where they do what C does not define, such as an addition that overflows.
    fn options(self) -> &'static [&'static str] {
        match self {
            Self::C => &[
                "-std=gnu11",
                "-O0",
                "-g",
                "-fcommon",
                NO_CHECKS,
                "-Wno-error=implicit-function-declaration",
                "-Wno-error=implicit-int",
                "-Wno-error=int-conversion",
                "-Wno-error=incompatible-pointer-types",
            ],
            Self::Cpp => &["-std=gnu++14", "-O0", "-g", NO_CHECKS],
        }
    }

    /// Whether a standard is one of this language.
    fn has_standard(self, standard: &str) -> bool {
        standard.contains("++") == (self == Self::Cpp)
    }
}

/// The words of an environment variable with options. They may have paths that are not UTF-8.
pub(crate) fn words_of(variable: &str) -> Vec<OsString> {
    words_in(&env::var_os(variable).unwrap_or_default())
}

/// As a shell divides them, which `make` gives them to.
#[cfg(unix)]
fn words_in(text: &OsStr) -> Vec<OsString> {
    use std::os::unix::ffi::{OsStrExt, OsStringExt};
    let text = text.as_bytes();
    // No shell takes what a quotation mark begins that has no end.
    let words = shlex::bytes::split(text).unwrap_or_else(|| {
        let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        words.map(<[u8]>::to_vec).collect()
    });
    words.into_iter().map(OsString::from_vec).collect()
}

#[cfg(not(unix))]
fn words_in(text: &OsStr) -> Vec<OsString> {
    text.to_string_lossy().split_whitespace().map(Into::into).collect()
}

/// The words of a command. The program may have spaces in its path if it is there, as in
/// `C:\Program Files\zig\zig.exe cc`.
fn command_words(command: &str) -> Vec<OsString> {
    let words: Vec<&str> = command.split_whitespace().collect();
    let is_file = |count: &usize| {
        let path = words[..*count].join(" ");
        Path::new(&path).is_file() || Path::new(&(path + env::consts::EXE_SUFFIX)).is_file()
    };
    let program = (1..=words.len()).rev().find(is_file).unwrap_or(words.len().min(1));
    let (program, rest) = words.split_at(program);
    let program = (!program.is_empty()).then(|| program.join(" "));
    program.into_iter().chain(rest.iter().map(ToString::to_string)).map(Into::into).collect()
}

/// A compiler that is there.
pub(crate) struct Compiler {
    pub(crate) language: Language,
    /// The command's first words.
    words: Vec<OsString>,
    /// What distinguishes it and the user's options from others; `None` when that can't be known.
    pub(crate) identity: Option<String>,
    /// The user's options.
    flags: Vec<OsString>,
    /// Options before and behind those with our headers.
    before: Vec<OsString>,
    behind: Vec<OsString>,
    is_clang: bool,
}

impl Compiler {
    /// The compiler that `CC` or `CXX` names, or the first one that is found, with the options for this program.
    pub(crate) fn find(language: Language, options: &Options) -> Result<Self, Sentence> {
        let [variable, flags] = language.variables();
        let named = env::var_os(variable).filter(|named| !named.is_empty());
        let words: Vec<OsString> = match &named {
            Some(named) => command_words(&named.to_string_lossy()),
            None => Vec::new(),
        };
        let (words, version) = if words.is_empty() {
            first_found(language)?
        } else {
            let version = version_of(&words)?;
            (words, version.unwrap_or_default())
        };
        let mut before: Vec<OsString> = language.options().iter().map(Into::into).collect();
        // Messages come through this program, so the compiler can't see the terminal.
        let knows_colours = ["Free Software Foundation", "clang"];
        if std::io::stderr().is_terminal() && knows_colours.iter().any(|by| version.contains(by)) {
            before.push("-fdiagnostics-color=always".into());
        }
        let mut behind = Vec::new();
        let mut add = |option: &str, value: &OsStr| {
            behind.push(OsString::from_iter([OsStr::new(option), value]));
        };
        options.include_folders.iter().for_each(|folder| add("-I", folder.as_os_str()));
        options.definitions.iter().for_each(|definition| add("-D", definition));
        let flags = words_of(flags);
        behind.extend(flags.iter().cloned());
        let standards = options.standards.iter().filter(|named| language.has_standard(named));
        behind.extend(standards.map(|named| format!("-std={named}").into()));
        let is_clang = version.contains("clang");
        let identity = None;
        let mut compiler = Self { language, words, identity, flags, before, behind, is_clang };
        compiler.identity = compiler.identity_now()?;
        Ok(compiler)
    }

    /// Whether it is still the one that was found, and not another one in its place.
    pub(crate) fn is_the_same(&self) -> Result<bool, Sentence> {
        Ok(self.identity_now()? == self.identity)
    }

    fn identity_now(&self) -> Result<Option<String>, Sentence> {
        let [program, options @ ..] = self.words.as_slice() else { return Ok(None) };
        if !key::is_known_compiler(program, &[options, &self.flags].concat()) {
            return Ok(None);
        }
        let mut command = self.compile(&[], &[]);
        self.add_source(&mut command, Path::new("-"));
        // Otherwise it names files that are new each time.
        command.args(["-c", "-save-temps=obj", "-o", "a.o"]);
        // What it says of files with options is in English then.
        let output = signals::output_of(command.env("LC_ALL", "C").arg("-###"))?;
        let commands = String::from_utf8(output.stderr).ok().filter(|_| output.status.success());
        Ok(commands.and_then(|commands| key::identity(program, &commands)))
    }

    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(&self.words[0]);
        command.args(&self.words[1..]);
        command
    }

    /// A command that compiles a source with more options, before those of the user, and still without its headers' folders
    /// behind those of the program.
    pub(crate) fn compile(&self, more: &[&str], folders: &[PathBuf]) -> Command {
        let mut command = self.command();
        command.args(&self.before).args(more);
        for folder in folders {
            command.arg("-I").arg(folder);
        }
        command.args(&self.behind);
        command
    }

    /// Options for this. clang's own assembler would read the files of the directives in it, and leave none of them in the
    /// text; and it tells of options that count only for a source.
    fn to_assembler(&self) -> &'static [&'static str] {
        match self.is_clang {
            true => &["-S", "-Xclang", "-no-integrated-as", "-Qunused-arguments"],
            false => &["-S"],
        }
    }

    /// A command that compiles what the preprocessor has made of a source to the assembler's text.
    pub(crate) fn compile_text(&self, more: &[&str], text: &Path) -> Command {
        let mut command = self.compile(more, &[]);
        command.args(self.to_assembler());
        let language = match self.language {
            Language::C => "cpp-output",
            Language::Cpp => "c++-cpp-output",
        };
        command.args(["-x", language]).arg(text);
        command
    }

    /// Whether it may warn of what is only in a source, such as comments and the places of spaces. gcc has to be asked.
    pub(crate) fn warns_of_source(&self) -> bool {
        let mut options = self.words.iter().chain(&self.flags);
        self.is_clang || options.any(|option| option.as_encoded_bytes().starts_with(b"-W"))
    }

    /// A command that makes an object of such a text.
    pub(crate) fn assemble(&self, text: &Path, object: &Path) -> Command {
        let mut command = self.compile(&[], &[]);
        if self.is_clang {
            // The options that count only for a source.
            command.arg("-Qunused-arguments");
        }
        command.args(["-c", "-x", "assembler"]).arg(text).arg("-o").arg(object);
        command
    }

    /// Has the command take this source.
    pub(crate) fn add_source(&self, command: &mut Command, source: &Path) {
        command.args(["-x", self.language.option()]).arg(source);
    }

    /// The folders in which it looks for headers with the user's options. The error says that it can't be started.
    pub(crate) fn folders(&self, options: &Options) -> Result<Folders, Sentence> {
        let ask = |mut command: Command| {
            // The headings of the lists are in English then.
            command.env("LC_ALL", "C").args(["-E", "-v", "-x", self.language.option(), "-"]);
            signals::output_of(&mut command).map(|output| output.stderr)
        };
        let said = ask(self.compile(&[], &[]))?;
        // Usually nobody names any, and it need not be asked twice.
        let are_all_its_own = self.flags.is_empty()
            && options.include_folders.is_empty()
            && FOLDERS.iter().all(|variable| env::var_os(variable).is_none());
        let said_alone = if are_all_its_own {
            said.clone()
        } else {
            let mut alone = self.command();
            FOLDERS.iter().for_each(|variable| _ = alone.env_remove(variable));
            ask(alone)?
        };
        Ok(Folders::read(&said, &said_alone).unwrap_or_else(|| Folders {
            all: options.include_folders.clone(),
            ..Folders::default()
        }))
    }
}

/// What a compiler says about itself; `None` when it does not like to be asked.
fn version_of(words: &[OsString]) -> Result<Option<String>, Sentence> {
    let Some((program, rest)) = words.split_first() else { return Ok(None) };
    let mut command = Command::new(program);
    let output = signals::output_of(command.args(rest).arg("--version"))?;
    signals::check("a compiler was asked for its version")?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    Ok(output.status.success().then_some(text))
}

fn first_found(language: Language) -> Result<(Vec<OsString>, String), Sentence> {
    for command in language.compilers() {
        let words: Vec<OsString> = command.split(' ').map(Into::into).collect();
        if let Ok(Some(version)) = version_of(&words) {
            return Ok((words, version));
        }
        signals::check("a compiler was looked for")?;
    }
    let [first, second, third, ..] = language.compilers();
    Err(format!(
        "no {} compiler is found: neither {first} nor {second} nor {third} nor zig. Install gcc or clang, or with \
         Python: pip install ziglang. Or name a compiler in {}",
        language.name(),
        language.variables()[0]
    )
    .into())
}

/// The compilers for the languages of a program.
#[derive(Default)]
pub(crate) struct Compilers {
    c: Option<Compiler>,
    cpp: Option<Compiler>,
}

impl Compilers {
    /// The one for a language, which is looked for when it is needed first.
    pub(crate) fn need(
        &mut self,
        language: Language,
        options: &Options,
    ) -> Result<&Compiler, Sentence> {
        let place = match language {
            Language::C => &mut self.c,
            Language::Cpp => &mut self.cpp,
        };
        Ok(match place {
            Some(found) => found,
            None => place.insert(Compiler::find(language, options)?),
        })
    }

    /// The one for a language that was needed.
    pub(crate) fn of(&self, language: Language) -> Result<&Compiler, Sentence> {
        let found = match language {
            Language::C => &self.c,
            Language::Cpp => &self.cpp,
        };
        found.as_ref().ok_or_else(|| format!("there is no {} compiler", language.name()).into())
    }

    pub(crate) fn for_linking(&self) -> Result<&Compiler, Sentence> {
        self.of(if self.cpp.is_some() { Language::Cpp } else { Language::C })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_has_arguments_and_its_program_may_have_spaces() {
        let folder = tempfile::Builder::new().prefix("ein Übersetzer").tempdir().unwrap();
        let program = folder.path().join(format!("zig 1{}", env::consts::EXE_SUFFIX));
        std::fs::write(&program, "").unwrap();
        let program = program.to_str().unwrap();
        let without = program.strip_suffix(env::consts::EXE_SUFFIX).unwrap();
        for named in [program, without] {
            assert_eq!(command_words(named), [named]);
            assert_eq!(command_words(&format!("{named}  cc -w")), [named, "cc", "-w"]);
        }
        assert_eq!(command_words(" no such  cc"), ["no", "such", "cc"]);
        assert_eq!(command_words(" "), [""; 0]);
    }

    #[cfg(unix)]
    #[test]
    fn words_of_variables_need_not_be_utf_8() {
        use std::os::unix::ffi::OsStrExt;
        let words = words_in(OsStr::from_bytes(b" -w\n -Ik\xf6rbe\t"));
        assert_eq!(words, ["-w".as_ref(), OsStr::from_bytes(b"-Ik\xf6rbe")]);
    }

    #[cfg(unix)]
    #[test]
    fn words_of_variables_are_divided_as_by_a_shell() {
        let words = |text: &str| words_in(text.as_ref());
        assert_eq!(words(r"-DSPEED='300' -I/My\ Libs"), ["-DSPEED=300", "-I/My Libs"]);
        assert_eq!(
            words(r#"-DTITLE='"my robot"' -DA=\"b\""#),
            ["-DTITLE=\"my robot\"", "-DA=\"b\""]
        );
        assert_eq!(words("-DA=it's -w"), ["-DA=it's", "-w"]);
    }
}
