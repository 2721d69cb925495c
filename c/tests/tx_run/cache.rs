//! A change that the compiler sees is seen: each kind of change, on one tiny program.

use std::fs::{self, Permissions};
use std::os::unix::fs::{symlink, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;

use super::support::{has_compiler, kept_in, tx_run, write, Run};

/// A program whose exit status is 1 before a change and 2 after it.
struct Case {
    name: &'static str,
    source: &'static str,
    /// Further files, and which of them change or come.
    before: &'static [(&'static str, &'static str)],
    after: &'static [(&'static str, &'static str)],
    /// Environment variables, with NAME=TEXT, and then arguments.
    line: &'static [&'static str],
    /// Whether what was compiled is kept before the change.
    is_kept: bool,
}

/// Returns what the header `h.h` says.
const BY_HEADER: &str = "#include \"h.h\"\nint main(void) { return V; }\n";
const BY_DEFINITION: &str = "int main(void) { return V; }\n";
/// Returns the options of the assembler, which count only there.
const BY_ASSEMBLER: &str = "__asm__(\".data\\n.globl d\\nd: .byte V\\n.text\\n\");\n\
    extern const char d;\nint main(void) { return d; }\n";
/// Returns what is in the file `data`.
const INCBIN: &str = "__asm__(\".globl d\\nd: .incbin \\\"data\\\"\\n\");\nextern const char d[];\nint main(void) { return d[0] - '0'; }\n";
/// Returns what is in the file `data`, by a directive in the name of a section.
const SECTION: &str =
    "__attribute__((section(\".data\\n.globl d\\nd: .inc\" \"bin \\\"data\\\"\\n.section .x\")))\n\
    int x = 1;\nextern const char d;\nint main(void) { return d - '0'; }\n";
/// Returns what is in the file beside the header `m/h.h`. The compiler gets a copy of it: `own.h` is spelled as on Windows.
const BESIDE_HEADER: &str =
    "#include \"Own.h\"\n#define HEADER \"m/h.h\"\n#include HEADER\n#include <stdio.h>\n\
    int main(void) { FILE *f = fopen(file(), \"r\"); return f ? getc(f) - '0' : 9; }\n";
/// Knows the file beside it.
const KNOWS_FILE: &str = "static const char *file(void)\n{ static char name[999]; int n = 0;\n\
    for (const char *c = __FILE__; *c; c++) name[n++] = *c;\nname[n - 1] = 'n'; return name; }\n";
const ONE: &str = "#define V 1\n";
const TWO: &str = "#define V 2\n";

