//! What can't be run is answered with a sentence.

use std::fs;
use std::path::MAIN_SEPARATOR;
use std::process::Command;

use super::ends::WRONG_POINTER;
#[cfg(unix)]
use super::support::make_pipe;
use super::support::{has_compiler, program, tx_run, write, Run};

const TIC: &str = "#include \"ROBO_TX_PRG.h\"\nint PrgTic(TA *p, int n) { return 0; }\n";
const INIT: &str = "#include \"ROBO_TX_PRG.h\"\nvoid PrgInit(TA *p, int n) { }\n";
const MAIN: &str = "int main(void) { return 3; }\n";

/// Runs sources with these texts.
fn run(texts: &[&str]) -> super::support::Ended {
    let folder = tempfile::tempdir().unwrap();
    let mut command = tx_run(&[]);
    for (index, text) in texts.iter().enumerate() {
        let path = folder.path().join(format!("part{index}.c"));
        fs::write(&path, text).unwrap();
        command.arg(path);
    }
    Run::start(&mut command).end()
}

#[test]
fn a_program_has_one_beginning() {
    if !has_compiler() {
        return;
    }
    run(&["int a;"]).badly("neither PrgTic nor main");
    run(&[INIT]).badly("there is no PrgTic");
    run(&[TIC]).badly("there is no PrgInit");
    run(&[TIC, TIC, INIT]).badly("more than one PrgTic");
    run(&[TIC, INIT, MAIN]).badly("a program begins with one of them");
    let ended = run(&[MAIN]);
    ended.badly("ended with the exit status 3");
    assert_eq!(ended.status, Some(3));
    run(&[TIC, INIT]).well();
}

/// A program that waits for its controller in this way would fill a disk.
#[test]
fn a_device_that_is_opened_in_a_loop_fails_with_one_sentence() {
    if !has_compiler() {
        return;
    }
    const LOOP: &str = "#include <windows.h>\n#include \"ftMscLib.h\"\nint main(void)\n{\n\
        DWORD error = 0;\n int attempt;\n ftxInitLib();\n for (attempt = 0; attempt < 50; attempt++)\n\
        if (ftxOpenComDevice(\"COM4\", 38400, &error) != NULL) return 5;\n return 3;\n}\n";
    let nobody = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "loop.c", LOOP);
    let mut command = tx_run(&["--host", &nobody.to_string()]);
    let ended = Run::start(command.arg(folder.path().join("loop.c"))).end();
    assert_eq!(ended.status, Some(3), "{ended:?}");
    assert_eq!(ended.err.matches("no controller was found").count(), 1, "{ended:?}");
    // Nor does one that waits for its second one.
    let first = LOOP.replace("for (", "ftxOpenComDevice(\"10.0.0.1\", 38400, &error);\n for (");
    write(folder.path(), "loop.c", &first.replace("COM4", "10.0.0.2"));
    let ended = Run::start(tx_run(&["--world", "none"]).arg(folder.path().join("loop.c"))).end();
    assert_eq!(ended.status, Some(3), "{ended:?}");
    assert_eq!(ended.err.matches("tx_run has given the program one controller").count(), 1);
}

#[test]
fn a_name_in_capital_letters_is_c() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("STOPGO.C");
    fs::write(&path, "int main(void) { int class = 0; return class; }\n").unwrap();
    Run::start(tx_run(&[]).arg(path)).end().well();
}

#[cfg_attr(windows, ignore = "the compiler for it is a program for Unix")]
#[test]
fn more_text_than_a_program_has_is_not_read() {
    if !has_compiler() {
        return;
    }
    const MORE: u64 = 101 << 20;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let run = |named: &str, compiler: &str| {
        let mut command = tx_run(&[named, "--world", "none"]);
        command.current_dir(path).env("XDG_CACHE_HOME", path.join("cache")).env("CC", compiler);
        Run::start(&mut command).end()
    };
    fs::File::create(path.join("large.c")).unwrap().set_len(MORE).unwrap();
    run("large.c", "cc").badly("large.c can't be read: it has more than 100 MB");
    // Any file may be named there.
    write(path, "named.c", "int main(void) { return 0; }\n#line 1 \"large.c\"\n");
    run("named.c", "cc").badly("named.c: the files that it is from have more than 100 MB");
    write(path, "a.c", "int main(void) { return 0; }\n");
    write(path, "cc.c", PADS);
    let compiled = Command::new("cc").current_dir(path).args(["-w", "cc.c", "-o", "cc"]).status();
    assert!(compiled.unwrap().success());
    run("a.c", "./cc").badly("a.c: the output of ./cc has more than 100 MB");
}

/// A compiler whose preprocessor writes many empty lines.
const PADS: &str = r#"
#include <stdio.h>
#include <string.h>
#include <unistd.h>
int main(int n, char **v) {
    int i;
    for (i = 1; i < n; i++)
        if (!strcmp(v[i], "-E") && strcmp(v[n - 1], "-"))
            for (i = 0; i < 101 << 20; i++) putchar('\n');
    fflush(stdout);
    v[0] = "cc";
    execvp("cc", v);
    return 9;
}
"#;

