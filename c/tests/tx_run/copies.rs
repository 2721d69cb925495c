//! Sources that are compiled as copies, because they include headers by other spellings.

use super::support::{has_compiler, run_files, tx_run, write, Run};

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
        "#inc\\\nlude \"val.h\"",
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
        run_files(&files, &["m.c", "-I", "a", "-I", "b"])
    };
    ended("ROBO_TX_FW.h").well();
    ended("robo_tx_fw.h").badly("config.h: with #include_next a header has to spell its includes");
    // A copy of what lies beside the source finds what the header itself does.
    let main = "#include \"util.h\"\nint main(void) { return (int)strlen(\"\"); }\n";
    let util = "#include \"robo_tx_fw.h\"\n#include_next <string.h>\n";
    run_files(&[("m.c", main), ("util.h", util)], &["m.c"]).well();
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
