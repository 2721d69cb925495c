//! Calls the exported functions of ftMscLib as a C program does, against simulated TXTs.
#![allow(non_snake_case, reason = "the functions have their own names")]
#![allow(missing_docs, reason = "tests")]

mod abuse;
mod api;
mod bench;
mod callbacks;
mod extended;
mod handles;
mod i2c;
mod inputs;
mod loaded;
mod outputs;
mod texts;
