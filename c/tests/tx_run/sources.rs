//! Programs as they are found: with old headers, other spellings, in several files, in C++.

#[cfg(target_os = "linux")]
use std::process::Command;

use super::support::{has_compiler, run_files, tx_run, txt, wait_for, write, Run};

const REST: &str = "void PrgInit(TA *p, int n) { other(); }\nint PrgTic(TA *p, int n) { return sizeof(UINT32) - 4; }\n";

#[test]
fn headers_may_be_spelled_in_many_ways() {
    if !has_compiler() {
        return;
    }
    let own = "#include \"ROBO_TX_FW.h\"\nvoid other(void);\n";
    let other = "#include \"..\\inc\\own.h\"\nvoid other(void) {}\n";
    for spelling in [
        "\"ROBO_TX_PRG.H\"",
        "<robo_tx_prg.h>",
        "\"../../Common/ROBO_TX_PRG.h\"",
        "\"..\\ROBO_TX_PRG.h\"",
    ] {
        let main = format!("#include {spelling}\n#include \"../inc/own.h\"\n{REST}");
        let files = [("src/a.c", &*main), ("src/b.c", other), ("inc/own.h", own)];
        run_files(&files, &["src/a.c", "src/b.c"]).well();
    }
}

#[test]
fn headers_of_that_time_beside_the_program_are_not_used() {
    if !has_compiler() {
        return;
    }
    let main = format!("#include \"../inc/ROBO_TX_PRG.h\"\n#include \"own.h\"\n{REST}");
    let files = [
        ("src/a.c", &*main),
        ("src/own.h", "#include \"../inc/ROBO_TX_FW.h\"\nstatic void other(void) {}\n"),
        ("inc/ROBO_TX_PRG.h", "#include \"ROBO_TX_FW.h\"\n#error old\n"),
        ("inc/ROBO_TX_FW.h", "typedef unsigned long UINT32;\n"),
    ];
    run_files(&files, &["src/a.c"]).well();
    // Messages still name the file as it was given.
    let wrong = format!("{main}\nint f(void) {{ return nonsense; }}\n");
    let files = [("src/a.c", &*wrong), files[1], files[2], files[3]];
    let ended = run_files(&files, &["src/a.c"]);
    ended.badly("src/a.c does not compile");
    assert!(ended.err.contains("src/a.c:6:"), "{}", ended.err);
}

#[test]
fn a_program_may_be_cpp() {
    if !has_compiler() {
        return;
    }
    let source = "#include <string>\n#include \"ROBO_TX_PRG.h\"\nstatic std::string text;\n\
                  extern \"C\" void PrgInit(TA *p, int n) { text = \"abc\"; }\n\
                  extern \"C\" int PrgTic(TA *p, int n) { return text.size() - 3; }\n";
    run_files(&[("a.cpp", source)], &["a.cpp"]).well();
}

#[test]
fn a_program_with_main_gets_its_arguments_and_the_host() {
    if !has_compiler() {
        return;
    }
    let source = "#include <stdio.h>\n#include <stdlib.h>\nint main(int n, char **arguments) {\n\
                  printf(\"%d %s %d\\n\", n, arguments[1], getenv(\"FT_TXT_HOST\") != NULL);\nreturn 0; }\n";
    let ended = run_files(&[("a.c", source)], &["a.c", "--world", "slide", "--", "--host"]);
    ended.well();
    assert_eq!(ended.out, "2 --host 1\n");
    assert!(ended.err.contains("on a simulated TXT at 127.0.0.1:"), "{}", ended.err);
    assert!(ended.err.contains("with the world slide"), "{}", ended.err);
}

