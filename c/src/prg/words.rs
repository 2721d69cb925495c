//! What the runtime says about a program, on the error output.

use std::env;
use std::path::PathBuf;
use std::sync::OnceLock;

use crate::report::write_line;

/// The program's name, for sentences and for the program itself.
pub(super) fn program_name() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let program = env::args_os().next().map(PathBuf::from);
        let name = program.as_deref().and_then(|path| path.file_stem());
        name.map_or_else(|| "the program".into(), |name| name.to_string_lossy().into_owned())
    })
}

/// Says a sentence.
pub(super) fn say(sentence: &str) {
    write_line(&format!("{}: {sentence}", program_name()));
}
