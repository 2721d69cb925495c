//! Projects of several folders with a makefile or a `CMakeLists.txt` of their own: only paths in them are new.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::support::{compilers, library, set_input, simulated, wait_duty, wait_offline, Running};

/// The files of a program for the TXT itself. A kit's header of that time lies in one of its include folders.
const FILES: &[(&str, &str)] = &[
    (
        "src/main.cpp",
        "#include <unistd.h>\n#include \"motor.h\"\n\
         static_assert(sizeof(uint32_t) == 4 && (char)200 > 0, \"today's integers\");\n\
         int main() {\nif (StartTxtDownloadProg() != KELIB_ERROR_NONE) return 1;\n\
         FISH_X1_TRANSFER *area = GetKeLibTransferAreaMainAddress();\nmotor(area);\n\
         while (!area->ftX1in.uni[0]) usleep(1000);\nStopTxtDownloadProg();\nreturn 0;\n}\n",
    ),
    // The library would call it in place of the C library's.
    ("src/gate.c", "#include <stdlib.h>\nint close(int gate) { if (gate) abort(); return 0; }\n"),
    ("lib/motor.cpp", "#include \"motor.h\"\nvoid motor(FISH_X1_TRANSFER *area) { area->ftX1out.duty[0] = DUTY; }\n"),
    ("inc/motor.h", "#include \"KeLibTxtDl.h\"\nvoid motor(FISH_X1_TRANSFER *area);\n"),
    ("deps/include/KeLibTxtDl.h", "typedef unsigned long uint32_t;\n#error old\n"),
    (
        "Makefile",
        "PKG = PKG_CONFIG_PATH=FOLDER/pkgconfig pkg-config --define-variable=libdir=LIBRARY\n\
         CXXFLAGS = -std=c++11 -DDUTY=300 $(shell $(PKG) --cflags ftMscLib-KIND) -Iinc -Ideps/include\n\
         CFLAGS = $(shell $(PKG) --cflags ftMscLib-KIND)\n\
         program: src/main.o src/gate.o lib/motor.o\n\t$(CXX) -o $@ $^ $(shell $(PKG) --libs ftMscLib-KIND)\n",
    ),
    (
        "CMakeLists.txt",
        "cmake_minimum_required(VERSION 3.13)\nproject(line C CXX)\nset(CMAKE_BUILD_TYPE Release)\n\
         find_package(ftMscLib REQUIRED COMPONENTS KIND)\nadd_subdirectory(lib)\n\
         add_executable(program src/main.cpp src/gate.c)\ntarget_link_libraries(program motor)\n",
    ),
    (
        "lib/CMakeLists.txt",
        "add_library(motor STATIC motor.cpp)\ntarget_compile_definitions(motor PRIVATE DUTY=300)\n\
         target_include_directories(motor PUBLIC ../deps/include ../inc)\n\
         target_link_libraries(motor PUBLIC ftMscLib::KIND)\n",
    ),
];

/// Writes the project, with FOLDER, LIBRARY and KIND replaced.
fn project(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("projects").join(name);
    let _ = fs::remove_dir_all(&folder);
    for (name, text) in FILES {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let text = text.replace("FOLDER", env!("CARGO_MANIFEST_DIR")).replace("KIND", "txt");
        fs::write(path, text.replace("LIBRARY", &library().display().to_string())).unwrap();
    }
    folder
}

/// Whether all of these programs are here; says it if not.
fn are_here(programs: &[&str]) -> bool {
    let missing: Vec<_> = programs
        .iter()
        .filter(|name| Command::new(name).arg("--version").output().is_err())
        .copied()
        .collect();
    if !missing.is_empty() {
        eprintln!("skipped: there is no {}", missing.join(" and no "));
    }
    missing.is_empty() && !compilers().is_empty()
}

fn run(command: &mut Command) -> Result<(), String> {
    let output = command.output().unwrap();
    let said = [&*output.stdout, &*output.stderr].concat();
    output.status.success().then_some(()).ok_or_else(|| String::from_utf8_lossy(&said).into_owned())
}