/// When the program is killed, `tx_run` stops the same controller, also if there are others by then.
#[test]
fn a_program_on_the_only_controller_gets_its_address() {
    if !has_compiler() {
        return;
    }
    let txt = ft_transfer_area_simulator::SimulatedTxt::builder().start().unwrap();
    let source = "#include <stdio.h>\n#include <stdlib.h>\n\
                  int main(void) { puts(getenv(\"FT_TXT_HOST\")); return 0; }\n";
    let auto = format!("Auto:{}", txt.address().port());
    let ended = run_files(&[("a.c", source)], &["a.c", "--host", &auto]);
    ended.well();
    assert_eq!(ended.out, format!("{}\n", txt.address()));
    assert!(ended.err.contains(&format!("on the TXT at {}", txt.address())), "{}", ended.err);
}

/// Runs a program with a `main` that turns M1 until I1 is pressed.
fn drives(name: &str, source: &str) {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), name, source);
    let run = Run::start(
        tx_run(&[name, "--host", &txt.address().to_string()]).current_dir(folder.path()),
    );
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
    run.end().well();
    wait_for(&txt, "the motor is off", |machine| machine.controllers[0].outputs.duty == [0; 8]);
}

#[test]
fn a_program_for_the_txt_itself_runs() {
    drives(
        "main.cpp",
        "#include <stdio.h>\n#include <unistd.h>\n#include \"KeLibTxtDl.h\"\n#include \"FtShmem.h\"\n\
         unsigned int DebugFlags;\nFILE *DebugFile;\n\
         int main(void) {\nif (StartTxtDownloadProg() != KELIB_ERROR_NONE) return 1;\n\
         FISH_X1_TRANSFER *area = GetKeLibTransferAreaMainAddress();\n\
         area->ftX1out.duty[0] = 300;\n\
         while (!area->ftX1in.uni[0]) usleep(1000);\n\
         StopTxtDownloadProg();\nreturn 0;\n}\n",
    );
}

#[test]
fn a_world_has_the_supply_that_a_program_for_the_txt_reads() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(
        folder.path(),
        "main.cpp",
        "#include <stdio.h>\n#include \"KeLibTxtDl.h\"\n#include \"FtShmem.h\"\n\
         unsigned int DebugFlags;\nFILE *DebugFile;\n\
         int main(void) {\nif (StartTxtDownloadProg() != KELIB_ERROR_NONE) return 1;\n\
         const auto &now = GetKeLibTransferAreaMainAddress()->sTxtInputs;\n\
         printf(\"%d %d %d\", now.u16TxtPower, now.u16TxtTemp, now.u16TxtRef);\n\
         StopTxtDownloadProg();\nreturn 0;\n}\n",
    );
    write(folder.path(), "empty.toml", "[supply]\npower = 6500\nreference = 3200\n");
    let run = |world: &str, power: &str| {
        let mut command = tx_run(&["main.cpp", "--world", world]);
        let command = command.current_dir(folder.path()).env("FT_TXT_POWER", power);
        let ended = Run::start(command).end();
        ended.well();
        ended.out
    };
    assert_eq!(run("empty.toml", ""), "6500 40 3200");
    assert_eq!(run("empty.toml", "7000"), "7000 40 3200", "who runs it decides");
    assert_eq!(run("default", ""), "8400 40 3300");
}

/// Its compiler was g++, which takes `.c` for C++.
#[test]
fn a_program_for_the_txt_may_be_cpp_in_files_named_c() {
    drives(
        "main.c",
        "#include \"KeLibTxtDl.h\"\n#include <unistd.h>\nstruct step { int duty; };\nstatic step plan[] = {{300}};\n\
         int main() {\nif (StartTxtDownloadProg() != KELIB_ERROR_NONE) return 1;\n\
         FISH_X1_TRANSFER *area = GetKeLibTransferAreaMainAddress();\n\
         for (step &one : plan) area->ftX1out.duty[0] = one.duty;\n\
         while (!area->ftX1in.uni[0]) usleep(1000);\nStopTxtDownloadProg();\nreturn 0;\n}\n",
    );
}

