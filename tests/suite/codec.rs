//! The compression compared with recorded cases, in both directions.

use ft_transfer_area::wire::{crc_of_words, Compressor, Expander};

use crate::vectors;

#[test]
fn every_recorded_case_compresses_and_expands_to_the_recorded_bytes() {
    let cases = vectors::load("codec.json");
    let cases = cases.as_array().unwrap();
    assert!(!cases.is_empty());
    for case in cases {
        let name = case["name"].as_str().unwrap();
        let mut compressor = Compressor::new();
        let mut expander = Expander::new();
        for frame in case["frames"].as_array().unwrap() {
            let words = frame["words"].as_array().unwrap();
            let words: Vec<u16> = words.iter().map(vectors::number).collect();
            let data = vectors::bytes(&frame["data"]);
            let crc = u32::from_str_radix(frame["crc"].as_str().unwrap(), 16).unwrap();

            let mut compressed = Vec::new();
            assert_eq!(compressor.compress(&words, &mut compressed), crc, "{name}: checksum");
            assert_eq!(compressed, data, "{name}: compressed");
            assert_eq!(crc_of_words(&words), crc, "{name}: checksum alone");
            assert_eq!(expander.expand(&data, words.len(), crc).unwrap(), words, "{name}: words");
        }
    }
}
