//! Copies of the program's files, in which includes say what they mean.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs::{self, File, ReadDir};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::headers::{Headers, COMMON};
use crate::link::folder_of;
use crate::read;
use crate::sources::{without_comments, Found, Include, Own, OwnFile, OwnFiles};

/// How many folders up an include may go by the compiler's options.
const BY_OPTIONS: usize = 2;

/// What an include means, and whether a compiler finds it without our help.
enum Meaning {
    Ours { ours: PathBuf, is_found: bool, passed_over: Option<PathBuf> },
    Own { own: Own, is_found: bool },
    Elsewhere,
}

impl Meaning {
    /// What an include means.
    fn of(include: &Include, headers: &Headers) -> Self {
        let name = include.name();
        let ours = headers.ours(&name).map(Path::to_owned);
        let is_literal =
            |ours: &Path| ours.file_name().is_some_and(|file| *include.written == *file);
        // Ours comes behind all others.
        let is_last = name == COMMON;
        match (&include.found, ours) {
            (Found::Own(own), Some(ours)) if is_replaced(&own.file, &name, headers) => {
                // A program may name our own folders.
                let is_same = read::file(&own.file).ok() == fs::read(&ours).ok();
                let passed_over = (!is_same).then(|| own.file.clone());
                let is_found = !own.is_beside && !is_last && is_literal(&ours);
                Self::Ours { ours, is_found, passed_over }
            }
            (Found::Own(own), _) => {
                let is_hidden = !own.is_beside && !is_last && headers.of_kit.contains_key(&name);
                Self::Own { own: own.clone(), is_found: own.is_exact && !is_hidden }
            }
            (Found::System, Some(ours)) if !is_literal(&ours) => Self::Elsewhere,
            (found, Some(ours)) => {
                let is_found = is_literal(&ours) && !(is_last && *found == Found::System);
                Self::Ours { ours, is_found, passed_over: None }
            }
            (_, None) => Self::Elsewhere,
        }
    }
}

/// Whether our header takes the place of the program's own file: the headers of that time were for other
/// compilers, with integers that are longer today.
fn is_replaced(file: &Path, name: &str, headers: &Headers) -> bool {
    if !headers.of_kit.contains_key(name) {
        return false;
    }
    if name != COMMON {
        return true;
    }
    let code = without_comments(&read::file(file).unwrap_or_default());
    defines(&String::from_utf8_lossy(&code), "UINT16")
}

/// Whether a `typedef` in this text defines the name, and does not only use it.
fn defines(code: &str, name: &str) -> bool {
    let is_in_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    // The first name is behind a type.
    let is_name = |(number, part): (usize, &str)| {
        let words: Vec<_> = part.split(|it| !is_in_name(it)).filter(|it| !it.is_empty()).collect();
        words.last() == Some(&name) && (number > 0 || words.len() > 1)
    };
    let mut definitions = code.split(';').filter_map(|statement| statement.rsplit_once("typedef"));
    definitions.any(|(_, names)| names.split(',').enumerate().any(is_name))
}

/// The files of a program in which includes say what they mean.
#[derive(Default)]
pub(crate) struct Copies {
    /// Where the copy of a file is.
    pub(crate) of: BTreeMap<PathBuf, PathBuf>,
    /// Files of the program in place of which our headers are used.
    pub(crate) passed_over: BTreeSet<PathBuf>,
    /// The folders of copied files, and those of their copies: below a folder of its own, with so many of the folders above
    /// as includes may go up.
    folders: BTreeMap<PathBuf, PathBuf>,
    levels: usize,
}