#[test]
fn a_file_named_c_is_in_the_language_that_its_program_shows() {
    if !has_compiler() {
        return;
    }
    let main = "#include \"own.h\"\nint main() { bool done = other() == 0; return done - 1; }\n";
    // Each is one of both languages alone.
    let cpp = "int other() { bool done = true; return !done; }\n";
    let c = "int other(void) { int class = 0; return class; }\n";
    let txt = "#include <KeLibTxtDl.h>\nint other();\n";
    let files = |other| [("a.c", main), ("b.c", other), ("own.h", txt)];
    run_files(&files(cpp), &["a.c", "b.c"]).well();
    run_files(&files(c), &["a.c", "b.c"])
        .badly("b.c does not compile; like the TXT's own compiler, tx_run takes .c for C++");
    run_files(&files(c), &["-x", "c", "a.c", "b.c"]).well();
    // Beside C++, files named .c are C, unless they include what is C++.
    let linked = "#include <KeLibTxtDl.h>\nextern \"C\" int other(void);\n";
    run_files(&[("a.cpp", main), ("b.c", c), ("own.h", linked)], &["a.cpp", "b.c"]).well();
    run_files(&[("a.cpp", main), ("b.c", c), ("own.h", txt)], &["a.cpp", "b.c"]).badly(
        "b.c has other: but not as it is called: with other arguments, or in the other language",
    );
    // The compiler that is named is one for C.
    let folder = tempfile::tempdir().unwrap();
    files(cpp).iter().for_each(|(name, text)| write(folder.path(), name, text));
    let mut command = tx_run(&["a.c", "b.c"]);
    let ended = Run::start(command.current_dir(folder.path()).env("CFLAGS", "-w")).end();
    ended.badly("b.c does not compile; it is taken for C; with -x c++ it is C++");
}

#[test]
fn a_program_of_kit_4_1_6_runs() {
    drives(
        "main.cpp",
        "#include \"../Common/ftProInterface2013TransferAreaCom.h\"\n\
         int main() {\nFISH_X1_TRANSFER *area = new FISH_X1_TRANSFER[IF08_MAX];\n\
         ftIF2013TransferAreaComHandler com(area, 1, \"192.168.7.2\");\n\
         if (!com.BeginTransfer()) return 1;\n\
         do { area[LOCAL_IO].ftX1out.duty[0] = 300;\n\
         if (!com.DoTransferCompressed()) return 2; } while (!area[LOCAL_IO].ftX1in.uni[0]);\n\
         com.EndTransfer();\ndelete[] area;\nreturn 0;\n}\n",
    );
}

#[test]
fn programs_of_kit_4_6_6_run() {
    let begin = "#include <conio.h>\n#include <chrono>\n\
         #include \"../Common/ftProInterface2013TransferAreaCom.h\"\n\
         int main() {\nFISH_X1_TRANSFER *area = new FISH_X1_TRANSFER[IF_TXT_MAX];\n";
    let thread = "ftIF2013TransferAreaComHandlerEx com(area, IF_TXT_MAX, \"192.168.7.2\");\n\
         if (com.TaComThreadStart() != 0) return 1;\n\
         area[ShmIfId_TXT::LOCAL_IO].ftX1out.duty[0] = 300;\n\
         while (!area[LOCAL_IO].ftX1in.uni[0]) this_thread::sleep_for(chrono::milliseconds(4));\n\
         cout << \"end\" << endl;\nreturn 0;\n}\n";
    drives("thread.cpp", &format!("{begin}{thread}"));
    let in_a_loop =
        "ftIF2013TransferAreaComHandler com(area);\nif (!com.BeginTransfer()) return 1;\n\
         do area[0].ftX1out.duty[0] = 300;\n while (com.DoTransfer() && !area[0].ftX1in.uni[0]);\n\
         com.EndTransfer();\nreturn 0;\n}\n";
    drives("loop.cpp", &format!("{begin}{in_a_loop}"));
}

