//! `txt bridge` with simulated TXTs: with a real Mosquitto where it is installed, and without.

#![cfg(unix)] // The tests send signals.

mod alone;
mod commands;
mod faults;
mod support;
mod values;
