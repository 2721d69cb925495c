//! The crate's items with their C names (`#[doc(alias = "…")]`), read from its source.
//!
//! The source is formatted by rustfmt, so attributes, items and the heads of blocks have a line each
//! and are indented. The test fails for a C name on anything else.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::public::Exports;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A struct, an enum or another type.
    Type,
    Constant,
    /// A function without `self`.
    Function,
    /// A function with `self`.
    Method,
    Field,
    Variant,
    /// A field of a variant.
    VariantField,
}

#[derive(Clone, Debug)]
pub(crate) struct Item {
    pub(crate) kind: Kind,
    pub(crate) name: String,
    /// The type that it belongs to, if any.
    container: Option<String>,
    /// Relative to `src`.
    pub(crate) file: PathBuf,
    line: usize,
    pub(crate) aliases: Vec<String>,
    /// The type of a field, or of its elements.
    pub(crate) type_name: String,
    has_arguments: bool,
}

pub(crate) struct Source {
    pub(crate) items: Vec<Item>,
    exports: Exports,
}

/// The name that the document uses for a value of each type.
const RECEIVERS: [(&str, &str); 8] = [
    ("FishX1Transfer", "area"),
    ("TransferAreaComHandler", "handler"),
    ("TransferAreaComHandlerBuilder", "builder"),
    ("TxtClient", "client"),
    ("CameraFrame", "frame"),
    ("transfer_area::State", "area.state"),
    ("transfer_area::OutputValues", "area.output"),
    ("transfer_area::Timer", "area.timer"),
];

impl Source {
    /// Reads all but the simulated TXT, which has no C names.
    pub(crate) fn read() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../src");
        let mut files = Vec::new();
        list(&root, &root, &mut files);
        files.sort();
        let mut items = Vec::new();
        for file in &files {
            let text = fs::read_to_string(root.join(file)).unwrap();
            items.extend(items_of(file, &text));
        }
        let source = Self { items, exports: Exports::read(&root) };
        for item in source.items.iter().filter(|item| !item.aliases.is_empty()) {
            // Panics for an item that is not public.
            source.show(item);
        }
        source
    }

    /// The items of each C name, as the document shows them.
    pub(crate) fn by_alias(&self) -> BTreeMap<&str, Vec<String>> {
        let mut names: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for item in &self.items {
            for alias in &item.aliases {
                names.entry(alias).or_default().push(self.show(item));
            }
        }
        for shown in names.values_mut() {
            shown.sort_by_key(|name| !name.starts_with("handler.") && !name.starts_with("area."));
        }
        names
    }

    /// The constants outside types. They keep their C names unless they have an alias.
    pub(crate) fn constants(&self) -> impl Iterator<Item = &Item> {
        let is_free = |item: &&Item| item.kind == Kind::Constant && item.container.is_none();
        self.items.iter().filter(is_free)
    }

    /// The fields of a type, in their order.
    pub(crate) fn fields<'a>(&'a self, of: &'a Item) -> impl Iterator<Item = &'a Item> {
        self.items.iter().filter(move |item| {
            item.kind == Kind::Field
                && item.file == of.file
                && item.container.as_deref() == Some(of.name.as_str())
        })
    }

    /// The type with this name that a file uses: its own, one from its directory, or the only one
    /// elsewhere.
    pub(crate) fn type_named(&self, name: &str, file: &Path) -> &Item {
        let types = || {
            self.items
                .iter()
                .filter(|item| item.kind == Kind::Type && item.name == name)
                .filter(|item| self.exports.path(&item.file, &item.name).is_some())
        };
        let own = types().find(|item| item.file == file);
        let near = || types().find(|item| item.file.parent() == file.parent());
        let any = || types().next().filter(|_| types().count() == 1);
        own.or_else(near).or_else(any).unwrap_or_else(|| panic!("{file:?}: which {name}?"))
    }

    fn variant_named(&self, name: &str, file: &Path) -> &Item {
        let is_it =
            |item: &&Item| item.kind == Kind::Variant && item.name == name && item.file == file;
        self.items.iter().find(is_it).unwrap_or_else(|| panic!("{file:?}: which {name}?"))
    }

    /// The item as the document shows it.
    pub(crate) fn show(&self, item: &Item) -> String {
        let Some(container) = &item.container else {
            let path = self.exports.path(&item.file, &item.name);
            let path = path.unwrap_or_else(|| panic!("{} is not public", item.place()));
            return if item.kind == Kind::Function { format!("{path}(…)") } else { path };
        };
        let container = match item.kind {
            Kind::VariantField => self.variant_named(container, &item.file),
            _ => self.type_named(container, &item.file),
        };
        let path = self.show(container);
        let receiver = RECEIVERS.iter().find(|(name, _)| *name == path).map(|(_, value)| value);
        let arguments = if item.has_arguments { "(…)" } else { "()" };
        match (item.kind, receiver) {
            (Kind::Method, Some(receiver)) => format!("{receiver}.{}{arguments}", item.name),
            (Kind::Method | Kind::Function, _) => format!("{path}::{}{arguments}", item.name),
            (Kind::Field, Some(receiver)) => format!("{receiver}.{}", item.name),
            _ => format!("{path}::{}", item.name),
        }
    }
}

impl Item {
    pub(crate) fn place(&self) -> String {
        format!("src/{}:{}: {}", self.file.display(), self.line, self.name)
    }
}

/// Lists the Rust files below a directory, relative to the root.
fn list(root: &Path, directory: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("simulator") {
            list(root, &path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path.strip_prefix(root).unwrap().to_owned());
        }
    }
}