const CASES: &[Case] = &[
    Case {
        name: "the source",
        source: "int main(void) { return 1; }\n",
        before: &[],
        after: &[("a.c", "int main(void) { return 2; }\n")],
        line: &[],
        is_kept: true,
    },
    Case {
        name: "a file that __has_include asks for",
        source: "#if __has_include(\"flag.h\")\n#define V 2\n#else\n#define V 1\n#endif\nint main(void) { return V; }\n",
        before: &[],
        after: &[("flag.h", "")],
        line: &[],
        is_kept: true,
    },
    Case {
        name: "a file that only the compiler asks for, with options of a pragma",
        source: "_Pragma(\"GCC optimize(2)\")\n#if defined __OPTIMIZE__ && __has_include(\"flag.h\")\n\
            #define V 2\n#else\n#define V 1\n#endif\nint main(void) { return V; }\n",
        before: &[],
        after: &[("flag.h", "")],
        line: &["CC=gcc"],
        is_kept: false,
    },
    Case {
        name: "a macro in a pragma, which is not in the text of clang",
        source: "#include \"h.h\"\n#pragma pack(push, V)\nstruct Packed { char one; int other; };\n#pragma pack(pop)\n\
            int main(void) { return sizeof(struct Packed) - 4; }\n",
        before: &[("h.h", ONE)],
        after: &[("h.h", TWO)],
        line: &["CC=clang"],
        is_kept: false,
    },
    Case {
        name: "the build folder in the name of a header",
        source: BESIDE_HEADER,
        before: &[("own.h", ""), ("m/h.h", KNOWS_FILE), ("m/h.n", "1")],
        after: &[("m/h.n", "2")],
        line: &[],
        is_kept: false,
    },
    Case {
        name: "what is in a file of options",
        source: BY_DEFINITION,
        before: &[("options", "-DV=1")],
        after: &[("options", "-DV=2")],
        line: &["CFLAGS=@options"],
        is_kept: false,
    },
    Case {
        name: "what is in a specs file",
        source: BY_DEFINITION,
        before: &[("s.specs", "*cc1_options:\n+ -DV=1\n")],
        after: &[("s.specs", "*cc1_options:\n+ -DV=2\n")],
        line: &["CC=gcc", "CFLAGS=-specs=s.specs"],
        is_kept: false,
    },
    Case {
        name: "a file that the assembler reads",
        source: INCBIN,
        before: &[("data", "1")],
        after: &[("data", "2")],
        line: &[],
        is_kept: false,
    },
    Case {
        name: "a file that the assembler in clang reads",
        source: INCBIN,
        before: &[("data", "1")],
        after: &[("data", "2")],
        line: &["CC=clang"],
        is_kept: false,
    },
    Case {
        name: "a header that comes earlier in CPATH",
        source: "#include <h.h>\nint main(void) { return V; }\n",
        before: &[("p2/h.h", ONE)],
        after: &[("p1/h.h", TWO)],
        line: &["CPATH=p1:p2"],
        is_kept: true,
    },
    Case {
        name: "a header that comes earlier behind -idirafter",
        source: BY_HEADER,
        before: &[("p2/h.h", ONE)],
        after: &[("p1/h.h", TWO)],
        line: &["CFLAGS=-idirafter p1 -idirafter p2"],
        is_kept: true,
    },
    Case {
        name: "a header with the name in a macro",
        source: "#define H \"h.h\"\n#include H\nint main(void) { return V; }\n",
        before: &[("p2/h.h", ONE)],
        after: &[("p1/h.h", TWO)],
        line: &["-I", "p1", "-I", "p2"],
        is_kept: true,
    },
    Case {
        name: "a header whose name is on the next line",
        source: "/* x */ #include \\\n\"h.h\"\nint main(void) { return V; }\n",
        before: &[("p2/h.h", ONE)],
        after: &[("p1/h.h", TWO)],
        line: &["-I", "p1", "-I", "p2"],
        is_kept: true,
    },
    Case {
        name: "a header of an option",
        source: BY_DEFINITION,
        before: &[("p2/h.h", ONE)],
        after: &[("p1/h.h", TWO)],
        line: &["CFLAGS=-include h.h -Ip1 -Ip2"],
        is_kept: false,
    },
    Case {
        name: "a header with a name that is hard to write",
        source: "#include \"a b$#\u{f6}/h%\\:.h\"\nint main(void) { return V; }\n",
        before: &[("a b$#\u{f6}/h%\\:.h", ONE)],
        after: &[("a b$#\u{f6}/h%\\:.h", TWO)],
        line: &[],
        is_kept: true,
    },
    Case {
        name: "a header with a name that is hard to write, with clang",
        source: "#include \"a b$#\u{f6}/h%.h\"\nint main(void) { return V; }\n",
        before: &[("a b$#\u{f6}/h%.h", ONE)],
        after: &[("a b$#\u{f6}/h%.h", TWO)],
        line: &["CC=clang"],
        is_kept: true,
    },
    Case {
        name: "a folder behind a link",
        source: BY_HEADER,
        before: &[("p1/h.h", TWO), ("p2/h.h", ONE)],
        after: &[("folder", "-> p1")],
        line: &["-I", "folder"],
        is_kept: true,
    },
    Case {
        name: "a script for the compiler",
        source: BY_DEFINITION,
        before: &[("gcc", "#!/bin/sh\nexec cc -DV=1 \"$@\"\n")],
        after: &[("gcc", "#!/bin/sh\nexec cc -DV=2 \"$@\"\n")],
        line: &["CC=./gcc"],
        is_kept: false,
    },
    Case {
        // What it adds shows in no preprocessor's text.
        name: "another compiler with the same name and version",
        source: "int main(void) { char c = -1; return c < 0 ? 1 : 2; }\n",
        before: &[("gcc", "calls cc -fsigned-char")],
        after: &[("gcc", "calls cc -funsigned-char")],
        line: &["CC=./gcc"],
        is_kept: true,
    },
    Case {
        name: "a file that the assembler reads for the name of a section",
        source: SECTION,
        before: &[("data", "1")],
        after: &[("data", "2")],
        line: &["CC=gcc"],
        is_kept: false,
    },
    Case {
        name: "a specs file in the compiler's own folder",
        source: "int main(void) { char c = -1; return c < 0 ? 1 : 2; }\n",
        before: &[("bin/gcc", "gcc itself")],
        after: &[("lib/gcc/OWN/specs", "*cc1_options:\n+ -funsigned-char\n\n")],
        line: &["CC=bin/gcc"],
        is_kept: true,
    },
    Case {
        name: "another assembler in the compiler's own folder",
        source: BY_ASSEMBLER,
        before: &[
            ("bin/gcc", "gcc itself"),
            ("lib/gcc/OWN/as", "calls /usr/bin/as --defsym=V=1"),
        ],
        after: &[("lib/gcc/OWN/as", "calls /usr/bin/as --defsym=V=2")],
        line: &["CC=bin/gcc"],
        is_kept: true,
    },
    Case {
        name: "another assembler behind one that can't be run",
        source: BY_ASSEMBLER,
        before: &[("p1/as", "no program"), ("p2/as", "calls /usr/bin/as --defsym=V=1")],
        after: &[("p2/as", "calls /usr/bin/as --defsym=V=2")],
        line: &["CC=gcc", "PATH=p1:p2:/usr/bin:/bin"],
        is_kept: true,
    },
    Case {
        name: "a script for the assembler",
        source: BY_ASSEMBLER,
        before: &[
            ("p1/as", "#!/bin/sh\nexec /usr/bin/as --defsym V=`cat v` \"$@\"\n"),
            ("v", "1"),
        ],
        after: &[("v", "2")],
        line: &["CC=gcc", "PATH=p1:/usr/bin:/bin"],
        is_kept: false,
    },
];