#[test]
fn messages_of_the_compiler_are_passed_on() {
    if !has_compiler() {
        return;
    }
    let ended = run(&["int main(void) { return nonsense; }\n"]);
    ended.badly("part0.c does not compile");
    assert!(ended.err.contains("part0.c:1:") && ended.err.contains("nonsense"), "{}", ended.err);
    run(&["int f(void);\nint main(void) { return f(); }\n"]).badly("can't be linked");
}

#[test]
fn a_long_in_place_of_a_dword_is_told() {
    // Where a long has 4 bytes there is nothing to tell.
    if !has_compiler() || cfg!(any(windows, target_pointer_width = "32")) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, text: &str| {
        write(folder.path(), name, text);
        Run::start(tx_run(&[name]).current_dir(folder.path())).end()
    };
    let text = "#include <windows.h>\n#include \"ftMscLib.h\"\n\
                static void __stdcall reached(unsigned long a, unsigned long b) {}\n\
                int main(void) { unsigned long error = 0; ftxOpenComDevice((char *) \"\", 0, &error); return 0; }\n";
    let told = "unsigned long has 8 bytes here: write DWORD, which has 4 as on Windows";
    run("pointer.cpp", text).badly(told);
    // Compilers only warn of it in C.
    let ended = run("pointer.c", text);
    assert!(ended.err.contains(told), "{}", ended.err);
    let call = text.replace(
        "unsigned long error = 0;",
        "SetCBMotorExReached(reached); return 0; DWORD error;",
    );
    run("callback.cpp", &call).badly(told);
    let right = text.replace("unsigned long", "DWORD");
    let ended = run("right.cpp", &right);
    ended.well();
    assert!(!ended.err.contains(told), "{}", ended.err);
}

#[test]
fn what_a_program_lacks_of_its_own_is_named() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let run = |arguments: &[&str]| Run::start(tx_run(arguments).current_dir(path)).end();
    write(path, "src/main.c", "#include \"axis.h\"\nint main(void) { return axis_move(0); }\n");
    write(path, "src/axis.c", "int axis_move(int way)\n{\n    return way;\n}\n");
    run(&["src/main.c"]).badly("does not compile; axis.h is missing: name its folder with -I");
    write(path, "inc/axis.h", "int axis_move(int way);\n");
    run(&["src/main.c"]).badly("src/main.c does not compile; axis.h is found with -I inc");
    let has_it = format!("; src{MAIN_SEPARATOR}axis.c has axis_move: name this file, too");
    run(&["src/main.c", "-I", "inc"]).badly(&has_it);
    run(&["src/main.c", "src/axis.c", "-I", "inc"]).well();
    fs::remove_file(path.join("src/axis.c")).unwrap();
    run(&["src/main.c", "-Iinc"]).badly("; no source here has axis_move: a file is missing");
}

#[test]
fn a_world_for_several_programs_names_the_command_for_it() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, "a.c", MAIN);
    let two = "[[controllers]]\nname = \"a\"\n[[controllers]]\nname = \"b\"\n";
    write(path, "two.toml", two);
    for world in ["factory", "two.toml"] {
        let ended = Run::start(tx_run(&["a.c", "--world", world]).current_dir(path)).end();
        ended.badly(&format!("start it with txt simulate --world {world}, and give each program"));
        assert!(ended.err.contains("--host"), "{}", ended.err);
    }
}

#[test]
fn without_a_compiler_there_is_a_sentence() {
    let mut command = tx_run(&[]);
    Run::start(command.arg(program("motor.c")).env("PATH", "").env_remove("CC"))
        .end()
        .badly("no C compiler is found: neither cc nor gcc nor clang");
    let mut command = tx_run(&[]);
    Run::start(command.arg(program("motor.c")).env("CC", "/none/cc -m32"))
        .end()
        .badly("the compiler /none/cc can't be started");
}

#[test]
fn sources_hosts_and_worlds_that_are_not_there_are_named() {
    Run::start(&mut tx_run(&["/none/a.c"])).end().badly("/none/a.c can't be read");
    #[cfg(unix)]
    {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("a.c");
        make_pipe(&pipe);
        Run::start(tx_run(&[]).arg(pipe)).end().badly("a.c is neither a file nor a folder");
    }
    Run::start(&mut tx_run(&["a.txt"])).end().badly("a.txt is neither a source");
    Run::start(&mut tx_run(&[])).end().badly("no source");
    if !has_compiler() {
        return;
    }
    let motor = program("motor.c");
    let motor = motor.to_str().unwrap();
    Run::start(&mut tx_run(&[motor, "--world", "mars"])).end().badly("mars");
    let ended = Run::start(&mut tx_run(&[motor, "--host", "127.0.0.1:1"])).end();
    ended.badly("no controller at 127.0.0.1:1");
    assert_eq!(ended.status, Some(1));
    Run::start(&mut tx_run(&[motor, "--host", "a:b:c:d"])).end().badly("a:b:c:d");
}

#[test]
fn a_crash_before_the_program_begins_is_named() {
    if !has_compiler() {
        return;
    }
    let crash = "__attribute__((constructor)) static void f(void) { *(volatile int *)8 = 1; }\n";
    run(&[TIC, INIT, crash]).badly(&format!("was ended by {WRONG_POINTER}"));
    let crash = INIT.replace("{ }", "{ *(volatile int *)8 = 1; }");
    run(&[TIC, &crash]).badly(&format!("crashed in PrgInit with {WRONG_POINTER}"));
}
