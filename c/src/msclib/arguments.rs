//! What C passes. The only place that uses a program's pointers.

use std::ffi::{c_char, c_void};

use crate::errors::FTLIB_ERR_INVALID_PARAM;
use crate::ffi::{copy_text, text_of};

/// `HANDLE`: as wide as a pointer, and none.
pub(super) type Handle = *mut c_void;

/// `bool`. Headers of that time make it one byte in C++ and in C# (`UnmanagedType.I1`), and an enumeration of
/// the width of an `int` in C. As an argument its lowest byte lies at the same place in all of them, so only
/// this byte is looked at.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub(super) struct Bool(u8);

impl Bool {
    pub(super) fn get(self) -> bool {
        self.0 != 0
    }
}

/// A text from the program: null, or a text that ends with 0 and does not change during the call.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub(super) struct TextIn(*const c_char);

impl TextIn {
    /// The text; what is not UTF-8 in it is replaced.
    pub(super) fn get(self) -> Result<String, u32> {
        // SAFETY: only C makes one, from what the header asks for.
        unsafe { text_of(self.0) }.ok_or(FTLIB_ERR_INVALID_PARAM)
    }

    pub(super) fn is_null(self) -> bool {
        self.0.is_null()
    }
}

/// Where the program wants a text: null, or as many bytes as the size that is passed with it.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub(super) struct TextOut(*mut c_char);

impl TextOut {
    /// Writes a text, cut to what fits. Returns its length there.
    pub(super) fn put(self, text: &str, size: u32) -> u32 {
        // SAFETY: only C makes one, from what the header asks for.
        unsafe { copy_text(text, self.0, size as usize) as u32 }
    }

    /// Whether a text has room there.
    pub(super) fn has_room(self, size: u32) -> bool {
        !self.0.is_null() && size > 0
    }
}

/// Where the program wants a value: null, or the place for it.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub(super) struct Out<T>(*mut T);

impl<T: Copy> Out<T> {
    /// Writes the value.
    pub(super) fn put(self, value: T) -> Result<(), u32> {
        self.check()?;
        // SAFETY: not null, and only C makes one, from what the header asks for.
        unsafe { self.0.write_unaligned(value) };
        Ok(())
    }

    /// An error when there is no place. Before a call changes anything.
    pub(super) fn check(self) -> Result<(), u32> {
        if self.0.is_null() {
            return Err(FTLIB_ERR_INVALID_PARAM);
        }
        Ok(())
    }
}

/// Bytes of the program's that only have to be there.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub(super) struct Bytes(*const c_void);

impl Bytes {
    pub(super) fn check(self) -> Result<(), u32> {
        if self.0.is_null() {
            return Err(FTLIB_ERR_INVALID_PARAM);
        }
        Ok(())
    }
}
