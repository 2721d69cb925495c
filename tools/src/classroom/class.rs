//! The file of a class: who is in it, what each has, and the tokens and ports that make the links stay.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write as _};
use std::path::Path;
use std::{fs, io};

use anyhow::{anyhow, bail, ensure, Context};
use serde::Deserialize;
use unicode_normalization::UnicodeNormalization;

use crate::text_file;
use crate::web::access::Token;

/// How long a file may be, in bytes.
const LONGEST: u64 = 256 << 10;
/// How long a name may be, in characters.
const NAME_MAX: usize = 40;
/// How long that of a controller may be.
const DEVICE_NAME_BYTES: usize = 16;

const HEAD: &str = "\
# A class of `txt classroom`. Whoever has a token comes in, so keep this file to yourself.
# The tokens, ports and places stay as they are, so the links do, too; a place says which ports a controller has. Names,
# worlds and lessons are yours to change: lesson = 3 instead of a world gives a pupil the machine of lesson 3. Pupils may
# be added and removed anywhere; one without a token and a place gets them.
";

/// A class, with all tokens.
#[derive(Debug)]
pub(super) struct Class {
    /// Main port of the first controller, if the file has one.
    pub(super) port: Option<u16>,
    pub(super) page_port: Option<u16>,
    /// Of the page of all.
    pub(super) token: Token,
    pub(super) pupils: Vec<Pupil>,
}

#[derive(Debug)]
pub(super) struct Pupil {
    pub(super) name: String,
    /// The name or the file of a world; `None` for the one that all have.
    pub(super) world: Option<String>,
    pub(super) token: Token,
    /// Which ports the controller has: 1 the first three, 2 the next ones.
    pub(super) place: u16,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    port: Option<u16>,
    page_port: Option<u16>,
    token: Option<String>,
    #[serde(default)]
    pupils: Vec<WrittenPupil>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenPupil {
    name: String,
    world: Option<String>,
    lesson: Option<u8>,
    token: Option<String>,
    place: Option<u16>,
}

impl Class {
    /// A class without a file: so many pupils, with numbers for names.
    pub(super) fn numbered(pupils: u16) -> anyhow::Result<Self> {
        let pupil = |number| {
            let name = format!("TXT {number}");
            Ok(Pupil { name, world: None, token: Token::random()?, place: number })
        };
        let pupils = (1..=pupils).map(pupil).collect::<anyhow::Result<_>>()?;
        Ok(Self { port: None, page_port: None, token: Token::random()?, pupils })
    }

    /// Reads a file, or makes a class of so many pupils for a file that does not exist yet. Missing tokens are made.
    pub(super) fn load(path: &Path, pupils: Option<u16>) -> anyhow::Result<Self> {
        let text = match read(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                let pupils = pupils.context(
                    "there is no such file yet: to make one, write how many pupils the class has",
                )?;
                return Self::numbered(pupils);
            }
            read => read?,
        };
        let class = Self::from_text(&text)?;
        let count = class.pupils.len();
        ensure!(
            pupils.is_none_or(|pupils| usize::from(pupils) == count),
            "the class in this file has {count} pupils; leave the number out, or change the file"
        );
        Ok(class)
    }

    fn from_text(text: &str) -> anyhow::Result<Self> {
        let written: Written = toml::from_str(text)?;
        let mut next = next_place(&written.pupils)?;
        let pupils = written.pupils.into_iter().map(|pupil| Pupil::read(pupil, &mut next));
        let pupils = pupils.collect::<anyhow::Result<Vec<_>>>()?;
        ensure!(
            !pupils.is_empty(),
            "there is nobody in it: write [[pupils]] and name = \"…\" for each"
        );
        let mut names: Vec<_> = pupils.iter().map(|pupil| as_seen(&pupil.name)).collect();
        names.sort_unstable();
        if let Some(two) = names.windows(2).find(|two| two[0] == two[1]) {
            bail!("two pupils are called {:?}: nobody could tell them apart", two[0]);
        }
        let token = token(written.token.as_deref()).context("the token of the page of all")?;
        each_has_a_token_of_its_own(&token, &pupils)?;
        Ok(Self { port: written.port, page_port: written.page_port, token, pupils })
    }

