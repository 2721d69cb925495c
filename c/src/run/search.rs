//! Where a compiler looks for headers. It says that itself: options, variables and its own folders have an order of their own.

use std::path::PathBuf;

use crate::read;

/// The folders in which a compiler looks for headers, in its order.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Folders {
    /// Those for quoted includes alone, which come before all others.
    pub(crate) quoted: Vec<PathBuf>,
    pub(crate) all: Vec<PathBuf>,
    /// Those among them that the compiler has by itself.
    pub(crate) system: Vec<PathBuf>,
}

impl Folders {
    /// From what a compiler says of itself (`-v`) with the user's options and alone. `None` if it does not name its
    /// folders.
    pub(crate) fn read(said: &[u8], said_alone: &[u8]) -> Option<Self> {
        let all = list(said, "<...>")?;
        let quoted = list(said, "\"...\"").unwrap_or_default();
        Some(Self { quoted, all, system: list(said_alone, "<...>").unwrap_or_default() })
    }
}

/// The lines below a heading. Each begins with a space.
fn list(said: &[u8], of: &str) -> Option<Vec<PathBuf>> {
    let heading = format!("{of} search starts here");
    let mut lines = said.split(|byte| *byte == b'\n');
    lines.find(|line| String::from_utf8_lossy(line).contains(&heading))?;
    let folders = lines.map_while(|line| line.strip_prefix(b" "));
    Some(folders.filter_map(|name| read::path(name.trim_ascii_end())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const GCC: &str =
        "ignoring nonexistent directory \"gone\"\n#include \"...\" search starts here:\n q q\n\
        #include <...> search starts here:\n inc\r\n /usr/include\nEnd of search list.\n more\n";

    #[test]
    fn the_lists_of_a_compiler_are_read() {
        let alone = "#include \"...\" search starts here:\n#include <...> search starts here:\n /usr/include\n";
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let expected = Folders {
            quoted: paths(&["q q"]),
            all: paths(&["inc", "/usr/include"]),
            system: paths(&["/usr/include"]),
        };
        assert_eq!(Folders::read(GCC.as_bytes(), alone.as_bytes()), Some(expected));
        assert_eq!(Folders::read(b"tcc version 0.9.27\n", alone.as_bytes()), None);
    }
}
