//! Compiles a program with the system's compiler, whose messages go to the terminal as they are.

use std::env;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::headers::{self, Headers};
use crate::kind::Kind;
use crate::sources::Included;
use crate::symbols::{self, Entry};
use crate::Sentence;

/// The main function of programs with PrgTic.
const TX_MAIN: &str = include_str!("../../lib/tx_main.c");

/// The library that all programs are linked with.
const LIBRARY: &str = if cfg!(windows) {
    "ftMscLib.dll"
} else if cfg!(target_os = "macos") {
    "libftMscLib.dylib"
} else {
    "libftMscLib.so"
};

/// A program that can be run.
pub(crate) struct Program {
    pub(crate) path: PathBuf,
    /// What it is, for people.
    pub(crate) kind: String,
    pub(crate) entry: Entry,
    /// The folder of the library.
    pub(crate) library_folder: PathBuf,
}

/// A language, with what its compiler is called and told.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Language {
    C,
    Cpp,
}

impl Language {
    fn of(source: &Path) -> Result<Self, Sentence> {
        let name = source.file_name().unwrap_or_default().to_string_lossy();
        let is_capital = !name.contains(char::is_lowercase);
        match source.extension().and_then(OsStr::to_str) {
            Some("c") => Ok(Self::C),
            // `STOPGO.C` is a name from Windows, `StopGo.C` is C++.
            Some("C") if is_capital => Ok(Self::C),
            Some("cpp" | "cc" | "cxx" | "c++" | "C" | "CPP") => Ok(Self::Cpp),
            _ => Err(format!("{} is no source: .c, .cpp, .cc or .cxx", source.display()).into()),
        }
    }

    fn name(self) -> &'static str {
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

    fn variable(self) -> &'static str {
        match self {
            Self::C => "CC",
            Self::Cpp => "CXX",
        }
    }

    fn compilers(self) -> [&'static str; 3] {
        match self {
            Self::C => ["cc", "gcc", "clang"],
            Self::Cpp => ["c++", "g++", "clang++"],
        }
    }

    /// Options that let compilers of today take programs of that time. Without optimization, because programs
    /// wait in loops for fields that are not volatile.
    fn options(self) -> &'static [&'static str] {
        match self {
            Self::C => &[
                "-std=gnu11",
                "-O0",
                "-g",
                "-fcommon",
                "-Wno-error=implicit-function-declaration",
                "-Wno-error=implicit-int",
                "-Wno-error=int-conversion",
                "-Wno-error=incompatible-pointer-types",
            ],
            Self::Cpp => &["-std=gnu++14", "-O0", "-g"],
        }
    }

    /// The command that compiles it, with the first words of its line.
    fn command(self) -> Result<Command, Sentence> {
        if let Some(named) = env::var_os(self.variable()).filter(|named| !named.is_empty()) {
            let named = named.to_string_lossy().into_owned();
            let mut words = named.split_whitespace();
            let mut command = Command::new(words.next().unwrap_or_default());
            command.args(words);
            return Ok(command);
        }
        let starts = |name: &&str| {
            let mut command = Command::new(name);
            command.arg("--version").stdin(Stdio::null()).stdout(Stdio::null());
            command.stderr(Stdio::null()).status().is_ok_and(|status| status.success())
        };
        let found = self.compilers().into_iter().find(starts);
        found.map(Command::new).ok_or_else(|| {
            let [first, second, third] = self.compilers();
            format!(
                "no {} compiler is found: neither {first} nor {second} nor {third}. Install gcc or clang, or \
                 name a compiler in {}",
                self.name(),
                self.variable()
            )
            .into()
        })
    }

    fn own_options(self) -> Vec<OsString> {
        let variable = match self {
            Self::C => "CFLAGS",
            Self::Cpp => "CXXFLAGS",
        };
        env::var(variable).unwrap_or_default().split_whitespace().map(Into::into).collect()
    }
}

