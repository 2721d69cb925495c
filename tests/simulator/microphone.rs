//! Responses with a number of values that the firmware's version does not promise.

use ft_transfer_area::wire::{CmprHeader, Expander};
use ft_transfer_area::{FirmwareVersion, FishX1Transfer, TransferAreaComHandler};

use crate::unpaced;
use crate::wire_client::Client;

#[test]
fn a_firmware_sends_another_number_of_words_when_asked_to() {
    for (patch, microphone, count) in [(3, true, 52), (4, false, 50)] {
        let firmware = FirmwareVersion::new(4, 2, patch);
        let txt = unpaced().firmware(firmware).microphone(microphone).start().unwrap();
        let mut client = Client::online(&txt);
        client.send_compressed(&[[0; 27]], 0);
        let header = CmprHeader::parse_response(&client.receive(CmprHeader::LEN)).unwrap();
        let data = client.receive(header.extra_size as usize);
        // The checksum decides.
        Expander::new().expand(&data, count, header.crc).unwrap();
        Expander::new().expand(&data, 102 - count, header.crc).unwrap_err();
    }
}

#[test]
fn this_crates_client_reads_both() {
    for (patch, microphone, loudness) in [(3, true, 7), (4, false, 0)] {
        let firmware = FirmwareVersion::new(4, 2, patch);
        let txt = unpaced().firmware(firmware).microphone(microphone).start().unwrap();
        txt.with_machine(|machine| machine.controllers[0].mic_lin = 7);
        let handler = TransferAreaComHandler::builder(txt.address()).build().unwrap();
        handler.begin_transfer().unwrap();
        let master: FishX1Transfer = handler.areas().wait_cycle().unwrap()[0];
        assert_eq!(master.txt_inputs2.mic_lin, loudness);
        handler.end_transfer().unwrap();
    }
}
