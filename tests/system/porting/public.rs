//! The path of an item from outside the crate, by the crate's `pub use` lines.

use std::fs;
use std::path::Path;

/// One name, or all names of a module, that a public module offers.
struct Export {
    /// The public module, followed by `::`; empty for the crate's root.
    module: String,
    /// The module that the name comes from.
    from: String,
    /// `*` for all.
    name: String,
}

pub(crate) struct Exports {
    exports: Vec<Export>,
    /// The public modules.
    modules: Vec<String>,
}

impl Exports {
    pub(crate) fn read(root: &Path) -> Self {
        let library = fs::read_to_string(root.join("lib.rs")).unwrap();
        let mut exports = Vec::new();
        collect(&library, "", &mut exports);
        let declared = library.lines().filter_map(|line| line.strip_prefix("pub mod "));
        let declared = declared.map(|name| name.trim_end_matches(';').to_owned());
        // A public module that is a single file is for the fuzzers, and not really public.
        let modules: Vec<String> = declared.filter(|name| root.join(name).is_dir()).collect();
        for module in &modules {
            let text = fs::read_to_string(root.join(module).join("mod.rs")).unwrap();
            collect(&text, &format!("{module}::"), &mut exports);
        }
        Self { exports, modules }
    }

    /// The shortest path to the item of this file with this name.
    pub(crate) fn path(&self, file: &Path, name: &str) -> Option<String> {
        // The file's module and its parents; each of them may be named in a `pub use`.
        let without_ending = file.with_extension("");
        let home: Vec<_> = without_ending.iter().map(|part| part.to_string_lossy()).collect();
        let exported = self.exports.iter().filter(|export| {
            (export.name == name || export.name == "*")
                && home.iter().any(|module| *module == export.from)
        });
        let own = self.modules.iter().filter(|module| home == [module.as_str(), "mod"]);
        let paths = exported.map(|export| format!("{}{name}", export.module));
        paths.chain(own.map(|module| format!("{module}::{name}"))).min_by_key(String::len)
    }
}

/// Collects what the `pub use` statements of a module offer.
fn collect(text: &str, module: &str, exports: &mut Vec<Export>) {
    for statement in text.split("\npub use ").skip(1) {
        let statement = statement.split(';').next().unwrap_or_default();
        let (path, names) = statement.rsplit_once("::").unwrap();
        let from = path.rsplit("::").next().unwrap_or(path);
        for name in names.trim_matches(['{', '}']).split(',') {
            exports.push(Export {
                module: module.to_owned(),
                from: from.to_owned(),
                name: name.trim().to_owned(),
            });
        }
    }
}