fn drives_a_motor(program: &Path) {
    let txt = simulated().start().unwrap();
    let running = Running::with(program, &txt, &[]);
    wait_duty(&txt, 0, 300);
    set_input(&txt, 0, 1);
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn a_makefile_takes_paths_from_pkg_config() {
    if !are_here(&["make", "pkg-config"]) {
        return;
    }
    let folder = project("make");
    run(Command::new("make").arg("-C").arg(&folder)).unwrap_or_else(|said| panic!("{said}"));
    drives_a_motor(&folder.join("program"));
}

fn cmake(folder: &Path, library: &Path) -> Result<(), String> {
    let mut configure = Command::new("cmake");
    configure.current_dir(folder).args(["-S", ".", "-B", "build"]);
    configure.arg(format!("-DftMscLib_DIR={}/cmake", env!("CARGO_MANIFEST_DIR")));
    configure.arg(format!("-DftMscLib_LIBRARY_DIR={}", library.display()));
    run(&mut configure)?;
    run(Command::new("cmake").current_dir(folder).args(["--build", "build"]))
}

#[test]
fn cmake_finds_the_package_and_its_kinds() {
    if !are_here(&["cmake"]) {
        return;
    }
    let folder = project("cmake");
    cmake(&folder, &library()).unwrap_or_else(|said| panic!("{said}"));
    drives_a_motor(&folder.join("build/program"));

    let said = cmake(&project("cmake_without"), Path::new("/none")).unwrap_err();
    assert!(said.contains("/none/libftMscLib"), "{said}");
    let folder = project("cmake_wrong");
    let list = folder.join("CMakeLists.txt");
    fs::write(&list, fs::read_to_string(&list).unwrap().replace(" txt)", " tx)")).unwrap();
    let said = cmake(&folder, &library()).unwrap_err();
    assert!(said.contains("no kind tx of programs"), "{said}");
}

/// A source for each kind, which only its headers let compile.
const KINDS: [(&str, &str); 6] = [
    ("robo_tx", "#include \"ROBO_TX_PRG.h\"\nTA area;\n"),
    ("pc", "#include <windows.h>\n#include \"ftMscLib.h\"\nHANDLE a;\n"),
    ("txt", "#include \"KeLibTxtDl.h\"\n#include \"common.h\"\nBOOL32 a;\n"),
    ("kit", "#include \"ftProInterface2013TransferAreaCom.h\"\nint distance = IF08_MAX;\n"),
    ("kit466", "#include <conio.h>\n#include \"ftProInterface2013TransferAreaCom.h\"\nthread a;\n"),
    ("fttxtlib", "#include \"FtTxtLib.h\"\nFtErrors a;\n"),
];

#[test]
fn each_kind_has_its_headers() {
    let Some(compiler) = compilers().first() else { return };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("projects/kinds");
    fs::create_dir_all(&folder).unwrap();
    let mut list = String::from("cmake_minimum_required(VERSION 3.13)\nproject(kinds C CXX)\n");
    for (kind, source) in KINDS {
        let file = folder.join(format!("{kind}.cpp"));
        fs::write(&file, source).unwrap();
        list += &format!(
            "find_package(ftMscLib REQUIRED COMPONENTS {kind})\nadd_library({kind} OBJECT {kind}.cpp)\n\
             target_link_libraries({kind} ftMscLib::{kind})\n"
        );
        if !are_here(&["pkg-config"]) {
            continue;
        }
        let mut asked = Command::new("pkg-config");
        asked.env("PKG_CONFIG_PATH", format!("{}/pkgconfig", env!("CARGO_MANIFEST_DIR")));
        let asked = asked.args(["--cflags", &format!("ftMscLib-{kind}")]).output().unwrap();
        let options = String::from_utf8(asked.stdout).unwrap();
        let mut command = Command::new(compiler);
        command.args(["-std=c++11", "-fsyntax-only"]).args(options.split_whitespace()).arg(file);
        run(&mut command).unwrap_or_else(|said| panic!("{kind}: {said}"));
    }
    fs::write(folder.join("CMakeLists.txt"), list).unwrap();
    if are_here(&["cmake"]) {
        cmake(&folder, &library()).unwrap_or_else(|said| panic!("{said}"));
    }
}