/// Writes a program that calls another one with one more option.
fn write_caller(program: &str, option: &str, to: &Path) {
    let source = format!(
        "#include <unistd.h>\nint main(int n, char **v) {{ char *words[999]; int i;\n\
         for (i = 0; i < n && i < 990; i++) words[i] = v[i];\n\
         words[0] = \"{program}\"; words[i] = \"{option}\"; words[i + 1] = 0;\n\
         execvp(words[0], words); return 9; }}\n"
    );
    let text = to.with_extension("caller.c");
    fs::write(&text, source).unwrap();
    compile(&text, to);
}

fn compile(source: &Path, to: &Path) {
    // One that runs is not written to.
    let _ = fs::remove_file(to);
    assert!(Command::new("cc").arg("-w").arg(source).arg("-o").arg(to).status().unwrap().success());
}

/// Whether there is a gcc with the GNU assembler.
fn has_gcc() -> bool {
    let knows_specs = Command::new("gcc").arg("-dumpspecs").output();
    knows_specs.is_ok_and(|it| it.status.success()) && Path::new("/usr/bin/as").exists()
}

/// What gcc says about itself.
fn of_gcc(question: &str) -> PathBuf {
    let output = Command::new("gcc").arg(question).output().unwrap();
    String::from_utf8(output.stdout).unwrap().trim().into()
}

/// The folder of its own files, below `lib/gcc`.
fn own_folder() -> PathBuf {
    of_gcc("-dumpmachine").join(of_gcc("-dumpversion"))
}

/// Puts a gcc here, which has its own files in `../lib/gcc`.
fn put_gcc(to: &Path) {
    let which = Command::new("sh").args(["-c", "command -v gcc"]).output().unwrap();
    let gcc = String::from_utf8(which.stdout).unwrap();
    fs::create_dir_all(to.parent().unwrap()).unwrap();
    fs::copy(gcc.trim(), to).unwrap();
    let own = to.parent().unwrap().join("../lib/gcc").join(own_folder());
    fs::create_dir_all(&own).unwrap();
    for of in ["-print-libgcc-file-name", "-print-prog-name=cc1"] {
        for file in fs::read_dir(of_gcc(of).parent().unwrap()).unwrap() {
            let file = file.unwrap();
            let _ = symlink(file.path(), own.join(file.file_name()));
        }
    }
}

fn put(folder: &Path, files: &[(&str, &str)]) {
    for (name, text) in files {
        let place = match name.strip_prefix("lib/gcc/OWN/") {
            Some(name) => folder.join("lib/gcc").join(own_folder()).join(name),
            None => folder.join(name),
        };
        fs::create_dir_all(place.parent().unwrap()).unwrap();
        if let Some(call) = text.strip_prefix("calls ") {
            let (program, option) = call.split_once(' ').unwrap();
            write_caller(program, option, &place);
        } else if *text == "gcc itself" {
            put_gcc(&place);
        } else if let Some(to) = text.strip_prefix("-> ") {
            let _ = fs::remove_file(&place);
            symlink(to, place).unwrap();
        } else {
            fs::write(&place, text).unwrap();
            let mode = if text.starts_with("#!") { 0o755 } else { 0o644 };
            fs::set_permissions(place, Permissions::from_mode(mode)).unwrap();
        }
    }
}

