//! Where libraries come from that programs use.

use std::path::Path;

use crate::missing;

/// A library, the beginning of the names of its headers, and its package in Debian. A name that ends with `*` is
/// the beginning of several. The first that fits counts.
const PACKAGES: &[(&str, &str, &str)] = &[
    ("jsoncpp", "json/", "libjsoncpp-dev"),
    ("spdlog", "spdlog/", "libspdlog-dev"),
    ("fmt", "fmt/", "libfmt-dev"),
    ("paho-mqttpp3", "mqtt/", "libpaho-mqttpp-dev"),
    ("paho-mqtt3*", "MQTT", "libpaho-mqtt-dev"),
    ("opencv_*", "opencv", "libopencv-dev"),
    ("nfc", "nfc/", "libnfc-dev"),
    ("freefare", "freefare.h", "libfreefare-dev"),
    ("mosquittopp", "mosquittopp.h", "libmosquittopp-dev"),
    ("mosquitto", "mosquitto.h", "libmosquitto-dev"),
    ("ssl", "openssl/", "libssl-dev"),
    ("crypto", "openssl/", "libssl-dev"),
    ("curl", "curl/", "libcurl4-openssl-dev"),
    ("yaml-cpp", "yaml-cpp/", "libyaml-cpp-dev"),
    ("sqlite3", "sqlite3.h", "libsqlite3-dev"),
    ("usb-1.0", "libusb-1.0/", "libusb-1.0-0-dev"),
    ("bluetooth", "bluetooth/", "libbluetooth-dev"),
    ("jpeg", "jpeglib.h", "libjpeg-dev"),
    ("ncurses", "ncurses.h", "libncurses-dev"),
    ("z", "zlib.h", "zlib1g-dev"),
    ("boost_*", "boost/", "libboost-all-dev"),
];

/// How names begin that are in a library.
const NAMES: &[(&str, &str)] = &[
    ("Json::", "jsoncpp"),
    ("spdlog::", "spdlog"),
    ("fmt::", "fmt"),
    ("mqtt::", "paho-mqttpp3"),
    ("MQTTAsync_", "paho-mqtt3as"),
    ("MQTTClient_", "paho-mqtt3cs"),
    ("cv::", "opencv_core"),
    ("nfc_", "nfc"),
    ("freefare_", "freefare"),
    ("mosquitto_", "mosquitto"),
    ("sqlite3_", "sqlite3"),
    ("curl_", "curl"),
    ("libusb_", "usb-1.0"),
];

/// Libraries of the kits and of Windows in place of which programs are linked to ftMscLib.
const REPLACED: &[&str] =
    &["KeLibTxt", "MotorIOLib", "ROBOProLib", "ftMscLib", "ftMscLibEx", "winmm", "ws2_32"];

/// Whether our library has what this one has.
pub(crate) fn is_replaced(library: &str) -> bool {
    REPLACED.contains(&library) && !(cfg!(windows) && matches!(library, "winmm" | "ws2_32"))
}

/// The package of a library.
fn of_library(name: &str) -> Option<&'static str> {
    let fits = |library: &str| match library.strip_suffix('*') {
        Some(beginning) => name.starts_with(beginning),
        None => library == name,
    };
    PACKAGES.iter().find(|(library, ..)| fits(library)).map(|(.., package)| *package)
}

/// The package of a header.
fn of_header(name: &str) -> Option<&'static str> {
    PACKAGES.iter().find(|(_, header, _)| name.starts_with(header)).map(|(.., package)| *package)
}

/// Folders in which Debian puts headers, and in which no compiler looks by itself.
const FOLDERS: [&str; 2] = ["/usr/include/jsoncpp", "/usr/include/opencv4"];

/// What to do about libraries that a linker has not found, as far as it has said so; empty when that was none.
pub(crate) fn advice_for_libraries<'a>(
    said: &str,
    libraries: impl Iterator<Item = &'a str>,
) -> String {
    let mut advice = String::new();
    for name in libraries.filter(|name| is_missed(said, name)) {
        let package =
            of_library(name).map(|package| format!(", which is in Debian's package {package}"));
        let sentence = format!("; the library {name} is missing{}", package.unwrap_or_default());
        if !advice.contains(&sentence) {
            advice += &sentence;
        }
    }
    advice
}

