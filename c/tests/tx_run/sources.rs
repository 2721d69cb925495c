//! Programs as they are found: with old headers, other spellings, in several files, in C++.

#[cfg(target_os = "linux")]
use std::path::Path;
#[cfg(target_os = "linux")]
use std::process::Command;

#[cfg(target_os = "linux")]
use super::support::{cache, shared_library};
use super::support::{has_compiler, tx_run, txt, wait_for, write, Ended, Run};

/// Runs these files, the names of which are relative to the folder in which `tx_run` is started.
fn run(files: &[(&str, &str)], arguments: &[&str]) -> Ended {
    let folder = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, text)| write(folder.path(), name, text));
    Run::start(tx_run(arguments).current_dir(folder.path())).end()
}

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
        run(&files, &["src/a.c", "src/b.c"]).well();
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
    run(&files, &["src/a.c"]).well();
    // Messages still name the file as it was given.
    let wrong = format!("{main}\nint f(void) {{ return nonsense; }}\n");
    let files = [("src/a.c", &*wrong), files[1], files[2], files[3]];
    let ended = run(&files, &["src/a.c"]);
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
    run(&[("a.cpp", source)], &["a.cpp"]).well();
}

#[test]
fn a_program_with_main_gets_its_arguments_and_the_host() {
    if !has_compiler() {
        return;
    }
    let source = "#include <stdio.h>\n#include <stdlib.h>\nint main(int n, char **arguments) {\n\
                  printf(\"%d %s %d\\n\", n, arguments[1], getenv(\"FT_TXT_HOST\") != NULL);\nreturn 0; }\n";
    let ended = run(&[("a.c", source)], &["a.c", "--world", "slide", "--", "--host"]);
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
    let ended = run(&[("a.c", source)], &["a.c", "--host", &auto]);
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
    run(&files(cpp), &["a.c", "b.c"]).well();
    run(&files(c), &["a.c", "b.c"])
        .badly("b.c does not compile; like the TXT's own compiler, tx_run takes .c for C++");
    run(&files(c), &["-x", "c", "a.c", "b.c"]).well();
    // Beside C++, files named .c are C, unless they include what is C++.
    let linked = "#include <KeLibTxtDl.h>\nextern \"C\" int other(void);\n";
    run(&[("a.cpp", main), ("b.c", c), ("own.h", linked)], &["a.cpp", "b.c"]).well();
    run(&[("a.cpp", main), ("b.c", c), ("own.h", txt)], &["a.cpp", "b.c"]).badly(
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
    let ended = run(&files, &["src/a.cpp", "-I", "inc"]);
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

/// What a program with these files says that includes the library's header in two spellings. With the second one its
/// source is copied.
#[track_caller]
fn says_in_both_spellings(files: &[(&str, &str)], variables: &[(&str, &str)], says: &str) {
    let folder = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, text)| write(folder.path(), name, text));
    for spelled in ["ftMscLib.h", "FtMscLib.h"] {
        let rest = files[0].1;
        let text = format!("#include <stdio.h>\n#include \"{spelled}\"\n{rest}");
        write(folder.path(), files[0].0, &text);
        let mut command = tx_run(&[files[0].0, "--world", "none"]);
        command.envs(variables.iter().copied());
        let ended = Run::start(command.current_dir(folder.path())).end();
        ended.well();
        assert_eq!(ended.out, says, "{spelled} {variables:?}");
    }
}