/// The public items of a file, and all others with a C name.
fn items_of(file: &Path, text: &str) -> Vec<Item> {
    let lines: Vec<&str> = text.lines().collect();
    // The tests are at the end. Before them there may be test modules in files of their own.
    let begin_tests = |pair: &[&str]| {
        let is_for_tests =
            ["#[cfg(test)]", "#[cfg(all(test"].iter().any(|&c| pair[0].starts_with(c));
        is_for_tests && pair[1].starts_with("mod ") && pair[1].ends_with('{')
    };
    let end = lines.windows(2).position(begin_tests).unwrap_or(lines.len());
    let lines = &lines[..end];
    let mut items = Vec::new();
    let mut aliases = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let code = line.trim_start();
        let alias = code.strip_prefix("#[doc(alias = \"").and_then(|end| end.strip_suffix("\")]"));
        if let Some(alias) = alias.filter(|alias| !alias.contains('"')) {
            aliases.push(alias.to_owned());
            continue;
        }
        assert!(!code.contains("doc(alias"), "{file:?}:{}: write one alias a line", index + 1);
        if code.starts_with("///") || code.starts_with("#[") {
            continue;
        }
        let is_declared = || {
            let head = head(lines, index).unwrap_or_default();
            head.starts_with("pub enum ") || head.ends_with("! {")
        };
        if code.starts_with("pub ") || !aliases.is_empty() || is_declared() {
            items.extend(item_at(file, lines, index, std::mem::take(&mut aliases)));
        }
    }
    items
}

/// The line that opens the block of a line, without its indentation.
fn head<'a>(lines: &[&'a str], index: usize) -> Option<&'a str> {
    let indentation = |line: &str| line.len() - line.trim_start().len();
    let own = indentation(lines[index]);
    let mut before = lines[..index].iter().rev().filter(|line| !line.trim().is_empty());
    before.find(|line| indentation(line) < own).map(|line| line.trim_start())
}

/// The item that begins at this line; `None` if there is none, and no C name.
fn item_at(file: &Path, lines: &[&str], index: usize, aliases: Vec<String>) -> Option<Item> {
    let head = head(lines, index).unwrap_or_default();
    let Some((kind, name, rest)) = parse(lines[index].trim_start(), head) else {
        assert!(aliases.is_empty(), "{file:?}:{}: no item for {aliases:?}", index + 1);
        return None;
    };
    let mut item = Item {
        kind,
        name: name.to_owned(),
        container: if kind == Kind::Type { None } else { container(head) },
        file: file.to_owned(),
        line: index + 1,
        aliases,
        type_name: String::new(),
        has_arguments: false,
    };
    match kind {
        Kind::Function => {
            let function = lines[index..].join(" ");
            let mut arguments = arguments(&function).split(',').map(str::trim).peekable();
            let selfs = ["self", "mut self", "&self", "&mut self"];
            if arguments.next_if(|first| selfs.contains(first)).is_some() {
                item.kind = Kind::Method;
            }
            item.has_arguments = arguments.any(|argument| !argument.is_empty());
        }
        Kind::Field => {
            // The elements' type: of `PerInput<UniConfig>` or `[IrInput; 5]`.
            let element = rest.split_once('<').map_or(rest, |(_, element)| element);
            item.type_name = word(element.trim_start_matches([':', ' ', '['])).to_owned();
        }
        _ => {}
    }
    Some(item)
}

/// The kind and the name of the item that a line begins, and the rest of the line. The head of its
/// block decides the kind where the line does not.
fn parse<'a>(code: &'a str, head: &str) -> Option<(Kind, &'a str, &'a str)> {
    let public = code.strip_prefix("pub ");
    let rest = public.unwrap_or(code);
    let rest = if rest.starts_with("const fn ") { &rest["const ".len()..] } else { rest };
    let keyword = match word(rest) {
        "struct" | "enum" | "type" => Some(Kind::Type),
        "const" => Some(Kind::Constant),
        "fn" => Some(Kind::Function),
        _ => None,
    };
    let rest = if keyword.is_some() { rest[word(rest).len()..].trim_start() } else { rest };
    let name = word(rest);
    let rest = &rest[name.len()..];
    let is_named = name.starts_with(char::is_alphabetic) && !head.contains('$');
    let kind = keyword.or_else(|| match () {
        // The macros that declare terminals and ids.
        () if head.ends_with("! {") => (rest.starts_with([':', ' '])).then_some(Kind::Type),
        () if public.is_some() => rest.starts_with(':').then_some(Kind::Field),
        () if rest.starts_with(": ") => Some(Kind::VariantField),
        () if head.starts_with("pub enum ") => Some(Kind::Variant),
        () => rest.starts_with(" = ").then_some(Kind::Variant),
    });
    kind.filter(|_| is_named).map(|kind| (kind, name, rest))
}

/// The name or keyword at the start.
fn word(code: &str) -> &str {
    let end = code.find(|c: char| !c.is_alphanumeric() && c != '_');
    &code[..end.unwrap_or(code.len())]
}

/// The type that a block with this head belongs to.
fn container(head: &str) -> Option<String> {
    let words = head.trim_end_matches('{').trim_end();
    let name = match words.strip_prefix("impl") {
        Some(words) => words.rsplit(' ').next()?,
        None => {
            words.strip_prefix("pub struct ").or(words.strip_prefix("pub enum ")).unwrap_or(words)
        }
    };
    let name = name.split('<').next()?;
    name.chars().all(char::is_alphanumeric).then(|| name.to_owned()).filter(|name| !name.is_empty())
}

/// The text between the first parentheses of a function.
fn arguments(function: &str) -> &str {
    let start = function.find('(').map_or(0, |start| start + 1);
    let mut depth = 1;
    let end = function[start..].find(|c| {
        depth += match c {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        depth == 0
    });
    &function[start..start + end.unwrap_or(0)]
}
