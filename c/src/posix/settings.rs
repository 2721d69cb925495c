//! Files with settings: lines of `key=value` below `[section]`.

use std::ffi::{c_char, c_int, CStr};
use std::{fs, io};

use crate::ffi::{caught, text_of};
use crate::text_file;

/// A file with more is not read.
const LARGEST: u64 = 1 << 20;
const FALSE: i32 = 0;

/// The file's lines, each without its end. Texts are in any encoding.
type Lines = Vec<Vec<u8>>;

fn trimmed(text: &[u8]) -> &[u8] {
    text.trim_ascii()
}

/// The section that begins with a line.
fn section_in(line: &[u8]) -> Option<&[u8]> {
    let rest = trimmed(line).strip_prefix(b"[")?;
    let end = rest.iter().position(|byte| *byte == b']').unwrap_or(rest.len());
    Some(trimmed(&rest[..end]))
}

/// The key and the value in a line.
fn setting_in(line: &[u8]) -> Option<(&[u8], &[u8])> {
    let line = trimmed(line);
    let at = line.iter().position(|byte| *byte == b'=')?;
    let is_setting = !line.starts_with(b";") && !line.starts_with(b"[");
    is_setting.then(|| (trimmed(&line[..at]), trimmed(&line[at + 1..])))
}

/// Without the quotes around it.
fn unquoted(value: &[u8]) -> &[u8] {
    match value {
        [b'"', inner @ .., b'"'] | [b'\'', inner @ .., b'\''] => inner,
        other => other,
    }
}

/// The lines of a section, without its first one.
fn places_of(lines: &Lines, section: &[u8]) -> Option<std::ops::Range<usize>> {
    let is_it =
        |line: &Vec<u8>| section_in(line).is_some_and(|it| it.eq_ignore_ascii_case(section));
    let begin = lines.iter().position(is_it)? + 1;
    let length = lines[begin..].iter().position(|line| section_in(line).is_some());
    Some(begin..length.map_or(lines.len(), |length| begin + length))
}

fn settings<'a>(lines: &'a Lines, section: &[u8]) -> impl Iterator<Item = (&'a [u8], &'a [u8])> {
    lines[places_of(lines, section).unwrap_or(0..0)].iter().filter_map(|line| setting_in(line))
}

fn value<'a>(lines: &'a Lines, section: &[u8], key: &[u8]) -> Option<&'a [u8]> {
    let found =
        settings(lines, section).find(|(known, _)| known.eq_ignore_ascii_case(trimmed(key)));
    found.map(|(_, value)| unquoted(value))
}

/// Sets a key, or removes it, or the whole section.
fn change(lines: &mut Lines, section: &[u8], key: Option<&[u8]>, value: Option<&[u8]>) {
    let places = places_of(lines, section);
    let Some(key) = key.map(trimmed) else {
        if let Some(places) = places {
            lines.drain(places.start - 1..places.end);
        }
        return;
    };
    let is_key =
        |line: &Vec<u8>| setting_in(line).is_some_and(|(known, _)| known.eq_ignore_ascii_case(key));
    let place = places.clone().and_then(|places| {
        lines[places.clone()].iter().position(is_key).map(|at| places.start + at)
    });
    let Some(value) = value else {
        place.map(|place| lines.remove(place));
        return;
    };
    let line = [key, b"=", value].concat();
    match (place, places) {
        (Some(place), _) => lines[place] = line,
        (None, Some(places)) => {
            // Behind the last line of the section that is not empty.
            let filled = lines[places.clone()].iter().rposition(|line| !trimmed(line).is_empty());
            lines.insert(places.start + filled.map_or(0, |at| at + 1), line);
        }
        (None, None) => lines.extend([[b"[", section, b"]"].concat(), line]),
    }
}

/// The lines of a file. One that is not there has none.
fn read(file: &str) -> io::Result<Lines> {
    let text = match text_file::read(file.as_ref(), LARGEST) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        read => read?,
    };
    let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&text);
    let lines =
        text.split(|byte| *byte == b'\n').map(|line| line.strip_suffix(b"\r").unwrap_or(line));
    let mut lines: Lines = lines.map(<[u8]>::to_vec).collect();
    if lines.last().is_some_and(Vec::is_empty) {
        lines.pop();
    }
    Ok(lines)
}

/// A name as Windows has it.
fn name_of(file: String) -> String {
    file.replace('\\', "/")
}

/// # Safety
///
/// `text` is null or a text that ends with 0 and does not change while this is used.
unsafe fn bytes_of<'a>(text: *const c_char) -> Option<&'a [u8]> {
    // SAFETY: as the caller promises.
    (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }.to_bytes())
}

/// Copies a text, or a list of texts that each have a 0, with another 0 behind it. Returns the length without this one.
/// What does not fit is cut; a list that is cut has two zeros behind it, which do not count.
///
/// # Safety
///
/// `to` is null or has `size` bytes that this call alone uses.
unsafe fn give(text: &[u8], is_list: bool, to: *mut c_char, size: usize) -> u32 {
    // Each list ends with two zeros, also one without texts.
    let ends = if is_list && (text.is_empty() || text.len() >= size) { 2 } else { 1 };
    if to.is_null() || size < ends {
        return 0;
    }
    let length = text.len().min(size - ends);
    // SAFETY: `length + ends` bytes lie within those that the caller promises.
    unsafe {
        to.cast::<u8>().copy_from_nonoverlapping(text.as_ptr(), length);
        to.add(length).write_bytes(0, ends);
    }
    length as u32
}