#[test]
fn a_source_that_is_copied_includes_what_lies_beside_it() {
    if !has_compiler() {
        return;
    }
    let files = [
        (
            "src/a.c",
            "#define CONFIG \"config.h\"\n#include CONFIG\n/* the axes */ #include \"axes.h\"\n\
             #include \\\n \"speed.h\"\n#include \"more.h\"\n\
             int main(void) { puts(CONFIGURED AXES SPEED MORE); return 0; }\n",
        ),
        ("src/config.h", "#define CONFIGURED \"own \"\n"),
        ("src/axes.h", "#define AXES \"own \"\n"),
        ("src/speed.h", "#define SPEED \"own \"\n"),
        ("src/more.h", "#define MORE \"own\"\n"),
        ("inc/config.h", "#define CONFIGURED \"inc \"\n"),
        ("inc/axes.h", "#define AXES \"inc \"\n"),
        ("inc/speed.h", "#define SPEED \"inc \"\n"),
        ("inc/more.h", "#define MORE \"inc\"\n"),
    ];
    for option in ["-I", "-iquote"] {
        let flags = format!("{option} inc");
        says_in_both_spellings(&files, &[("CFLAGS", &flags)], "own own own own\n");
    }
    // Also from folders above.
    let files = [
        (
            "a/b/c/src/a.c",
            "#define UP(path) ../path\n#define TEXT(path) #path\n#define QUOTED(path) TEXT(path)\n\
             #include QUOTED(UP(UP(UP(above.h))))\n#include \"more.h\"\n\
             #if __has_include(\"../../d/asked.h\")\n#include \"../../d/asked.h\"\n#endif\n\
             int main(void) { puts(SPEED ASKED MORE); return 0; }\n",
        ),
        ("a/b/c/src/more.h", "#define MORE \"own\"\n"),
        ("a/above.h", "#include \"speed.h\"\n"),
        ("a/speed.h", "#define SPEED \"own \"\n"),
        ("a/b/d/asked.h", "#define ASKED \"own \"\n"),
        ("x/y/z/none.h", ""),
        ("x/d/asked.h", "#define ASKED \"inc \"\n"),
        ("above.h", "#define SPEED \"inc \"\n"),
    ];
    says_in_both_spellings(&files, &[("CFLAGS", "-Ix/y/z")], "own own own\n");
    // A header elsewhere does not look beside the source.
    let files = [
        ("src/a.c", "#include \"first.h\"\nint main(void) { puts(MORE); return 0; }\n"),
        ("src/more.h", "#define MORE \"own\"\n"),
        ("inc/first.h", "#include \"more.h\"\n"),
        ("inc2/more.h", "#define MORE \"inc2\"\n"),
    ];
    says_in_both_spellings(&files, &[("CFLAGS", "-Iinc -Iinc2")], "inc2\n");
}

#[test]
fn a_source_that_is_copied_includes_what_the_compiler_finds_first() {
    if !has_compiler() {
        return;
    }
    let files = [
        ("main.cpp", "#include \"speed.h\"\nint main() { puts(SPEED); return 0; }\n"),
        ("a/speed.h", "#define SPEED \"a\"\n"),
        ("b/speed.h", "#define SPEED \"b\"\n"),
    ];
    let compiler = if cfg!(windows) { "zig c++ -Ia" } else { "c++ -Ia" };
    let c_plus_plus = [("CXX", compiler), ("CXXFLAGS", "-Ib")];
    for (variables, says) in [
        (&[("CXXFLAGS", "-isystem a -I b")][..], "b\n"),
        (&[("CXXFLAGS", "-I a -iquote b")], "b\n"),
        (&[("CFLAGS", "-Ia"), ("CXXFLAGS", "-Ib")], "b\n"),
        (&[("CXXFLAGS", "--include-directory a -Ib")], "a\n"),
        (&c_plus_plus, "a\n"),
    ] {
        says_in_both_spellings(&files, variables, says);
    }
}