    /// What the controllers are called. Their names have 16 bytes, so those of pupils that begin alike get the number of the
    /// place: it stays when others leave.
    pub(super) fn device_names(&self) -> Vec<String> {
        let cut = |name: &str, bytes: usize| {
            let end = (0..=name.len().min(bytes)).rev().find(|end| name.is_char_boundary(*end));
            name[..end.unwrap_or(0)].to_owned()
        };
        let all: Vec<_> = self.pupils.iter().map(|it| cut(&it.name, DEVICE_NAME_BYTES)).collect();
        let mut count = HashMap::<_, usize>::new();
        all.iter().for_each(|name| *count.entry(name).or_default() += 1);
        // Those that are alone first: no number makes another one of them.
        let mut taken: HashSet<_> = all.iter().filter(|name| count[name] == 1).cloned().collect();
        let names = all.iter().zip(&self.pupils).map(|(name, pupil)| match count[name] {
            1 => name.clone(),
            _ => {
                let number = |number: u32| format!(" {number}");
                let numbered = (u32::from(pupil.place)..)
                    .map(|it| cut(name, DEVICE_NAME_BYTES - number(it).len()) + &number(it));
                let mut free = numbered.skip_while(|name| !taken.insert(name.clone()));
                free.next().unwrap_or_default()
            }
        });
        names.collect()
    }

    /// Writes what links need into the file: its own comments and everything else stay.
    pub(super) fn keep(&mut self, path: &Path, port: u16, page_port: u16) -> anyhow::Result<()> {
        // Port 0 means others each time.
        (self.port, self.page_port) = (Some(port).filter(|port| *port != 0), Some(page_port));
        let old = match read(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
            read => read?,
        };
        let new = if old.is_empty() { self.whole() } else { self.completed(&old)? };
        if new != old {
            keep(path, &new)?;
        }
        Ok(())
    }

    /// A new file.
    fn whole(&self) -> String {
        let mut text = HEAD.to_owned();
        self.write_links(
            &mut text,
            &Written { port: None, page_port: None, token: None, pupils: Vec::new() },
        );
        for Pupil { name, token, place, .. } in &self.pupils {
            let token = token.text();
            // A number is no word that TOML would take for something else.
            let _ = write!(
                text,
                "\n[[pupils]]\nname = \"{name}\"\ntoken = \"{token}\"\nplace = {place}\n"
            );
        }
        text
    }

    /// The file with what it lacks.
    fn completed(&self, old: &str) -> anyhow::Result<String> {
        let written: Written = toml::from_str(old)?;
        let mut new = String::new();
        self.write_links(&mut new, &written);
        let mut pupils = self.pupils.iter().zip(&written.pupils);
        for line in old.lines() {
            new += line;
            new.push('\n');
            if line.split('#').next().is_some_and(|line| line.trim() == "[[pupils]]") {
                let (pupil, written) = pupils.next().context("a [[pupils]] too many")?;
                if written.token.is_none() {
                    let _ = writeln!(new, "token = \"{}\"", pupil.token.text());
                }
                if written.place.is_none() {
                    let _ = writeln!(new, "place = {}", pupil.place);
                }
            }
        }
        ensure!(
            pupils.all(|(_, written)| written.token.is_some() && written.place.is_some()),
            "a token and a place can't be added: begin each pupil with a line [[pupils]]"
        );
        Ok(new)
    }

    /// Writes the lines of the class itself that are not there yet.
    fn write_links(&self, text: &mut String, written: &Written) {
        let ports =
            [("port", self.port, written.port), ("page_port", self.page_port, written.page_port)];
        for (name, port, before) in ports {
            if let (Some(port), None) = (port, before) {
                let _ = writeln!(text, "{name} = {port}");
            }
        }
        if written.token.is_none() {
            let _ = writeln!(text, "token = \"{}\"", self.token.text());
        }
    }
}

impl Pupil {
    /// The next place is for a pupil who has none yet.
    fn read(written: WrittenPupil, next: &mut u16) -> anyhow::Result<Self> {
        let WrittenPupil { name, world, lesson, token: given, place } = written;
        let is_name = !as_seen(&name).is_empty() && name.chars().count() <= NAME_MAX;
        ensure!(
            is_name && !name.contains(char::is_control),
            "{name:?} is no name: it has 1 to {NAME_MAX} letters"
        );
        let world = match (world, lesson) {
            (Some(_), Some(_)) => bail!("{name}: write a world or a lesson, not both"),
            (world, None) => world,
            (None, Some(lesson)) => Some(format!("lesson{lesson}")),
        };
        let token = token(given.as_deref()).with_context(|| name.clone())?;
        let place = place.unwrap_or_else(|| {
            let free = *next;
            *next = next.saturating_add(1);
            free
        });
        Ok(Self { name, world, token, place })
    }
}

