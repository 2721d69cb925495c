//! COM ports: which controller a program means by `COM4`.
//!
//! | what | which controller |
//! |---|---|
//! | `FT_TXT_PORTS="COM4=192.168.7.2, COM5=10.0.0.7:65000"` | those, first of all |
//! | the same lines in a file `ft_txt_ports`, in the current folder or in the user's configuration folder | those, next, unless `FT_TXT_PORTS` has the entry `none` |
//! | `FT_TXT_HOST`: a host, `HOST:PORT` or `auto` | for every other COM port |
//! | a host in place of the port | itself; for programs of `tx_run` also `FT_TXT_HOST`, unless `FT_TXT_PORTS` names it |
//! | nothing of these | `COM1` USB, `COM2` Wi-Fi, `COM3` Bluetooth, `COM4` the controller on this machine |
//!
//! So a controller's number depends on how it is connected, and on nothing else: it is the same at each start,
//! whichever controllers answer.

use std::env;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::Duration;

use ft_transfer_area::{find_controllers, ConnectionKind, SearchOptions};

use crate::port_entries::entries;
use crate::{host, online, report, text_file};

/// The file with COM ports.
const FILE: &str = "ft_txt_ports";
/// The entry after which no file counts, as for programs of `tx_run`.
const NO_FILE: &str = "none";
/// How long it may be, in bytes.
const MOST: u64 = 64 << 10;
/// How long a search for controllers may take.
pub(crate) const SEARCH_LIMIT: Duration = Duration::from_secs(1);

/// The COM ports of controllers at the usual addresses.
const USUAL: [(ConnectionKind, &str); 4] = [
    (ConnectionKind::Usb, "192.168.7.2"),
    (ConnectionKind::Wifi, "192.168.8.2"),
    (ConnectionKind::Bluetooth, "192.168.9.2"),
    (ConnectionKind::SameMachine, "127.0.0.1"),
];

/// Which ports a program wants to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Selection {
    /// `ALL_PORTS`.
    All,
    /// `USB_ONLY`: controllers found over USB, and the named ones except those over Bluetooth. A program that
    /// only knows USB so finds what its user has named.
    Usb,
    /// `BT_ONLY`.
    Bluetooth,
}

/// The configured COM ports.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Ports {
    /// Number and host; the first entry of a number counts.
    named: Vec<(u32, String)>,
    /// The host of all others.
    others: Option<String>,
    /// Whether that is also the one of each host that a program names itself.
    is_chosen: bool,
}

impl Ports {
    /// What the environment and the files say now.
    pub(crate) fn configured() -> Self {
        let mut ports = Self {
            named: Vec::new(),
            others: host::from_environment(),
            is_chosen: online::is_of_tx_run(),
        };
        let variable = host::variable("FT_TXT_PORTS").unwrap_or_default();
        ports.add("FT_TXT_PORTS", &variable);
        if entries(&variable).any(|entry| entry == NO_FILE) {
            return ports;
        }
        for file in files() {
            match read(&file) {
                Ok(text) => ports.add(&file.display().to_string(), &text),
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                Err(error) => {
                    report::warning(format_args!("{} can't be read: {error}", file.display()));
                }
            }
        }
        ports
    }

    /// Adds the entries of a text. One that is wrong is reported, and left out.
    fn add(&mut self, origin: &str, text: &str) {
        for entry in entries(text).filter(|entry| *entry != NO_FILE) {
            let parts = entry.split_once('=').map(|(name, host)| (number_of(name), host.trim()));
            match parts {
                Some((Some(number), host)) if !host.is_empty() => self.add_port(number, host),
                _ => report::warning(format_args!(
                    "{origin}: \"{entry}\" is not like COM4=192.168.7.2"
                )),
            }
        }
    }

    fn add_port(&mut self, number: u32, host: &str) {
        if self.named.iter().all(|(named, _)| *named != number) {
            self.named.push((number, host.to_owned()));
        }
    }

    /// The host of a port by its number.
    pub(crate) fn host(&self, number: u32) -> Option<String> {
        let named = self.named.iter().find(|(named, _)| *named == number);
        let usual =
            || USUAL.get(number.checked_sub(1)? as usize).map(|(_, host)| (*host).to_owned());
        named.map(|(_, host)| host.clone()).or_else(|| self.others.clone()).or_else(usual)
    }

    /// The host that a program means, by `COM4`, by a text of [`list`](Self::list), or by the host itself.
    pub(crate) fn host_of(&self, name: &str) -> Option<String> {
        let name = name.trim();
        match number_of(name) {
            Some(number) => self.host(number),
            None => Some(self.chosen_for(name).unwrap_or(name).to_owned()),
        }
    }