impl Case {
    fn check(&self) {
        let folder = tempfile::tempdir().unwrap();
        let cache = folder.path().join("cache");
        put(folder.path(), &[("a.c", self.source), ("folder", "-> p2")]);
        put(folder.path(), self.before);
        let status = || {
            let mut command = tx_run(&["a.c", "--world", "none"]);
            command.current_dir(folder.path()).env("XDG_CACHE_HOME", &cache).env("HOME", &cache);
            for word in self.line {
                match word.split_once('=').filter(|(name, _)| name.starts_with(['C', 'P'])) {
                    Some((name, value)) => command.env(name, value),
                    None => command.arg(word),
                };
            }
            let ended = Run::start(&mut command).end();
            assert!(ended.err.contains("runs on"), "{}: {}", self.name, ended.err);
            ended
        };
        for _ in 0..2 {
            let ended = status();
            assert_eq!(ended.status, Some(1), "{}: {}", self.name, ended.err);
        }
        assert_eq!(kept_in(&cache).len(), usize::from(self.is_kept), "{}", self.name);
        put(folder.path(), self.after);
        let ended = status();
        assert_eq!(ended.status, Some(2), "{}: {}", self.name, ended.err);
    }
}

#[test]
fn a_change_that_the_compiler_sees_is_seen() {
    if !has_compiler() {
        return;
    }
    let has_clang = Command::new("clang").arg("--version").output().is_ok();
    let cases = CASES.iter().filter(|case| match case.line.first() {
        Some(&("CC=gcc" | "CC=bin/gcc")) => has_gcc(),
        Some(&"CC=clang") => has_clang,
        _ => true,
    });
    let cases: Vec<_> = cases.collect();
    thread::scope(|scope| {
        for part in cases.chunks(cases.len().div_ceil(3)) {
            scope.spawn(move || part.iter().for_each(|case| case.check()));
        }
    });
}

/// A program that calls the compiler with an option, after a script that is there once: `asked` when it is asked what it
/// would do, `compiled` when it compiles.
fn write_compiler_with_scripts(option: &str, to: &Path) {
    let source = format!(
        "#include <stdlib.h>\n#include <string.h>\n#include <unistd.h>\n\
         int main(int n, char **v) {{ char *words[999]; int i;\n\
         for (i = 0; i < n && i < 990; i++) {{ words[i] = v[i];\n\
         if (!strcmp(v[i], \"-###\")) system(\"test -x asked && ./asked && rm asked\");\n\
         if (!strcmp(v[i], \"-S\")) system(\"test -x compiled && ./compiled && rm compiled\"); }}\n\
         words[0] = \"/usr/bin/gcc\"; words[i] = \"{option}\"; words[i + 1] = 0;\n\
         execv(words[0], words); return 9; }}\n"
    );
    let text = to.with_extension("scripts.c");
    fs::create_dir_all(to.parent().unwrap()).unwrap();
    fs::write(&text, source).unwrap();
    compile(&text, to);
}

/// Runs a program with this compiler in place of which these scripts put another one, then puts back the first one.
fn check_with_another_compiler(compiler: &str, scripts: &[(&str, &str)], back: &str) {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    for (of, option) in [("p1/gcc", "-fsigned-char"), ("p2/gcc", "-funsigned-char")] {
        write_compiler_with_scripts(option, &folder.path().join(of));
    }
    let source = "int main(void) { char c = -1; return c < 0 ? 1 : 2; }\n";
    put(folder.path(), &[("a.c", source), ("gcc", "-> p1/gcc"), ("back", back)]);
    put(folder.path(), scripts);
    let status = || {
        let mut command = tx_run(&["a.c", "--world", "none"]);
        command.current_dir(folder.path()).env("XDG_CACHE_HOME", &cache).env("HOME", &cache);
        command.env("CC", compiler).env("PATH", "p0:p1:/usr/bin:/bin");
        Run::start(&mut command).end().status
    };
    assert_eq!(status(), Some(2), "{compiler}: the other one compiles");
    assert!(Command::new("./back").current_dir(folder.path()).status().unwrap().success());
    for _ in 0..2 {
        assert_eq!(status(), Some(1), "{compiler}: {scripts:?}");
    }
    assert_eq!(kept_in(&cache).len(), 1, "{compiler}: {scripts:?}");
}