/// A name as a page shows it: without spaces at its ends, and without what takes no room.
pub(super) fn as_seen(name: &str) -> String {
    let takes_room = |c: &char| !matches!(c, '\u{AD}' | '\u{180E}' | '\u{200B}'..='\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2060}'..='\u{206F}' | '\u{FE00}'..='\u{FE0F}' | '\u{FEFF}');
    let shown: String = name.nfc().filter(takes_room).collect();
    shown.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The place after all that have an owner: that of a pupil who was removed may be wanted again. Each has one owner.
fn next_place(pupils: &[WrittenPupil]) -> anyhow::Result<u16> {
    let mut owners = HashMap::new();
    for WrittenPupil { name, place, .. } in pupils {
        let Some(place) = *place else { continue };
        ensure!(place > 0, "{name}: places begin with 1");
        if let Some(other) = owners.insert(place, name) {
            bail!(
                "{name} has the same place as {other}, so both would have the same ports; remove the line with the \
                 place of {name}, and a new one is made"
            );
        }
    }
    Ok(owners.into_keys().max().unwrap_or(0).saturating_add(1))
}

/// A token says whose page it opens. A line may have been copied with a pupil.
fn each_has_a_token_of_its_own(all: &Token, pupils: &[Pupil]) -> anyhow::Result<()> {
    let of_pupils = pupils.iter().map(|pupil| (pupil.token.text(), pupil.name.as_str()));
    let mut owners = HashMap::from([(all.text(), "the page of all")]);
    for (token, name) in of_pupils {
        if let Some(other) = owners.insert(token, name) {
            bail!(
                "{name} has the same token as {other}, so both links would open one page; remove the line with the \
                 token of {name}, and a new one is made"
            );
        }
    }
    Ok(())
}

/// The token with this text, or a new one.
fn token(text: Option<&str>) -> anyhow::Result<Token> {
    let Some(text) = text else { return Token::random() };
    let known = Token::known(text);
    known.ok_or_else(|| {
        anyhow!("a token has 32 digits from 0 to f; remove its line, and a new one is made")
    })
}

/// Reads the file, if it is no longer than one of a class.
pub(super) fn read(path: &Path) -> io::Result<String> {
    text_file::read(path, LONGEST)
}

/// Writes a file that is read again, if it is no longer than one of a class.
pub(super) fn keep(path: &Path, text: &str) -> anyhow::Result<()> {
    ensure!(
        text.len() as u64 <= LONGEST,
        "it would have more than {LONGEST} bytes, and could not be read again: remove lines of earlier pupils"
    );
    write(path, text)
}

/// Writes a file as a whole, for this user only. A link stays a link.
pub(super) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    let behind = if path.is_symlink() { path.canonicalize().ok() } else { None };
    let path = behind.as_deref().unwrap_or(path);
    if fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        bail!("it is a device or a pipe, and a file is expected");
    }
    let mut name = path.file_name().context("this is no file")?.to_owned();
    name.push(".new");
    let new = path.with_file_name(name);
    // What is there may be a link, or for others, too.
    let _ = fs::remove_file(&new);
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(&new)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    Ok(fs::rename(&new, path)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_could_not_be_read_again_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("8c.csv");
        let longest = "a".repeat(LONGEST as usize);
        keep(&file, &longest).unwrap();
        assert_eq!(read(&file).unwrap(), longest);
        assert!(keep(&file, &(longest + "a")).unwrap_err().to_string().contains("earlier pupils"));
        assert_eq!(read(&file).unwrap().len() as u64, LONGEST);
    }

    #[cfg(unix)]
    #[test]
    fn the_file_behind_a_link_is_written_for_this_user_alone() {
        use std::os::unix::fs::{symlink, PermissionsExt};

        let folder = tempfile::tempdir().unwrap();
        let [file, link, new, other] =
            ["7b.toml", "link.toml", "7b.toml.new", "other"].map(|name| folder.path().join(name));
        fs::write(&file, "old").unwrap();
        fs::write(&other, "other").unwrap();
        symlink("7b.toml", &link).unwrap();
        symlink("other", new).unwrap();
        write(&link, "new").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
        assert_eq!(fs::read_to_string(other).unwrap(), "other");
        // Nor is a pipe or a device replaced by a file.
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let error = write(&pipe, "new").unwrap_err().to_string();
        assert!(error.contains("it is a device or a pipe"), "{error}");
        assert!(!fs::symlink_metadata(&pipe).unwrap().is_file());
    }

    #[test]
    fn a_new_file_is_read_again_with_the_same_links() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("7b.toml");
        let mut made = Class::load(&path, Some(3)).unwrap();
        made.keep(&path, 65000, 8000).unwrap();
        let read = Class::load(&path, None).unwrap();
        assert_eq!(
            (read.port, read.page_port, &read.token),
            (Some(65000), Some(8000), &made.token)
        );
        let all = |class: &Class| -> Vec<_> {
            class.pupils.iter().map(|one| (one.name.clone(), one.token.text().to_owned())).collect()
        };
        assert_eq!(all(&read), all(&made));
        let error = Class::load(&path, Some(4)).unwrap_err().to_string();
        assert!(error.contains("has 3 pupils"), "{error}");
    }

    #[test]
    fn what_a_teacher_has_written_stays_and_gets_tokens() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("7b.toml");
        let text = "# my class\n[[pupils]] # by the window\nname = \"Zoë\"\nlesson = 3\n\n[[pupils]]\nname = \"Ben\"\n";
        fs::write(&path, text).unwrap();
        let mut class = Class::load(&path, None).unwrap();
        assert_eq!(class.pupils[0].world.as_deref(), Some("lesson3"));
        class.keep(&path, 65000, 8000).unwrap();
        let now = fs::read_to_string(&path).unwrap();
        assert!(text.lines().all(|line| now.contains(line)), "{now}");
        let mut again = Class::load(&path, None).unwrap();
        assert_eq!(again.pupils[1].token, class.pupils[1].token);
        again.keep(&path, 65000, 8000).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), now);
    }

    #[test]
    fn who_leaves_or_comes_changes_nobody_elses_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("7b.toml");
        let pupil = |name: &str| format!("[[pupils]]\nname = \"{name}\"\n");
        let places = |text: String| -> (String, Vec<_>) {
            fs::write(&path, text).unwrap();
            let mut class = Class::load(&path, None).unwrap();
            class.keep(&path, 65000, 8000).unwrap();
            let places = class.pupils.iter().map(|one| (one.name.clone(), one.place)).collect();
            (fs::read_to_string(&path).unwrap(), places)
        };
        let own = |places: &[(&str, u16)]| -> Vec<_> {
            places.iter().map(|(name, place)| (String::from(*name), *place)).collect()
        };
        let (text, first) = places(["A", "B", "C"].map(pupil).concat());
        assert_eq!(first, own(&[("A", 1), ("B", 2), ("C", 3)]));
        let mut parts: Vec<_> = text.split("[[pupils]]").collect();
        parts[2] = "\nname = \"New\"\n";
        let (_, then) = places(parts.join("[[pupils]]"));
        assert_eq!(then, own(&[("A", 1), ("New", 4), ("C", 3)]));
    }

    #[test]
    fn a_token_that_was_copied_is_refused() {
        let token = format!("token = \"{}\"\n", "0".repeat(32));
        let [a, b] = ["A", "B"].map(|name| format!("[[pupils]]\nname = \"{name}\"\n{token}"));
        Class::from_text(&a).unwrap();
        for (text, part) in [
            (format!("{a}{b}"), "B has the same token as A"),
            (format!("{token}{a}"), "A has the same token as the page of all"),
        ] {
            let error = Class::from_text(&text).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn controllers_of_pupils_whose_names_begin_alike_have_numbers() {
        let names = ["Maximilian Mustermann", "Zoë", "Maximilian Musterfrau"];
        let text = names.map(|name| format!("[[pupils]]\nname = {name:?}\n")).concat();
        let devices = Class::from_text(&text).unwrap().device_names();
        assert_eq!(devices, ["Maximilian Mus 1", "Zoë", "Maximilian Mus 3"]);
        // Another one leaves, and nobody gets a name that was somebody else's.
        let text = format!("{text}[[pupils]]\nname = \"Maximilian Musterkind\"\n");
        let mut class = Class::from_text(&text).unwrap();
        class.pupils.remove(0);
        assert_eq!(class.device_names(), ["Zoë", "Maximilian Mus 3", "Maximilian Mus 4"]);
    }

    #[test]
    fn what_is_no_class_gets_a_sentence() {
        for (text, part) in [
            ("", "there is nobody in it"),
            ("[[pupils]]\nname = \"\"", "is no name"),
            ("[[pupils]]\nname = \"A\"\ntoken = \"geheim\"", "32 digits"),
            ("[[pupils]]\nname = \"A\"\n[[pupils]]\nname = \"A\"", "two pupils are called"),
            ("[[pupils]]\nname = \"A\"\n[[pupils]]\nname = \" A \"", "two pupils are called"),
            (
                "[[pupils]]\nname = \"A B\"\n[[pupils]]\nname = \"A\\u00A0\\u200BB\"",
                "two pupils are called",
            ),
            (
                "[[pupils]]\nname = \"Zo\\u00EB\"\n[[pupils]]\nname = \"Zoe\\u0308\"",
                "two pupils are called",
            ),
            ("[[pupils]]\nname = \"A\"\nworld = \"car\"\nlesson = 1", "not both"),
            ("[[pupils]]\nname = \"A\"\nplace = 0", "places begin with 1"),
            (
                "[[pupils]]\nname = \"A\"\nplace = 2\n[[pupils]]\nname = \"B\"\nplace = 2",
                "B has the same place as A",
            ),
            ("[[pupils]]\nname = \"A\"\ncolour = 1", "unknown field `colour`"),
        ] {
            let error = format!("{:#}", Class::from_text(text).unwrap_err());
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
