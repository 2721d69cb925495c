//! A change that the compiler sees is seen: each kind of change, on one tiny program.

use std::fs::{self, Permissions};
use std::os::unix::fs::{symlink, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;

use super::support::{has_compiler, tx_run, write, Run};

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
        source: "__asm__(\".globl d\\nd: .incbin \\\"data\\\"\\n\");\nextern const char d[];\nint main(void) { return d[0] - '0'; }\n",
        before: &[("data", "1")],
        after: &[("data", "2")],
        line: &[],
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
        before: &[("gcc", "compiled with -fsigned-char")],
        after: &[("gcc", "compiled with -funsigned-char")],
        line: &["CC=./gcc"],
        is_kept: true,
    },
];

/// A program that calls the compiler with one more option.
fn compile_compiler(option: &str, to: &Path) {
    let source = format!(
        "#include <unistd.h>\nint main(int n, char **v) {{ char *words[999]; int i;\n\
         for (i = 0; i < n && i < 990; i++) words[i] = v[i];\n\
         words[0] = \"cc\"; words[i] = \"{option}\"; words[i + 1] = 0; execvp(\"cc\", words); return 9; }}\n"
    );
    let text = to.with_extension("compiler.c");
    fs::write(&text, source).unwrap();
    // One that runs is not written to.
    let _ = fs::remove_file(to);
    assert!(Command::new("cc").arg("-w").arg(&text).arg("-o").arg(to).status().unwrap().success());
}

fn put(folder: &Path, files: &[(&str, &str)]) {
    for (name, text) in files {
        if let Some(option) = text.strip_prefix("compiled with ") {
            compile_compiler(option, &folder.join(name));
        } else if let Some(to) = text.strip_prefix("-> ") {
            let _ = fs::remove_file(folder.join(name));
            symlink(to, folder.join(name)).unwrap();
        } else {
            write(folder, name, text);
            fs::set_permissions(folder.join(name), Permissions::from_mode(0o755)).unwrap();
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
                match word.split_once('=').filter(|(name, _)| name.starts_with('C')) {
                    Some((name, value)) => command.env(name, value),
                    None => command.arg(word),
                };
            }
            Run::start(&mut command).end()
        };
        let kept = || -> Vec<PathBuf> {
            fs::read_dir(cache.join("tx_run")).unwrap().map(|it| it.unwrap().path()).collect()
        };
        for _ in 0..2 {
            let ended = status();
            assert_eq!(ended.status, Some(1), "{}: {}", self.name, ended.err);
        }
        assert_eq!(kept().len(), usize::from(self.is_kept), "{}", self.name);
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
    let has_gcc =
        Command::new("gcc").arg("-dumpspecs").output().is_ok_and(|it| it.status.success());
    let cases = CASES.iter().filter(|case| has_gcc || !case.line.contains(&"CC=gcc"));
    let cases: Vec<_> = cases.collect();
    thread::scope(|scope| {
        for part in cases.chunks(cases.len().div_ceil(3)) {
            scope.spawn(move || part.iter().for_each(|case| case.check()));
        }
    });
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