/// In each of these, both headers are copied: they include one of ours, which is written in another way.
#[test]
fn a_header_that_is_copied_is_the_one_that_the_compiler_finds_first() {
    if !has_compiler() {
        return;
    }
    let program = |name: &str, include: &str| {
        let main = format!("#include {include}\nint main(void) {{ puts(SPEED); return 0; }}\n");
        let header =
            |speed: &str| format!("#include \"ROBO_TX_FW.H\"\n#define SPEED \"{speed}\"\n");
        [
            (name.to_owned(), main),
            ("a/speed.h".into(), header("a")),
            ("b/speed.h".into(), header("b")),
        ]
    };
    for (name, include, variables, says) in [
        ("m.c", "\"speed.h\"", &[("CFLAGS", "-isystem a -I b")][..], "b\n"),
        ("m.c", "<speed.h>", &[("CFLAGS", "-iquote a -I b")], "b\n"),
        ("m.c", "\"speed.h\"", &[("CFLAGS", "-I b -iquote a")], "a\n"),
        ("m.c", "\"speed.h\"", &[("CFLAGS", "-idirafter a -I b")], "b\n"),
        ("m.c", "\"speed.h\"", &[("CPATH", "b"), ("CFLAGS", "-isystem a")], "b\n"),
        ("m.c", "\"speed.h\"", &[("CXXFLAGS", "-I a"), ("CFLAGS", "-I b")], "b\n"),
        ("m.cpp", "\"speed.h\"", &[("CFLAGS", "-I a"), ("CXXFLAGS", "-I b")], "b\n"),
        ("m.c", "\"speed.h\"", &[("C_INCLUDE_PATH", "b"), ("CFLAGS", "-I b -I a")], "a\n"),
    ] {
        let files = program(name, include);
        let files: Vec<_> = files.iter().map(|(name, text)| (&**name, &**text)).collect();
        says_in_both_spellings(&files, variables, says);
    }
    // The compiler finds a name that is written exactly before one in other letters.
    let files = [
        ("m.c", "#include \"Speed.h\"\nint main(void) { puts(SPEED); return 0; }\n"),
        ("a/speed.h", "#define SPEED \"a\"\n"),
        ("b/Speed.h", "#define SPEED \"b\"\n"),
    ];
    // Windows has both names for each.
    let says = if cfg!(windows) { "a\n" } else { "b\n" };
    says_in_both_spellings(&files, &[("CFLAGS", "-I a -idirafter b")], says);
}

#[test]
fn what_the_text_of_a_copy_does_not_show_is_what_the_compiler_finds() {
    if !has_compiler() {
        return;
    }
    let says = |includes: &str, headers: &[(&str, &str)], flags: &str, says: &str| {
        let main = format!("{includes}\nint main(void) {{ puts(VALUE); return 0; }}\n");
        let files = [&[("src/m.c", &*main)], headers].concat();
        says_in_both_spellings(&files, &[("CFLAGS", flags)], says);
    };
    let [beside, inc] =
        [("src/val.h", "#define VALUE \"src\"\n"), ("inc/val.h", "#define VALUE \"inc\"\n")];
    for include in [
        "#define N \"val.h\"\n#include N",
        "#import \"val.h\"",
        "%:include \"val.h\"",
        "#include \\\n\"val.h\"",
        "#define MSG HDR\"(\"\n#include \"val.h\"",
        "#define N \"../src/val.h\"\n#include N",
    ] {
        says(include, &[beside, inc], "-w -Iinc", "src\n");
    }
    // What a header includes is not looked for beside the source.
    let nested = ("inc/more.h", "#include \"val.h\"\n");
    let other = ("more/val.h", "#define VALUE \"more\"\n");
    says(
        "#define N \"own.h\"\n#include N\n#include <more.h>",
        &[beside, nested, other, ("src/own.h", "")],
        "-Iinc -Imore",
        "more\n",
    );
    // Nor is there a header for a question that is not about the files beside.
    let asks =
        "#if __has_include(<val.h>)\n#include <val.h>\n#else\n#define VALUE \"none\"\n#endif";
    says(asks, &[beside], "", "none\n");
    // A header that is copied, too, looks beside itself.
    let axis = ("axis/axis.h", "#include \"FtMscLib.h\"\n#define N \"val.h\"\n#include N\n");
    says(
        "#include \"../axis/axis.h\"",
        &[axis, beside, ("axis/val.h", "#define VALUE \"axis\"\n")],
        "",
        "axis\n",
    );
    let with_old_copy =
        ("axis/axis.h", "#include \"ROBO_TX_FW.h\"\n#define N \"val.h\"\n#include N\n");
    let old = ("axis/ROBO_TX_FW.h", "typedef unsigned long UINT32;\n");
    says(
        "#include \"../axis/axis.h\"",
        &[with_old_copy, old, beside, ("axis/val.h", "#define VALUE \"axis\"\n")],
        "",
        "axis\n",
    );
}

