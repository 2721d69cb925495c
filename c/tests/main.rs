//! The tests in one program, so that they are linked once, and those that wait for machines wait beside each other.
//! The names decide which begin first: the stations of `examples` take longest.

mod examples;
mod headers;
mod kits;
mod tables;
mod tx_run;
