//! The recorded packets: from the folder named by `TRANSFER_AREA_VECTORS`, else `tests/vectors`.

use std::path::PathBuf;

use serde_json::Value;

/// The recorded file of this name.
pub(crate) fn load(name: &str) -> Value {
    let path = folder().join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path:?}: {error}"))
}

/// The names of all recorded sessions in the folder.
pub(crate) fn session_names() -> Vec<String> {
    let folder = folder();
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{folder:?}: {error}"));
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.starts_with("session_") && name.ends_with(".json"))
        .collect();
    names.sort();
    names
}

fn folder() -> PathBuf {
    std::env::var_os("TRANSFER_AREA_VECTORS").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/vectors")),
        PathBuf::from,
    )
}

/// The bytes of a hexadecimal string.
pub(crate) fn bytes(hex: &Value) -> Vec<u8> {
    let hex = hex.as_str().expect("a hexadecimal string");
    assert!(hex.len() % 2 == 0, "{hex:?} has a half byte");
    (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect()
}

/// An array of integers, with the type and length that the caller needs.
pub(crate) fn numbers<T: TryFrom<i64>, const N: usize>(array: &Value) -> [T; N] {
    let values = array.as_array().expect("an array");
    assert_eq!(values.len(), N, "{array}");
    std::array::from_fn(|i| number(&values[i]))
}

/// One integer.
pub(crate) fn number<T: TryFrom<i64>>(value: &Value) -> T {
    let number = value.as_i64().unwrap_or_else(|| panic!("{value} is not an integer"));
    T::try_from(number).unwrap_or_else(|_| panic!("{number} is out of range"))
}
