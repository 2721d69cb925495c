//! What callbacks get: the same structs in the headers of both kinds of programs.

/// `BT_SWITCHED_OFF`.
const BT_SWITCHED_OFF: u16 = 3;

/// The longest Bluetooth message.
pub(crate) const BT_MESSAGE_MAX: usize = 16;

/// `BT_CB`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct BtResult {
    pub(crate) channel: u16,
    pub(crate) status: u16,
}

/// `BT_RECV_CB`.
#[repr(C)]
pub(crate) struct BtReceived {
    result: BtResult,
    length: u16,
    message: [u8; BT_MESSAGE_MAX],
}

/// `I2C_CB`.
#[repr(C)]
pub(crate) struct I2cResult {
    pub(crate) value: u16,
    pub(crate) status: u16,
}

const _: () = assert!(size_of::<BtReceived>() == 22);

impl BtResult {
    /// Bluetooth is off.
    pub(crate) fn off(channel: u16) -> Self {
        Self { channel, status: BT_SWITCHED_OFF }
    }
}

impl BtReceived {
    /// Bluetooth is off.
    pub(crate) fn off(channel: u16) -> Self {
        Self { result: BtResult::off(channel), length: 0, message: [0; BT_MESSAGE_MAX] }
    }
}