    /// The host that `tx_run` has chosen, when a program names another one, or the same, that is not the host of a named
    /// port.
    pub(crate) fn chosen_for(&self, name: &str) -> Option<&str> {
        let name = name.trim();
        let is_named = || self.named.iter().any(|(_, host)| host::is_same(host, name));
        let is_replaced = self.is_chosen && number_of(name).is_none() && !is_named();
        self.others.as_deref().filter(|_| is_replaced)
    }

    /// The ports as texts like `COM1 (ROBO TXT, USB)`. Named ones are listed whether they answer or not, and
    /// controllers are searched for only when no host is set for all others.
    pub(crate) fn list(&self, selection: Selection) -> Vec<String> {
        let found = match self.others {
            Some(_) => Vec::new(),
            None => found(),
        };
        self.list_with(selection, &found)
    }

    fn list_with(&self, selection: Selection, found: &[(ConnectionKind, String)]) -> Vec<String> {
        let is_free = |number: &u32| self.named.iter().all(|(named, _)| named != number);
        let other =
            self.others.as_ref().and_then(|host| Some(((1..).find(is_free)?, host.clone())));
        let mut ports: Vec<_> = self
            .named
            .iter()
            .cloned()
            .chain(other)
            .filter(|(_, host)| match selection {
                Selection::All => true,
                Selection::Usb => !is_bluetooth(host),
                Selection::Bluetooth => is_bluetooth(host),
            })
            .collect();
        for (connection, name) in found {
            let usual = USUAL.iter().zip(1..).find(|((kind, _), _)| kind == connection);
            let Some((&(_, host), number)) = usual else { continue };
            let is_selected = match selection {
                Selection::All => true,
                Selection::Usb => *connection == ConnectionKind::Usb,
                Selection::Bluetooth => *connection == ConnectionKind::Bluetooth,
            };
            let is_named = self.named.iter().any(|(_, named)| named == host);
            if is_selected && !is_named && is_free(&number) {
                ports.push((number, format!("{name}, {connection}")));
            }
        }
        ports.sort_unstable();
        ports.into_iter().map(|(number, text)| format!("COM{number} ({text})")).collect()
    }
}

/// The controllers at the usual addresses: how they are connected, and their names.
fn found() -> Vec<(ConnectionKind, String)> {
    match find_controllers(&SearchOptions::default().limit(SEARCH_LIMIT)) {
        Ok(found) => found.controllers.into_iter().map(|it| (it.connection, it.name)).collect(),
        Err(error) => {
            log::info!("{error:#}");
            Vec::new()
        }
    }
}

fn is_bluetooth(host: &str) -> bool {
    let address = host.split(':').next();
    USUAL.iter().any(|(kind, usual)| *kind == ConnectionKind::Bluetooth && address == Some(usual))
}

