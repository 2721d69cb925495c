//! The kinds of programs.

use std::fmt;

use crate::sources::without_texts;

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
    /// The classes of the TXT's kit 4.6.6, which has its header under the same name.
    Kit466,
    /// FtTxtLib, the TXT's kit 4.6.6.
    FtTxtLib,
}

const KELIB: &str = "kelibtxtdl.h";

/// The headers that show the kind, in lower case. The first that is included decides, so those that others
/// bring along come last.
const HEADERS: &[(&str, Kind)] = &[
    ("fttxtlib.h", Kind::FtTxtLib),
    ("ftprointerface2013transferareacomex2.h", Kind::FtTxtLib),
    ("ftprointerface2013transferareacomex1.h", Kind::FtTxtLib),
    (KELIB, Kind::KeLib),
    ("ftprointerface2013transferareacom.h", Kind::Kit),
    ("ftmsclibex.h", Kind::MscLib),
    ("ftmsclib.h", Kind::MscLib),
    ("robo_tx_prg.h", Kind::Downloaded),
    ("fterrcode.h", Kind::MscLib),
    ("robo_tx_fw.h", Kind::Downloaded),
    ("ftshmemtxt.h", Kind::Kit466),
    ("ftshmem.h", Kind::KeLib),
];

/// Those of the TXT that no compiler for C has ever taken: that for downloaded programs has `extern "C"` as it stands,
/// and the others have classes. Each is the beginning of a name.
const IN_CPP: [&str; 3] = ["kelibtxtdl.h", "ftprointerface2013transferareacom", "fttxtlib.h"];

/// Whether a header, named in lower case and without folders, is one of the TXT in C++.
pub(crate) fn is_in_cpp(name: &str) -> bool {
    IN_CPP.iter().any(|beginning| name.starts_with(beginning))
}

/// What programs use of kit 4.6.6 that kit 4.1.6 does not have.
const OF_KIT_4_6_6: &[&str] = &["IF_TXT_MAX", "ShmIfId_TXT", "AreaComHandlerEx", "DoTransfer("];

impl Kind {
    /// The kind of a program: by the names that its sources include, in lower case and without folders, and by the
    /// text of its files where two kits have the same names.
    pub(crate) fn of<'a>(
        included: impl Iterator<Item = &'a str> + Clone,
        mut texts: impl Iterator<Item = &'a [u8]> + Clone,
    ) -> Option<Self> {
        let has = |header: &str| included.clone().any(|name| name == header);
        match HEADERS.iter().find(|(header, _)| has(header))?.1 {
            // It may include that of FtTxtLib only when something is defined.
            Self::FtTxtLib if has(KELIB) && !texts.clone().any(is_for_ft_txt_lib) => {
                Some(Self::KeLib)
            }
            Self::Kit if texts.any(is_of_kit_4_6_6) => Some(Self::Kit466),
            kind => Some(kind),
        }
    }

    /// Whether it is for the TXT, whose compiler was g++.
    pub(crate) fn is_for_txt(self) -> bool {
        match self {
            Self::KeLib | Self::Kit | Self::Kit466 | Self::FtTxtLib => true,
            Self::Downloaded | Self::MscLib => false,
        }
    }

    /// The folders of its headers, in the folder of all headers.
    pub(crate) fn folders(self) -> &'static [&'static str] {
        match self {
            Self::Downloaded | Self::MscLib => &[""],
            Self::KeLib => &["txt"],
            Self::Kit => &["kit"],
            Self::Kit466 => &["kit466", "kit"],
            Self::FtTxtLib => &["fttxtlib"],
        }
    }
}

/// Whether its class is used.
fn is_for_ft_txt_lib(text: &[u8]) -> bool {
    String::from_utf8_lossy(&without_texts(text)).contains("AreaComHandlerEx2")
}

fn is_of_kit_4_6_6(text: &[u8]) -> bool {
    let text = String::from_utf8_lossy(&without_texts(text)).replace(' ', "");
    OF_KIT_4_6_6.iter().any(|name| text.contains(name))
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Downloaded => "a program with PrgTic for the ROBO TX",
            Self::MscLib => "a PC program for ftMscLib",
            Self::KeLib => "a program for the TXT itself",
            Self::Kit => "a program for the TXT's kit 4.1.6",
            Self::Kit466 => "a program for the TXT's kit 4.6.6",
            Self::FtTxtLib => "a program for FtTxtLib",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_that_brings_others_along_tells_the_kind() {
        let of = |names: &[&str]| Kind::of(names.iter().copied(), std::iter::empty());
        assert_eq!(of(&["stdio.h", "robo_tx_fw.h", "ftmsclib.h"]), Some(Kind::MscLib));
        assert_eq!(of(&["robo_tx_prg.h"]), Some(Kind::Downloaded));
        assert_eq!(of(&["ftshmem.h", "kelibtxtdl.h"]), Some(Kind::KeLib));
        let ex2 = ["ftprointerface2013transferareacom.h", "ftprointerface2013transferareacomex2.h"];
        assert_eq!((of(&ex2[..1]), of(&ex2)), (Some(Kind::Kit), Some(Kind::FtTxtLib)));
        assert_eq!(of(&["stdio.h"]), None);
    }

    #[test]
    fn a_program_with_two_headers_of_the_txt_is_for_the_one_that_is_used() {
        let of = |text: &str| {
            let names = ["fttxtlib.h", "kelibtxtdl.h"];
            Kind::of(names.into_iter(), std::iter::once(text.as_bytes()))
        };
        assert_eq!(of("StartTxtDownloadProg();"), Some(Kind::KeLib));
        assert_eq!(of("ftIF2013TransferAreaComHandlerEx2 com;"), Some(Kind::FtTxtLib));
    }

    #[test]
    fn the_two_kits_with_one_header_are_told_apart_by_what_is_used() {
        let of = |text: &str| {
            let names = ["ftprointerface2013transferareacom.h"];
            Kind::of(names.into_iter(), std::iter::once(text.as_bytes()))
        };
        assert_eq!(of("com.DoTransferCompressed(); com.DoTransferSimple();"), Some(Kind::Kit));
        assert_eq!(of("// com.DoTransfer();\nputs(\"DoTransfer() failed\");"), Some(Kind::Kit));
        for text in ["new X[IF_TXT_MAX]", "ShmIfId_TXT::LOCAL_IO", "com -> DoTransfer ()"] {
            assert_eq!(of(text), Some(Kind::Kit466), "{text}");
        }
        assert_eq!(of("ftIF2013TransferAreaComHandlerEx *com;"), Some(Kind::Kit466));
    }
}
