//! Compiles sources, several at the same time, as far as the cache does not have them.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::Mutex;
use std::thread;

use crate::cache::Cache;
use crate::compiler::{Compiler, Compilers};
use crate::copies::{self, Copies};
use crate::headers::Headers;
use crate::inputs::{Language, Source};
use crate::key::{self, Key};
use crate::kind::Kind;
use crate::language;
use crate::packages;
use crate::read;
use crate::signals;
use crate::sources::{Include, OwnFiles};
use crate::symbols::Entry;
use crate::{pass_on, say, Sentence};

/// What the compilation of all sources needs.
pub(crate) struct Plan {
    build: PathBuf,
    pub(crate) kind: Option<Kind>,
    headers: Headers,
    copies: BTreeMap<Language, Copies>,
}

impl Plan {
    /// For a program with these files.
    pub(crate) fn new(own: &BTreeMap<Language, OwnFiles>, build: &Path) -> Result<Self, Sentence> {
        let names: Vec<String> =
            own.values().flat_map(OwnFiles::includes).map(Include::name).collect();
        let files = own.values().flat_map(|own| own.files.values());
        let texts = files.map(|file| file.code.as_slice());
        let kind = Kind::of(names.iter().map(String::as_str), texts);
        let headers = Headers::write(kind.unwrap_or(Kind::Downloaded), build)?;
        let mut copies = BTreeMap::new();
        for (language, own) in own {
            let to = build.join("own").join(language.name());
            copies.insert(*language, Copies::write(own, &headers, &to)?);
        }
        Ok(Self { build: build.to_owned(), kind, headers, copies })
    }

    /// A program that begins so has PrgTic, or is for a PC, whatever its text shows, as when its header comes by a macro.
    /// Returns whether what was compiled for another kind has to be compiled again.
    pub(crate) fn begins_with(&mut self, entry: Entry) -> bool {
        let kind = match (entry, self.kind) {
            (Entry::PrgTic, _) => Some(Kind::Downloaded),
            (Entry::Main, Some(Kind::Downloaded)) => Some(Kind::MscLib),
            (Entry::Main, kind) => kind,
        };
        let had_unsigned_char = self.has_unsigned_char();
        self.kind = kind;
        self.has_unsigned_char() != had_unsigned_char
    }

    /// Whether `char` has no sign, as on the controllers.
    fn has_unsigned_char(&self) -> bool {
        matches!(self.kind, Some(Kind::Downloaded | Kind::KeLib))
    }

    pub(crate) fn tell_what_is_passed_over(&self) {
        let over: BTreeSet<_> = self.copies.values().flat_map(|it| &it.passed_over).collect();
        if !over.is_empty() {
            let names: Vec<String> = over.iter().map(|file| file.display().to_string()).collect();
            say(&format!("its own headers are used in place of {}", names.join(", ")));
        }
    }
}

