//! Names, versions and the state of the interface.

use super::{BLUETOOTH_ADR_LEN, BT_CNT_MAX, HOSTNAME_LEN, MAX_EXTENSIONS};

/// Versions of the controller's parts, one byte per number, 16 bytes. Not sent online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FTX1_SHMVER")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Versions {
    /// The hardware.
    pub hardware: u32,
    /// The firmware.
    pub firmware: u32,
    /// The shared memory's layout.
    #[doc(alias = "ta")]
    pub shm_if: u32,
    /// The interface protocol.
    pub fish_x1: u32,
}

/// Names and versions of the controller, 64 bytes. Not sent online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FTX1_SHMIFINFO")]
#[doc(alias = "TA_INFO")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Info {
    /// Host name, ended by NUL.
    #[doc(alias = "device_name")]
    pub hostname: [u8; HOSTNAME_LEN + 1],
    /// Bluetooth address, ended by NUL.
    #[doc(alias = "bt_addr")]
    pub btaddr: [u8; BLUETOOTH_ADR_LEN + 1],
    /// Unused.
    pub dummy: u8,
    /// An address in the controller's memory.
    #[doc(alias = "SharedMemoryStart")]
    #[doc(alias = "ta_array_start_addr")]
    pub shared_memory_start: u32,
    /// An address in the controller's memory.
    #[doc(alias = "AppAreaStart")]
    #[doc(alias = "pgm_area_start_addr")]
    pub app_area_start: u32,
    /// Size of the controller's program memory.
    #[doc(alias = "AppAreaSize")]
    #[doc(alias = "pgm_area_size")]
    pub app_area_size: u32,
    /// Versions of the controller's parts.
    pub version: Versions,
}

/// State of one Bluetooth channel of the ROBO TX, 8 bytes. Not sent online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "BT_STATUS")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BtStatus {
    /// State of the connection.
    pub conn_state: u16,
    /// 1 while the channel waits for a connection.
    pub is_listen: u16,
    /// 1 while the channel receives messages.
    pub is_receive: u16,
    /// Quality of the link, 0..=31.
    pub link_quality: u16,
}

/// A program on the ROBO TX, 8 bytes. Not sent online.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "PGM_INFO")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ProgramInfo {
    /// Address of its name in the controller's memory.
    pub name: u32,
    /// Its state.
    pub state: u8,
    /// Unused.
    pub dummy: [u8; 3],
}

/// State of the interface, 100 bytes.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FTX1_STATE")]
#[doc(alias = "TA_STATE")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// Mark of a program on the controller. Not used online.
    #[doc(alias = "pgm_initialized")]
    pub init: u8,
    /// Mark of a program on the controller. Not used online.
    pub config: u8,
    /// Unused.
    pub dummy: [u8; 2],
    /// Mark of a program on the controller. Not used online.
    pub trace: u32,
    /// Mode of the interface. Not used online.
    #[doc(alias = "dev_mode")]
    pub io_mode: u8,
    /// Which controller this area is for: 0 the master, 1 the first extension, and so on. A
    /// handler sets it once, when it makes its areas, and
    /// [`do_transfer`](crate::TxtClient::do_transfer) each time.
    pub id: u8,
    /// Not used online.
    pub info_id: u8,
    /// With a new id, the area's [`Config`](super::Config) is sent to the controller before the next
    /// exchange. [`raise_config_id`](super::FishX1Transfer::raise_config_id) raises it after a
    /// change. The first id is 1.
    #[doc(alias = "m_config_id")]
    pub config_id: u8,
    /// In the master's area: 1 for each extension that took part in the last exchange.
    #[doc(alias = "ext_dev_connect_state")]
    #[doc(alias = "GetRoboTxSlaveAlive")]
    #[doc(alias = "GetRoboTxSlaveState")]
    pub io_slave_alive: [u8; MAX_EXTENSIONS],
    /// Bluetooth channels of the ROBO TX. Not used online.
    pub btstatus: [BtStatus; BT_CNT_MAX],
    /// Program on the ROBO TX. Not used online.
    pub master_pgm: ProgramInfo,
    /// Program on the ROBO TX. Not used online.
    pub local_pgm: ProgramInfo,
}
