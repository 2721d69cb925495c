//! Compiles sources, several at the same time, as far as the cache does not have them.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::Mutex;
use std::thread;

use crate::cache::{self, Cache, Compiled, Key};
use crate::compiler::{self, Compiler, Compilers};
use crate::copies::Copies;
use crate::headers::Headers;
use crate::inputs::{Inputs, Source};
use crate::kind::Kind;
use crate::link::folder_of;
use crate::options::Options;
use crate::packages;
use crate::signals;
use crate::sources::{Include, OwnFiles};
use crate::{say, Sentence};

/// What else compilers take from the environment.
const VARIABLES: [&str; 3] = ["CPATH", "C_INCLUDE_PATH", "CPLUS_INCLUDE_PATH"];

/// The main function of programs with PrgTic.
pub(crate) const TX_MAIN: &str = include_str!("../../lib/tx_main.c");

/// What the compilation of all sources needs.
pub(crate) struct Plan {
    build: PathBuf,
    pub(crate) kind: Option<Kind>,
    headers: Headers,
    copies: Copies,
    own: OwnFiles,
}

impl Plan {
    pub(crate) fn new(
        inputs: &Inputs,
        options: &Options,
        compilers: &Compilers,
        build: &Path,
    ) -> Result<Self, Sentence> {
        let folders = compiler::include_folders(options);
        let sources = inputs.sources.iter().map(|source| source.path.as_path());
        let own = OwnFiles::read(sources, &folders)
            .map_err(|(file, error)| format!("{} can't be read: {error}", file.display()))?;
        let names: Vec<String> = own.includes().map(Include::name).collect();
        let texts = own.files.values().map(|file| file.text.as_slice());
        let kind = Kind::of(names.iter().map(String::as_str), texts);
        let headers = Headers::write(kind.unwrap_or(Kind::Downloaded), build)?;
        let copies = Copies::write(&own, &headers, &build.join("own"), &compilers.have_header())?;
        Ok(Self { build: build.to_owned(), kind, headers, copies, own })
    }

    /// Whether `char` has no sign, as on the controllers.
    fn has_unsigned_char(&self) -> bool {
        matches!(self.kind, Some(Kind::Downloaded | Kind::KeLib))
    }

    pub(crate) fn tell_what_is_passed_over(&self) {
        let over = &self.copies.passed_over;
        if !over.is_empty() {
            let names: Vec<String> = over.iter().map(|file| file.display().to_string()).collect();
            say(&format!("its own headers are used in place of {}", names.join(", ")));
        }
    }

    /// What of the program's files a source consists of, for the key of a cache: the source and what it
    /// includes directly or not, with what each include means. It is the same in each run.
    fn parts_of<'a>(&'a self, source: &'a Path) -> Vec<(&'a Path, u128, Vec<&'a Path>)> {
        let mut known = BTreeSet::new();
        let mut open = vec![source];
        let mut parts = Vec::new();
        while let Some(path) = open.pop() {
            if !known.insert(path) {
                continue;
            }
            let Some(file) = self.own.files.get(path) else { continue };
            let own = file.includes.iter().filter_map(|include| include.own.as_ref());
            let means: Vec<&Path> = own.map(|own| own.file.as_path()).collect();
            open.extend(&means);
            parts.push((path, file.content, means));
        }
        parts
    }
}