/// Each with a 0 behind it.
fn list<'a>(names: impl Iterator<Item = &'a [u8]>) -> Vec<u8> {
    names.flat_map(|name| name.iter().copied().chain([0])).collect()
}

/// Reads a setting, or the names of sections or keys.
///
/// # Safety
///
/// The texts are null or end with 0 and do not change during the call; `to` is null or has `size` bytes that this call
/// alone uses.
#[no_mangle]
pub unsafe extern "C" fn GetPrivateProfileStringA(
    section: *const c_char,
    key: *const c_char,
    otherwise: *const c_char,
    to: *mut c_char,
    size: u32,
    file: *const c_char,
) -> u32 {
    caught(0, || {
        let size = size as usize;
        // SAFETY: as the caller promises.
        let (section, key, otherwise, file) =
            unsafe { (bytes_of(section), bytes_of(key), bytes_of(otherwise), text_of(file)) };
        let lines = file.and_then(|file| read(&name_of(file)).ok()).unwrap_or_default();
        let (text, is_list) = match (section, key) {
            (None, _) => (list(lines.iter().filter_map(|line| section_in(line))), true),
            (Some(section), None) => (list(settings(&lines, section).map(|(key, _)| key)), true),
            (Some(section), Some(key)) => {
                let found = value(&lines, section, key);
                (found.or(otherwise).unwrap_or_default().to_vec(), false)
            }
        };
        // SAFETY: as the caller promises.
        unsafe { give(&text, is_list, to, size) }
    })
}

/// The number at the beginning of a text: decimal, or with 0x before it.
fn number(text: &[u8]) -> u32 {
    let text = String::from_utf8_lossy(text).trim().to_ascii_lowercase();
    let (text, is_negative) = text.strip_prefix('-').map_or((&*text, false), |rest| (rest, true));
    let (digits, base) = text.strip_prefix("0x").map_or((text, 10), |rest| (rest, 16));
    let digits = digits.chars().map_while(|digit| digit.to_digit(base));
    let value = digits.fold(0_u32, |value, digit| value.wrapping_mul(base).wrapping_add(digit));
    if is_negative {
        value.wrapping_neg()
    } else {
        value
    }
}

/// Reads a number.
///
/// # Safety
///
/// The texts are null or end with 0 and do not change during the call.
#[no_mangle]
pub unsafe extern "C" fn GetPrivateProfileIntA(
    section: *const c_char,
    key: *const c_char,
    otherwise: c_int,
    file: *const c_char,
) -> u32 {
    caught(otherwise as u32, || {
        // SAFETY: as the caller promises.
        let given = unsafe { (bytes_of(section), bytes_of(key), text_of(file)) };
        let (Some(section), Some(key), Some(file)) = given else { return otherwise as u32 };
        let lines = read(&name_of(file)).unwrap_or_default();
        value(&lines, section, key).map_or(otherwise as u32, number)
    })
}

/// Writes a setting, or removes a key or a section. The rest of the file stays as it is.
///
/// # Safety
///
/// The texts are null or end with 0 and do not change during the call.
#[no_mangle]
pub unsafe extern "C" fn WritePrivateProfileStringA(
    section: *const c_char,
    key: *const c_char,
    value: *const c_char,
    file: *const c_char,
) -> i32 {
    caught(FALSE, || {
        // SAFETY: as the caller promises.
        let (given, key, value) =
            unsafe { ((bytes_of(section), text_of(file)), bytes_of(key), bytes_of(value)) };
        let (Some(section), Some(file)) = given else { return FALSE };
        let file = name_of(file);
        let Ok(mut lines) = read(&file) else { return FALSE };
        change(&mut lines, section, key, value);
        let text: Vec<u8> =
            lines.into_iter().flat_map(|line| [line, b"\r\n".to_vec()].concat()).collect();
        fs::write(&file, text).is_ok().into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Lines {
        text.lines().map(|line| line.as_bytes().to_vec()).collect()
    }

    #[test]
    fn values_are_found_whatever_their_case_and_quotes() {
        let lines = lines("; none=0\n[Motor]\nDuty = 300\nName=\"M 1\"\n[ other ]\nduty=5\n");
        assert_eq!(value(&lines, b"motor", b"DUTY"), Some(&b"300"[..]));
        assert_eq!(value(&lines, b"Motor", b"name"), Some(&b"M 1"[..]));
        assert_eq!(value(&lines, b"Other", b"duty"), Some(&b"5"[..]));
        assert_eq!(value(&lines, b"Motor", b"none"), None);
        assert_eq!([&b"12x"[..], b"0x1F", b"-2", b""].map(number), [12, 31, u32::MAX - 1, 0]);
    }

    #[test]
    fn a_change_leaves_the_other_lines() {
        let mut all = lines("[a]\nx=1\n; why\n\n[b]\ny=2");
        change(&mut all, b"A", Some(b"X"), Some(b"7"));
        change(&mut all, b"a", Some(b"z"), Some(b"8"));
        change(&mut all, b"c", Some(b"w"), Some(b"9"));
        assert_eq!(all, lines("[a]\nX=7\n; why\nz=8\n\n[b]\ny=2\n[c]\nw=9"));
        change(&mut all, b"a", Some(b"x"), None);
        change(&mut all, b"b", None, None);
        change(&mut all, b"d", None, None);
        assert_eq!(all, lines("[a]\n; why\nz=8\n\n[c]\nw=9"));
    }
}
