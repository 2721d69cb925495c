//! Links compiled files to a program.

use std::env;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::compiler::{words_of, Compiler, NO_CHECKS};
use crate::inputs::Inputs;
use crate::libraries::{self, Library};
use crate::options::Options;
#[cfg(target_os = "linux")]
use crate::own_names;
use crate::packages;
use crate::read;
use crate::signals;
use crate::{pass_on, Sentence};

/// The library that all programs are linked with.
const LIBRARY: &str = if cfg!(windows) {
    "ftMscLib.dll"
} else if cfg!(target_os = "macos") {
    "libftMscLib.dylib"
} else {
    "libftMscLib.so"
};

/// Links a program's compiled files with more files and options, and what the command line and the environment name. The
/// program gets a folder in that with the compiled files.
pub(crate) fn link(
    compiler: &Compiler,
    objects: &mut [PathBuf],
    more: &[OsString],
    inputs: &Inputs,
    options: &Options,
    library: &Path,
    path: &Path,
) -> Result<(), Sentence> {
    let named = options.libraries.iter().map(|name| joined("-l", name)).chain(words_of("LDLIBS"));
    let libraries = without_replaced(named);
    let flags = without_replaced(words_of("LDFLAGS").into_iter());
    let command = |folders: &[PathBuf], objects: &[PathBuf]| -> Result<Command, Sentence> {
        let mut command = compiler.command();
        command.arg(NO_CHECKS).args(&flags).args(more).args(objects).args(&inputs.archives);
        for folder in &options.library_folders {
            command.arg("-L").arg(folder);
        }
        command.args(&libraries).arg(library).args(["-lm", "-lpthread", "-o"]).arg(path);
        look_in(folders, library, &mut command)?;
        Ok(command)
    };
    let beside = inputs.archives.iter().map(|archive| folder_of(archive).to_owned());
    let mut folders: Vec<PathBuf> = Vec::new();
    for folder in options.library_folders.iter().cloned().chain(beside) {
        if !folders.contains(&folder) {
            folders.push(folder);
        }
    }
    let named = named_by(&[flags.as_slice(), &libraries].concat(), &folders, inputs);
    let first = |folders: &[PathBuf]| command(folders, objects);
    #[cfg_attr(not(target_os = "linux"), expect(unused_mut, reason = "nothing is hidden there"))]
    let (mut output, taken, folders) = link_in(folders, library, named, first)?;
    #[cfg(target_os = "linux")]
    if output.status.success() {
        let others = taken.iter().filter_map(Library::file_of_system).chain([library]);
        if own_names::hide(objects, others, folder_of(folder_of(path)))? {
            output = signals::output_of(&mut command(&folders, objects)?)?;
        }
    }
    signals::check("the program was compiled")?;
    pass_on(&output.stderr);
    if output.status.success() {
        return match cfg!(target_os = "linux") {
            true => libraries::check(path, &taken, &folders, library),
            false => Ok(()),
        };
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let names: Vec<String> = libraries.iter().filter_map(|word| library_name(word)).collect();
    let libraries = packages::advice_for_libraries(&said, names.iter().map(String::as_str));
    let sources: Vec<&Path> = inputs.sources.iter().map(|source| &*source.path).collect();
    let advice = packages::advice_for_names(&said, &names, &sources);
    Err(format!("the program can't be linked{libraries}{advice}").into())
}

/// These words without the kits' libraries, in place of which ours is linked.
fn without_replaced(mut words: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut kept = Vec::new();
    while let Some(mut word) = words.next() {
        if word == "-l" {
            word = joined("-l", &words.next().unwrap_or_default());
        }
        if !library_name(&word).is_some_and(|name| packages::is_replaced(&name)) {
            kept.push(word);
        }
    }
    kept
}

/// The dynamic libraries that are named, with these words for the linker and these folders.
fn named_by(words: &[OsString], folders: &[PathBuf], inputs: &Inputs) -> Vec<Library> {
    let mut to_look_in = [&values_of(b'L', words), folders].concat();
    to_look_in.extend(env::var_os("LIBRARY_PATH").iter().flat_map(env::split_paths));
    libraries::named(&inputs.archives, &values_of(b'l', words), &to_look_in)
}

/// Links with these folders for the loader. Returns what the linker has said, which dynamic libraries it has taken, those
/// that are named if it does not say that, and the folders in an order in which none hides one of these.
fn link_in(
    folders: Vec<PathBuf>,
    library: &Path,
    named: Vec<Library>,
    command: impl Fn(&[PathBuf]) -> Result<Command, Sentence>,
) -> Result<(Output, Vec<Library>, Vec<PathBuf>), Sentence> {
    if cfg!(target_os = "linux") {
        let mut output = signals::output_of(command(&folders)?.arg("-Wl,--trace"))?;
        let mut taken = libraries::taken(&output.stdout, library);
        if !output.status.success() {
            // A linker that does not know the option, such as zig's.
            output = signals::output_of(&mut command(&folders)?)?;
            taken = named;
        }
        if output.status.success() {
            let ordered = libraries::folders(folders.clone(), &taken)?;
            if ordered != folders {
                output = signals::output_of(&mut command(&ordered)?)?;
            }
            return Ok((output, taken, ordered));
        }
        return Ok((output, Vec::new(), folders));
    }
    Ok((signals::output_of(&mut command(&folders)?)?, Vec::new(), folders))
}

/// The values of an option of one letter: `-Lfolder` and `-L folder`.
fn values_of(letter: u8, words: &[OsString]) -> Vec<PathBuf> {
    let mut values = Vec::new();
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let value = match word.as_encoded_bytes() {
            [b'-', its, value @ ..] if *its == letter => match value {
                [] => words.next().map(PathBuf::from),
                value => read::path(value),
            },
            _ => None,
        };
        values.extend(value);
    }
    values
}

