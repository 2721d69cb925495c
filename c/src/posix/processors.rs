//! How many processors there are. Programs share their work between as many threads.

use std::cell::Cell;
use std::ffi::c_void;
use std::mem::offset_of;
use std::ptr;
use std::thread;

use crate::ffi::caught;

const TRUE: i32 = 1;
const FALSE: i32 = 0;

const ERROR_INVALID_PARAMETER: u32 = 87;
const ERROR_INSUFFICIENT_BUFFER: u32 = 122;

/// `RelationProcessorCore`, `RelationGroup` and `RelationAll`.
const CORES: i32 = 0;
const GROUPS: i32 = 4;
const ALL: i32 = 0xFFFF;

/// How many processors a group has at most: the bits of a mask.
const GROUP_SIZE: usize = usize::BITS as usize;

thread_local! {
    static LAST_ERROR: Cell<u32> = const { Cell::new(0) };
}

/// `SYSTEM_INFO`.
#[repr(C)]
pub struct SystemInfo {
    architecture: u16,
    reserved: u16,
    page_size: u32,
    addresses: [*mut c_void; 2],
    processor_mask: usize,
    processors: u32,
    processor_type: u32,
    granularity: u32,
    level: u16,
    revision: u16,
}

/// `GROUP_AFFINITY`.
#[repr(C)]
#[derive(Clone, Copy)]
struct Affinity {
    mask: usize,
    group: u16,
    reserved: [u16; 3],
}

/// A record about one core, as `SYSTEM_LOGICAL_PROCESSOR_INFORMATION_EX` has it.
#[repr(C)]
struct CoreRecord {
    kind: i32,
    size: u32,
    flags: [u8; 22],
    group_count: u16,
    affinity: Affinity,
}

/// A record about one group.
#[repr(C)]
struct GroupRecord {
    kind: i32,
    size: u32,
    counts: [u16; 2],
    reserved: [u8; 20],
    processors: [u8; 40],
    mask: usize,
}

// As the structure in C: the union begins behind kind and size.
const _: () = assert!(offset_of!(CoreRecord, flags) == 8 && offset_of!(GroupRecord, counts) == 8);

/// Those of the first group; programs of that time know no other one.
fn processors() -> usize {
    thread::available_parallelism().map_or(1, usize::from).min(GROUP_SIZE)
}

/// The mask of so many processors.
fn mask(count: usize) -> usize {
    usize::MAX >> (GROUP_SIZE - count)
}

/// Tells what is known of the processors and the memory.
///
/// # Safety
///
/// `info` is null or points to a structure that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn GetSystemInfo(info: *mut SystemInfo) {
    /// `PROCESSOR_ARCHITECTURE_UNKNOWN`.
    const UNKNOWN: u16 = 0xFFFF;
    caught((), || {
        if info.is_null() {
            return;
        }
        // SAFETY: a question to the system.
        let page_size = u32::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) });
        let known = SystemInfo {
            architecture: UNKNOWN,
            reserved: 0,
            page_size: page_size.unwrap_or(4096),
            addresses: [ptr::null_mut(), ptr::without_provenance_mut(usize::MAX)],
            processor_mask: mask(processors()),
            processors: processors() as u32,
            processor_type: 0,
            granularity: 0x1_0000,
            level: 0,
            revision: 0,
        };
        // SAFETY: not null, so a structure, as the caller promises.
        unsafe { info.write(known) };
    });
}

/// The bytes of the records of a kind.
fn records(kind: i32) -> Option<Vec<u8>> {
    if !(CORES..=GROUPS).contains(&kind) && kind != ALL {
        return None;
    }
    let count = processors();
    let mut bytes = Vec::new();
    if matches!(kind, CORES | ALL) {
        for index in 0..count {
            let affinity = Affinity { mask: 1 << index, group: 0, reserved: [0; 3] };
            let size = size_of::<CoreRecord>() as u32;
            add(
                &mut bytes,
                CoreRecord { kind: CORES, size, flags: [0; 22], group_count: 1, affinity },
            );
        }
    }
    if matches!(kind, GROUPS | ALL) {
        let mut processors = [0; 40];
        processors[..2].fill(count as u8);
        let size = size_of::<GroupRecord>() as u32;
        let (counts, mask) = ([1; 2], mask(count));
        add(
            &mut bytes,
            GroupRecord { kind: GROUPS, size, counts, reserved: [0; 20], processors, mask },
        );
    }
    Some(bytes)
}

/// Adds a record, none of which has gaps between its fields.
fn add<T>(bytes: &mut Vec<u8>, record: T) {
    let at: *const T = &record;
    // SAFETY: the bytes of a record that is there.
    bytes.extend_from_slice(unsafe { std::slice::from_raw_parts(at.cast(), size_of::<T>()) });
}

/// Writes a record for each core or group. With a buffer that is too short it fails, and returns the length.
///
/// # Safety
///
/// `length` is null or points to a number; `buffer` is null or has so many bytes. Both are used by this call
/// alone.
#[no_mangle]
pub unsafe extern "C" fn GetLogicalProcessorInformationEx(
    kind: i32,
    buffer: *mut u8,
    length: *mut u32,
) -> i32 {
    caught(FALSE, || {
        let (Some(bytes), false) = (records(kind), length.is_null()) else {
            return fails(ERROR_INVALID_PARAMETER);
        };
        // SAFETY: not null, so a number, as the caller promises.
        let given = unsafe { length.replace(bytes.len() as u32) } as usize;
        if buffer.is_null() || given < bytes.len() {
            return fails(ERROR_INSUFFICIENT_BUFFER);
        }
        // SAFETY: it is long enough.
        unsafe { buffer.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        TRUE
    })
}

fn fails(error: u32) -> i32 {
    LAST_ERROR.set(error);
    FALSE
}

/// Sets what [`GetLastError`] returns in this thread.
#[no_mangle]
pub extern "C" fn SetLastError(error: u32) {
    let _ = LAST_ERROR.try_with(|last| last.set(error));
}

/// Why the last of these calls has failed in this thread.
#[no_mangle]
pub extern "C" fn GetLastError() -> u32 {
    LAST_ERROR.try_with(Cell::get).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_record_for_each_processor_and_one_for_their_group() {
        let (cores, groups) = (records(CORES).unwrap().len(), records(GROUPS).unwrap().len());
        assert_eq!(cores, processors() * size_of::<CoreRecord>());
        assert_eq!(records(ALL).unwrap().len(), cores + groups);
        assert_eq!(records(1), Some(Vec::new()));
        assert_eq!((records(-1), records(5)), (None, None));
        assert_eq!(mask(1), 1);
        assert_eq!(mask(GROUP_SIZE), usize::MAX);
    }
}
