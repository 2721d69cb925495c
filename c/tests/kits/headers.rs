//! The headers of the kits and of `KeLibTxtDl.h`, in every standard and with every compiler.

use std::fmt::Write;
use std::path::Path;

use super::support::{compilers, include};
use crate::headers::compilers::Language;

const KELIB_ERRORS: &str = include_str!("kelib_errors.csv");
const FIELDS: &str = include_str!("../../../tests/system/porting/transfer_area.csv");

/// Whether a source compiles without a warning.
fn check(program: &str, folder: &str, standard: &str, source: &str, name: &str) {
    let build = Path::new(env!("CARGO_TARGET_TMPDIR")).join("kits");
    std::fs::create_dir_all(&build).unwrap();
    let file = build.join(name.replace(' ', "_"));
    std::fs::write(&file, source).unwrap();
    let mut command = crate::compiler(program);
    command.arg(format!("-std={standard}")).args(["-Wall", "-Wextra", "-Werror"]);
    crate::check_only(&mut command, &file);
    command.arg("-I").arg(include(folder)).arg("-I").arg(include(folder).join("Common"));
    // What the header of kit 4.6.6 finds in that of 4.1.6, and what programs use of Windows.
    for folder in ["kit", "kit/Common"].into_iter().chain(cfg!(unix).then_some("posix")) {
        command.arg("-I").arg(include(folder));
    }
    let output = command.arg(&file).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} -std={standard} {folder}: {said}");
}

#[test]
fn every_field_is_where_the_controller_has_it() {
    let mut checks = String::new();
    for line in FIELDS.lines().skip(1) {
        let mut values = line.split(',');
        let mut next = || values.next().unwrap();
        let (field, offset, size) = (next(), next(), next());
        if field == "FISH_X1_TRANSFER" {
            writeln!(checks, "CHECK(sizeof(FISH_X1_TRANSFER) == {size});").unwrap();
        } else {
            writeln!(checks, "CHECK(offsetof(FISH_X1_TRANSFER, {field}) == {offset});").unwrap();
            writeln!(checks, "CHECK(sizeof(((FISH_X1_TRANSFER *)0)->{field}) == {size});").unwrap();
        }
    }
    assert!(checks.lines().count() > 200);
    for (folder, header) in
        [("txt", "FtShmem.h"), ("kit", "FtShmemTxt.h"), ("fttxtlib", "FtShmemTxt.h")]
    {
        let source = format!(
            "#include <stddef.h>\n#include \"{header}\"\n#define CHECK(what) static_assert(what, #what)\n\
             {checks}"
        );
        for compiler in compilers() {
            check(compiler, folder, "c++11", &source, &format!("layout_{folder}_{compiler}.cpp"));
        }
    }
}

#[test]
fn the_codes_of_kelib_have_their_values() {
    let mut source = "#include \"KeLibTxtDl.h\"\n".to_owned();
    for line in KELIB_ERRORS.lines().skip(1) {
        let (name, value) = line.split_once(';').unwrap();
        writeln!(source, "static_assert({name} == {value}, \"{name}\");").unwrap();
    }
    for compiler in compilers() {
        check(compiler, "txt", "c++11", &source, &format!("codes_{compiler}.cpp"));
    }
}

