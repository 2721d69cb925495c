//! A program of several folders, with threads, classes and headers of that time: `programs/line`.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Once;

use super::support::{has_compiler, kept_in, program, tx_run, txt, wait_for, write, Ended, Run};

/// The options that its makefile had.
const OPTIONS: [&str; 8] = [
    "-I",
    "inc",
    "-Ideps/include",
    "-D",
    "LAMP_DUTY=77",
    "-std=c++11",
    "-lKeLibTxt",
    "-lMotorIOLib",
];

/// A copy of the program, which tests may change, with a cache of its own.
struct Line {
    folder: tempfile::TempDir,
}

impl Line {
    fn new() -> Option<Self> {
        if !has_compiler() {
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        copy(&program("line"), folder.path());
        Some(Self { folder })
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = tx_run(arguments);
        command.current_dir(self.path()).env("XDG_CACHE_HOME", self.path().join("cache"));
        command.env("HOME", self.path().join("cache"));
        command.env("CC", compilers().join("cc")).env("CXX", compilers().join("c++"));
        command.env("LOG", self.path().join("log"));
        command
    }

    /// Runs it with these sources, so that it only says what it is made of.
    fn run(&self, sources: &[&str]) -> Ended {
        let mut command = self.command(&[sources, &OPTIONS, &["--", "say"]].concat());
        let ended = Run::start(&mut command).end();
        ended.well();
        assert_eq!(ended.out, "lamp 77\n");
        ended
    }

    /// The names of the sources that were compiled since this was asked last.
    fn compiled(&self) -> Vec<String> {
        let log = self.path().join("log");
        let text = fs::read_to_string(&log).unwrap_or_default();
        let _ = fs::remove_file(log);
        let name_of =
            |line: &str| Path::new(line).file_stem().unwrap().to_str().unwrap().to_owned();
        let names = text.lines().map(name_of);
        // It is a part of `tx_run`.
        let mut names: Vec<String> = names.filter(|name| name != "end_first").collect();
        names.sort();
        names
    }

    /// The entries of its cache.
    fn cached(&self) -> Vec<PathBuf> {
        kept_in(&self.path().join("cache"))
    }
}

/// Calls the compiler with its own name, and leaves a line for each source, or text of one, that it compiles.
const COMPILER: &str = r#"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
int main(int n, char **v) {
    int i, compiles = 0, is_text = 0;
    FILE *log = fopen(getenv("LOG"), "a");
    for (i = 1; i < n; i++) {
        compiles |= !strcmp(v[i], "-c");
        is_text |= !strcmp(v[i], "-S");
    }
    for (i = 1; i < n; i++) {
        char *name = strrchr(v[i], '/'), *end = strrchr(v[i], '.');
        int is_source = end && (!strcmp(end, ".c") || !strcmp(end, ".cpp"));
        if (compiles && is_source) fprintf(log, "%s\n", v[i]);
        /* Before the name of the source is its number. */
        if (is_text && name && end && !strcmp(end, ".text")) fprintf(log, "%s\n", strchr(name, '_') + 1);
    }
    fclose(log);
    v[0] = strrchr(v[0], '/') + 1;
    execvp(v[0], v);
    return 9;
}
"#;

/// The folder with such compilers. They are programs, since what a script compiles is not kept.
fn compilers() -> PathBuf {
    static MADE: Once = Once::new();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compilers");
    MADE.call_once(|| {
        write(&folder, "compiler.c", COMPILER);
        for name in ["cc", "c++"] {
            let mut compiler = Command::new("cc");
            let compiler = compiler.current_dir(&folder).args(["compiler.c", "-o", "new"]);
            assert!(compiler.status().unwrap().success());
            fs::rename(folder.join("new"), folder.join(name)).unwrap();
        }
    });
    folder
}

fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).unwrap() {
        let from = entry.unwrap().path();
        let to = to.join(from.file_name().unwrap());
        if from.is_dir() {
            fs::create_dir(&to).unwrap();
            copy(&from, &to);
        } else {
            fs::copy(from, to).unwrap();
        }
    }
}

const ALL: [&str; 3] = ["axis", "lamp", "main"];
const SOURCES: [&str; 3] = ["src/main.cpp", "lib", "lib/io"];

#[test]
fn a_program_of_several_folders_drives_its_axes() {
    let Some(line) = Line::new() else { return };
    let txt = txt().start().unwrap();
    let host = txt.address().to_string();
    let run = Run::start(&mut line.command(&[&SOURCES, &OPTIONS[..], &["--host", &host]].concat()));
    wait_for(&txt, "both axes look for their switches", |machine| {
        let duty = machine.controllers[0].outputs.duty;
        (duty[0], duty[2], duty[7]) == (512, 512, 77)
    });
    txt.with_machine(|machine| machine.controllers[0].uni[..2].fill(1));
    let ended = run.end();
    ended.well();
    assert_eq!(ended.out, "one two done\n");
}