/// It is there while it compiles, or until the end. Nothing of it is kept.
#[test]
fn what_another_compiler_has_made_for_a_moment_is_not_kept() {
    if !has_compiler() || !has_gcc() || !Path::new("/usr/bin/gcc").exists() {
        return;
    }
    let to_p2 = "#!/bin/sh\nln -sfn p2/gcc gcc\n";
    let to_p1 = "#!/bin/sh\nln -sfn p1/gcc gcc\n";
    let first_in_path = "#!/bin/sh\nmkdir p0; cp p2/gcc p0/gcc\n";
    check_with_another_compiler("./gcc", &[("asked", to_p2)], to_p1);
    let both = [("asked", to_p2), ("compiled", to_p1)];
    check_with_another_compiler("./gcc", &both, "#!/bin/sh\n");
    check_with_another_compiler("gcc", &[("asked", first_in_path)], "#!/bin/sh\nrm -r p0\n");
}

/// gcc reads it in place of the header, also one that is older. What it makes of it is not kept.
#[test]
fn a_precompiled_header_that_is_gone_leaves_nothing_wrong() {
    if !has_compiler() || !has_gcc() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, "a.c", BY_HEADER);
    write(path, "h.h", ONE);
    let mut gcc = Command::new("gcc");
    gcc.args(["-std=gnu11", "-O0", "-g", "-x", "c-header", "h.h", "-o", "h.h.gch"]);
    assert!(gcc.current_dir(path).status().unwrap().success());
    write(path, "h.h", TWO);
    let status = || {
        let mut command = tx_run(&["a.c", "-std=gnu11", "--world", "none"]);
        command.current_dir(path).env("XDG_CACHE_HOME", path.join("cache")).env("CC", "gcc");
        Run::start(&mut command).end().status
    };
    assert_eq!(status(), Some(1), "gcc does not read it");
    fs::remove_file(path.join("h.h.gch")).unwrap();
    assert_eq!(status(), Some(2));
}

/// The preprocessor, or only what comes after it, sees another header, which is there again when that is done. What is kept
/// is of the header that the preprocessor has seen.
#[test]
fn a_header_that_changes_for_a_moment_leaves_nothing_wrong() {
    if !has_compiler() {
        return;
    }
    for [begin, before, after] in [
        ["mkdir inc; cp v1/h.h inc", "cp v2/h.h inc", "cp v1/h.h inc"],
        ["ln -s v1 inc", "ln -sfn v2 inc", "ln -sfn v1 inc"],
        ["ln -s v1 now; ln -s now inc", "ln -sfn v2 now", "ln -sfn v1 now"],
        ["mv v1 inc", "mv inc v1; mv v2 inc", "mv inc v2; mv v1 inc; touch inc/a; rm inc/a"],
        ["mkdir -p first/inc; mv v1 inc", "cp v2/h.h first/inc", "rm first/inc/h.h"],
    ] {
        for (step, first) in [("-E", 2), ("-S", 1)] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path();
            write(path, "cc.c", &CHANGES_HEADER.replace("STEP", step));
            compile(&path.join("cc.c"), &path.join("cc"));
            write(path, "a.c", "#include <inc/h.h>\nint main(void) { return V; }\n");
            write(path, "v1/h.h", "#define V 1\n");
            write(path, "v2/h.h", "#define V 2\n");
            let begun = Command::new("sh").args(["-c", begin]).current_dir(path).status();
            assert!(begun.unwrap().success());
            write(path, "before", before);
            write(path, "after", after);
            for status in [first, 1, 1] {
                let mut command = tx_run(&["a.c", "--world", "none", "-I", "first", "-I", "."]);
                command.current_dir(path).env("XDG_CACHE_HOME", path.join("cache"));
                let ended = Run::start(command.env("CC", "./cc")).end();
                assert_eq!(ended.status, Some(status), "{before} {step}: {}", ended.err);
                assert_eq!(fs::read_to_string(path.join("inc/h.h")).unwrap(), "#define V 1\n");
                let _ = fs::remove_file(path.join("before"));
            }
            let kept = kept_in(&path.join("cache")).len();
            assert_eq!(kept, first as usize, "{before} {step}");
        }
    }
}

