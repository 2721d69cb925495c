//! Checks that the document and the sample for Node-RED use the topics that there are.

use std::collections::BTreeSet;

use serde_json::Value;

use super::commands::Received;
use super::topics::{Addressed, Topics, ERROR, EVENT, MASTER, STATE, STOP};
use super::value::values_of;

const DOCUMENT: &str = include_str!("../../../docs/bridge.md");
const FLOW: &str = include_str!("../../samples/node-red.json");

/// What follows prefix and name in all topics that the bridge publishes.
fn reported() -> BTreeSet<String> {
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
    assert_eq!(documented, reported());
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

/// What is wrong with a flow: ids that are used twice, or that nobody has.
fn check_flow(flow: &[Value]) {
    let ids: BTreeSet<&str> = flow.iter().map(|node| text(node, "id")).collect();
    assert_eq!(ids.len(), flow.len(), "each node has an id of its own");
    let ends = |node: &Value, key: &str| -> Vec<String> {
        let lists = node[key].as_array().into_iter().flatten();
        lists
            .flat_map(|end| end["wires"].as_array().cloned().unwrap_or_default())
            .map(|end| text(&end, "id").to_owned())
            .collect()
    };
    for node in flow {
        let wired = node["wires"].as_array().into_iter().flatten();
        let wired =
            wired.flat_map(|ends| ends.as_array().unwrap()).map(|end| end.as_str().unwrap());
        let mut named: Vec<String> = wired.map(str::to_owned).collect();
        named.extend(["in", "out"].iter().flat_map(|key| ends(node, key)));
        let keys = match text(node, "type") {
            // Its broker is an address.
            "mqtt-broker" => &["z"][..],
            _ => &["z", "broker", "server"],
        };
        named.extend(keys.iter().map(|key| text(node, key).to_owned()));
        // An instance of a subflow has its id in its type.
        named.extend(text(node, "type").strip_prefix("subflow:").map(str::to_owned));
        for id in named.iter().filter(|id| !id.is_empty()) {
            assert!(ids.contains(&**id), "{id} of {}", node["id"]);
        }
    }
}

fn text<'a>(node: &'a Value, key: &str) -> &'a str {
    node[key].as_str().unwrap_or_default()
}

#[test]
fn the_flow_for_node_red_is_well_formed_and_uses_the_topics() {
    let flow: Vec<Value> = serde_json::from_str(FLOW).unwrap();
    check_flow(&flow);
    let is_command = |tail: &str| {
        let error = Received::parse(tail, b"{}").err().unwrap_or_default();
        // The payload comes from other nodes.
        assert!(error.is_empty() || error.contains("is missing"), "{tail}: {error}");
    };
    let topics = Topics::new("ft", "press");
    for node in &flow {
        match text(node, "type") {
            // Their topics come with messages.
            "mqtt in" | "mqtt out" => assert_eq!(text(node, "topic"), ""),
            "inject" if !text(node, "topic").is_empty() => is_command(text(node, "topic")),
            "mqtt-broker" => {
                let tail = |topic| match topics.addressed(topic) {
                    Some(Addressed::Command(tail)) => tail,
                    Some(Addressed::State) | None => panic!("{topic}"),
                };
                assert_eq!(tail(text(node, "willTopic")), STOP);
                assert_eq!(text(node, "willRetain"), "false");
            }
            _ => {}
        }
        if text(node, "type") == "mqtt out" {
            assert_eq!(text(node, "retain"), "false");
        }
    }
    is_command("M1/set");
    assert!(FLOW.contains(r#"topic: \"M1/set\""#) && reported().contains("I1"));
}

#[test]
fn the_flow_finds_controllers_by_their_state_and_drives_none_at_first() {
    let flow: Vec<Value> = serde_json::from_str(FLOW).unwrap();
    let node = |id| flow.iter().find(|node| text(node, "id") == id).unwrap();
    assert!(text(node("ft-subscribe"), "func").contains(&format!("/+/{STATE}`")));
    assert!(flow.iter().all(|node| !node.to_string().contains("CONTROLLER")), "a name is typed");
    assert_eq!(node("ft-rule")["d"], true, "the example drives what is found");
    let page = text(node("ft-page-html"), "template");
    assert!(page.find(r#"group("Inputs")"#) < page.find(r#"group("Outputs")"#));
    assert!(page.contains(r#"content="dark light""#));
}

/// Other programs may use the broker, and publish as much as they like behind a controller's name.
#[test]
fn the_flow_keeps_only_what_its_page_shows() {
    let flow: Vec<Value> = serde_json::from_str(FLOW).unwrap();
    let newest = flow.iter().find(|node| text(node, "name") == "newest values").unwrap();
    let (filter, keeps) = text(newest, "func").split_once("return null;").unwrap();
    assert!(filter.contains(".test(topic)") && filter.contains("text.length > "), "{filter}");
    assert!(keeps.contains("[topic]: payload") && !filter.contains("[topic]"), "{keeps}");
    let found = flow.iter().find(|node| text(node, "id") == "ft-found").unwrap();
    let (_, keeps) = text(found, "func").split_once("found[controller] = { ").unwrap();
    let (kept, _) = keeps.split_once(" }").unwrap();
    assert_eq!(kept, "state: part(msg.payload.state), bridge", "and a part is short");
}

/// Another machine may get the name of the one before.
#[test]
fn the_flow_is_master_of_what_it_has_sent_commands_to() {
    let flow: Vec<Value> = serde_json::from_str(FLOW).unwrap();
    let found = flow.iter().find(|node| text(node, "id") == "ft-found").unwrap();
    let (change, removal) = text(found, "func").split_once("delete found[controller]").unwrap();
    let forgets = "delete driven[controller];";
    assert!(change.contains("bridge !== known.bridge") && change.contains(forgets), "{change}");
    assert!(removal.contains(forgets), "{removal}");
}