/// Kit 4.1.6 opens no namespace, so its programs have names that the standard library has, too.
#[test]
fn names_of_a_program_of_kit_4_1_6_do_not_clash_with_the_standard_library() {
    drives(
        "main.cpp",
        "#include <iostream>\n#include \"ftProInterface2013TransferAreaCom.h\"\n\
         int distance = 300, left = 0, move = 1;\n\
         int main() {\nFISH_X1_TRANSFER area[1];\nftIF2013TransferAreaComHandler com(area);\n\
         if (!com.BeginTransfer()) return 1;\n\
         do area[left].ftX1out.duty[0] = distance * move;\n\
         while (com.DoTransferCompressed() && !area[0].ftX1in.uni[0]);\n\
         com.EndTransfer();\nreturn 0;\n}\n",
    );
}

#[test]
fn the_kind_is_seen_through_an_include_folder() {
    if !has_compiler() {
        return;
    }
    let files = [
        (
            "src/a.cpp",
            "#include \"Utils.h\"\nint main() { return sizeof(FISH_X1_TRANSFER) - 1024; }\n",
        ),
        ("inc/utils.h", "#include \"deep/txt.h\"\n"),
        ("inc/deep/txt.h", "#include <KeLibTxtDl.h>\n"),
    ];
    let ended = run_files(&files, &["src/a.cpp", "-I", "inc"]);
    ended.well();
    assert!(ended.err.contains("a program for the TXT itself"), "{}", ended.err);
}

/// A header of a library is not ours because it has the name of one of ours.
#[test]
fn headers_of_libraries_are_left_alone() {
    if !has_compiler() {
        return;
    }
    let files = [
        (
            "a.cpp",
            "#include <x/common.h>\n#include \"KeLibTxtDl.h\"\nint main() { return of_x - 7; }\n",
        ),
        ("sys/x/common.h", "static const int of_x = 7;\n"),
    ];
    let folder = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, text)| write(folder.path(), name, text));
    let mut command = tx_run(&["a.cpp"]);
    command.env("CPLUS_INCLUDE_PATH", folder.path().join("sys"));
    Run::start(command.current_dir(folder.path())).end().well();
}

#[test]
fn a_program_for_ft_txt_lib_runs() {
    drives(
        "main.cpp",
        "#include \"FtTxtLib.h\"\n#include <windows.h>\nusing namespace fischertechnik::txt::remote::api;\n\
         int main() {\nftIF2013TransferAreaComHandlerEx2 com(1, \"192.168.7.2\");\n\
         if (com.ftxStartTransferArea() != FtErrors::FTLIB_ERR_SUCCESS) return 1;\n\
         com.SetOutMotorValues(LOCAL_IO, Motor::M1, 300, Direction::CW);\n\
         while (!com.GetTransferAreasArrayAddr()[0].ftX1in.uni[0]) Sleep(1);\n\
         com.ftxStopTransferArea();\nreturn 0;\n}\n",
    );
}

#[test]
fn a_pc_program_runs() {
    drives(
        "pc.c",
        "#include <windows.h>\n#include \"common.h\"\n#include \"ROBO_TX_FW.h\"\n#include \"ftMscLib.h\"\n\
         #include \"ftErrCode.h\"\nint main(void) {\nDWORD error;\nHANDLE h;\nTA_ARRAY volatile *areas;\n\
         ftxInitLib();\nh = ftxOpenComDevice(\"COM4\", 38400, &error);\nif (!h) return 1;\n\
         areas = GetTransferAreasArrayAddr(h);\nif (ftxStartTransferArea(h)) return 2;\n\
         SetOutMotorValues(h, TA_LOCAL, 0, 300, 0);\n\
         while (!areas->ftxTransferArea[0].input.uni[0]) Sleep(1);\n\
         ftxStopTransferArea(h);\nftxCloseDevice(h);\nftxCloseLib();\nreturn 0;\n}\n",
    );
}

