//! Compiles sources, several at the same time, as far as the cache does not have them.

use std::collections::BTreeSet;
use std::env;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::Mutex;
use std::thread;

use crate::cache::Cache;
use crate::compiler::{self, Compiler, Compilers};
use crate::copies::Copies;
use crate::headers::Headers;
use crate::inputs::{Inputs, Source};
use crate::key::{self, Key};
use crate::kind::Kind;
use crate::link::folder_of;
use crate::options::Options;
use crate::packages;
use crate::signals;
use crate::sources::{Include, OwnFiles};
use crate::{pass_on, say, Sentence};

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
        let key = self.key()?;
        if let Some(messages) = key.and_then(|key| self.cache.take(key, object)) {
            pass_on(&messages);
            return Ok(());
        }
        let mut command = self.command();
        command.arg("-c").arg("-o").arg(object);
        let output = signals::output_of(&mut command)?;
        pass_on(&output.stderr);
        if !output.status.success() {
            let advice = packages::advice_for_header(&String::from_utf8_lossy(&output.stderr));
            return Err(format!("{} does not compile{advice}", self.path().display()).into());
        }
        // A file that changes meanwhile may have been compiled before or after.
        if let Some(key) = key.filter(|key| self.key().is_ok_and(|now| now == Some(*key))) {
            self.cache.add(key, object, &output.stderr);
        }
        Ok(())
    }

    fn path(&self) -> &Path {
        &self.source.path
    }

    /// The command without what is to be done.
    fn command(&self) -> Command {
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
        let copy = self.plan.copies.of.get(self.path());
        self.compiler.add_source(&mut command, copy.map_or(self.path(), PathBuf::as_path));
        command
    }

    /// The key of what the compiler makes of the source now; `None` when that can't be known.
    fn key(&self) -> Result<Option<Key>, Sentence> {
        let Some(compiler) = self.compiler.identity.as_ref().filter(|_| self.cache.is_there())
        else {
            return Ok(None);
        };
        let mut command = self.command();
        // gcc then names the precompiled headers that it takes in place of others.
        let output = signals::output_of(command.args(["-E", "-fpch-preprocess"]))?;
        if !output.status.success() {
            return Ok(None);
        }
        let folder = env::current_dir().unwrap_or_default();
        // Warnings may depend on comments, and show lines as they are written.
        let written = self.plan.own.files.get(self.path()).map_or(&[][..], |file| &file.text);
        let command = self.command();
        let words = command.get_args().map(OsStr::as_encoded_bytes);
        let others = [compiler.as_bytes(), folder.as_os_str().as_encoded_bytes(), written];
        Ok(key::of(&output.stdout, others.into_iter().chain(words), &self.plan.build))
    }
}