/// Compiles sources; returns the compiled files in their order, whose names have numbers from `first` on. After one that
/// does not compile no other is begun.
pub(crate) fn compile_all(
    sources: &[Source],
    first: usize,
    compilers: &Compilers,
    plan: &Plan,
    cache: &Cache,
) -> Result<Vec<PathBuf>, Sentence> {
    let objects: Vec<PathBuf> = sources
        .iter()
        .zip(first..)
        .map(|(source, number)| {
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

/// A source after the preprocessor.
struct Text {
    key: Key,
    text: Vec<u8>,
    /// Whether the preprocessor has said something.
    has_messages: bool,
}

impl Unit<'_> {
    /// Compiles the source. What is kept is made of the preprocessor's text alone, whatever the files become meanwhile.
    fn compile(&self, object: &Path) -> Result<(), Sentence> {
        let Some(text) = self.text()? else { return self.compile_to_object(object) };
        if let Some(messages) = self.cache.take(text.key, object) {
            self.pass_on(&messages);
            return Ok(());
        }
        let [preprocessed, assembler] = ["text", "s"].map(|end| object.with_extension(end));
        fs::write(&preprocessed, &text.text)?;
        let mut command = self.compiler.compile_text(self.more_options(), &preprocessed);
        self.warn_of_nothing_in_ours(&mut command);
        let compiled = signals::output_of(command.arg("-o").arg(&assembler))?;
        let mut command = self.compiler.assemble(&assembler, object);
        if !compiled.status.success() || !signals::output_of(&mut command)?.status.success() {
            return self.compile_to_object(object);
        }
        let may_warn = self.compiler.warns_of_source() || key::asks_for_warnings(&text.text);
        let messages = match may_warn || text.has_messages || !compiled.stderr.is_empty() {
            true => self.messages(object)?,
            false => Vec::new(),
        };
        let is_all = read::file(&assembler).is_ok_and(|text| !key::reads_files(&text));
        let are_of_text = || self.text().map(|now| now.is_some_and(|now| now.key == text.key));
        if is_all && self.compiler.is_the_same()? && (messages.is_empty() || are_of_text()?) {
            self.cache.add(text.key, object, &messages);
        }
        Ok(())
    }

    /// Compiles the source for what the compiler says of it: its text has other spaces, and no comments and macros.
    fn messages(&self, object: &Path) -> Result<Vec<u8>, Sentence> {
        let mut command = self.command();
        command.arg("-S");
        self.compile_source(command, &object.with_extension("messages"))
    }

    fn compile_to_object(&self, object: &Path) -> Result<(), Sentence> {
        let mut command = self.command();
        command.arg("-c");
        self.compile_source(command, object).map(drop)
    }

    /// Compiles the source as it is now by this command, and returns what the compiler says.
    fn compile_source(&self, mut command: Command, to: &Path) -> Result<Vec<u8>, Sentence> {
        let output = signals::output_of(command.arg("-o").arg(to))?;
        if output.status.success() {
            self.pass_on(&output.stderr);
            return Ok(output.stderr);
        }
        pass_on(&output.stderr);
        let said = String::from_utf8_lossy(&output.stderr);
        let is_for_txt = self.plan.kind.is_some_and(Kind::is_for_txt);
        // A header that is missing is missing in each language.
        let advice = packages::advice_for_header(&said, self.path())
            .unwrap_or_else(|| language::advice(self.source, is_for_txt).into());
        let of_longs = language::advice_for_longs(&said);
        let of_extended = packages::advice_for_extended(&said);
        let path = self.path().display();
        Err(format!("{path} does not compile{advice}{of_longs}{of_extended}").into())
    }

    /// Shows the warnings, and says what they mean when the program will not do what it does on Windows.
    fn pass_on(&self, warnings: &[u8]) {
        pass_on(warnings);
        let advice = language::advice_for_longs(&String::from_utf8_lossy(warnings));
        if !advice.is_empty() {
            say(&format!("{}{advice}", self.path().display()));
        }
    }

    fn path(&self) -> &Path {
        &self.source.path
    }

    fn more_options(&self) -> &'static [&'static str] {
        if self.plan.has_unsigned_char() {
            &["-funsigned-char"]
        } else {
            &[]
        }
    }

    /// What the user wants to be warned of is for the program.
    fn warn_of_nothing_in_ours(&self, command: &mut Command) {
        if self.path().starts_with(&self.plan.build) {
            command.arg("-w");
        }
    }

    /// The command without what is to be done.
    fn command(&self) -> Command {
        let headers = &self.plan.headers;
        let copies = self.plan.copies.get(&self.source.language);
        let mut command = self.compiler.compile(self.more_options(), &headers.folders);
        command.arg("-idirafter").arg(&headers.last);
        self.warn_of_nothing_in_ours(&mut command);
        let copy = copies.and_then(|it| it.of.get(self.path()));
        if copy.is_some() {
            // `__FILE__` is in the copy.
            let mut name = OsString::from("-D__BASE_FILE__=");
            name.push(copies::literal(self.path()));
            command.arg("-Wno-builtin-macro-redefined").arg(name);
        }
        self.compiler.add_source(&mut command, copy.map_or(self.path(), PathBuf::as_path));
        command
    }

    /// What the preprocessor makes of the source; `None` when what is compiled from it is not kept.
    fn text(&self) -> Result<Option<Text>, Sentence> {
        let Some(compiler) = self.compiler.identity.as_ref().filter(|_| self.cache.is_there())
        else {
            return Ok(None);
        };
        // With the second option gcc names a precompiled header that it would read.
        let too_much = |error| format!("{}: {error}", self.path().display());
        let mut command = self.command();
        command.args(["-E", "-fpch-preprocess"]);
        let output = signals::output_of(&mut command).map_err(too_much)?;
        // The next start has another build folder.
        if !output.status.success() || key::names_folder(&output.stdout, &self.plan.build) {
            return Ok(None);
        }
        let [text, said] = [&output.stdout, &output.stderr]
            .map(|text| key::with_fixed_name(text, &self.plan.build));
        let written = key::written_in(&text).map_err(|error| too_much(error.into()))?;
        let options = self.more_options().concat();
        let others = [compiler.as_bytes(), options.as_bytes(), &said, &written];
        let key = key::of(&text, &others);
        let has_messages = !said.is_empty();
        Ok(key.map(|key| Text { key, text: output.stdout, has_messages }))
    }
}