/// What programs for the TXT itself use of the header besides the areas' fields.
#[test]
fn the_names_of_the_txts_header_are_there() {
    let source = "#include \"KeLibTxtDl.h\"\n\
        static void of_i2c(struct shm_if_s *, I2C_CB *data) { data->status = I2C_READ_ERROR; }\n\
        static void of_bt(struct shm_if_s *, BT_CB *data) { data->status = BT_SWITCHED_OFF; }\n\
        static void of_message(struct shm_if_s *, BT_RECV_CB *data) { data->msg[BT_MSG_LEN - 1] = 0; }\n\
        P_I2C_CB_FUNC i2c = of_i2c;\nP_CB_FUNC bt = of_bt;\nP_RECV_CB_FUNC message = of_message;\n\
        enum CB_I2cStatus status = I2C_WRITE_ERROR;\nenum BtConnState state = BT_STATE_CONNECTED;\n\
        BT_SCAN_STATUS found;\nenum BtInquiryScanStatus scan = BT_INQUIRY_SCAN_END;\n\
        struct _IR_DATA remotes[NUM_OF_IR_RECEIVER + 1];\nFISH_X1_TRANSFER areas[NUM_OF_TXT_MODULES];\n\
        char letter = areas[0].ftX1state.local_pgm.name[0];\n\
        bool has_hook = areas[0].IFHookTable.IsRunAllowed != 0 || areas[0].IFHookTable.atoi != 0;\n\
        static_assert(sizeof areas[0].reserved == RESERVE_SIZE, \"the rest\");\n\
        static_assert(sizeof(HOOK_TABLE) == 35 * 4, \"35 addresses\");\n";
    let boolean = "#include \"ftProInterface2013TransferAreaCom.h\"\nboolean done = false;\n";
    for compiler in compilers() {
        check(compiler, "txt", "c++11", source, &format!("names_{compiler}.cpp"));
        for folder in ["kit", "kit466", "fttxtlib"] {
            check(compiler, folder, "c++11", boolean, &format!("boolean_{folder}_{compiler}.cpp"));
        }
    }
}

#[cfg_attr(windows, ignore = "zig takes too long for many small sources under Wine")]
#[test]
fn the_headers_compile_in_every_standard() {
    let kit = "#include <iostream>\n#include \"../Common/ftProInterface2013TransferAreaCom.h\"\n\
               #include \"ftProInterface2013JpegDecode.h\"\nusing namespace std;\nSOCKET s;\n";
    let kelib = "#include <stdint.h>\n#include \"KeLibTxtDl.h\"\n#include \"FtShmem.h\"\n\
                 #include <stdint.h>\nuint32_t a; INT16 b; BOOL32 c; struct shm_if_s *area;\n";
    let ex2 = "#include \"FtTxtLib.h\"\n#include <iostream>\n#include <windows.h>\nusing namespace std;\n";
    let common = "#include \"common.h\"\n#include \"KeLibTxtDl.h\"\nBOOL32 a; UINT16 b;\n";
    for compiler in compilers() {
        for standard in ["c++98", "c++20"] {
            check(compiler, "txt", standard, common, &format!("common_{compiler}_{standard}.cpp"));
        }
        for standard in Language::Cpp.standards() {
            check(compiler, "kit", standard, kit, &format!("kit_{compiler}_{standard}.cpp"));
            check(compiler, "txt", standard, kelib, &format!("txt_{compiler}_{standard}.cpp"));
        }
        let programs = [
            ("kit", "c++98", include_str!("programs/kit.cpp")),
            ("txt", "c++11", include_str!("programs/kelib.cpp")),
            ("kit466", "c++11", include_str!("programs/kit466.cpp")),
            ("kit466", "c++20", include_str!("programs/kit466.cpp")),
            ("fttxtlib", "c++11", include_str!("programs/ex2.cpp")),
        ];
        for (folder, standard, source) in programs {
            check(compiler, folder, standard, source, &format!("program_{folder}_{compiler}.cpp"));
        }
        for standard in Language::Cpp.standards().iter().filter(|name| **name != "c++98") {
            let source = match cfg!(windows) {
                true => ex2.to_owned(),
                false => ex2.replace("<windows.h>", "\"../posix/windows.h\""),
            };
            check(
                compiler,
                "fttxtlib",
                standard,
                &source,
                &format!("ex2_{compiler}_{standard}.cpp"),
            );
        }
    }
    for compiler in crate::compilers_of(&["gcc", "clang"], "zig cc") {
        if !crate::is_here(compiler) {
            eprintln!("skipped: {compiler} is not here");
            continue;
        }
        for standard in ["c99", "c11"] {
            check(compiler, "txt", standard, kelib, &format!("txt_{compiler}_{standard}.c"));
        }
    }
}
