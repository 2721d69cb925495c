//! From the files of a program to something that can be run.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use crate::cache::Cache;
use crate::compiler::{self, Compiler};
use crate::headers::{Copies, Headers};
use crate::inputs::{Inputs, Language, Source};
use crate::kind::Kind;
use crate::link;
use crate::options::Options;
use crate::say;
use crate::sources::{Include, OwnFiles};
use crate::symbols::{self, Entry};
use crate::work;
use crate::Sentence;

/// The main function of programs with PrgTic.
pub(crate) const TX_MAIN: &str = include_str!("../../lib/tx_main.c");

/// A program that can be run.
pub(crate) struct Program {
    pub(crate) path: PathBuf,
    /// What it is, for people.
    pub(crate) kind: String,
    pub(crate) entry: Entry,
    /// The folder of the library.
    pub(crate) library_folder: PathBuf,
}

/// Compiles and links a program in the build folder.
pub(crate) fn build(options: &Options, build: &Path) -> Result<Program, Sentence> {
    let inputs = Inputs::of(&options.files)?;
    let library = link::library()?;
    let mut compilers = Compilers::find(&inputs, options)?;
    let plan = Plan::new(&inputs, options, &compilers, build)?;
    plan.tell_what_is_passed_over();
    let cache = Cache::of_user();
    let mut compiled = work::compile_all(&inputs.sources, &compilers, &plan, &cache)?;
    let with_names = inputs.sources.iter().map(|source| source.path.clone()).zip(compiled.clone());
    let named = inputs.objects.iter().map(|object| (object.clone(), object.clone()));
    let all: Vec<_> = with_names.chain(named).collect();
    let entry = symbols::entry(&all, !inputs.archives.is_empty())?;
    if entry == Entry::PrgTic {
        let path = build.join("tx_main.c");
        fs::write(&path, TX_MAIN)?;
        let main = [Source { path, language: Language::C }];
        compilers.need(Language::C, options)?;
        compiled.extend(work::compile_all(&main, &compilers, &plan, &cache)?);
    }
    let folder = build.join("program");
    fs::create_dir(&folder)?;
    let path = folder.join(&inputs.name).with_extension(env::consts::EXE_EXTENSION);
    link::link(compilers.for_linking()?, &compiled, &inputs, options, &library, &path)?;
    cache.tidy();
    let kind = match (entry, plan.kind) {
        (Entry::PrgTic, _) => Kind::Downloaded.to_string(),
        (Entry::Main, Some(kind)) => kind.to_string(),
        (Entry::Main, None) => "a program that includes no header of TX or TXT".into(),
    };
    let library_folder = link::folder_of(&library).to_owned();
    Ok(Program { path, kind, entry, library_folder })
}

/// The compilers for the languages of a program.
#[derive(Default)]
pub(crate) struct Compilers {
    c: Option<Compiler>,
    cpp: Option<Compiler>,
}

impl Compilers {
    fn find(inputs: &Inputs, options: &Options) -> Result<Self, Sentence> {
        let mut compilers = Self::default();
        for source in &inputs.sources {
            compilers.need(source.language, options)?;
        }
        if inputs.sources.is_empty() {
            // It can link whatever the compiled files were written in.
            compilers.need(Language::Cpp, options)?;
        }
        Ok(compilers)
    }

    fn need(&mut self, language: Language, options: &Options) -> Result<(), Sentence> {
        let place = match language {
            Language::C => &mut self.c,
            Language::Cpp => &mut self.cpp,
        };
        if place.is_none() {
            *place = Some(Compiler::find(language, options)?);
        }
        Ok(())
    }

    /// The one for a language that was needed.
    pub(crate) fn of(&self, language: Language) -> Result<&Compiler, Sentence> {
        let found = match language {
            Language::C => &self.c,
            Language::Cpp => &self.cpp,
        };
        found.as_ref().ok_or_else(|| format!("there is no {} compiler", language.name()).into())
    }

    fn for_linking(&self) -> Result<&Compiler, Sentence> {
        self.of(if self.cpp.is_some() { Language::Cpp } else { Language::C })
    }

    /// Whether a compiler itself has a header with this name. The compilers are asked when this is asked first.
    fn have_header(&self) -> impl Fn(&str) -> bool + '_ {
        let folders = std::cell::OnceCell::new();
        move |name| {
            let folders: &Vec<PathBuf> = folders.get_or_init(|| {
                [&self.c, &self.cpp]
                    .into_iter()
                    .flatten()
                    .flat_map(Compiler::system_folders)
                    .collect()
            });
            // None of them has headers for Windows.
            !name.starts_with("..") && folders.iter().any(|folder| folder.join(name).is_file())
        }
    }
}

/// What the compilation of all sources needs.
pub(crate) struct Plan {
    pub(crate) build: PathBuf,
    kind: Option<Kind>,
    pub(crate) headers: Headers,
    pub(crate) copies: Copies,
    own: OwnFiles,
}

impl Plan {
    fn new(
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
    pub(crate) fn has_unsigned_char(&self) -> bool {
        matches!(self.kind, Some(Kind::Downloaded | Kind::KeLib))
    }

    fn tell_what_is_passed_over(&self) {
        let over = &self.copies.passed_over;
        if !over.is_empty() {
            let names: Vec<String> = over.iter().map(|file| file.display().to_string()).collect();
            say(&format!("its own headers are used in place of {}", names.join(", ")));
        }
    }

    /// What of the program's files a source consists of, for the key of a cache: the source and what it
    /// includes directly or not, with what each include means. It is the same in each run.
    pub(crate) fn parts_of<'a>(&'a self, source: &'a Path) -> Vec<(&'a Path, u128, Vec<&'a Path>)> {
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
