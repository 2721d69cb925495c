//! Everything of ftMscLib, in a library with the file name `ftMscLibEx`.
#![allow(non_snake_case, reason = "the library has the name of the original")]

// Linking it exports its functions.
extern crate ftMscLib as _;