/// 4 for `COM4`, `com4`, `\\.\COM4` and `COM4 (ROBO TXT, USB)`.
pub(crate) fn number_of(name: &str) -> Option<u32> {
    let name = name.trim();
    let name = name.strip_prefix(r"\\.\").unwrap_or(name);
    let (kind, behind) = name.split_at_checked(3)?;
    let digits = behind.find(|c: char| !c.is_ascii_digit()).unwrap_or(behind.len());
    let (number, rest) = behind.split_at(digits);
    let ends = rest.is_empty() || rest == ":" || rest.starts_with([' ', '(']);
    let is_port = kind.eq_ignore_ascii_case("COM") && ends;
    number.parse().ok().filter(|number| is_port && *number > 0)
}

/// Where the file may be.
fn files() -> Vec<PathBuf> {
    let home = || env::var_os("HOME").map(PathBuf::from);
    let user = if cfg!(windows) {
        env::var_os("APPDATA").map(PathBuf::from)
    } else if cfg!(target_os = "macos") {
        home().map(|home| home.join("Library/Application Support"))
    } else {
        let folder = env::var_os("XDG_CONFIG_HOME").filter(|folder| !folder.is_empty());
        folder.map(PathBuf::from).or_else(|| home().map(|home| home.join(".config")))
    };
    [Some(PathBuf::new()), user].into_iter().flatten().map(|folder| folder.join(FILE)).collect()
}

/// The text of a file.
fn read(path: &Path) -> io::Result<String> {
    let text = text_file::read(path, MOST)?;
    String::from_utf8(text).map_err(|error| io::Error::new(ErrorKind::InvalidData, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ports(text: &str) -> Ports {
        let mut ports = Ports::default();
        ports.add("a test", text);
        ports
    }

    #[test]
    fn ports_are_named_in_entries_of_a_variable_or_lines_of_a_file() {
        let text = "COM4=192.168.7.2, com5 = 10.0.0.7:65000 # the sorter\n\n# COM6=no\nCOM4=other\nCOM7\nCOMA=1\nX=1";
        let ports = ports(text);
        let named = [(4, "192.168.7.2".to_owned()), (5, "10.0.0.7:65000".to_owned())];
        assert_eq!(ports.named, named);
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
        std::fs::write(at("long"), "#".repeat(70_000)).unwrap();
        std::fs::write(at("right"), "COM4=a").unwrap();
        for (path, part) in [
            (Path::new("/dev/zero"), "no file"),
            (&at("pipe"), "no file"),
            (&at("long"), "more than 64 KiB"),
        ] {
            let error = read(path).unwrap_err().to_string();
            assert!(error.contains(part), "{path:?}: {error}");
        }
        assert_eq!(read(&at("right")).unwrap(), "COM4=a");
        assert_eq!(read(&at("none")).unwrap_err().kind(), ErrorKind::NotFound);
    }

    #[test]
    fn a_port_is_meant_by_its_number_or_its_text_and_all_else_is_a_host() {
        for name in ["COM12", " com12 ", r"\\.\COM12", "COM12 (ROBO TXT, USB)", "COM12:"] {
            assert_eq!(number_of(name), Some(12), "{name}");
        }
        for name in [
            "COM",
            "COM0",
            "COMx",
            "COM1x",
            "COM-1",
            "COM99999999999",
            "C",
            "",
            "comöö",
            "192.168.7.2",
        ] {
            assert_eq!(number_of(name), None, "{name}");
        }
        assert_eq!(ports("").host_of("txt:65000"), Some("txt:65000".to_owned()));
    }

    #[test]
    fn a_named_port_goes_before_the_host_for_all_and_this_before_the_usual_ones() {
        let mut ports = ports("COM2=sorter");
        assert_eq!(ports.host(1).as_deref(), Some("192.168.7.2"));
        assert_eq!(ports.host(2).as_deref(), Some("sorter"));
        assert_eq!((ports.host(5), ports.host(0)), (None, None));
        ports.others = Some("127.0.0.1:4000".to_owned());
        assert_eq!(ports.host(1).as_deref(), Some("127.0.0.1:4000"));
        assert_eq!(ports.host_of("COM2").as_deref(), Some("sorter"));
        assert_eq!(ports.list(Selection::All), ["COM1 (127.0.0.1:4000)", "COM2 (sorter)"]);
    }

    #[test]
    fn a_host_in_a_program_of_tx_run_is_the_chosen_one_unless_it_is_that_of_a_named_port() {
        let mut ports = ports("COM2=sorter");
        ports.others = Some("127.0.0.1:4000".to_owned());
        assert_eq!(ports.host_of("192.168.7.2").as_deref(), Some("192.168.7.2"));
        ports.is_chosen = true;
        for name in ["192.168.7.2", " auto ", "127.0.0.1:4000"] {
            assert_eq!(ports.host_of(name).as_deref(), Some("127.0.0.1:4000"), "{name}");
            assert!(ports.chosen_for(name).is_some(), "{name}");
        }
        assert_eq!(ports.host_of("Sorter:65000").as_deref(), Some("Sorter:65000"));
        assert_eq!(ports.chosen_for("COM2"), None);
        ports.others = None;
        assert_eq!(ports.host_of("192.168.7.2").as_deref(), Some("192.168.7.2"));
    }

    #[test]
    fn found_controllers_are_listed_under_the_number_of_their_connection() {
        let kinds = [ConnectionKind::Usb, ConnectionKind::Wifi, ConnectionKind::Bluetooth];
        let found = kinds.map(|kind| (kind, "TXT".to_owned()));
        let list = |text, selection| ports(text).list_with(selection, &found);
        let all = ["COM1 (TXT, USB)", "COM2 (TXT, Wi-Fi)", "COM3 (TXT, Bluetooth)"];
        assert_eq!(list("", Selection::All), all);
        assert_eq!(list("", Selection::Usb), all[..1]);
        assert_eq!(list("", Selection::Bluetooth), all[2..]);
        // The number is taken, and the controller is named.
        let named = ["COM1 (sorter)", "COM3 (TXT, Bluetooth)", "COM9 (192.168.8.2)"];
        assert_eq!(list("COM1=sorter,COM9=192.168.8.2", Selection::All), named);
        assert_eq!(list("COM9=sorter", Selection::Usb), ["COM1 (TXT, USB)", "COM9 (sorter)"]);
        let bluetooth = list("COM9=192.168.9.2:65000", Selection::Bluetooth);
        assert_eq!(bluetooth, ["COM3 (TXT, Bluetooth)", "COM9 (192.168.9.2:65000)"]);
    }
}
