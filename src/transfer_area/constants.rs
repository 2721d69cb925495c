//! The kit's constants.

/// Index of the master's transfer area.
#[doc(alias = "TA_LOCAL")]
pub const LOCAL_IO: usize = 0;
/// Index of the first extension's transfer area.
#[doc(alias = "TA_EXT_1")]
pub const REMOTE_IO_1: usize = 1;
/// Index of the second extension's transfer area.
#[doc(alias = "TA_EXT_2")]
pub const REMOTE_IO_2: usize = 2;
/// Index of the third extension's transfer area.
#[doc(alias = "TA_EXT_3")]
pub const REMOTE_IO_3: usize = 3;
/// Index of the fourth extension's transfer area.
#[doc(alias = "TA_EXT_4")]
pub const REMOTE_IO_4: usize = 4;
/// Index of the fifth extension's transfer area.
#[doc(alias = "TA_EXT_5")]
pub const REMOTE_IO_5: usize = 5;
/// Index of the sixth extension's transfer area.
#[doc(alias = "TA_EXT_6")]
pub const REMOTE_IO_6: usize = 6;
/// Index of the seventh extension's transfer area.
#[doc(alias = "TA_EXT_7")]
pub const REMOTE_IO_7: usize = 7;
/// Index of the eighth extension's transfer area.
#[doc(alias = "TA_EXT_8")]
pub const REMOTE_IO_8: usize = 8;
/// The maximum number of transfer areas: the master and its extensions.
#[doc(alias = "IF08_MAX")]
#[doc(alias = "SHM_IF_CNT")]
#[doc(alias = "TA_COUNT")]
#[doc(alias = "IF_TXT_MAX")]
pub const MAX_AREAS: usize = 9;
/// The maximum number of extensions.
#[doc(alias = "SLAVE_CNT_MAX")]
#[doc(alias = "N_EXT")]
pub const MAX_EXTENSIONS: usize = MAX_AREAS - 1;

/// Number of universal inputs, I1 to I8.
#[doc(alias = "N_UNI")]
pub const IZ_UNI_INPUT: usize = 8;
/// Number of counter inputs, C1 to C4.
#[doc(alias = "N_CNT")]
pub const IZ_COUNTER: usize = 4;
/// Number of motor outputs, M1 to M4.
#[doc(alias = "N_MOTOR")]
pub const IZ_MOTOR: usize = 4;
/// Number of single outputs, O1 to O8.
#[doc(alias = "N_PWM_CHAN")]
pub const IZ_PWM_CHAN: usize = 8;
/// Number of infrared remotes, by the settings of their DIP switches.
#[doc(alias = "NUM_OF_IR_RECEIVER")]
pub const IZ_IR_RECEIVER: usize = 4;

/// The lowest duty: off.
pub const DUTY_MIN: i16 = 0;
/// The highest duty: full speed or brightness.
pub const DUTY_MAX: i16 = 512;

/// Smallest value of an input in the 5 kΩ range, in Ω.
pub const R_MIN: i16 = 10;
/// Largest value of an input in the 5 kΩ range, in Ω.
pub const R_MAX: i16 = 4999;
/// An input in the 5 kΩ range is over range: nothing connected, or more than 5 kΩ.
pub const R_OVR: i16 = 5000;
/// Smallest value of an input in the 15 kΩ range, in Ω.
pub const R2_MIN: i16 = 30;
/// Largest value of an input in the 15 kΩ range, in Ω.
pub const R2_MAX: i16 = 14999;
/// An input in the 15 kΩ range is over range: nothing connected, or more than 15 kΩ.
pub const R2_OVR: i16 = 15000;
/// Largest value of a voltage input, in mV.
pub const U_MAX: i16 = 9999;
/// A voltage input is over range: 10 V or more.
pub const U_OVR: i16 = 10000;
/// Smallest value of the ultrasonic sensor, in cm.
pub const ULTRASONIC_MIN: i16 = 2;
/// Largest value of the ultrasonic sensor, in cm.
pub const ULTRASONIC_MAX: i16 = 1023;
/// The ultrasonic sensor is over range: no echo came back.
pub const ULTRASONIC_OVR: i16 = 1024;
/// No ultrasonic sensor is connected.
pub const NO_ULTRASONIC: i16 = 4096;

/// Index in [`TxtInputs::ir_input`](super::TxtInputs::ir_input): any remote, with any DIP switches.
///
/// This is the index in the kit's header, on the controller and in other clients. The kit's document
/// says that any remote has index 4, which is a mistake.
pub const IR_RECEIVER_IDX_ALL_DATA: usize = 0;
/// Index in [`TxtInputs::ir_input`](super::TxtInputs::ir_input): the remote with DIP switches off, off.
pub const IR_RECEIVER_IDX_OFF_OFF: usize = 1;
/// Index in [`TxtInputs::ir_input`](super::TxtInputs::ir_input): the remote with DIP switches on, off.
pub const IR_RECEIVER_IDX_ON_OFF: usize = 2;
/// Index in [`TxtInputs::ir_input`](super::TxtInputs::ir_input): the remote with DIP switches off, on.
pub const IR_RECEIVER_IDX_OFF_ON: usize = 3;
/// Index in [`TxtInputs::ir_input`](super::TxtInputs::ir_input): the remote with DIP switches on, on.
pub const IR_RECEIVER_IDX_ON_ON: usize = 4;

/// Length of the host name in [`Info`](super::Info), without the closing NUL.
#[doc(alias = "DEV_NAME_LEN_MAX")]
pub const HOSTNAME_LEN: usize = 16;
/// Length of the Bluetooth address in [`Info`](super::Info), without the closing NUL.
#[doc(alias = "BT_ADDR_STR_LEN")]
pub const BLUETOOTH_ADR_LEN: usize = 17;
/// Length of a message for the ROBO TX's display, without the closing NUL.
pub const DISPL_MSG_LEN_MAX: usize = 98;
/// Number of the ROBO TX's Bluetooth channels.
pub const BT_CNT_MAX: usize = 8;