/// They have names of folders in which ours are.
#[test]
fn headers_of_the_program_in_folders_are_its_own() {
    if !has_compiler() {
        return;
    }
    for name in ["posix/io.h", "posix/windows.h", "detail/callback_data.h", "txt/common.h"] {
        let main = format!("#include \"{name}\"\nint main(void) {{ puts(VALUE); return 0; }}\n");
        let header = format!("inc/{name}");
        let files = [("m.c", &*main), (&*header, "#define VALUE \"own\"\n")];
        says_in_both_spellings(&files, &[("CFLAGS", "-Iinc")], "own\n");
    }
    if cfg!(windows) {
        return;
    }
    // Ours with names of Windows come last.
    let main = "#include <conio.h>\nint main(void) { puts(VALUE); return 0; }\n";
    let files = [("m.c", main), ("inc/conio.h", "#define VALUE \"own\"\n")];
    for variable in [("CFLAGS", "-isystem inc"), ("CFLAGS", "-idirafter inc"), ("CPATH", "inc")] {
        says_in_both_spellings(&files, &[variable], "own\n");
    }
}

#[test]
fn a_source_that_is_copied_keeps_its_name() {
    if !has_compiler() {
        return;
    }
    let text = "#include \"more.h\"\nint main(void) { puts(__BASE_FILE__ \" \" __FILE__ \" \" MORE); return 0; }\n";
    let files = [("src/a.c", text), ("src/more.h", "#define MORE __BASE_FILE__\n")];
    says_in_both_spellings(&files, &[("CFLAGS", "-Wall -Werror")], "src/a.c src/a.c src/a.c\n");
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
    self::run(&[("pc.c", pc)], &["pc.c"]).well();
}

#[test]
fn a_header_with_include_next_is_not_run_as_a_copy() {
    if !has_compiler() {
        return;
    }
    let main = "#include <config.h>\nint main(void) { return SPEED - 512; }\n";
    let config = |written: &str| {
        format!(
            "#ifndef A\n#define A\n#include \"{written}\"\n  # include_next <config.h>\n#endif\n"
        )
    };
    let ended = |written: &str| {
        let files = [
            ("m.c", main),
            ("b/config.h", "#define SPEED 512\n"),
            ("a/config.h", &config(written)),
        ];
        self::run(&files, &["m.c", "-I", "a", "-I", "b"])
    };
    ended("ROBO_TX_FW.h").well();
    ended("robo_tx_fw.h").badly("config.h: with #include_next a header has to spell its includes");
    // A copy of what lies beside the source finds what the header itself does.
    let main = "#include \"util.h\"\nint main(void) { return (int)strlen(\"\"); }\n";
    let util = "#include \"robo_tx_fw.h\"\n#include_next <string.h>\n";
    self::run(&[("m.c", main), ("util.h", util)], &["m.c"]).well();
}

