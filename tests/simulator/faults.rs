//! Every fault that can be ordered, as a client sees it.

use std::io::Read;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CmprHeader, CommandId, ResponseId};
use ft_transfer_area_simulator::Error;
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

/// The response to the first exchange; the one before is to StartOnline.
const FIRST_EXCHANGE: u64 = 1;

/// A simulated TXT with I1 at 1234 whose first exchange is disturbed.
fn disturbed(kind: FaultKind) -> SimulatedTxt {
    let txt = unpaced().fault(Fault::at_response(FIRST_EXCHANGE, kind)).start().unwrap();
    txt.with_machine(|machine| machine.controllers[0].uni[0] = 1234);
    txt
}

/// A client that has begun an exchange.
fn begin_exchange(txt: &SimulatedTxt) -> Client {
    let mut client = Client::online(txt);
    client.send_compressed(&[[0; 27]], 0);
    client
}

/// The response to the first exchange without a fault.
fn usual() -> Vec<u8> {
    let txt = disturbed(FaultKind::Dribble);
    assert_eq!(begin_exchange(&txt).receive_compressed().words[0], 1234);
    let mut client = begin_exchange(&txt);
    let mut response = client.receive(CmprHeader::LEN);
    let size = CmprHeader::parse_response(&response).unwrap().extra_size as usize;
    response.extend(client.receive(size));
    response
}

/// Whether the first exchange of the next connection is undisturbed.
fn assert_struck_once(txt: &SimulatedTxt, client: Client) {
    drop(client);
    assert_eq!(begin_exchange(txt).receive_compressed().words[0], 1234);
}

#[test]
fn a_delay_is_at_least_as_long_as_ordered() {
    let delay = Duration::from_millis(60);
    let txt = disturbed(FaultKind::Delay(delay));
    let begin = Instant::now();
    let mut client = begin_exchange(&txt);
    assert_eq!(client.receive_compressed().words[0], 1234);
    assert!(begin.elapsed() >= delay);
    assert_struck_once(&txt, client);
}

#[test]
fn a_delay_or_pace_of_more_than_an_hour_is_refused() {
    let hour = Duration::from_secs(3600);
    for time in [hour + Duration::from_millis(1), Duration::MAX] {
        for kind in [FaultKind::Delay(time), FaultKind::Jitter(time)] {
            let error = unpaced().fault(Fault::at_response(0, kind)).start().unwrap_err();
            assert!(error.to_string().contains("has to be 0 to 3600000"), "{error}");
        }
        let error = SimulatedTxt::builder().pace(time).start().unwrap_err();
        assert!(matches!(error, Error::OutOfRange { most: 3_600_000, .. }), "{error}");
    }
    let longest = Fault::at_response(0, FaultKind::Delay(hour));
    unpaced().pace(hour).fault(longest).start().unwrap();
}

#[test]
fn a_long_delay_does_not_hold_up_the_end() {
    let txt = disturbed(FaultKind::Delay(Duration::from_secs(3600)));
    let mut client = begin_exchange(&txt);
    assert!(txt.wait_until(|machine| machine.exchanges() == 1, LIMIT), "the delay has not begun");
    let begin = Instant::now();
    drop(txt);
    assert!(begin.elapsed() < LIMIT);
    assert!(client.until_closed().is_empty());
}

#[test]
fn silence_skips_one_response() {
    let txt = disturbed(FaultKind::Silence);
    let mut client = begin_exchange(&txt);
    client.command(CommandId::QueryStatus);
    ResponseId::QueryStatus.check(&client.receive(24)).unwrap();
    assert_eq!(txt.with_machine(|machine| machine.exchanges()), 1);
    assert_struck_once(&txt, client);
}

#[test]
fn a_dribbled_response_is_whole() {
    let txt = disturbed(FaultKind::Dribble);
    let mut client = begin_exchange(&txt);
    assert_eq!(client.receive_compressed().words[0], 1234);
    assert_struck_once(&txt, client);
}

