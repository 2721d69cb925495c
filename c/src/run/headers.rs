//! The headers, which are part of this program, and where the compiler finds them.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use include_dir::{include_dir, Dir, File};

use crate::kind::Kind;
use crate::sources::{Include, Included};

static HEADERS: Dir = include_dir!("$CARGO_MANIFEST_DIR/include");

/// The folder from which includes with a folder before the name are looked for: `../../Common/ROBO_TX_FW.h`.
const DEEP: &str = "spelled/1/2/3/4/5/6/7/8";

/// The headers as files, for one program.
pub(crate) struct Headers {
    /// Folders for the compiler, in this order.
    pub(crate) folders: Vec<PathBuf>,
    /// Where our headers lie, by their names in lower case.
    known: BTreeMap<String, PathBuf>,
    deep: PathBuf,
}

impl Headers {
    /// Writes the headers of a kind into the build folder.
    pub(crate) fn write(kind: Kind, build: &Path) -> io::Result<Self> {
        let include = build.join("include");
        fs::create_dir(&include)?;
        HEADERS.extract(&include)?;
        let deep = build.join(DEEP);
        fs::create_dir_all(&deep)?;
        let mut headers = Self { folders: vec![deep.clone()], known: BTreeMap::new(), deep };
        for folder in kind.folders() {
            let files = match *folder {
                "" => HEADERS.files().collect(),
                _ => HEADERS.get_dir(folder).map_or_else(Vec::new, |dir| dir.files().collect()),
            };
            headers.add(&include, files);
            headers.folders.push(include.join(folder));
        }
        Ok(headers)
    }

    fn add(&mut self, include: &Path, files: Vec<&File>) {
        for file in files {
            let name = file.path().file_name().unwrap_or_default().to_string_lossy().to_lowercase();
            self.known.entry(name).or_insert_with(|| include.join(file.path()));
        }
    }

    /// Our header in place of the one that is included, if there is one.
    fn ours(&self, include: &Include) -> Option<&Path> {
        self.known.get(&include.name().to_lowercase()).map(PathBuf::as_path)
    }

    /// Whether the program's own file is to be replaced by our header: the headers of that time were for other
    /// compilers, with integers that are longer today. `common.h` may also be something of the program's own.
    fn replaces(&self, include: &Include) -> bool {
        let (Some(file), Some(_)) = (&include.file, self.ours(include)) else { return false };
        if !include.name().eq_ignore_ascii_case("common.h") {
            return true;
        }
        let text = fs::read(file).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        text.contains("typedef") && text.contains("UINT16")
    }

    /// The program's own files that are to be replaced.
    pub(crate) fn replaced<'a>(&self, included: &'a Included) -> Vec<&'a Path> {
        let includes = included.includes.iter().filter(|include| self.replaces(include));
        includes.filter_map(|include| include.file.as_deref()).collect()
    }

    /// Makes headers available as the sources spell them: ours with other cases and with folders before them,
    /// and all of them with the `\` of Windows.
    pub(crate) fn spell(&self, included: &Included) -> io::Result<()> {
        for include in &included.includes {
            if let Some(header) = self.to_spell(include)? {
                let spelled = self.deep.join(&include.written);
                if let Some(folder) = spelled.parent() {
                    fs::create_dir_all(folder)?;
                }
                fs::write(spelled, format!("#include {:?}\n", header.display().to_string()))?;
            }
        }
        Ok(())
    }

    /// The header that is meant by a spelling that the compiler does not understand by itself.
    fn to_spell(&self, include: &Include) -> io::Result<Option<PathBuf>> {
        let written = &include.written;
        if written.contains(':') || written.starts_with('/') {
            return Ok(None);
        }
        let for_windows = written.contains('\\') && !cfg!(windows);
        match (&include.file, self.ours(include)) {
            (Some(file), _) if !self.replaces(include) => {
                for_windows.then(|| fs::canonicalize(file)).transpose()
            }
            (_, Some(ours)) => {
                let is_known = ours.file_name().is_some_and(|name| **written == *name);
                Ok((!is_known).then(|| ours.to_owned()))
            }
            (_, None) => Ok(None),
        }
    }
}

/// Copies the program's own files into a folder, without those that our headers replace, so the compiler does
/// not find them beside the source. Messages name the files where they were. Returns where a file is now.
pub(crate) fn copy_without(
    replaced: &[&Path],
    included: &Included,
    to: &Path,
) -> io::Result<BTreeMap<PathBuf, PathBuf>> {
    let absolute = |file: &Path| fs::canonicalize(file);
    let replaced = replaced.iter().map(|file| absolute(file)).collect::<io::Result<Vec<_>>>()?;
    let mut copies = BTreeMap::new();
    for file in &included.files {
        let absolute = absolute(file)?;
        let copy = to.join(absolute.components().filter(is_normal).collect::<PathBuf>());
        copies.insert(file.clone(), copy.clone());
        if let Some(folder) = copy.parent() {
            fs::create_dir_all(folder)?;
        }
        if replaced.contains(&absolute) {
            continue;
        }
        let text = fs::read(file)?;
        let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&text);
        let mut marked = format!("#line 1 {:?}\n", file.display().to_string()).into_bytes();
        marked.extend_from_slice(text);
        fs::write(copy, marked)?;
    }
    Ok(copies)
}

fn is_normal(component: &std::path::Component) -> bool {
    matches!(component, std::path::Component::Normal(_))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_found_as_programs_spell_them() {
        let folder = tempfile::tempdir().unwrap();
        let source = folder.path().join("a.c");
        let includes = "#include \"ROBO_TX_PRG.H\"\n#include \"../../Common/robo_tx_fw.h\"\n";
        fs::write(&source, includes).unwrap();
        let included = Included::by(&[source]).unwrap();
        let build = tempfile::tempdir().unwrap();
        let headers = Headers::write(Kind::Downloaded, build.path()).unwrap();
        headers.spell(&included).unwrap();
        for include in &included.includes {
            assert!(headers.folders[0].join(&include.written).is_file(), "{include:?}");
        }
        assert!(headers.folders.iter().all(|folder| folder.is_dir()), "{:?}", headers.folders);
    }

    #[test]
    fn old_headers_of_the_program_are_replaced_and_its_own_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::write(&path, text).unwrap();
            path
        };
        let source = write("a.c", "#include \"ROBO_TX_FW.h\"\n#include \"common.h\"\nint a;\n");
        let old = write("ROBO_TX_FW.h", "typedef unsigned long UINT32;\n");
        write("common.h", "int b;\n");
        let included = Included::by(std::slice::from_ref(&source)).unwrap();
        let build = tempfile::tempdir().unwrap();
        let headers = Headers::write(Kind::Downloaded, build.path()).unwrap();
        let replaced = headers.replaced(&included);
        assert_eq!(replaced, [old.as_path()]);
        let copies = copy_without(&replaced, &included, &build.path().join("own")).unwrap();
        let copy = fs::read_to_string(&copies[&source]).unwrap();
        assert!(copy.starts_with("#line 1 ") && copy.ends_with("int a;\n"), "{copy}");
        assert!(!copies[&old].exists());
        assert!(copies[&source].with_file_name("common.h").is_file());
    }
}