#[test]
fn a_common_h_of_the_programs_own_is_that_also_by_a_macro() {
    if !has_compiler() {
        return;
    }
    let main = "#include CONFIG\nint main(void) { return SPEED - 512; }\n";
    let files = [("m.c", main), ("inc/common.h", "#define SPEED 512\n")];
    for config in ["CONFIG=\"common.h\"", "CONFIG=<common.h>"] {
        self::run(&files, &["m.c", "-I", "inc", "-D", config]).well();
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
    self::run(&[("m.c", main), ("ft_types.h", "#define SPEED 512\n")], &["m.c"]).well();
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
        let ended = run(&[(name, text)], &[name]);
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
    run(&[("a.c", main), ("common.h", own)], &["a.c"]).well();
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

/// Such as an umlaut from an old archive.
#[cfg(target_os = "linux")]
#[test]
fn a_source_that_is_copied_may_have_names_in_another_character_set() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join(OsStr::from_bytes(b"Fr\xe4se"));
    let umlaut = OsStr::from_bytes(b"\xe4.h");
    std::fs::create_dir(&own).unwrap();
    write(folder.path(), "inc/none.h", "");
    std::fs::write(folder.path().join("inc").join(umlaut), "#define LATIN 4\n").unwrap();
    std::fs::write(own.join(umlaut), "#define LATIN 1\n").unwrap();
    write(&own, "config.h", "#define CONFIG 2\n");
    for spelled in ["ftMscLib.h", "FTMSCLIB.H"] {
        let text = format!(
            "#include \"{spelled}\"\n#include \"config.h\"\n\
             #if __has_include(\"config.h\")\n#define ASKED 10\n#else\n#define ASKED 20\n#endif\n"
        );
        let rest = b"#include \"\xe4.h\"\nint main(void) { return ASKED + CONFIG + LATIN; }\n";
        std::fs::write(own.join("a.c"), [text.as_bytes(), rest].concat()).unwrap();
        let mut command = tx_run(&["--world", "none", "-I"]);
        let ended = Run::start(command.arg(folder.path().join("inc")).arg(own.join("a.c"))).end();
        assert_eq!(ended.status, Some(13), "{spelled}: {}", ended.err);
    }
}

#[cfg(unix)]
#[test]
fn a_source_is_not_copied_out_of_a_folder_with_a_quotation_mark() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (spelled, is_well) in [("ftMscLib.h", true), ("FTMSCLIB.H", false)] {
        let text = format!("#include \"{spelled}\"\nint main(void) {{ return 0; }}\n");
        write(folder.path(), "a \"b\"/a.c", &text);
        let mut command = tx_run(&["a \"b\"/a.c", "--world", "none"]);
        let ended = Run::start(command.current_dir(folder.path())).end();
        match is_well {
            true => ended.well(),
            false => ended.badly("a quotation mark is in the name"),
        }
    }
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
    run(&[("end_first.c", other), ("main.c", main)], &["end_first.c", "main.c"]).well();
    let tic = "#include \"ROBO_TX_PRG.h\"\nvoid PrgInit(TA *p, int n) {}\n\
               int other(void);\nint PrgTic(TA *p, int n) { return other(); }\n";
    run(&[("tx_main.c", other), ("tic.c", tic)], &["tx_main.c", "tic.c"]).well();
}

#[test]
fn a_folder_for_libraries_may_have_a_comma_in_its_name() {
    if !has_compiler() {
        return;
    }
    run(&[("a.c", "int main(void) { return 0; }\n")], &["a.c", "-L", "left,right"]).well();
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

/// As a compiler and a linker make them.
#[cfg(target_os = "linux")]
#[test]
fn a_program_shares_variables_and_functions_with_its_own_library() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let files = [
        (
            "speed.h",
            "int speed;\nint drive(int channel);\nint on_limit(void);\nint error(int place);\n",
        ),
        (
            "lib/drive.c",
            "#include <unistd.h>\n#include \"../speed.h\"\n\
             __attribute__((weak)) int on_limit(void) { return 1; }\n\
             int drive(int channel) { return speed + on_limit() + error(1) + close(channel); }\n",
        ),
        (
            "main.c",
            "#include <conio.h>\n#include \"speed.h\"\nint on_limit(void) { return 20; }\n\
             int error(int place) { return 100 * place; }\n\
             int close(int channel) { return channel; }\nint _kbhit(void) { return 7; }\n\
             int main(void) { speed = 4; return drive(-1) + close(50) + (kbhit() == _kbhit()); }\n",
        ),
    ];
    files.iter().for_each(|(name, text)| write(folder.path(), name, text));
    shared_library(&at("lib/drive.c"), &at("lib/libdrive.so"), &["-fcommon"]);
    assert!(Command::new("cc")
        .args(["-w", "-fcommon", "-c", "main.c", "-o", "lib/main.o"])
        .arg(format!("-I{}/include/posix", env!("CARGO_MANIFEST_DIR")))
        .current_dir(folder.path())
        .status()
        .unwrap()
        .success());
    for program in ["main.c", "lib/main.o"] {
        let mut command = tx_run(&["--world", "none", program, "lib/libdrive.so"]);
        let ended = Run::start(command.current_dir(folder.path())).end();
        assert_eq!(ended.status, Some(4 + 20 + 100 - 1 + 50), "{program} {ended:?}");
    }
}