#[test]
fn a_wrong_id_belongs_to_no_response() {
    let txt = disturbed(FaultKind::WrongId);
    let mut client = begin_exchange(&txt);
    let id: [u8; 4] = client.receive(4).try_into().unwrap();
    assert_eq!(ResponseId::from_id(u32::from_le_bytes(id)), None);
    assert_eq!(client.receive(usual().len() - 4), usual()[4..]);
    assert_struck_once(&txt, client);
}

#[test]
fn a_wrong_crc_is_the_only_difference() {
    let txt = disturbed(FaultKind::WrongCrc);
    let mut client = begin_exchange(&txt);
    let response = client.receive(usual().len());
    assert_eq!(response[..8], usual()[..8]);
    assert_ne!(response[8..12], usual()[8..12]);
    assert_eq!(response[12..], usual()[12..]);
    assert_struck_once(&txt, client);
}

#[test]
fn an_extra_size_is_announced_as_ordered() {
    let txt = disturbed(FaultKind::ExtraSize(u32::MAX));
    let mut client = begin_exchange(&txt);
    let response = client.receive(usual().len());
    assert_eq!(response[4..8], [0xFF; 4]);
    assert_eq!(response[8..], usual()[8..]);
    assert_struck_once(&txt, client);
}

#[test]
fn a_mask_is_announced_as_ordered() {
    let txt = disturbed(FaultKind::Mask(0x0103));
    let mut client = begin_exchange(&txt);
    let response = client.receive(usual().len());
    assert_eq!(response[..12], usual()[..12]);
    assert_eq!(response[12..14], [0x03, 0x01]);
    assert_eq!(response[14..], usual()[14..]);
    assert_struck_once(&txt, client);
}

#[test]
fn jitter_holds_each_exchange_back_and_changes_no_byte() {
    let jitter = FaultKind::Jitter(Duration::from_millis(10));
    let txt = unpaced().seed(7).fault(Fault::at_each_exchange(jitter)).start().unwrap();
    let mut client = Client::online(&txt);
    let begin = Instant::now();
    for _ in 0..20 {
        client.exchange_compressed(&[[0; 27]], 0);
    }
    // With this seed the 20 times add up to 107.8 ms.
    assert!(begin.elapsed() >= Duration::from_micros(107_800));
}

#[test]
fn a_fault_of_an_exchange_does_not_count_other_responses() {
    let fault = Fault::at_exchange(1, FaultKind::Close { after: 0 });
    let txt = unpaced().fault(fault).start().unwrap();
    let mut client = Client::online(&txt);
    for _ in 0..3 {
        client.command(CommandId::QueryStatus);
        ResponseId::QueryStatus.check(&client.receive(24)).unwrap();
    }
    client.exchange_compressed(&[[0; 27]], 0);
    client.send_compressed(&[[0; 27]], 0);
    assert_eq!(client.until_closed(), []);
}

#[test]
fn cut_data_is_half_as_long() {
    let txt = disturbed(FaultKind::CutData);
    let mut client = begin_exchange(&txt);
    let whole = usual();
    let half = (whole.len() - CmprHeader::LEN) / 2;
    let header = CmprHeader::parse_response(&client.receive(CmprHeader::LEN)).unwrap();
    assert_eq!(header.extra_size as usize, half);
    assert_eq!(header.crc.to_le_bytes(), whole[8..12]);
    assert_eq!(client.receive(half), whole[CmprHeader::LEN..][..half]);
    client.command(CommandId::QueryStatus);
    ResponseId::QueryStatus.check(&client.receive(24)).unwrap();
    assert_struck_once(&txt, client);
}

#[test]
fn surplus_bytes_come_before_the_next_response() {
    let txt = disturbed(FaultKind::Surplus(5));
    let mut client = begin_exchange(&txt);
    assert_eq!(client.receive_compressed().words[0], 1234);
    client.receive(5);
    client.command(CommandId::QueryStatus);
    ResponseId::QueryStatus.check(&client.receive(24)).unwrap();
    assert_struck_once(&txt, client);
}

