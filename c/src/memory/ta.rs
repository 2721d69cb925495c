//! `TA`, the area as programs for the ROBO TX name it.

use std::ffi::{c_char, c_void};

use ft_transfer_area::transfer_area::{
    BtStatus, Change, Config, DisplayMessage, Info, InputValues, OutputValues, Status, Timer,
    TxtInputs, TxtInputs2, TxtOutputs,
};

/// `TA`. With 32-bit pointers it has 1024 bytes, as on the TX; with wider ones it is longer, because three
/// of its parts hold pointers. Fields that only a TXT has lie where `TA` has reserves.
#[repr(C)]
pub(crate) struct Ta {
    pub(crate) info: Info,
    pub(crate) state: TaState,
    pub(crate) config: Config,
    pub(crate) input: InputValues,
    pub(crate) output: OutputValues,
    pub(crate) display: TaDisplay,
    pub(crate) status: Status,
    pub(crate) change: Change,
    pub(crate) timer: Timer,
    pub(crate) reserved_1: [u8; 28],
    pub(crate) hook_table: HookTable,
    pub(crate) txt_inputs: TxtInputs,
    pub(crate) txt_outputs: TxtOutputs,
    pub(crate) txt_inputs2: TxtInputs2,
    pub(crate) reserved_2: [u8; 154],
}

/// `TA_STATE`.
#[repr(C)]
pub(crate) struct TaState {
    pub(crate) pgm_initialized: u8,
    pub(crate) reserved_1: [u8; 7],
    pub(crate) dev_mode: u8,
    pub(crate) id: u8,
    pub(crate) info_id: u8,
    pub(crate) config_id: u8,
    pub(crate) ext_dev_connect_state: [u8; 8],
    pub(crate) btstatus: [BtStatus; 8],
    pub(crate) reserved_2: [u8; 8],
    pub(crate) local_pgm: PgmInfo,
}

/// `PGM_INFO`.
#[repr(C)]
pub(crate) struct PgmInfo {
    pub(crate) name: *mut c_char,
    pub(crate) state: u8,
    pub(crate) reserved: [u8; 3],
}

/// `TA_DISPLAY`.
#[repr(C)]
pub(crate) struct TaDisplay {
    pub(crate) display_msg: DisplayMessage,
    pub(crate) display_frame: DisplayFrame,
}

/// `DISPLAY_FRAME`.
#[repr(C)]
pub(crate) struct DisplayFrame {
    pub(crate) frame: *mut u8,
    pub(crate) id: u16,
    pub(crate) is_pgm_master_of_display: u16,
}

/// `TA_HOOK_TABLE`: 36 functions, in the order of the table.
#[repr(C)]
pub(crate) struct HookTable(pub(crate) [*const c_void; 36]);

#[cfg(target_pointer_width = "32")]
const _: () = assert!(size_of::<Ta>() == 1024);