/// Which libraries have names that a linker has not found, without those that it was given; and which of the program's
/// files have the others. `sources` are those that were compiled.
pub(crate) fn advice_for_names(said: &str, given: &[String], sources: &[&Path]) -> String {
    let mut missing: Vec<&str> = said.lines().filter_map(missing_name).collect();
    missing.sort_unstable();
    missing.dedup();
    let is_missing = |beginning: &str| missing.iter().any(|name| name.starts_with(beginning));
    let lacks = |library: &str| !given.iter().any(|name| name == library);
    let found = NAMES.iter().filter(|(beginning, library)| lacks(library) && is_missing(beginning));
    let advice: String = found
        .map(|(beginning, library)| format!("; {beginning} is in a library: add -l {library}"))
        .collect();
    missing.retain(|name| !NAMES.iter().any(|(beginning, _)| name.starts_with(beginning)));
    advice + &missing::advice_for_names(&missing, sources)
}

/// What is called but not there, in a line of a linker. Of `vtable for a::B` and of `int a::b<int>(c::D)` it is
/// the part that begins with `a::`.
fn missing_name(line: &str) -> Option<&str> {
    let gnu = line.split_once("undefined reference to `").map(|(_, name)| name);
    let lld = || line.split_once("undefined symbol: ").map(|(_, name)| name);
    let apple = || line.strip_suffix(", referenced from:")?.trim_start().strip_prefix('"');
    let whole = gnu.or_else(lld).or_else(apple)?;
    whole.split(['(', '<', '\'', '"']).next()?.split(' ').next_back()
}

/// Whether a linker says that it has not found a library. All of them name it as it was given, or in quotes.
fn is_missed(said: &str, name: &str) -> bool {
    let is_end = |rest: &str| {
        !rest.starts_with(|next: char| next.is_alphanumeric() || "_-.+".contains(next))
    };
    let option = format!("-l{name}");
    let quoted = format!("library '{name}' not found");
    said.contains(&quoted)
        || said.match_indices(&option).any(|(at, _)| is_end(&said[at + option.len()..]))
}

/// What to do about a header that a compiler has not found in a source; `None` when it has found all.
pub(crate) fn advice_for_header(said: &str, source: &Path) -> Option<String> {
    // A compiler also says it of a program that it does not find.
    let of_files = |line: &&str| !line.contains("execvp");
    let header = said.lines().filter(of_files).find_map(|line| {
        let (before, _) = line.split_once(": No such file")?;
        before.rsplit_once(' ').map(|(_, header)| header)
    });
    let header = header.or_else(|| {
        let (before, _) = said.split_once("' file not found")?;
        before.rsplit_once('\'').map(|(_, header)| header)
    });
    // Colours come between the words.
    let header =
        header.map(|header| header.trim_start_matches(|first: char| !first.is_alphanumeric()));
    let header = header?;
    let is_there = |folder: &&str| Path::new(folder).join(header).is_file();
    Some(match (FOLDERS.into_iter().find(is_there), of_header(header)) {
        (Some(folder), _) => format!("; {header} is found with -I {folder}"),
        (None, Some(package)) => format!("; {header} is in Debian's package {package}"),
        (None, None) => missing::advice_for_header(header, source),
    })
}

/// The header of ftMscLibEx, which has its names.
const EXTENDED: &str = include_str!("../../include/ftMscLibEx.h");

/// What compilers say of a name that they do not know.
const UNKNOWN: [&str; 4] = ["not declared", "undeclared", "implicit declaration", "unknown type"];

/// What to do when a compiler does not know a name of ftMscLibEx: its manual names no header, and programs may include that
/// of ftMscLib. Empty when it knows them.
pub(crate) fn advice_for_extended(said: &str) -> &'static str {
    let lines = said.lines().filter(|line| UNKNOWN.iter().any(|words| line.contains(words)));
    // A word of a comment is none.
    let is_its_form = |name: &str| {
        name.starts_with("SetCB") || name.starts_with("GetCB") || name.ends_with(['2', '4'])
    };
    let mut unknown = lines.flat_map(names).filter(|name| is_its_form(name));
    if unknown.any(|name| names(EXTENDED).any(|other| other == name)) {
        "; include ftMscLibEx.h in place of ftMscLib.h"
    } else {
        ""
    }
}