/// Runs `cc`, and scripts before and after it at this step.
const CHANGES_HEADER: &str = r##"
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
int main(int n, char **v) {
    int i, compiles = 0, status = 0;
    for (i = 1; i < n; i++) compiles |= !strcmp(v[i], "STEP");
    compiles = compiles && access("before", F_OK) == 0;
    if (compiles) status |= system("sh before");
    if (fork() == 0) { v[0] = "cc"; execvp("cc", v); _exit(9); }
    wait(&i);
    if (compiles) status |= system("sh after");
    return (status | i) != 0;
}
"##;

/// A comment may be for the compiler, and the preprocessor's text has none.
#[test]
fn a_comment_in_a_header_counts_for_warnings() {
    if !has_compiler() || !has_gcc() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, "a.c", "int x;\n#include \"h.h\"\nint main(void) { return f(0); }\n");
    let header = |comment: &str| {
        let text = format!("static int f(int a) {{\n switch (a) {{\n case 1: x = 1;\n{comment}\n default: x = 0;\n }}\n return x;\n}}\n");
        write(path, "h.h", &text);
    };
    let warns = || {
        let mut command = tx_run(&["a.c", "--world", "none"]);
        command.current_dir(path).env("XDG_CACHE_HOME", path.join("cache"));
        command.env("CC", "gcc").env("CFLAGS", "-Wimplicit-fallthrough");
        let ended = Run::start(&mut command).end();
        ended.well();
        ended.err.contains("fall through")
    };
    for comment in ["/* fall through */", "", "/* fall through */"] {
        header(comment);
        for _ in 0..2 {
            assert_eq!(warns(), comment.is_empty());
        }
    }
}

/// clang writes such a name with the numbers of its bytes.
#[test]
fn a_comment_counts_in_a_file_whose_name_has_umlauts() {
    if !has_compiler() || Command::new("clang").arg("--version").output().is_err() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for comment in ["one", "two"] {
        let source =
            format!("int main(void)\n{{\n    if (0); /* {comment} */\n    return 0;\n}}\n");
        write(path, "j\u{f6}rg/b.c", &source);
        let mut command = tx_run(&["j\u{f6}rg/b.c", "--world", "none"]);
        command.current_dir(path).env("XDG_CACHE_HOME", path.join("cache")).env("CC", "clang");
        let ended = Run::start(&mut command).end();
        ended.well();
        assert!(ended.err.contains(&format!("/* {comment} */")), "{}", ended.err);
    }
}

/// What the preprocessor leaves of a source has other spaces, and the places of what stands in its macros.
#[test]
fn warnings_are_those_of_the_source() {
    if !has_compiler() || !has_gcc() {
        return;
    }
    let cases = [
        (
            "int f(int x) {\n    if (x)\n        return 1;\n        x = 3;\n    return x;\n}\n\
             int main(void) { return f(0) - 3; }\n",
            "-Wmisleading-indentation",
            "a.c:2:5: ",
        ),
        (
            "#pragma GCC diagnostic warning \"-Wmisleading-indentation\"\n\
             int main(void) {\n    if (0)\n        return 1;\n        return 0;\n}\n",
            "",
            "a.c:3:5: ",
        ),
        (
            "#include <stddef.h>\nint main(int n, char **v) { return   n == NULL; }\n",
            "",
            "a.c:2:40: ",
        ),
    ];
    for (source, flags, place) in cases {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        write(path, "a.c", source);
        for _ in 0..2 {
            let mut command = tx_run(&["a.c", "--world", "none"]);
            command.current_dir(path).env("XDG_CACHE_HOME", path.join("cache"));
            let ended = Run::start(command.env("CC", "gcc").env("CFLAGS", flags)).end();
            ended.well();
            assert!(ended.err.contains(&format!("{place}warning: ")), "{}", ended.err);
        }
        assert_eq!(kept_in(&path.join("cache")).len(), 1);
    }
}

#[test]
fn what_lies_in_a_folder_of_others_is_not_run() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    fs::create_dir_all(cache.join("tx_run")).unwrap();
    fs::set_permissions(cache.join("tx_run"), Permissions::from_mode(0o777)).unwrap();
    write(folder.path(), "a.c", "int main(void) { return 0; }\n");
    let mut command = tx_run(&["a.c", "--world", "none"]);
    command.current_dir(folder.path()).env("XDG_CACHE_HOME", &cache).env("HOME", &cache);
    let ended = Run::start(&mut command).end();
    ended.well();
    assert!(
        ended.err.contains("everything is compiled anew, because others can write to"),
        "{ended:?}"
    );
    assert_eq!(fs::read_dir(cache.join("tx_run")).unwrap().count(), 0);
}
