//! The C libraries, and why some of their names have no counterpart in Rust.

/// Names without a counterpart, and what to do instead or why there is nothing to do.
pub(crate) type Without = &'static [(&'static [&'static str], &'static str)];

/// A library whose calls are in `calls.rs`, in the function with this heading.
pub(crate) struct Calls {
    pub(crate) heading: &'static str,
    /// Whether the Rust item of each call has the call's name as an alias.
    pub(crate) has_aliases: bool,
    pub(crate) without: Without,
}

/// A header's names. Each has a counterpart, or a reason why there is none.
pub(crate) struct Library {
    pub(crate) heading: &'static str,
    pub(crate) names: &'static [&'static str],
    pub(crate) without: Without,
}

const NO_DISPLAY: &str = "an online TXT shows nothing from the program";
const NO_BLUETOOTH: &str = "an online TXT has no Bluetooth messages";
const NO_FILES: &str = "the online protocol has no files, programs or updates";

pub(crate) const CALLS: &[Calls] = &[
    Calls {
        heading: "The TXT's kit: `ftIF2013TransferAreaComHandler`",
        has_aliases: true,
        without: &[
            (
                &["~ftIF2013TransferAreaComHandler"],
                "dropping the handler does what `end_transfer` does",
            ),
            (
                &["OpenSocket", "SendCommand", "SendCommandEx"],
                "`TxtClient::connect` and the other methods of `TxtClient`",
            ),
        ],
    },
    Calls {
        heading: "FtTxtLib: `ftIF2013TransferAreaComHandlerEx2`",
        has_aliases: true,
        without: &[
            (&["PrintIR"], "print `area.txt_inputs.ir_input`"),
            (&["StopI2C"], "the connection ends with the transfer"),
        ],
    },
    Calls {
        heading: "The ROBO TX's library: `ftMscLib`",
        has_aliases: true,
        without: &[
            (
                &["ftxInitLib", "ftxCloseLib", "ftxIsLibInit", "ftxIsHandleValid", "GetSessionId"],
                "there is nothing to initialise, and no handle that may be invalid",
            ),
            (
                &["ftxGetLibVersion", "ftxGetLibVersionStr"],
                "the version is the one in your `Cargo.lock`",
            ),
            (&["ftxCloseAllDevices"], "end each handler's transfer"),
            (
                &["GetAvailableComPorts", "EnumComPorts"],
                "a TXT has a network address and no COM port",
            ),
            (
                &["GetTransferAreaStatusAddr", "GetComStatus", "GetRoboTxMasterState"],
                "`handler.areas().is_running()` and `handler.areas().error()`",
            ),
            (&["ResetTrapStatistic"], "each transfer counts from 0"),
            (
                &[
                    "ftxGetSerialNrStrg",
                    "ftxGetFirmwareStrg",
                    "ftxGetManufacturerStrg",
                    "ftxGetShortNameStrg",
                    "ftxGetLongNameStrg",
                    "GetRoboTxInfo",
                    "GetRoboTxBtAddr",
                    "GetRoboTxHwStr",
                    "GetRoboTxMemLayout",
                    "GetRoboTxSerialStr",
                    "GetRoboTxDllStr",
                    "SetRoboTxDevName",
                ],
                "an online TXT sends only its name and its firmware's version; its name can't be set",
            ),
            (&["SetRoboTxMessage", "GetInDisplayButtonValue"], NO_DISPLAY),
            (
                &[
                    "FtRemoteCmd",
                    "FtFileUpload",
                    "FtRamFileUpload",
                    "RTxCleanDisk",
                    "FtProgramRun",
                    "FtProgramStop",
                    "RoboTxFwUpdate",
                ],
                NO_FILES,
            ),
            (
                &[
                    "GetRoboTxBtStatus",
                    "StartScanBtDevice",
                    "CancelScanBtDevice",
                    "ConnectBtAddress",
                    "DisconnectBt",
                    "SendBtMessage",
                    "BtListenConOn",
                    "BtListenConOff",
                    "BtReadMsgOn",
                    "BtReadMsgOff",
                    "StatusBtConnection",
                ],
                NO_BLUETOOTH,
            ),
        ],
    },
    Calls { heading: "Programs on the TXT: `KeLibTxtDl`", has_aliases: true, without: &[] },
    Calls {
        heading: "Programs on the ROBO TX: `ROBO_TX_PRG`",
        has_aliases: true,
        without: &[
            (&["PrgInit"], "the code before `begin_transfer`"),
            (&["IsRunAllowed"], "there is no firmware to go back to"),
            (&["GetSystemTime"], "`std::time::Instant`, or `area.timer`"),
            (&["DisplayMsg", "IsDisplayBeingRefreshed"], NO_DISPLAY),
            (
                &[
                    "BtConnect",
                    "BtDisconnect",
                    "BtSend",
                    "BtStartReceive",
                    "BtStopReceive",
                    "BtStartListen",
                    "BtStopListen",
                    "BtAddrToStr",
                ],
                NO_BLUETOOTH,
            ),
            (
                &[
                    "sprintf", "memmove", "strcat", "strncat", "strchr", "strrchr", "strcmp",
                    "strncmp", "stricmp", "strnicmp", "strcpy", "strncpy", "strlen", "strstr",
                    "strtok", "strupr", "strlwr", "atoi",
                ],
                "Rust has its own",
            ),
        ],
    },
    Calls {
        heading: "Around the libraries",
        has_aliases: false,
        without: &[
            (&["printf"], "`println!`, or `print!` without the end of the line"),
            (&["WSAStartup", "WSACleanup"], "there is nothing to initialise"),
        ],
    },
];