impl Copies {
    /// Copies the files in which an include would not be found, or not as it is meant, and those that include
    /// them. Messages name the files where they were.
    pub(crate) fn write(own: &OwnFiles, headers: &Headers, to: &Path) -> io::Result<Self> {
        let meanings: BTreeMap<&Path, Vec<Meaning>> = own
            .files
            .iter()
            .map(|(path, file)| {
                let all = file.includes.iter().map(|include| Meaning::of(include, headers));
                (path.as_path(), all.collect())
            })
            .collect();
        let ups = ups(own);
        // A macro may repeat its own.
        let levels = if ups > 0 { usize::MAX } else { BY_OPTIONS };
        let mut copies = Self { levels, ..Self::default() };
        copies.choose(&meanings, to);
        for (path, copy) in &copies.of {
            if own.includes_next(path) {
                let file = path.display();
                let why = "with #include_next a header has to spell its includes as the files are, and so have those that it \
                           includes, without copies of a kit's headers";
                return Err(io::Error::other(format!("{file}: {why}")));
            }
            if !can_be_quoted(&std::path::absolute(path)?) {
                return Err(refused(
                    path,
                    "a quotation mark is in the name of the file or a folder",
                ));
            }
            let text = copies.text(path, &own.files[path].text, own, &meanings[path.as_path()]);
            fs::create_dir_all(copy.parent().unwrap_or(to))?;
            let mut written = File::create(copy)?;
            written.write_all(&text)?;
            // `__TIMESTAMP__` is that of the file, if both disks have such times.
            let time = fs::metadata(path).and_then(|data| data.modified());
            let _ = time.and_then(|time| written.set_modified(time));
        }
        let with_more = copies.of.keys().filter(|path| own.files[*path].may_have_more_includes());
        let with_more: BTreeSet<&Path> = with_more.map(|path| folder_of(path)).collect();
        for folder in with_more {
            let mut above = folder.to_owned();
            let places = copies.folders[folder].ancestors().take_while(|place| *place != to);
            for (level, place) in places.enumerate() {
                match fs::read_dir(&above) {
                    Ok(entries) => stand_in(entries, place, headers)?,
                    Err(error) if level <= ups => {
                        return Err(refused(&above, &format!("it can't be listed ({error})")));
                    }
                    Err(_) => {}
                }
                above.push("..");
            }
        }
        Ok(copies)
    }

    /// Where the copy of a file goes: to those from its folder.
    fn place(&mut self, path: &Path, to: &Path) -> PathBuf {
        let folder = folder_of(path).to_owned();
        let (number, levels) = (self.folders.len().to_string(), self.levels);
        let place = self.folders.entry(folder).or_insert_with_key(|folder| {
            let folder = folder.canonicalize().unwrap_or_else(|_| folder.clone());
            let names: Vec<_> =
                folder.ancestors().map_while(Path::file_name).take(levels).collect();
            names.into_iter().rev().fold(to.join(number), |place, name| place.join(name))
        });
        place.join(path.file_name().unwrap_or_default())
    }

    fn choose(&mut self, meanings: &BTreeMap<&Path, Vec<Meaning>>, to: &Path) {
        let mut including: BTreeMap<&Path, Vec<&Path>> = BTreeMap::new();
        let mut rest = Vec::new();
        for (path, all) in meanings {
            for meaning in all {
                if let Meaning::Own { own, .. } = meaning {
                    including.entry(&own.file).or_default().push(path);
                }
            }
            let is_found = |meaning: &Meaning| match meaning {
                Meaning::Ours { is_found, .. } | Meaning::Own { is_found, .. } => *is_found,
                Meaning::Elsewhere => true,
            };
            if !all.iter().all(is_found) {
                rest.push(*path);
            }
        }
        while let Some(path) = rest.pop() {
            if !self.of.contains_key(path) {
                let copy = self.place(path, to);
                self.of.insert(path.to_path_buf(), copy);
                rest.extend(including.get(path).into_iter().flatten());
            }
        }
        for meaning in meanings.values().flatten() {
            if let Meaning::Ours { passed_over, .. } = meaning {
                self.passed_over.extend(passed_over.clone());
            }
        }
    }

