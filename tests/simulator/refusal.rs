//! One client is served at a time. The others wait, and are served one after the other.

use std::time::Duration;

use ft_transfer_area::wire::{CommandId, ResponseId};
use ft_transfer_area::{Error, TimeLimits, TransferAreaComHandler};

use crate::unpaced;
use crate::wire_client::Client;

/// A client that asks for the status and gets it.
fn assert_answers(client: &mut Client) {
    client.command(CommandId::QueryStatus);
    ResponseId::QueryStatus.check(&client.receive(24)).unwrap();
}

#[test]
fn a_second_client_waits_while_one_is_online_and_is_served_then() {
    let txt = unpaced().start().unwrap();
    let mut first = Client::online(&txt);
    let mut waiting = [(); 2].map(|()| {
        let mut client = Client::connect(&txt);
        client.command(CommandId::QueryStatus);
        client
    });
    for _ in 0..100 {
        first.exchange_compressed(&[[0; 27]], 0);
    }
    for client in &mut waiting {
        assert!(client.is_silent());
    }
    first.command(CommandId::StopOnline);
    first.receive(4);
    assert!(waiting[0].is_silent(), "the first is connected");
    drop(first);
    for client in waiting {
        let mut client = client;
        ResponseId::QueryStatus.check(&client.receive(24)).unwrap();
    }
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
}

#[test]
fn a_client_that_has_left_is_served_when_it_comes_again() {
    let txt = unpaced().start().unwrap();
    for _ in 0..200 {
        // It leaves with a command unanswered, so that the end comes after a command.
        let mut client = Client::online(&txt);
        client.command(CommandId::QueryStatus);
    }
    assert_answers(&mut Client::connect(&txt));
}

#[test]
fn this_crates_client_reports_that_it_gets_no_answer() {
    let txt = unpaced().start().unwrap();
    let _first = Client::online(&txt);
    let limits = TimeLimits::default().read(Duration::from_millis(200));
    let builder = TransferAreaComHandler::builder(txt.address());
    let error = builder.time_limits(limits).build().unwrap().begin_transfer().unwrap_err();
    assert!(matches!(error, Error::NoAnswer { .. }), "{error:?}");
}