#[test]
fn a_program_of_several_folders_is_compiled_once() {
    let Some(line) = Line::new() else { return };
    let ended = line.run(&SOURCES);
    assert_eq!(line.compiled(), ALL);
    // Which copies are passed over is said once, and what the kind is.
    let over =
        "in place of deps/include/FtShmem.h, deps/include/KeLibTxtDl.h, deps/include/common.h\n";
    assert_eq!(ended.err.matches(over).count(), 1, "{}", ended.err);
    assert!(ended.err.contains("main, a program for the TXT itself, runs on"), "{}", ended.err);
    line.run(&SOURCES);
    assert_eq!(line.compiled(), [""; 0]);

    // Only what includes a header that has changed is compiled again, and with other options everything.
    let axis = line.path().join("inc/line/axis.h");
    let text = fs::read_to_string(&axis).unwrap();
    fs::write(&axis, text + "typedef int longer;\n").unwrap();
    line.run(&SOURCES);
    assert_eq!(line.compiled(), ["axis", "main"]);
    fs::write(
        line.path().join("inc/line/lamp.h"),
        "extern \"C\" int lamp_duty(int);\n#error old\n",
    )
    .unwrap();
    let arguments = [&SOURCES[..], &OPTIONS].concat();
    Run::start(&mut line.command(&arguments)).end().badly("main.cpp does not compile");
}

#[test]
fn other_options_and_a_header_that_comes_before_compile_again() {
    let Some(line) = Line::new() else { return };
    line.run(&SOURCES);
    line.compiled();
    let more = [&SOURCES[..], &["-D", "MORE"]].concat();
    line.run(&more);
    assert_eq!(line.compiled(), ALL);
    // Beside the source it is found first.
    write(line.path(), "lib/io/line/lamp.h", "int lamp_duty(int on);\n");
    line.run(&SOURCES);
    assert_eq!(line.compiled(), ["lamp"]);
}

/// Its main function is in C and comes from `tx_run`.
#[test]
fn a_downloaded_program_is_compiled_once() {
    let Some(line) = Line::new() else { return };
    let text = "#include \"ROBO_TX_PRG.h\"\nextern \"C\" void PrgInit(TA *, int) {}\n\
                extern \"C\" int PrgTic(TA *, int) { return 0; }\n";
    write(line.path(), "tic.cpp", text);
    for compiled in [&["tic", "tx_main"][..], &[]] {
        Run::start(&mut line.command(&["tic.cpp"])).end().well();
        assert_eq!(line.compiled(), compiled);
    }
}

#[test]
fn a_broken_cache_is_made_again() {
    let Some(line) = Line::new() else { return };
    line.run(&SOURCES);
    line.compiled();
    let entries = line.cached();
    assert_eq!(entries.len(), 3);
    fs::write(&entries[0], "").unwrap();
    fs::write(&entries[1], "tx_run 3\nnonsense\n").unwrap();
    let mut bytes = fs::read(&entries[2]).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&entries[2], bytes).unwrap();
    line.run(&SOURCES);
    assert_eq!(line.compiled(), ALL);
    line.run(&SOURCES);
    assert_eq!(line.compiled(), [""; 0]);
    // No folder can be made here, which is not an error.
    fs::remove_dir_all(line.path().join("cache")).unwrap();
    fs::write(line.path().join("cache"), "").unwrap();
    line.run(&SOURCES);
    line.run(&SOURCES);
    assert_eq!(line.compiled().len(), 6);
}

#[test]
fn several_may_run_at_once() {
    let Some(line) = Line::new() else { return };
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| line.run(&SOURCES));
        }
    });
    line.compiled();
    assert_eq!(line.cached().len(), 3, "nothing unfinished is left");
    line.run(&SOURCES);
    assert_eq!(line.compiled(), [""; 0]);
}