/// Compiles and links a program in the build folder.
pub(crate) fn compile(sources: &[PathBuf], build: &Path) -> Result<Program, Sentence> {
    let languages =
        sources.iter().map(|source| Language::of(source)).collect::<Result<Vec<_>, _>>()?;
    let library = library()?;
    let work = Work::new(sources, build)?;
    let mut compiled = Vec::new();
    for (source, language) in sources.iter().zip(&languages) {
        compiled.push((source.clone(), work.compile(source, *language, compiled.len())?));
    }
    let entry = symbols::entry(&compiled)?;
    let mut objects: Vec<PathBuf> = compiled.into_iter().map(|(_, object)| object).collect();
    if entry == Entry::PrgTic {
        let main = build.join("tx_main.c");
        fs::write(&main, TX_MAIN)?;
        objects.push(work.compile(&main, Language::C, objects.len())?);
    }
    let linker = if languages.contains(&Language::Cpp) { Language::Cpp } else { Language::C };
    let name = sources[0].file_stem().unwrap_or(OsStr::new("program"));
    let folder = build.join("program");
    fs::create_dir(&folder)?;
    let path = folder.join(name).with_extension(env::consts::EXE_EXTENSION);
    link(linker, &objects, &library, &path)?;
    let kind = match (entry, work.kind) {
        (Entry::PrgTic, _) => Kind::Downloaded.to_string(),
        (Entry::Main, Some(kind)) => kind.to_string(),
        (Entry::Main, None) => "a program that includes no header of TX or TXT".into(),
    };
    let library_folder = library.parent().map(Path::to_owned).unwrap_or_default();
    Ok(Program { path, kind, entry, library_folder })
}

/// What the compilation of each source needs.
struct Work<'a> {
    build: &'a Path,
    kind: Option<Kind>,
    headers: Headers,
    /// Where sources are copied to, because old headers lie beside them.
    copies: std::collections::BTreeMap<PathBuf, PathBuf>,
}

impl<'a> Work<'a> {
    fn new(sources: &[PathBuf], build: &'a Path) -> Result<Self, Sentence> {
        let included = Included::by(sources)
            .map_err(|(file, error)| format!("{} can't be read: {error}", file.display()))?;
        let names: Vec<String> =
            included.includes.iter().map(|include| include.name().to_lowercase()).collect();
        let kind = Kind::of(names.iter().map(String::as_str));
        let headers = Headers::write(kind.unwrap_or(Kind::Downloaded), build)?;
        headers.spell(&included)?;
        let replaced = headers.replaced(&included);
        let copies = if replaced.is_empty() {
            Default::default()
        } else {
            headers::copy_without(&replaced, &included, &build.join("own"))?
        };
        Ok(Self { build, kind, headers, copies })
    }

    /// Compiles one source; returns the compiled file.
    fn compile(
        &self,
        source: &Path,
        language: Language,
        number: usize,
    ) -> Result<PathBuf, Sentence> {
        let object = self.build.join(format!("{number}.o"));
        let copy = self.copies.get(source);
        let mut command = language.command()?;
        command.args(language.options());
        if matches!(self.kind, Some(Kind::Downloaded | Kind::KeLib)) {
            // As on the controllers.
            command.arg("-funsigned-char");
        }
        command.args(language.own_options());
        for folder in &self.headers.folders {
            command.arg("-I").arg(folder);
        }
        if copy.is_some() {
            // What is included in ways that the text does not tell.
            command
                .arg("-I")
                .arg(source.parent().filter(|it| *it != Path::new("")).unwrap_or(Path::new(".")));
        }
        command.args(["-x", language.option()]);
        command.arg("-c").arg(copy.map_or(source, PathBuf::as_path)).arg("-o").arg(&object);
        run(&mut command, &format!("{} does not compile", source.display()))?;
        Ok(object)
    }
}

fn link(
    language: Language,
    objects: &[PathBuf],
    library: &Path,
    path: &Path,
) -> Result<(), Sentence> {
    let mut command = language.command()?;
    command.args(objects).arg(library);
    if !cfg!(windows) {
        let mut search = OsString::from("-Wl,-rpath,");
        search.push(library.parent().unwrap_or(Path::new("")));
        command.arg(search);
    }
    command.args(["-lm", "-lpthread", "-o"]).arg(path);
    run(&mut command, "the program can't be linked")
}

fn run(command: &mut Command, otherwise: &str) -> Result<(), Sentence> {
    match command.stdin(Stdio::null()).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err(otherwise.into()),
        Err(error) => {
            let name = command.get_program().to_string_lossy();
            Err(format!("the compiler {name} can't be started: {error}").into())
        }
    }
}

/// The library: beside this program, or where it was built. If there are two, the newer one.
fn library() -> Result<PathBuf, Sentence> {
    let program = env::current_exe()?;
    let folder = program.parent().unwrap_or(Path::new(""));
    let places = [
        folder.join(LIBRARY),
        folder.join("deps").join(LIBRARY),
        folder.join("../lib").join(LIBRARY),
    ];
    let changed = |place: &PathBuf| fs::metadata(place).and_then(|data| data.modified()).ok();
    let newest = places.into_iter().filter_map(|place| Some((changed(&place)?, place))).max();
    newest.map(|(_, place)| place).ok_or_else(|| {
        format!("{LIBRARY} is not there: it belongs into {}", folder.display()).into()
    })
}