/// The loader takes it from the library that it finds first.
#[cfg(target_os = "linux")]
#[test]
fn a_function_of_a_library_that_the_own_library_replaces_is_told() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for (name, text) in [
        ("helper.c", "void Sleep(int seconds) { }\nint pause_of(void) { return 2; }\n"),
        ("station.c", "void Sleep(int);\nint pause_of(void);\nint stop(void) { Sleep(2); return pause_of(); }\n"),
        ("main.c", "int stop(void);\nint main(void) { return stop(); }\n"),
    ] {
        write(folder.path(), name, text);
    }
    shared_library(&at("helper.c"), &at("libhelper.so"), &[]);
    let here = folder.path().display();
    let options = [format!("-L{here}"), "-lhelper".into(), format!("-Wl,-rpath,{here}")];
    let options = options.each_ref().map(String::as_str);
    shared_library(
        &at("station.c"),
        &at("libstation.so"),
        &[&["-Wl,--no-as-needed"], &options[..]].concat(),
    );
    let mut command = tx_run(&["--world", "none", "main.c", "libstation.so"]);
    let ended = Run::start(command.current_dir(folder.path())).end();
    assert_eq!(ended.status, Some(2), "{ended:?}");
    let told = format!("in place of functions of {here}/libhelper.so those of ftMscLib are called");
    assert!(ended.err.contains(&told) && ended.err.contains(": Sleep\n"), "{}", ended.err);
}

#[cfg(target_os = "linux")]
#[test]
fn a_program_may_call_its_main_and_have_its_own_function_for_a_quick_exit() {
    if !has_compiler() {
        return;
    }
    let main = "#include <windows.h>\n#include \"ftMscLib.h\"\n\
        #include \"ftErrCode.h\"\nint again(void);\nint calls;\nint main(void)\n{\n\
        DWORD error;\nHANDLE device;\nif (calls++ > 0) return 0;\nftxInitLib();\n\
        device = ftxOpenComDevice(\"COM4\", 38400, &error);\nftxStartTransferArea(device);\nagain();\n\
        return ftxIsTransferActiv(device) == FTLIB_ERR_THREAD_IS_RUNNING ? 2 + calls : 1;\n}\n";
    let again = "int main(void);\nvoid quick_exit(int station);\n\
        int again(void) { quick_exit(3); return main(); }\n";
    let own = "int station;\nvoid quick_exit(int left) { station = left; }\n";
    let files = [("main.c", main), ("again.c", again), ("own.c", own)];
    let ended = run(&files, &["main.c", "again.c", "own.c"]);
    assert_eq!(ended.status, Some(4), "{ended:?}");
}

#[cfg_attr(windows, ignore = "the threads of Windows")]
#[test]
fn a_thread_gets_the_stack_that_it_is_asked_for() {
    if !has_compiler() {
        return;
    }
    let main = "#include <windows.h>\n#include <string.h>\n\
        static DWORD WINAPI run(LPVOID argument)\n{\n\
        char large[6 << 20];\nmemset(large, 1, sizeof large);\nreturn large[argument != NULL];\n}\n\
        int main(void)\n{\nHANDLE thread = CreateThread(NULL, 8 << 20, run, NULL, 0, NULL);\n\
        return thread == NULL || WaitForSingleObject(thread, 30000) != WAIT_OBJECT_0;\n}\n";
    run(&[("main.c", main)], &["main.c"]).well();
}