    /// The text of a copy: its includes name what they mean, because nothing else lies beside it. What a compiler finds in
    /// other folders is left to it, unless that is a copy, too.
    fn text(&self, path: &Path, text: &[u8], own: &OwnFiles, meanings: &[Meaning]) -> Vec<u8> {
        let mut copy = [b"#line 1 ", literal(path).as_encoded_bytes(), b"\n"].concat();
        let mut end = if text.starts_with(b"\xEF\xBB\xBF") { 3 } else { 0 };
        for (include, meaning) in own.files[path].includes.iter().zip(meanings) {
            let named = match meaning {
                Meaning::Ours { ours, is_found: false, .. } => ours.clone(),
                Meaning::Own { own, is_found } => match self.of.get(&own.file) {
                    Some(copy) => copy.clone(),
                    None if *is_found && !own.is_beside => continue,
                    None => std::path::absolute(&own.file).unwrap_or_else(|_| own.file.clone()),
                },
                Meaning::Ours { is_found: true, .. } | Meaning::Elsewhere => continue,
            };
            copy.extend_from_slice(&text[end..include.place.start]);
            copy.extend_from_slice(quoted(&named).as_encoded_bytes());
            end = include.place.end;
        }
        copy.extend_from_slice(&text[end..]);
        copy
    }
}

/// How many folders up the program's files may go where their includes do not show it, as with macros.
fn ups(own: &OwnFiles) -> usize {
    let is_up = |three: &&[u8]| [b"../".as_slice(), b"..\\"].contains(three);
    let ups = |code: &[u8]| code.windows(3).filter(is_up).count();
    let unseen = |file: &OwnFile| {
        let seen = file.includes.iter().map(|include| ups(include.written.as_bytes()));
        ups(&file.code).saturating_sub(seen.sum())
    };
    own.files.values().map(unseen).sum()
}

/// Why no copy is made of what lies here.
fn refused(file: &Path, why: &str) -> io::Error {
    let file = file.display();
    io::Error::other(format!(
        "{file}: {why}, so sources have to spell their includes as the files are, without copies of a kit's headers"
    ))
}

/// Puts something in a folder of copies for each other file of their own folder, and for each folder there. A copy may
/// include files in ways that its text does not show, such as `#include MACRO`, and looks for them beside itself. Our headers
/// are found elsewhere.
fn stand_in(entries: ReadDir, place: &Path, headers: &Headers) -> io::Result<()> {
    for entry in entries.flatten() {
        let (file, to) = (std::path::absolute(entry.path())?, place.join(entry.file_name()));
        let name = entry.file_name().to_string_lossy().to_lowercase();
        if to.exists() || !can_be_quoted(&file) || is_replaced(&file, &name, headers) {
            continue;
        }
        // What a link leads to may be on a disk that stands still.
        if entry.file_type().is_ok_and(|it| it.is_file()) {
            write_include(&to, &file)?;
        } else if cfg!(unix) {
            // Its files and those around it are then found as from the folder itself.
            #[cfg(unix)]
            std::os::unix::fs::symlink(file, to)?;
        }
    }
    Ok(())
}

/// A path as C has it in quotes, in whatever character set it is.
pub(crate) fn quoted(path: &Path) -> OsString {
    let mut quoted = OsString::from("\"");
    if cfg!(windows) {
        // Compilers for Windows know `/`, too, and `\` may mean something else.
        quoted.push(path.display().to_string().replace('\\', "/"));
    } else {
        quoted.push(path);
    }
    quoted.push("\"");
    quoted
}

/// A path as a text in C, in which a backslash begins an escape. In the name of a header it does not.
pub(crate) fn literal(path: &Path) -> OsString {
    let quoted = quoted(path).into_encoded_bytes();
    let escaped = quoted.split(|byte| *byte == b'\\').collect::<Vec<_>>().join(&b"\\\\"[..]);
    read::path(&escaped).unwrap_or_default().into()
}

/// Whether this is a name that C can have in quotes.
fn can_be_quoted(path: &Path) -> bool {
    !path.as_os_str().as_encoded_bytes().iter().any(|byte| [b'"', b'\n'].contains(byte))
}