/// The words of a text, as C has names.
fn names(text: &str) -> impl Iterator<Item = &str> {
    text.split(|next: char| !next.is_ascii_alphanumeric() && next != '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_of_names_of_ft_msc_lib_ex_is_named() {
        for said in [
            "ex.cpp:9:5: error: 'SetCBUniChanged' was not declared in this scope\n",
            "\x1b[1mex.cpp:9:5: error: \x1b[0muse of undeclared identifier 'StartMotorExCmd4'\n",
            "ex.c:3:1: error: unknown type name 'CB_LEVEL2'\n",
        ] {
            assert!(advice_for_extended(said).contains("include ftMscLibEx.h"), "{said}");
        }
        for said in ["a.c:1:1: error: 'motor2' undeclared\n", "SetCBUniChanged: wrong type\n"] {
            assert_eq!(advice_for_extended(said), "");
        }
    }

    #[test]
    fn the_package_of_a_library_that_is_missing_is_named() {
        let said =
            "/usr/bin/ld: cannot find -ljsoncpp: No such file\n/usr/bin/ld: cannot find -lown\n";
        let advice = advice_for_libraries(said, ["jsoncpp", "json", "own", "own", "m"].into_iter());
        let expected =
            "; the library jsoncpp is missing, which is in Debian's package libjsoncpp-dev; the \
                        library own is missing";
        assert_eq!(advice, expected);
        let said = "ld: library 'opencv_core' not found\n";
        let advice = advice_for_libraries(said, ["opencv_core", "opencv"].into_iter());
        assert!(advice.ends_with("libopencv-dev"), "{advice}");
        for (library, package) in
            [("paho-mqtt3as", "libpaho-mqtt-dev"), ("paho-mqttpp3", "libpaho-mqttpp-dev")]
        {
            assert_eq!(of_library(library), Some(package));
        }
    }

    #[test]
    fn the_library_of_names_that_are_missing_is_named() {
        let gnu = "/usr/bin/ld: a.o: in function `cv::f()':\na.cpp:1: undefined reference to `vtable for fmt::v9::A'\n\
                   a.cpp:2: undefined reference to `Json::Value::Value(int)'\n\
                   a.cpp:3: undefined reference to `own::call(mqtt::client&)'\n";
        let advice = advice_for_names(gnu, &[String::from("jsoncpp")], &[]);
        let own = "; no source here has own::call: a file is missing, or a library (-l)";
        assert_eq!(advice, format!("; fmt:: is in a library: add -l fmt{own}"));
        let advice = "; fmt:: is in a library: add -l fmt";
        let lld = "ld.lld: error: undefined symbol: char fmt::v9::point<char>(int)\n";
        assert_eq!(advice_for_names(lld, &[], &[]), advice);
        let apple =
            "Undefined symbols:\n  \"fmt::v9::f()\", referenced from:\n      own::g() in a.o\n";
        assert_eq!(advice_for_names(apple, &[], &[]), advice);
    }

    #[test]
    fn the_package_of_a_header_that_is_missing_is_named() {
        let advice_for_header = |said| advice_for_header(said, Path::new("/none/src/a.cpp"));
        let gcc = "a.cpp:3:10: fatal error: json/no.h: No such file or directory\n";
        let advice = advice_for_header(gcc).unwrap();
        assert_eq!(advice, "; json/no.h is in Debian's package libjsoncpp-dev");
        let clang = "a.cpp:1:10: fatal error: 'MQTTClient.h' file not found\n";
        assert_eq!(
            advice_for_header(clang).unwrap(),
            "; MQTTClient.h is in Debian's package libpaho-mqtt-dev"
        );
        let own = advice_for_header("a.cpp:1:10: fatal error: own.h: No such file\n").unwrap();
        assert!(own.contains("own.h is missing: name its folder with -I"), "{own}");
        assert_eq!(advice_for_header("a.cpp:1:1: error: 'json' was not declared\n"), None);
        for program in [
            "gcc: fatal error: cannot execute 'as': execvp: No such file or directory\n",
            "gcc: error trying to exec 'cc1plus': execvp: No such file or directory\n",
        ] {
            assert_eq!(advice_for_header(program), None);
        }
    }
}
