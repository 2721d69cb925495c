//! A controller that is online and says nothing more: nobody knows what it does with what it is sent.

use std::io::{Read, Write};
use std::net::TcpStream;

use ft_transfer_area::wire::{CommandId, ExchangeData, ExchangeDataResponse};
use ft_transfer_area_recorder::{FailureKind, Transfer};
use serde_json::json;

use super::clients::transfers;
use super::gone::{outputs_off, Controller};
use super::support::{accept, listener, Watch};

/// Says farewell, which the controller receives and does not answer.
fn say_farewell(controller: &mut Controller, mut program: TcpStream) {
    program.write_all(&CommandId::StopOnline.id().to_le_bytes()).unwrap();
    controller.stream.read_exact(&mut [0; 4]).unwrap();
}

#[test]
fn after_a_farewell_without_an_answer_the_controller_is_stopped() {
    let (listener, address) = listener();
    let watch = Watch::with_lines(address);
    let (mut controller, program) = Controller::online(&watch, listener);
    say_farewell(&mut controller, program);
    let offline = watch.line_where(|line| line["what"] == "offline");
    assert_eq!(
        (&offline["by_program"], &offline["stop_online"]),
        (&json!(false), &json!("unanswered"))
    );
    let next = accept(&controller.listener);
    // The first one is open and silent as before.
    let _first = std::mem::replace(&mut controller.stream, next);
    controller.is_stopped();
    assert_eq!(outputs_off(&watch), ("unanswered".into(), true.into()));
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn page_and_recording_say_that_a_farewell_had_no_answer() {
    let (listener, address) = listener();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let arguments = ["--leave-outputs", "--record", path.to_str().unwrap()];
    let watch = Watch::start(address, &arguments);
    let mut page = watch.page();
    let (mut controller, program) = Controller::online(&watch, listener);
    say_farewell(&mut controller, program);
    page.state(0, |state| {
        let link = &state["link"];
        link["phase"] == "idle" && link["error"]["code"] == "stop_online_unanswered"
    });
    // Another one, that is not understood either, hides nothing.
    let mut other = watch.connect();
    other.write_all(b"what").unwrap();
    accept(&controller.listener).read_exact(&mut [0; 4]).unwrap();
    page.state(0, |state| state["link"]["phase"] == "connecting");
    drop(other);
    let state = page.state(0, |state| state["link"]["phase"] == "idle");
    assert_eq!(state["link"]["error"]["code"], "stop_online_unanswered");
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
    let transfers = transfers(&path);
    let Some(Transfer::EndedBy(failure)) = transfers.last() else { panic!("{transfers:?}") };
    assert_eq!(failure.kind, FailureKind::NoAnswer);
    assert!(failure.error.starts_with("no answer to StopOnline for "), "{failure:?}");
    assert!(failure.error.ends_with("motors may go on"), "{failure:?}");
}

/// Sends so many exchanges, each with another duty of O1, and the last one with 512. The controller receives all.
fn send_exchanges(count: usize, controller: &mut Controller, program: &mut TcpStream) {
    let mut sent = Vec::new();
    for duty in (512 - count as i16 + 1)..=512 {
        let duty = [duty, 0, 0, 0, 0, 0, 0, 0];
        ExchangeData { duty, ..ExchangeData::default() }.emit(&mut sent);
    }
    program.write_all(&sent).unwrap();
    controller.stream.read_exact(&mut sent).unwrap();
}

#[test]
fn what_a_program_has_sent_into_a_silence_is_told_and_its_answers_are_those_of_what_they_answer() {
    let (listener, address) = listener();
    let watch = Watch::with_lines(address);
    let (mut controller, mut program) = Controller::online(&watch, listener);
    send_exchanges(100, &mut controller, &mut program);
    let unanswered =
        watch.line_where(|line| line["what"] == "unanswered" && line["exchanges"] == 100);
    assert_eq!(unanswered["forgotten"], 36);
    let line = watch.line_where(|line| line["motor"] == "M1");
    assert_eq!((&line["duty"][0], &line["answered"]), (&json!(512), &json!(false)));
    assert!(line["cycle"].is_null());
    let mut response = Vec::new();
    ExchangeDataResponse::default().emit(&mut response);
    controller.stream.write_all(&response.repeat(100)).unwrap();
    for (cycle, duty) in (37..=100).zip(449..) {
        let line = watch.line_where(|line| line["motor"] == "M1" && !line["cycle"].is_null());
        assert_eq!((&line["cycle"], &line["duty"][0]), (&json!(cycle), &json!(duty)));
    }
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn page_and_recording_have_the_outputs_that_a_program_has_sent_into_a_silence() {
    let (listener, address) = listener();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let arguments = ["--leave-outputs", "--record", path.to_str().unwrap()];
    let watch = Watch::start(address, &arguments);
    let mut page = watch.page();
    let (mut controller, mut program) = Controller::online(&watch, listener);
    send_exchanges(100, &mut controller, &mut program);
    page.state(0, |state| {
        let sent = &state["areas"][0]["motors"][0]["duty"];
        *sent == json!([512, 0]) && state["link"]["error"]["code"] == "unanswered"
    });
    drop((controller, program));
    page.state(0, |state| state["link"]["phase"] == "idle");
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
    let transfers = transfers(&path);
    let Some(Transfer::EndedBy(failure)) = transfers.last() else { panic!("{transfers:?}") };
    let end = "so 36 exchanges are left out; the last 100 exchanges had no answer, the newest has TXT O1 512";
    assert!(failure.error.ends_with(end), "{failure:?}");
}