#[test]
fn compiled_files_archives_and_libraries_are_linked() {
    let Some(line) = Line::new() else { return };
    let run = |program: &str, arguments: &[&str]| {
        let mut command = Command::new(program);
        let status = command.args(arguments).current_dir(line.path()).status().unwrap();
        assert!(status.success(), "{program} {arguments:?}");
    };
    let lamp = ["-funsigned-char", "-Iinc/line", "-DLAMP_DUTY=77", "lib/io/lamp.c"];
    fs::write(
        line.path().join("lib/io/lamp.c"),
        fs::read_to_string(line.path().join("lib/io/lamp.c")).unwrap().replace("line\\", ""),
    )
    .unwrap();
    run("cc", &[&["-c", "-o", "lamp.o"], &lamp[..]].concat());
    line.run(&["src/main.cpp", "lib", "lamp.o"]);
    run("ar", &["rcs", "liblamp.a", "lamp.o"]);
    line.run(&["src/main.cpp", "lib", "liblamp.a"]);
    line.run(&["src/main.cpp", "lib", "-L", ".", "-l", "lamp"]);
    fs::remove_file(line.path().join("liblamp.a")).unwrap();
    fs::create_dir(line.path().join("so")).unwrap();
    run("cc", &[&["-shared", "-fPIC", "-o", "so/liblamp.so"], &lamp[..]].concat());
    // It is also found when the program runs.
    line.run(&["src/main.cpp", "lib", "so/liblamp.so"]);
    line.run(&["src/main.cpp", "lib", "-Lso", "-llamp"]);
    let mut command =
        line.command(&[&["src/main.cpp", "lib"], &OPTIONS[..], &["--", "say"]].concat());
    let ended = Run::start(
        command.env("LDFLAGS", "-Lso -Wl,-rpath,so").env("LDLIBS", "-llamp -lROBOProLib"),
    )
    .end();
    ended.well();
    assert_eq!(ended.out, "lamp 77\n");
    assert_eq!(line.compiled().into_iter().filter(|name| name == "main").count(), 1);
}

#[test]
fn what_is_missing_is_named_with_its_package() {
    let Some(line) = Line::new() else { return };
    let run = |arguments: &[&str]| Run::start(&mut line.command(arguments)).end();
    write(line.path(), "a.cpp", "int main() { return 0; }\n");
    let ended = run(&["a.cpp", "-l", "opencv_of_nowhere", "-lof_nowhere"]);
    ended.badly("can't be linked");
    assert!(ended
        .err
        .contains("opencv_of_nowhere is missing, which is in Debian's package libopencv-dev"));
    assert!(ended.err.contains("; the library of_nowhere is missing\n"), "{}", ended.err);
    write(line.path(), "b.cpp", "#include <spdlog/of_nowhere.h>\nint main() { return 0; }\n");
    run(&["b.cpp"]).badly("spdlog/of_nowhere.h is in Debian's package libspdlog-dev");
    write(line.path(), "c.cpp", "namespace fmt { void f(); }\nint main() { fmt::f(); }\n");
    run(&["c.cpp"]).badly("can't be linked; fmt:: is in a library: add -l fmt");
    run(&["lib/io", "nothing.o"]).badly("nothing.o can't be read");
    run(&["lib/io", "nothing"]).badly("there is no folder nothing");
    run(&["inc"]).badly("there is no source in inc");
    run(&["lib", "lib/axis.cpp"]).badly("lib/axis.cpp is named twice");
    run(&["a.cpp", "-O2"]).badly("CXXFLAGS");
}

#[test]
fn a_program_may_be_compiled_with_any_warnings_as_errors() {
    let Some(line) = Line::new() else { return };
    write(line.path(), "a.c", "int main(void);\nint main(void) { return 0; }\n");
    for flags in ["-Werror -Wmissing-prototypes -Wsign-conversion", "-Werror -Wall -Wextra"] {
        Run::start(line.command(&["a.c"]).env("CFLAGS", flags)).end().well();
    }
}

#[test]
fn warnings_are_shown_at_each_start() {
    let Some(line) = Line::new() else { return };
    write(line.path(), "a.c", "#warning look here\nint main(void) { return 0; }\n");
    for _ in 0..2 {
        let ended = Run::start(&mut line.command(&["a.c"])).end();
        ended.well();
        assert!(ended.err.contains("look here"), "{}", ended.err);
    }
    assert_eq!(line.compiled(), ["a"]);
}

#[test]
fn an_interruption_while_it_compiles_is_none_of_the_sources() {
    let Some(line) = Line::new() else { return };
    let begun = line.path().join("begun");
    let script = format!(
        "#!/bin/sh\ncase \"$*\" in *-c*) : >\"{}\"; exec sleep 600;; esac\nexec cc \"$@\"\n",
        begun.display()
    );
    write(line.path(), "cc", &script);
    fs::set_permissions(line.path().join("cc"), Permissions::from_mode(0o755)).unwrap();
    write(line.path(), "a.c", "int main(void) { return 0; }\n");
    for (signal, name) in [(libc::SIGINT, "Ctrl-C"), (libc::SIGTERM, "SIGTERM")] {
        let _ = fs::remove_file(&begun);
        let run = Run::start(line.command(&["a.c"]).env("CC", line.path().join("cc")));
        super::support::wait_until("the compiler has begun", || begun.exists());
        run.signal(signal);
        let ended = run.end();
        ended.badly(&format!("ended by {name} while the program was compiled"));
        assert!(!ended.err.contains("does not compile"), "{}", ended.err);
        assert_eq!(ended.status, Some(1));
    }
}