/// Each has the name by which the program looks for it, as nearly every library has.
#[cfg(target_os = "linux")]
#[test]
fn of_two_libraries_with_one_name_the_program_gets_the_one_that_it_is_linked_with() {
    use std::os::unix::fs::PermissionsExt;

    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let library = |place: &str, name: &str, value: u8| {
        write(folder.path(), "part.c", &format!("int {name}(void) {{ return {value}; }}\n"));
        let file = at(place).join(format!("lib{name}.so.1"));
        std::fs::create_dir_all(at(place)).unwrap();
        shared_library(&at("part.c"), &file, &[&format!("-Wl,-soname,lib{name}.so.1")]);
        std::fs::remove_file(at("part.c")).unwrap();
        std::os::unix::fs::symlink(&file, at(place).join(format!("lib{name}.so"))).unwrap();
    };
    library("a", "other", 40);
    library("a", "speed", 1);
    library("b", "speed", 2);
    let both = "int speed(void);\nint other(void);\nint main(void) { return other() + speed(); }\n";
    write(folder.path(), "m.c", both);
    let status = |arguments: &[&str], variables: &[(&str, &str)]| {
        let mut command = tx_run(&["--world", "none", "m.c"]);
        command.args(arguments).envs(variables.iter().copied()).current_dir(folder.path());
        Run::start(&mut command).end()
    };
    // A name as of a script of the linker, with which ncurses comes.
    let script = format!("INPUT({})", at("b/libspeed.so.1").display());
    write(folder.path(), "script/libspeed.so", &script);
    let [other, speed] = ["a/libother.so.1", "b/libspeed.so.1"];
    let beside = at("b").display().to_string();
    let compiler = format!(
        "#!/bin/sh\nPATH=/usr/bin:/bin\ncase \" $* \" in *\" -c \"*|*\" -E \"*) ;; *) set -- \"$@\" {beside}/libspeed.so; esac\nexec cc \"$@\"\n"
    );
    // As with zig, and with mold.
    let says_nothing = "#!/bin/sh\ncase \"$*\" in *--trace*) exit 1; esac\nexec cc \"$@\"\n";
    let says_otherwise = "#!/bin/sh\ncase \"$*\" in *--trace*) ;; *) exec cc \"$@\"; esac\ncc \"$@\" | sed 's/^/trace: /'\n";
    for (name, text) in
        [("bin/cc", &*compiler), ("no_trace", says_nothing), ("trace", says_otherwise)]
    {
        write(folder.path(), name, text);
        std::fs::set_permissions(at(name), std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let [no_trace, trace] = ["no_trace", "trace"].map(|name| at(name).display().to_string());
    let own_compiler = format!("{}:{}", at("bin").display(), std::env::var("PATH").unwrap());
    for (arguments, variables) in [
        (&[other, speed][..], &[][..]),
        (&[speed, other, "-L", "a"], &[]),
        (&["-L", "a", "-l", "other", "-l", "speed"], &[("LDFLAGS", "-Lb")]),
        (&[other, "-L", "script", "-l", "speed"], &[]),
        (&[other], &[("LDLIBS", "-L b -l speed")]),
        (&[other], &[("LDLIBS", speed)]),
        (&[other, "-l", "speed"], &[("LIBRARY_PATH", &beside)]),
        // A compiler that the user has not named may have libraries of its own, too.
        (&[other], &[("PATH", &own_compiler)]),
        (&[speed, other, "-L", "a"], &[("CC", &no_trace)]),
        (&["-L", "a", "-l", "other", "-l", "speed"], &[("CC", &no_trace), ("LDFLAGS", "-L b")]),
        (&[other, speed], &[("CC", &trace)]),
    ] {
        let ended = status(arguments, variables);
        assert_eq!(ended.status, Some(42), "{arguments:?} {variables:?} {ended:?}");
    }
    let ended = status(&["-L", "a", "-L", "b", "-l", "other", "-l", "speed"], &[]);
    assert_eq!(ended.status, Some(41));
    // The loader would look in `c` and in `d`.
    library("c:d", "speed", 2);
    let ended = status(&["-L", "a", "-l", "other", "-l", "speed"], &[("LDFLAGS", "-Lc:d")]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("c:d/libspeed.so: no folder of a library"), "{}", ended.err);
    // And for a folder of the system, whatever that has.
    library("$LIB", "speed", 2);
    let ended = status(&["-L", "a", "-L", "$LIB", "-l", "other", "-l", "speed"], &[]);
    assert_eq!(ended.status, Some(41), "that in `a` comes first: {ended:?}");
    let ended = status(&["-L", "$LIB", "-l", "speed", other], &[]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("$LIB/libspeed.so: no folder of a library"), "{}", ended.err);
    // One of the system, which an order does not help.
    library("sdk", "vendor", 9);
    let main = "#include <math.h>\n#include <stdlib.h>\nint vendor(void);\n\
        int main(int argc, char *argv[]) { return vendor() + (int)cos(atof(argv[argc - 1])); }\n";
    write(folder.path(), "m.c", main);
    let ended = status(&["-L", "sdk", "-l", "vendor"], &[]);
    assert_eq!(ended.status, Some(10), "{ended:?}");
    shared_library(&at("m.c"), &at("sdk/libm.so.6"), &["-Wl,-soname,libm.so.6"]);
    let ended = status(&["-L", "sdk", "-l", "vendor"], &[]);
    assert_eq!(ended.status, Some(1), "{ended:?}");
    let hides = format!("{} is another library", at("sdk/libm.so.6").display());
    assert!(ended.err.contains(&hides), "{}", ended.err);
    // A library whose own name is that of one of the system, and not of its file.
    std::fs::remove_file(at("sdk/libm.so.6")).unwrap();
    write(folder.path(), "part.c", "int mine(void) { return 1; }\n");
    shared_library(&at("part.c"), &at("sdk/libmine.so"), &["-Wl,-soname,libresolv.so.2"]);
    write(folder.path(), "m.c", "int mine(void);\nint main(void) { return mine(); }\n");
    let ended = status(&["sdk/libmine.so"], &[]);
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(ended.err.contains("would not get sdk/libmine.so"), "{}", ended.err);
    // A library of the program may have any name, and what is only for the linker another place.
    shared_library(&at("part.c"), &at("sdk/librt.so"), &["-Wl,-soname,librt.so"]);
    std::fs::create_dir_all(at("real")).unwrap();
    shared_library(&at("part.c"), &at("real/libmine.so.9"), &["-Wl,-soname,libmine.so.9"]);
    shared_library(&at("part.c"), &at("sdk/libmine.so"), &["-Wl,-soname,libmine.so.9"]);
    let real = at("real").display().to_string();
    for (arguments, variables) in [
        (&["-L", "sdk", "-l", "rt"][..], &[][..]),
        (&["-L", "sdk", "-L", "real", "-l", "mine"], &[]),
        (&["-L", "sdk", "-l", "mine"], &[("LD_LIBRARY_PATH", &*real)]),
    ] {
        let ended = status(arguments, variables);
        assert_eq!(ended.status, Some(1), "{arguments:?} {ended:?}");
        assert!(ended.err.contains("has ended with the exit status 1"), "{}", ended.err);
    }
    // Whatever the order is, one of them is another one.
    write(folder.path(), "m.c", both);
    library("b", "other", 80);
    let ended = status(&[other, speed], &[]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("is another library with the same name"), "{}", ended.err);
}

/// The folder of the library may be that of the system's libraries.
#[cfg(target_os = "linux")]
#[test]
fn a_library_that_is_named_is_the_one_that_the_program_gets() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let at = |name: &str| folder.path().join(name);
    for name in ["bin", "lib", "named"] {
        std::fs::create_dir(at(name)).unwrap();
    }
    let built = Path::new(env!("CARGO_BIN_EXE_tx_run"));
    std::fs::copy(built, at("bin/tx_run")).unwrap();
    let library = built.with_file_name("deps").join("libftMscLib.so");
    std::fs::copy(library, at("lib/libftMscLib.so")).unwrap();
    for (place, value) in [("lib", 1), ("named", 2)] {
        write(folder.path(), "value.c", &format!("int value(void) {{ return {value}; }}\n"));
        shared_library(&at("value.c"), &at(place).join("libvalue.so"), &[]);
    }
    std::fs::remove_file(at("value.c")).unwrap();
    write(folder.path(), "main.c", "int value(void);\nint main(void) { return value(); }\n");
    let mut command = Command::new(at("bin/tx_run"));
    command.args(["--world", "none", "-l", "value", "-L"]).arg(at("named")).arg(at("main.c"));
    let command = command.env("XDG_CACHE_HOME", cache()).env_remove("FT_TXT_HOST");
    let ended = Run::start(command).end();
    assert_eq!(ended.status, Some(2), "{ended:?}");
}