#[test]
fn surplus_bytes_have_an_end() {
    let txt = disturbed(FaultKind::Surplus(usize::MAX));
    let mut client = begin_exchange(&txt);
    assert_eq!(client.receive_compressed().words[0], 1234);
    client.receive(65_536);
    client.command(CommandId::QueryStatus);
    ResponseId::QueryStatus.check(&client.receive(24)).unwrap();
    assert_struck_once(&txt, client);
}

#[test]
fn a_connection_closes_after_the_ordered_bytes() {
    let whole = usual();
    for (after, sent) in [(0, 0), (1, 1), (16, 16), (whole.len(), whole.len()), (9999, whole.len())]
    {
        let txt = disturbed(FaultKind::Close { after });
        let mut client = begin_exchange(&txt);
        assert_eq!(client.until_closed(), whole[..sent]);
        assert_struck_once(&txt, client);
    }
}

#[test]
fn faults_for_the_same_response_strike_one_connection_each() {
    let close = Fault::at_response(0, FaultKind::Close { after: 0 });
    let txt = unpaced().fault(close).fault(close).start().unwrap();
    for _ in 0..2 {
        let mut client = Client::connect(&txt);
        client.command(CommandId::QueryStatus);
        assert_eq!(client.until_closed(), []);
    }
    let mut client = Client::connect(&txt);
    client.command(CommandId::QueryStatus);
    let mut response = Vec::new();
    (&client.stream).take(24).read_to_end(&mut response).unwrap();
    ResponseId::QueryStatus.check(&response).unwrap();
}

#[test]
fn a_script_disturbs_the_response_to_its_exchange() {
    let txt = unpaced().on_exchange(|machine| {
        if machine.controllers[0].outputs.duty[0] == 77 {
            machine.disturb(FaultKind::WrongCrc);
            machine.disturb(FaultKind::Close { after: CmprHeader::LEN });
        }
    });
    let txt = txt.start().unwrap();
    let mut client = Client::online(&txt);
    client.send_compressed(&[[0; 27]], 0);
    client.receive_compressed();
    let mut words = [0; 27];
    words[0] = 77;
    client.send_compressed(&[words], 0);
    assert_eq!(client.receive(CmprHeader::LEN).len(), CmprHeader::LEN);
    assert!(client.until_closed().is_empty());
}

#[test]
fn a_controller_that_is_away_serves_nobody_new_until_it_is_back() {
    let txt = unpaced().start().unwrap();
    let mut connected = Client::online(&txt);
    txt.with_machine(|machine| machine.set_absent(true));
    connected.send_compressed(&[[0; 27]], 0);
    connected.receive_compressed();
    drop(connected);
    assert!(txt.wait_until(|machine| !machine.connected(), LIMIT));
    for _ in 0..3 {
        assert!(Client::connect(&txt).until_closed().is_empty());
    }
    assert_eq!(txt.with_machine(|machine| (machine.connections(), machine.absent())), (1, true));
    txt.with_machine(|machine| machine.set_absent(false));
    Client::online(&txt);
}

#[test]
fn a_controller_reports_what_a_script_tells_it() {
    let reported = ft_transfer_area::wire::ExchangeDataResponse {
        uni: [5; 8],
        counter_reset_id: [1, 2, 3, 4],
        motor_command_id: [5, 6, 7, 8],
        sound_command_id: 9,
        ..Default::default()
    };
    let mut number = 0;
    let txt = unpaced().on_exchange(move |machine| {
        number += 1;
        machine.controllers[0].report_as(Some(reported).filter(|_| number == 1));
    });
    let txt = txt.start().unwrap();
    let mut client = Client::online(&txt);
    let mut words = || {
        client.send_compressed(&[[0; 27]], 0);
        client.receive_compressed().words
    };
    assert_eq!(words()[16..25], [1, 2, 3, 4, 5, 6, 7, 8, 9]);
    assert_eq!(words()[..25], [0; 25], "it reports its own inputs again");
}