/// Compiles sources; returns the compiled files in their order. After one that does not compile no other is begun.
pub(crate) fn compile_all(
    sources: &[Source],
    compilers: &Compilers,
    plan: &Plan,
    cache: &Cache,
) -> Result<Vec<PathBuf>, Sentence> {
    let objects: Vec<PathBuf> = sources
        .iter()
        .enumerate()
        .map(|(number, source)| {
            let name = source.path.file_stem().unwrap_or_default().to_string_lossy();
            plan.build.join(format!("{number}_{name}.o"))
        })
        .collect();
    let (next, has_failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let failures = Mutex::new(Vec::new());
    let work = || {
        while !has_failed.load(Ordering::Relaxed) {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(source) = sources.get(number) else { return };
            let compiled = compilers.of(source.language).and_then(|compiler| {
                Unit { source, compiler, plan, cache }.compile(&objects[number])
            });
            if let Err(error) = compiled {
                has_failed.store(true, Ordering::Relaxed);
                let mut failures = failures.lock().unwrap_or_else(|it| it.into_inner());
                failures.push((number, error.to_string()));
            }
        }
    };
    let most = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 1..most.min(sources.len()) {
            scope.spawn(work);
        }
        work();
    });
    signals::check("the program was compiled")?;
    let mut failures = failures.into_inner().unwrap_or_else(|it| it.into_inner());
    failures.sort();
    let sentences: Vec<String> = failures.into_iter().map(|(_, sentence)| sentence).collect();
    if sentences.is_empty() {
        Ok(objects)
    } else {
        Err(sentences.join("\n").into())
    }
}

/// A source, and what its compilation needs.
struct Unit<'a> {
    source: &'a Source,
    compiler: &'a Compiler,
    plan: &'a Plan,
    cache: &'a Cache,
}

impl Unit<'_> {
    fn compile(&self, object: &Path) -> Result<(), Sentence> {
        let key = self.key();
        if let Some(messages) = self.cache.take(key, object) {
            tell(&messages);
            return Ok(());
        }
        let read = object.with_extension("d");
        let output = signals::output_of(&mut self.command(object, &read)?)?;
        tell(&output.stderr);
        if !output.status.success() {
            let advice = packages::advice_for_header(&String::from_utf8_lossy(&output.stderr));
            return Err(format!("{} does not compile{advice}", self.path().display()).into());
        }
        if let Some(read) = self.read_by_compiler(&read) {
            self.cache.add(key, &Compiled { object, read: &read, messages: &output.stderr });
        }
        Ok(())
    }

    fn path(&self) -> &Path {
        &self.source.path
    }

    fn command(&self, object: &Path, read: &Path) -> Result<std::process::Command, Sentence> {
        let headers = &self.plan.headers;
        let mut command = self.compiler.compile(&headers.folders);
        if self.plan.has_unsigned_char() {
            command.arg("-funsigned-char");
        }
        if let Some(windows) = &headers.windows {
            command.arg("-I").arg(windows);
        }
        // What is included in ways that the text does not tell.
        let folders: BTreeSet<&Path> = self.plan.copies.of.keys().map(|it| folder_of(it)).collect();
        for folder in folders {
            command.arg("-idirafter").arg(folder);
        }
        command.arg("-MD").arg("-MF").arg(read);
        let copy = self.plan.copies.of.get(self.path());
        self.compiler.add_source(&mut command, copy.map_or(self.path(), PathBuf::as_path), object);
        Ok(command)
    }

    /// Everything that is known before the source is compiled.
    fn key(&self) -> Key {
        let variables: Vec<_> = VARIABLES.iter().map(env::var_os).collect();
        let folder = env::current_dir().unwrap_or_default();
        let options: Vec<_> = self.compiler.options().collect();
        let language = self.compiler.language.name();
        let plan = self.plan;
        let ours = (plan.headers.identity(), TX_MAIN, plan.has_unsigned_char());
        // Our own main function lies in another folder each time.
        let name = self.path().strip_prefix(&plan.build).unwrap_or(self.path());
        let program = (name, plan.parts_of(self.path()));
        Key::of(&(&self.compiler.identity, options, language, variables, folder, ours, program))
    }

    /// The files that the compiler has read, without our headers and copies, which the key knows. `None` when it
    /// has not said so.
    fn read_by_compiler(&self, said: &Path) -> Option<Vec<PathBuf>> {
        let text = fs::read_to_string(said).ok()?;
        let mut files = cache::dependencies(&text);
        files.retain(|file| !file.starts_with(&self.plan.build));
        Some(files)
    }
}

/// Passes on what a compiler has said, without that of another one between it.
fn tell(messages: &[u8]) {
    // There is nobody left to be told when the terminal is gone.
    let _ = std::io::stderr().lock().write_all(messages);
}
