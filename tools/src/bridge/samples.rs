//! Checks that the document and the sample for Node-RED use the topics that there are.

use std::collections::BTreeSet;

use serde_json::Value;

use super::commands::Received;
use super::topics::{Addressed, Topics, ERROR, EVENT, MASTER, STATE};
use super::value::values_of;

const DOCUMENT: &str = include_str!("../../../docs/bridge.md");
const FLOW: &str = include_str!("../../samples/node-red.json");

/// What follows prefix and name in all topics that the bridge publishes.
fn told() -> BTreeSet<String> {
    let values = values_of(0).into_iter().map(|(tail, _)| tail);
    values.chain([STATE, MASTER, EVENT, ERROR].map(str::to_owned)).collect()
}

/// The rows of the table below a heading: the code in the first two cells.
fn table(heading: &str) -> Vec<(Vec<String>, Vec<String>)> {
    let (_, below) = DOCUMENT.split_once(heading).unwrap();
    let lines = below.lines().skip_while(|line| !line.starts_with("|---"));
    let rows = lines.skip(1).take_while(|line| line.starts_with('|'));
    let code = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    rows.map(|row| {
        let cells: Vec<&str> = row.split('|').collect();
        (code(cells[1]), code(cells[2]))
    })
    .collect()
}

/// `I1` … `I8` is a range: all topics between these.
fn expand(topics: &[String]) -> Vec<String> {
    match topics {
        [first, last] if first.starts_with(|c: char| c.is_uppercase()) => {
            let count: usize = last[1..2].parse().unwrap();
            (1..=count).map(|n| first.replacen('1', &n.to_string(), 1)).collect()
        }
        _ => topics.to_vec(),
    }
}

#[test]
fn the_document_has_all_topics_and_no_others() {
    let rows = table("### What the bridge publishes");
    let documented: BTreeSet<String> = rows.iter().flat_map(|(topics, _)| expand(topics)).collect();
    assert_eq!(documented, told());
    for (_, payloads) in rows {
        let payload: Value = serde_json::from_str(&payloads[0]).unwrap();
        assert!(payload.is_object(), "{payload}");
    }
}

#[test]
fn the_documented_commands_work() {
    let rows = table("### What the bridge accepts");
    for (topics, payloads) in &rows {
        let payload = payloads.first().map_or("", |payload| payload);
        let parsed = Received::parse(&topics[0], payload.as_bytes());
        assert!(parsed.is_ok(), "{topics:?} {payload}: {parsed:?}");
    }
    let topics: BTreeSet<&str> = rows.iter().map(|(topics, _)| &*topics[0]).collect();
    for topic in ["M1/set", "M1/move", "M1/stop", "M1/mode", "O1/set", "C1/reset", "C1/mode"] {
        assert!(topics.contains(topic), "{topic}");
    }
}

#[test]
fn the_flow_for_node_red_is_well_formed_and_uses_the_topics() {
    let flow: Vec<Value> = serde_json::from_str(FLOW).unwrap();
    let text = |node: &Value, key: &str| node[key].as_str().unwrap_or_default().to_owned();
    let ids: BTreeSet<String> = flow.iter().map(|node| text(node, "id")).collect();
    assert_eq!(ids.len(), flow.len(), "each node has an id of its own");
    let topics = Topics::new("ft", "press");
    let tail = |topic: &str| match topics.addressed(topic) {
        Some(Addressed::Command(tail)) => tail.to_owned(),
        Some(Addressed::State) => STATE.to_owned(),
        None => panic!("{topic}"),
    };
    let is_command = |topic: &str| {
        // The payload comes from other nodes.
        let error = Received::parse(&tail(topic), b"{}").err().unwrap_or_default();
        assert!(!error.contains("there is no"), "{error}");
    };
    for node in &flow {
        for wire in node["wires"].as_array().into_iter().flatten() {
            for end in wire.as_array().unwrap() {
                assert!(ids.contains(end.as_str().unwrap()), "{end}");
            }
        }
        let topic = text(node, "topic");
        match &*text(node, "type") {
            "mqtt in" => assert!(told().contains(&tail(&topic)), "{topic}"),
            "mqtt out" => {
                is_command(&topic);
                assert_eq!(node["retain"], "false", "{topic}");
            }
            "mqtt-broker" => is_command(&text(node, "willTopic")),
            _ => {}
        }
    }
    let kinds: BTreeSet<String> = flow.iter().map(|node| text(node, "type")).collect();
    for kind in ["mqtt in", "mqtt out", "mqtt-broker", "function", "debug"] {
        assert!(kinds.contains(kind), "{kind}");
    }
}