#[test]
fn char_has_no_sign_in_a_program_with_prg_tic_however_it_gets_its_header() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let run = |begin: &str, flags: &str| {
        let text = format!(
            "{begin}\nvoid PrgInit(TA *p, int n) {{}}\nint PrgTic(TA *p, int n) {{ return (char)-1 == -1; }}\n"
        );
        write(folder.path(), "a.c", &text);
        Run::start(tx_run(&["a.c"]).current_dir(folder.path()).env("CFLAGS", flags)).end()
    };
    for begin in [
        "/*\n#include \"ftMscLib.h\"\n*/\n#include \"ROBO_TX_PRG.h\"",
        "#ifdef PC\n#include \"ftMscLib.h\"\n#else\n#include \"ROBO_TX_PRG.h\"\n#endif",
        "#define KIT \"ROBO_TX_PRG.h\"\n#include KIT",
    ] {
        run(begin, "").well();
    }
    run("#include \"ROBO_TX_PRG.h\"", "-fsigned-char").badly("PrgTic has returned the error 1");
    let pc = "#include \"ROBO_TX_FW.h\"\nint main(void) { return (char)-1 != -1; }\n";
    run_files(&[("pc.c", pc)], &["pc.c"]).well();
}

#[test]
fn a_common_h_of_the_programs_own_is_that_also_by_a_macro() {
    if !has_compiler() {
        return;
    }
    let main = "#include CONFIG\nint main(void) { return SPEED - 512; }\n";
    let files = [("m.c", main), ("inc/common.h", "#define SPEED 512\n")];
    for config in ["CONFIG=\"common.h\"", "CONFIG=<common.h>"] {
        run_files(&files, &["m.c", "-I", "inc", "-D", config]).well();
    }
}

#[cfg(unix)]
#[test]
fn a_source_that_is_gone_is_not_left_out_of_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "src/main.c", "int main(void) { return 0; }\n");
    std::os::unix::fs::symlink("../shared/limit.c", folder.path().join("src/limit.c")).unwrap();
    let ended = Run::start(tx_run(&["src"]).current_dir(folder.path())).end();
    ended.badly("src/limit.c can't be read: No such file or directory");
}

#[test]
fn a_header_that_no_kit_has_is_the_programs_own() {
    if !has_compiler() {
        return;
    }
    let main = "#include \"ft_types.h\"\n#include \"ROBO_TX_FW.h\"\nint main(void) { return SPEED - 512; }\n";
    run_files(&[("m.c", main), ("ft_types.h", "#define SPEED 512\n")], &["m.c"]).well();
}

#[test]
fn a_header_that_is_not_compiled_does_not_tell_the_kind() {
    if !has_compiler() {
        return;
    }
    let pc = "/*\n#include \"KeLibTxtDl.h\"\n*/\n#include \"ftMscLib.h\"\nint main(void) { int class = 0; return class; }\n";
    let txt = "#ifdef ELSEWHERE\n#include \"FtTxtLib.h\"\n#endif\n#include \"KeLibTxtDl.h\"\n\
               int main() { return sizeof(FISH_X1_TRANSFER) - 1024; }\n";
    for (name, text, kind) in
        [("a.c", pc, "a PC program for ftMscLib"), ("a.cpp", txt, "a program for the TXT itself")]
    {
        let ended = run_files(&[(name, text)], &[name]);
        ended.well();
        assert!(ended.err.contains(kind), "{}", ended.err);
    }
}

#[test]
fn an_own_header_is_no_copy_of_a_kits_because_it_uses_an_integer() {
    if !has_compiler() {
        return;
    }
    let own = "typedef enum { CLOSED, OPEN } Gate;\nextern UINT16 presses;\n#define CODE 0\n";
    let main = "#include \"ROBO_TX_PRG.h\"\n#include \"common.h\"\nUINT16 presses;\nGate gate;\n\
                void PrgInit(TA *p, int n) {}\nint PrgTic(TA *p, int n) { return CODE; }\n";
    run_files(&[("a.c", main), ("common.h", own)], &["a.c"]).well();
}

