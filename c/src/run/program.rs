//! From the files of a program to something that can be run.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use crate::cache::Cache;
use crate::compiler::Compilers;
use crate::inputs::{Inputs, Language, Source};
use crate::kind::Kind;
use crate::link;
use crate::options::Options;
use crate::symbols::{self, Entry};
use crate::work::{self, Plan, TX_MAIN};
use crate::Sentence;

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
