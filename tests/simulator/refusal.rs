//! One client is online at a time. After any number of clients the next one is served.

use ft_transfer_area::wire::{CommandId, ResponseId};
use ft_transfer_area::{Error, TransferAreaComHandler};

use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

/// A client that asks for the status and gets it.
fn assert_answers(client: &mut Client) {
    client.command(CommandId::QueryStatus);
    ResponseId::QueryStatus.check(&client.receive(24)).unwrap();
}

#[test]
fn a_second_client_is_refused_while_one_is_online() {
    let txt = unpaced().start().unwrap();
    let mut first = Client::online(&txt);
    for refused in 1..=3 {
        assert_eq!(Client::connect(&txt).until_closed(), []);
        assert!(txt.wait_until(LIMIT, |machine| machine.refused() == refused));
        first.exchange_compressed(&[[0; 27]], 0);
    }
    assert_eq!(txt.with_machine(|machine| machine.connections()), 1);
    drop(first);
    Client::online(&txt).exchange_compressed(&[[0; 27]], 0);
}

#[test]
fn a_second_client_is_refused_during_exchanges_too() {
    let txt = unpaced().start().unwrap();
    let mut first = Client::online(&txt);
    let second = Client::connect(&txt);
    let mut exchanges = 0;
    // The first never pauses for longer than it takes to send the next command.
    while txt.with_machine(|machine| machine.refused()) == 0 {
        first.exchange_compressed(&[[0; 27]], 0);
        exchanges += 1;
        assert!(exchanges < 100_000, "it is not refused");
    }
    let mut second = second;
    assert_eq!(second.until_closed(), []);
}

#[test]
fn a_second_client_is_refused_while_the_first_has_sent_half_a_command() {
    let txt = unpaced().start().unwrap();
    let mut first = Client::online(&txt);
    let query = CommandId::QueryStatus.id().to_le_bytes();
    first.send(&query[..2]);
    assert_eq!(Client::connect(&txt).until_closed(), []);
    first.send(&query[2..]);
    ResponseId::QueryStatus.check(&first.receive(24)).unwrap();
}

#[test]
fn a_second_client_waits_while_the_first_is_not_online() {
    let txt = unpaced().start().unwrap();
    let mut first = Client::connect(&txt);
    assert_answers(&mut first);
    let mut second = Client::connect(&txt);
    second.command(CommandId::QueryStatus);
    assert_answers(&mut first);
    drop(first);
    ResponseId::QueryStatus.check(&second.receive(24)).unwrap();
    assert_eq!(txt.with_machine(|machine| machine.refused()), 0);
}

#[test]
fn a_client_that_has_left_is_not_refused_when_it_comes_again() {
    let txt = unpaced().start().unwrap();
    for _ in 0..200 {
        // It leaves with a command unanswered, so that the end comes after a command.
        let mut client = Client::online(&txt);
        client.command(CommandId::QueryStatus);
    }
    assert_answers(&mut Client::connect(&txt));
    assert_eq!(txt.with_machine(|machine| machine.refused()), 0);
}

#[test]
fn this_crates_client_reports_that_it_was_refused() {
    let txt = unpaced().start().unwrap();
    let _first = Client::online(&txt);
    let handler = TransferAreaComHandler::builder("127.0.0.1").port(txt.port()).build().unwrap();
    let error = handler.begin_transfer().unwrap_err();
    assert!(matches!(error, Error::ConnectionClosed { .. } | Error::Io { .. }), "{error:?}");
}