#[cfg(unix)]
#[test]
fn options_in_variables_need_not_be_utf_8() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "a.c", "int main(void) { return CODE; }\n");
    let mut command = tx_run(&["a.c"]);
    command.env("CFLAGS", OsStr::from_bytes(b"-Ik\xf6rbe -DCODE=7"));
    command.env("LDFLAGS", OsStr::from_bytes(b"-Lk\xf6rbe"));
    let ended = Run::start(command.current_dir(folder.path())).end();
    assert_eq!(ended.status, Some(7), "{}", ended.err);
}

#[cfg(unix)]
#[test]
fn zig_is_the_compiler_of_those_who_have_no_other() {
    use std::os::unix::fs::PermissionsExt;
    if !has_compiler() {
        return;
    }
    // It is named by two words, and here it is another compiler.
    let folder = tempfile::tempdir().unwrap();
    let zig = folder.path().join("zig");
    let text = "#!/bin/sh\n[ \"$1\" = cc ] || exit 1\nshift\nPATH=/usr/local/bin:/usr/bin:/bin exec cc \"$@\"\n";
    std::fs::write(&zig, text).unwrap();
    std::fs::set_permissions(&zig, std::fs::Permissions::from_mode(0o755)).unwrap();
    write(folder.path(), "three.c", "int main(void) { return 3; }\n");
    let mut command = tx_run(&["--world", "none"]);
    command.arg(folder.path().join("three.c")).env("PATH", folder.path()).env_remove("CC");
    let ended = Run::start(&mut command).end();
    assert_eq!(ended.status, Some(3), "{ended:?}");
}

#[cfg_attr(windows, ignore = "zig takes @x.c for the options in x.c, also as ./@x.c")]
#[test]
fn a_name_that_looks_like_an_option_is_a_name() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "-w.c", "int main(void) { return 0; }\n");
    // Compilers take `@x.c` for the options in this file.
    write(folder.path(), "x.c", "int x;\n");
    write(folder.path(), "@x.c", "int y;\n");
    for arguments in [&["."][..], &["./-w.c", "@x.c"]] {
        Run::start(tx_run(arguments).current_dir(folder.path())).end().well();
    }
}

#[test]
fn sources_may_have_the_names_of_those_that_tx_run_adds() {
    if !has_compiler() {
        return;
    }
    let main = "int other(void);\nint main(void) { return other(); }\n";
    let other = "int other(void) { return 0; }\n";
    run_files(&[("end_first.c", other), ("main.c", main)], &["end_first.c", "main.c"]).well();
    let tic = "#include \"ROBO_TX_PRG.h\"\nvoid PrgInit(TA *p, int n) {}\n\
               int other(void);\nint PrgTic(TA *p, int n) { return other(); }\n";
    run_files(&[("tx_main.c", other), ("tic.c", tic)], &["tx_main.c", "tic.c"]).well();
}

#[cfg(target_os = "linux")]
#[test]
fn a_compiler_that_leaves_something_running_is_not_waited_for() {
    use std::os::unix::fs::PermissionsExt;
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let (script, left) = (folder.path().join("compiler"), folder.path().join("left"));
    let text =
        format!("#!/bin/sh\nsleep 1000 &\necho $! >> '{}'\nexec cc \"$@\"\n", left.display());
    std::fs::write(&script, text).unwrap();
    std::fs::set_permissions(&script, std::fs::Permissions::from_mode(0o755)).unwrap();
    write(folder.path(), "three.c", "int main(void) { return 3; }\n");
    let mut command = tx_run(&["--world", "none"]);
    command.arg(folder.path().join("three.c")).env("CC", &script);
    let ended = Run::start(&mut command).end();
    assert_eq!(ended.status, Some(3), "{ended:?}");
    for number in std::fs::read_to_string(left).unwrap().lines() {
        assert!(Command::new("kill").arg(number).status().unwrap().success());
    }
}
