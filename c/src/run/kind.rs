//! The kinds of programs.

use std::fmt;

/// What a program was written for. Its sources include the header that says so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// `PrgInit` and `PrgTic`, downloaded to a ROBO TX.
    Downloaded,
    /// A PC program for ftMscLib.
    MscLib,
    /// A program with a `main` that ran on the TXT itself.
    KeLib,
    /// The class of the TXT's kit 4.1.6.
    Kit,
    /// FtTxtLib, the TXT's kit 4.6.6.
    FtTxtLib,
}

/// The headers that tell the kind, in lower case. The first that is included tells it, so those that others
/// bring along come last.
const HEADERS: &[(&str, Kind)] = &[
    ("fttxtlib.h", Kind::FtTxtLib),
    ("ftprointerface2013transferareacomex2.h", Kind::FtTxtLib),
    ("ftprointerface2013transferareacomex1.h", Kind::FtTxtLib),
    ("kelibtxtdl.h", Kind::KeLib),
    ("ftprointerface2013transferareacom.h", Kind::Kit),
    ("ftmsclib.h", Kind::MscLib),
    ("robo_tx_prg.h", Kind::Downloaded),
    ("fterrcode.h", Kind::MscLib),
    ("robo_tx_fw.h", Kind::Downloaded),
    ("ftshmem.h", Kind::KeLib),
];

impl Kind {
    /// The kind of a program whose sources include these names, in lower case and without folders.
    pub(crate) fn of<'a>(included: impl Iterator<Item = &'a str> + Clone) -> Option<Self> {
        HEADERS
            .iter()
            .find(|(header, _)| included.clone().any(|name| name == *header))
            .map(|(_, kind)| *kind)
    }

    /// The folders of its headers, in the folder of all headers.
    pub(crate) fn folders(self) -> &'static [&'static str] {
        const OWN: &[&[&str]] = if cfg!(windows) {
            &[&[""], &["txt"], &["kit"], &["fttxtlib"]]
        } else {
            &[&["", "posix"], &["txt", "posix"], &["kit", "posix"], &["fttxtlib", "posix"]]
        };
        match self {
            Self::Downloaded | Self::MscLib => OWN[0],
            Self::KeLib => OWN[1],
            Self::Kit => OWN[2],
            Self::FtTxtLib => OWN[3],
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Downloaded => "a program with PrgTic for the ROBO TX",
            Self::MscLib => "a PC program for ftMscLib",
            Self::KeLib => "a program for the TXT itself",
            Self::Kit => "a program for the TXT's kit 4.1.6",
            Self::FtTxtLib => "a program for FtTxtLib",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_that_brings_others_along_tells_the_kind() {
        let of = |names: &[&str]| Kind::of(names.iter().copied());
        assert_eq!(of(&["stdio.h", "robo_tx_fw.h", "ftmsclib.h"]), Some(Kind::MscLib));
        assert_eq!(of(&["robo_tx_prg.h"]), Some(Kind::Downloaded));
        assert_eq!(of(&["ftshmem.h", "kelibtxtdl.h"]), Some(Kind::KeLib));
        let ex2 = ["ftprointerface2013transferareacom.h", "ftprointerface2013transferareacomex2.h"];
        assert_eq!((of(&ex2[..1]), of(&ex2)), (Some(Kind::Kit), Some(Kind::FtTxtLib)));
        assert_eq!(of(&["stdio.h"]), None);
    }
}
