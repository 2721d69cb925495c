//! Programs with libraries, of the system and of their own.

#[cfg(target_os = "linux")]
use std::path::Path;
#[cfg(target_os = "linux")]
use std::process::Command;

#[cfg(target_os = "linux")]
use super::support::{cache, shared_library, tx_run, write, Run};
use super::support::{has_compiler, run_files};

#[test]
fn a_folder_for_libraries_may_have_a_comma_in_its_name() {
    if !has_compiler() {
        return;
    }
    run_files(&[("a.c", "int main(void) { return 0; }\n")], &["a.c", "-L", "left,right"]).well();
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
    let ended = run_files(&files, &["main.c", "again.c", "own.c"]);
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
    run_files(&[("main.c", main)], &["main.c"]).well();
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
