//! Parts of the transfer area that an online transfer neither reads nor writes.

use super::{PerMotor, PerOutput, DISPL_MSG_LEN_MAX};

/// A message for the ROBO TX's display, 100 bytes. Not used online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FTX1_MSG")]
#[doc(alias = "DISPLAY_MSG")]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DisplayMessage {
    /// Raised with each message.
    pub id: u8,
    /// The text, ended by NUL.
    pub text: [u8; DISPL_MSG_LEN_MAX + 1],
}

impl Default for DisplayMessage {
    fn default() -> Self {
        Self { id: 0, text: [0; DISPL_MSG_LEN_MAX + 1] }
    }
}

/// A picture for the ROBO TX's display, 8 bytes. Not used online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FTX1_FRAME")]
#[doc(alias = "DISPLAY_FRAME")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DisplayFrame {
    /// Address of the picture in the controller's memory.
    pub frame: u32,
    /// Raised with each picture.
    pub id: u16,
    /// 1 while the program draws the display.
    pub is_pgm_master_of_display: u16,
}

/// The ROBO TX's display, 108 bytes. Not used online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FTX1_DISPLAY")]
#[doc(alias = "TA_DISPLAY")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Display {
    /// The message.
    pub display_msg: DisplayMessage,
    /// The picture.
    pub display_frame: DisplayFrame,
}

/// State of the ROBO TX's serial transfer, 4 bytes. Not used online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "TRANSFER_STATUS")]
#[doc(alias = "TA_STATUS")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// State of the transfer.
    pub status: u8,
    /// State of the inputs and outputs.
    pub iostatus: u8,
    /// Error code of the connection.
    #[doc(alias = "ComErr")]
    pub com_err: u16,
}

/// Change marks of the ROBO TX's serial transfer, 8 bytes. Not used online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "CHANGE_STATE")]
#[doc(alias = "TA_CHANGE")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Change {
    /// Any change.
    #[doc(alias = "UpdInterface")]
    pub upd_interface: u16,
    /// A change of the state.
    #[doc(alias = "ChangeStatus")]
    pub change_status: u8,
    /// A change of a universal input, one bit for each.
    #[doc(alias = "ChangeUni")]
    pub change_uni: u8,
    /// A change of a counter input, one bit for each.
    #[doc(alias = "ChangeCntIn")]
    pub change_cnt_in: u8,
    /// A change of a counter, one bit for each.
    #[doc(alias = "ChangeCounter")]
    pub change_counter: u8,
    /// A change of a timer, one bit for each.
    #[doc(alias = "ChangeTimer")]
    pub change_timer: u8,
    /// Unused.
    pub reserved: u8,
}

/// Motor values as the controller's own control loop sees them, 24 bytes. Not used online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "MOTOR")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MotorValues {
    /// Duty of the outputs.
    pub duty: PerOutput<i16>,
    /// Values for debugging.
    pub debug: PerMotor<i16>,
}

/// Simulated buttons of the ROBO TX, 4 bytes. Not used online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "INPUT_SIM")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputSim {
    /// The two buttons.
    #[doc(alias = "simButtons")]
    pub sim_buttons: [i16; 2],
}