/// Makes a file that is nothing but this other one.
pub(crate) fn write_include(file: &Path, of: &Path) -> io::Result<()> {
    fs::write(file, [b"#include ", quoted(of).as_encoded_bytes(), b"\n"].concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kind::Kind;
    use crate::search::Folders;
    use crate::sources;

    struct Made {
        folder: tempfile::TempDir,
        build: tempfile::TempDir,
        copies: Copies,
    }

    /// What becomes of files with these texts, of which those that end with `.c` are the sources, with the
    /// include folder `inc`.
    fn made(kind: Kind, files: &[(&str, &str)]) -> Made {
        let (folder, build) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let sources = files.iter().filter(|(name, _)| name.ends_with(".c"));
        let sources: Vec<PathBuf> = sources.map(|(name, _)| folder.path().join(name)).collect();
        let system = vec![build.path().join("system")];
        for name in ["math.h", "lib/common.h"] {
            sources::tests::write(&system[0], name, "");
        }
        let all = [vec![folder.path().join("inc")], system.clone()].concat();
        let folders = Folders { quoted: Vec::new(), all, system };
        let own = OwnFiles::read(sources.iter().map(PathBuf::as_path), &folders).unwrap();
        let headers = Headers::write(kind, build.path()).unwrap();
        assert!(headers.folders.iter().all(|folder| folder.is_dir()), "{:?}", headers.folders);
        let copies = Copies::write(&own, &headers, &build.path().join("own")).unwrap();
        Made { folder, build, copies }
    }

    fn in_sources(path: &Path) -> String {
        quoted(path).to_str().unwrap().trim_matches('"').to_owned()
    }

    impl Made {
        /// The include lines of a copy, with OURS and PROGRAM for the two folders; `None` without a copy.
        fn copy(&self, name: &str) -> Option<Vec<String>> {
            let copy = self.copies.of.get(&self.folder.path().join(name))?;
            let text = fs::read_to_string(copy).unwrap();
            let text = text.replace(&in_sources(&self.build.path().join("include")), "OURS");
            let text = text.replace(&in_sources(self.folder.path()), "PROGRAM");
            assert!(text.starts_with(&format!("#line 1 \"PROGRAM/{name}\"\n")), "{text}");
            Some(text.lines().filter(|line| line.contains("include")).map(str::to_owned).collect())
        }

        fn passed_over(&self) -> Vec<&Path> {
            let folder = self.folder.path();
            self.copies.passed_over.iter().map(|file| file.strip_prefix(folder).unwrap()).collect()
        }
    }

    #[test]
    fn a_typedef_that_only_uses_a_name_does_not_define_it() {
        for defining in [
            "#ifndef U\ntypedef unsigned short UINT16;",
            "typedef struct { int a; } b; typedef unsigned char UINT8 ; typedef unsigned short int UINT16 , *PUINT16;",
            "typedef unsigned short *PUINT16, UINT16;",
        ] {
            assert!(defines(defining, "UINT16"), "{defining}");
        }
        for other in [
            "typedef enum { CLOSED, OPEN } Gate; extern UINT16 presses;",
            "typedef UINT16 Speed; UINT16 a;",
            "typedef struct { UINT16 a, b; } Pair;",
            "typedef unsigned short MYUINT16;",
            "#define UINT16_MAX 3\n",
        ] {
            assert!(!defines(other, "UINT16"), "{other}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_copy_has_the_name_and_the_time_of_its_file() {
        let made = made(Kind::Downloaded, &[("a\\b.c", "#include \"ROBO_TX_PRG.H\"\n")]);
        let file = made.folder.path().join("a\\b.c");
        let copy = &made.copies.of[&file];
        let text = fs::read_to_string(copy).unwrap();
        let folder = in_sources(made.folder.path());
        assert_eq!(text.lines().next(), Some(&*format!("#line 1 \"{folder}/a\\\\b.c\"")));
        let times = [&file, copy].map(|it| fs::metadata(it).unwrap().modified().unwrap());
        assert_eq!(times[0], times[1]);
    }

    #[cfg_attr(windows, ignore = "file names are not case-sensitive there")]
    #[test]
    fn headers_are_found_as_programs_spell_them() {
        let a = "#include \"ROBO_TX_PRG.H\"\n#include \"../../Common/robo_tx_fw.h\"\n#include <Math.h>\n";
        let b = "#include \"ROBO_TX_PRG.h\"\n#include <math.h>\n#include <lib/common.h>\n";
        // `math.h` is not the program's own header, though Windows would take that.
        let made = made(Kind::Downloaded, &[("a.c", a), ("b.c", b), ("inc/Math.h", "")]);
        let expected = [
            "#include \"OURS/ROBO_TX_PRG.h\"",
            "#include \"OURS/ROBO_TX_FW.h\"",
            "#include <Math.h>",
        ];
        assert_eq!(made.copy("a.c").unwrap(), expected);
        assert_eq!(made.copy("b.c"), None);
    }

    #[test]
    fn old_headers_of_the_program_are_replaced_and_its_own_are_not() {
        let made = made(
            Kind::Downloaded,
            &[
                ("a.c", "#include \"ROBO_TX_FW.h\"\n#include \"common.h\"\n#include \"own.h\"\n"),
                ("b.c", "#include \"inc.h\"\n"),
                ("ROBO_TX_FW.h", "typedef unsigned long UINT32;\n"),
                ("common.h", "int b;\n"),
                ("own.h", "int c;\n"),
                ("inc/inc.h", "#include \"other.h\"\n"),
                ("inc/other.h", "#include \"ROBO_TX_FW.h\"\n#include <conio.h>\n"),
                ("inc/ROBO_TX_FW.h", "typedef unsigned long UINT32;\n"),
                ("inc/conio.h", "int d;\n"),
            ],
        );
        let expected = [
            "#include \"OURS/ROBO_TX_FW.h\"",
            "#include \"PROGRAM/common.h\"",
            "#include \"PROGRAM/own.h\"",
        ];
        assert_eq!(made.copy("a.c").unwrap(), expected);
        // What includes a copy is a copy, too.
        let other = &made.copies.of[&made.folder.path().join("inc/other.h")];
        let inc =
            fs::read_to_string(&made.copies.of[&made.folder.path().join("inc/inc.h")]).unwrap();
        assert!(inc.contains(&in_sources(other)), "{inc}");
        assert_eq!(made.copy("own.h"), None);
        assert_eq!(made.copy("common.h"), None);
        let over = [Path::new("ROBO_TX_FW.h"), Path::new("inc/ROBO_TX_FW.h")];
        assert_eq!(made.passed_over(), over);
    }

    #[cfg_attr(windows, ignore = "file names are not case-sensitive there")]
    #[test]
    fn copies_in_include_folders_are_passed_over_and_own_files_there_are_not_hidden() {
        let made = made(
            Kind::KeLib,
            &[
                ("a.c", "#include <KeLibTxtDl.h>\n#include \"common.h\"\n#include \"Own.h\"\n"),
                ("b.c", "#include \"FtShmem.h\"\n"),
                ("inc/KeLibTxtDl.h", "typedef unsigned long UINT32;\n"),
                ("inc/FtShmem.h", "typedef unsigned long UINT32;\n"),
                ("inc/common.h", "int own;\n"),
                ("inc/own.h", ""),
            ],
        );
        let expected =
            ["#include <KeLibTxtDl.h>", "#include \"common.h\"", "#include \"PROGRAM/inc/own.h\""];
        assert_eq!(made.copy("a.c").unwrap(), expected);
        assert_eq!(made.copy("b.c"), None);
        assert_eq!(made.passed_over(), [Path::new("inc/FtShmem.h"), Path::new("inc/KeLibTxtDl.h")]);
    }
}
