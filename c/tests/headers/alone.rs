//! Each header can be included alone, and twice.

use super::compilers::{self, Language};

pub(crate) const HEADERS: [&str; 6] =
    ["ROBO_TX_PRG.h", "ROBO_TX_FW.h", "ftMscLib.h", "ftMscLibEx.h", "ftErrCode.h", "common.h"];

/// Those that replace headers of Windows.
pub(crate) const POSIX: [&str; 19] = [
    "windows.h",
    "conio.h",
    "process.h",
    "tchar.h",
    "winsock2.h",
    "ws2tcpip.h",
    "wincon.h",
    "winuser.h",
    "mmsystem.h",
    "stdafx.h",
    "SDKDDKVer.h",
    "targetver.h",
    "windef.h",
    "winbase.h",
    "io.h",
    "direct.h",
    "share.h",
    "crtdbg.h",
    "strsafe.h",
];

#[cfg_attr(windows, ignore = "zig takes too long for many small sources under Wine")]
#[test]
fn each_header_stands_alone() {
    let posix = POSIX.into_iter().filter(|_| cfg!(not(windows)));
    for header in HEADERS.into_iter().chain(posix) {
        let source =
            format!("#include <{header}>\n#include <{header}>\nint main(void) {{ return 0; }}\n");
        for compiler in compilers::all() {
            // Those between are for all headers together.
            compiler.check_ends(&source);
        }
    }
}

/// The checks here can fail.
#[test]
fn a_wrong_source_is_seen() {
    for compiler in compilers::all() {
        let source = "#include <ROBO_TX_FW.h>\nTA_INFO_ info;\n";
        let standard = if compiler.language == Language::C { "c89" } else { "c++98" };
        let said = compiler.check(standard, &[], source).unwrap_err();
        assert!(said.contains("TA_INFO_"), "{said}");
    }
}