/// Has a program look for its dynamic libraries in these folders.
fn look_in(folders: &[PathBuf], library: &Path, command: &mut Command) -> io::Result<()> {
    if cfg!(windows) {
        return Ok(());
    }
    // The own one has what the system puts there, too, when this program is installed. So those that were named come
    // first; the library itself is named by its path where the system keeps that.
    for folder in folders.iter().map(PathBuf::as_path).chain([folder_of(library)]) {
        // Behind `-Wl` a comma would be the end of the path.
        command.args(["-Xlinker", "-rpath", "-Xlinker"]).arg(std::path::absolute(folder)?);
    }
    Ok(())
}

fn joined(option: &str, value: &OsStr) -> OsString {
    OsString::from_iter([OsStr::new(option), value])
}

/// The library in `-lname`.
fn library_name(word: &OsStr) -> Option<String> {
    word.to_str()?.strip_prefix("-l").map(str::to_owned)
}

/// The folder of a file.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|it| *it != Path::new("")).unwrap_or(Path::new("."))
}

/// The library: beside this program, or where it was built. If there are two, the newer one.
pub(crate) fn library() -> Result<PathBuf, Sentence> {
    let program = env::current_exe()?;
    let folder = program.parent().unwrap_or(Path::new(""));
    let places = [
        folder.join(LIBRARY),
        folder.join("deps").join(LIBRARY),
        folder.join("../lib").join(LIBRARY),
    ];
    let changed = |place: &PathBuf| fs::metadata(place).and_then(|data| data.modified()).ok();
    let newest = places.into_iter().filter_map(|place| Some((changed(&place)?, place))).max();
    newest
        .map(|(_, place)| place)
        .ok_or_else(|| format!("{LIBRARY} is not there: it belongs in {}", folder.display()).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kits_libraries_are_left_out_however_they_are_named() {
        let words = ["-L", "lib", "-lKeLibTxt", "-l", "MotorIOLib", "-l", "m", "-lown"];
        let kept = without_replaced(words.into_iter().map(OsString::from));
        assert_eq!(kept, ["-L", "lib", "-lm", "-lown"]);
    }
}
