//! From the files of a program to something that can be run.

use std::collections::{BTreeMap, BTreeSet};
use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use crate::cache::Cache;
use crate::compiler::Compilers;
use crate::inputs::{Inputs, Language, Source};
use crate::language;
use crate::link;
use crate::options::Options;
use crate::sources::OwnFiles;
use crate::symbols::{Entry, Found, ENDS};
use crate::work::{self, Plan};
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
    let cache = Cache::of_user();
    let built = build_with(&cache, options, build);
    // Also when something is wrong with it: what was right is kept.
    cache.tidy();
    built
}

fn build_with(cache: &Cache, options: &Options, build: &Path) -> Result<Program, Sentence> {
    let mut inputs = Inputs::of(&options.files)?;
    let library = link::library()?;
    let mut compilers = Compilers::default();
    let mut own = own_files(&inputs.sources, &mut compilers, options)?;
    let named = inputs.sources.clone();
    language::choose(&mut inputs.sources, &own, options);
    if inputs.sources != named {
        // In the other language they may include other files.
        own = own_files(&inputs.sources, &mut compilers, options)?;
    }
    if inputs.sources.is_empty() {
        // It can link whatever the compiled files were written in.
        compilers.need(Language::Cpp, options)?;
    }
    let mut plan = Plan::new(&own, build)?;
    plan.tell_what_is_passed_over();
    let mut compiled = work::compile_all(&inputs.sources, 0, &compilers, &plan, cache)?;
    let with_names = inputs.sources.iter().map(|source| source.path.clone()).zip(compiled.clone());
    let named = inputs.objects.iter().map(|object| (object.clone(), object.clone()));
    let all: Vec<_> = with_names.chain(named).collect();
    let found = Found::in_all(&all)?;
    let entry = found.entry(!inputs.archives.is_empty())?;
    if plan.begins_with(entry) {
        compiled = work::compile_all(&inputs.sources, 0, &compilers, &plan, cache)?;
    }
    compiled.append(&mut inputs.objects);
    let mut more = Vec::new();
    let ours = Ours::of(entry, &inputs, &found);
    if let Some(ours) = &ours {
        let path = build.join(ours.name);
        fs::write(&path, &ours.text)?;
        compilers.need(ours.language, options)?;
        let source = [Source { path, language: ours.language }];
        let first = inputs.sources.len();
        let compiled = work::compile_all(&source, first, &compilers, &plan, cache)?;
        more.extend(compiled.into_iter().map(PathBuf::into_os_string));
        more.extend(ours.link_options.iter().map(OsString::from));
    }
    let folder = build.join("program");
    fs::create_dir(&folder)?;
    let path = folder.join(&inputs.name).with_extension(env::consts::EXE_EXTENSION);
    link::link(compilers.for_linking()?, &mut compiled, &more, &inputs, options, &library, &path)?;
    let kind = match plan.kind {
        Some(kind) => kind.to_string(),
        None => "a program that includes no header of TX or TXT".into(),
    };
    let library_folder = link::folder_of(&library).to_owned();
    Ok(Program { path, kind, entry, library_folder })
}

/// The sources in each language, and what they include.
fn own_files(
    sources: &[Source],
    compilers: &mut Compilers,
    options: &Options,
) -> Result<BTreeMap<Language, OwnFiles>, Sentence> {
    let mut own = BTreeMap::new();
    let languages: BTreeSet<Language> = sources.iter().map(|source| source.language).collect();
    for language in languages {
        let folders = compilers.need(language, options)?.folders(options)?;
        let in_language = sources.iter().filter(|source| source.language == language);
        let files = OwnFiles::read(in_language.map(|source| source.path.as_path()), &folders)
            .map_err(|(file, error)| format!("{} can't be read: {error}", file.display()))?;
        own.insert(language, files);
    }
    Ok(own)
}

/// A source of ours that belongs to a program.
struct Ours {
    name: &'static str,
    text: String,
    language: Language,
    link_options: Vec<String>,
}

impl Ours {
    fn of(entry: Entry, inputs: &Inputs, found: &Found) -> Option<Self> {
        match entry {
            Entry::PrgTic => Some(Self {
                name: "tx_main.c",
                text: include_str!("../../lib/tx_main.c").into(),
                language: Language::C,
                link_options: Vec::new(),
            }),
            // Other linkers have no such options.
            Entry::Main if cfg!(target_os = "linux") => Some(Self {
                name: "end_first.c",
                text: definitions(found) + include_str!("../../lib/end_first.c"),
                // No second compiler is needed.
                language: match inputs.sources.iter().all(|one| one.language == Language::C) {
                    true if !inputs.sources.is_empty() => Language::C,
                    _ => Language::Cpp,
                },
                link_options: ["main"]
                    .into_iter()
                    .chain(ENDS.into_iter().filter(|end| !found.own_ends.contains(end)))
                    .map(|name| format!("-Wl,--wrap={name}"))
                    .collect(),
            }),
            Entry::Main => None,
        }
    }
}

/// Lines that tell `end_first.c` which ends are the program's own.
fn definitions(found: &Found) -> String {
    let own = found.own_ends.iter().map(|end| format!("#define FT_OWN_{}\n", end.to_uppercase()));
    own.collect()
}
