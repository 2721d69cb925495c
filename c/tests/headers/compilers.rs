//! The compilers of this machine.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::OnceLock;

/// A compiler for one language, with the standards of it that it knows.
pub(crate) struct Compiler {
    pub(crate) program: &'static str,
    pub(crate) language: Language,
    pub(crate) standards: Vec<&'static str>,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Language {
    C,
    Cpp,
}

impl Language {
    /// The oldest and the newest one; with `THOROUGH` in the environment those between, too, which
    /// takes a minute.
    pub(crate) fn standards(self) -> &'static [&'static str] {
        match (self, std::env::var_os("THOROUGH").is_some()) {
            (Self::C, false) => &["c89", "c2x"],
            // C17 only corrects C11.
            (Self::C, true) => &["c89", "c99", "c11", "gnu17", "c2x"],
            (Self::Cpp, false) => &["c++98", "c++20"],
            (Self::Cpp, true) => &["c++98", "c++11", "c++17", "c++20"],
        }
    }

    fn extension(self) -> &'static str {
        match self {
            Self::C => "c",
            Self::Cpp => "cpp",
        }
    }
}

/// What is tried for each language, and what zig is called for it.
const PROGRAMS: [(Language, [&str; 2], &str); 2] =
    [(Language::C, ["gcc", "clang"], "zig cc"), (Language::Cpp, ["g++", "clang++"], "zig c++")];

/// All compilers that are here.
pub(crate) fn all() -> &'static [Compiler] {
    static COMPILERS: OnceLock<Vec<Compiler>> = OnceLock::new();
    COMPILERS.get_or_init(|| {
        let mut found = Vec::new();
        for (language, programs, zig) in PROGRAMS {
            let programs = crate::compilers_of(&programs, zig).into_iter();
            found.extend(programs.filter_map(|program| find(program, language)));
        }
        if found.is_empty() {
            crate::miss_compilers("C compiler");
        }
        found
    })
}

/// The first one for a language.
pub(crate) fn of(language: Language) -> Option<&'static Compiler> {
    all().iter().find(|compiler| compiler.language == language)
}

/// Those for C.
pub(crate) fn for_c() -> impl Iterator<Item = &'static Compiler> {
    all().iter().filter(|compiler| compiler.language == Language::C)
}

fn find(program: &'static str, language: Language) -> Option<Compiler> {
    let mut compiler = Compiler { program, language, standards: Vec::new() };
    if compiler.command().arg("--version").output().is_err() {
        eprintln!("not checked with {program}, which is not here");
        return None;
    }
    compiler.standards = language
        .standards()
        .iter()
        .copied()
        .filter(|standard| {
            let known = compiler.check(standard, &[], "int main(void) { return 0; }\n").is_ok();
            if !known {
                eprintln!("not checked as {standard}, which {program} does not know");
            }
            known
        })
        .collect();
    Some(compiler)
}

impl Compiler {
    pub(crate) fn command(&self) -> Command {
        let mut command = crate::compiler(self.program);
        // Messages in English, as the tests search them.
        command.env("LC_ALL", "C");
        command
    }

    /// Whether a source compiles without a warning. The error is what the compiler said.
    pub(crate) fn check(
        &self,
        standard: &str,
        options: &[&str],
        source: &str,
    ) -> Result<(), String> {
        let file = write(source, self.language);
        let mut command = self.command();
        command.arg(format!("-std={standard}"));
        command.args(["-pedantic", "-Wall", "-Wextra", "-Werror"]);
        crate::check_only(&mut command, &file);
        let said = run(command.args(includes()).args(options).arg(&file))?;
        said.status.success().then_some(()).ok_or_else(|| {
            let text = String::from_utf8_lossy(&said.stderr);
            format!("{} {options:?} as {standard}:\n{source}\n{text}", self.program)
        })
    }

    /// Checks a source in each standard.
    pub(crate) fn check_all(&self, source: &str) {
        self.check_in(&self.standards, source);
    }

    /// Checks a source in the oldest and the newest standard.
    pub(crate) fn check_ends(&self, source: &str) {
        let ends = [self.standards.first(), self.standards.last()];
        let ends: Vec<_> = ends.into_iter().flatten().copied().collect();
        self.check_in(&ends, source);
    }

    fn check_in(&self, standards: &[&str], source: &str) {
        for standard in standards {
            if let Err(said) = self.check(standard, &[], source) {
                panic!("{said}");
            }
        }
    }
}

fn run(command: &mut Command) -> Result<Output, String> {
    command.output().map_err(|error| error.to_string())
}

/// The folders in which programs find the headers.
pub(crate) fn includes() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    let mut folders = vec![format!("-I{}", folder.display())];
    if cfg!(not(windows)) {
        folders.push(format!("-I{}", folder.join("posix").display()));
    }
    folders
}

/// Writes a source file, each to a name of its own.
pub(crate) fn write(source: &str, language: Language) -> PathBuf {
    static NUMBER: AtomicUsize = AtomicUsize::new(0);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("headers");
    std::fs::create_dir_all(&folder).unwrap();
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let file = folder.join(format!("source_{number}.{}", language.extension()));
    std::fs::write(&file, source).unwrap();
    file
}
