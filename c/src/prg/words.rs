//! What the runtime says about a program, on the error output.

use std::env;
use std::path::PathBuf;
use std::sync::OnceLock;

use crate::sentences;

/// The program's name, for sentences and for the program itself.
pub(super) fn program_name() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let program = env::args_os().next().map(PathBuf::from);
        let name = program.as_deref().and_then(|path| path.file_stem());
        name.map_or_else(|| "the program".into(), |name| name.to_string_lossy().into_owned())
    })
}

/// Says a sentence when no motor turns, which waits for who reads it.
pub(super) fn say(sentence: &str) {
    sentences::write_last(&format!("{}: {sentence}\n", program_name()));
}
