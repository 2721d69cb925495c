//! The headers in `include`, compiled as programs compile them: with every compiler that is here, from C89 on
//! and as C++. A compiler or a standard that is missing is reported, not failed.

mod alone;
pub(crate) mod compilers;
mod exports;
mod layout;
mod programs;
mod running;
mod stand_ins;
mod tables;
mod together;
mod values;
