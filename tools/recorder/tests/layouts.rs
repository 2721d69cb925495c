//! The layouts for Foxglove and PlotJuggler name only what a recording has.

use std::collections::BTreeMap;
use std::fs;

use ft_transfer_area::{CameraFrame, TransferAreaComHandler};
use ft_transfer_area_recorder::{Options, Recorder};
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::Value;

use crate::recording::folder;

/// The fields of each topic of a recording: those of its schema that are in its messages, if it has some.
fn topics() -> BTreeMap<String, Vec<String>> {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    let txt = SimulatedTxt::builder().start().unwrap();
    let handler = TransferAreaComHandler::builder(txt.address().to_string()).build().unwrap();
    let recorder = Recorder::start(&handler, &path, Options::default()).unwrap();
    handler.begin_transfer().unwrap();
    (0..20).for_each(|_| drop(handler.areas().wait_cycle().unwrap()));
    handler.end_transfer().unwrap();
    let picture = include_bytes!("../../../tests/camera/clean_48x32_420.jpg");
    recorder.frames().record(&CameraFrame::new(picture.to_vec()));
    recorder.finish().unwrap();

    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().expect("a finished file has an index");
    let channels = summary.channels.values().map(|channel| {
        let schema = channel.schema.as_ref().expect("each channel has a schema");
        let schema: Value = serde_json::from_slice(&schema.data).unwrap();
        let fields = schema["properties"].as_object().unwrap().keys().cloned().collect();
        (channel.topic.clone(), fields)
    });
    let mut topics: BTreeMap<String, Vec<String>> = channels.collect();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let values: Value = serde_json::from_slice(&message.data).unwrap();
        // Those of a transfer are different ones each time.
        if message.channel.topic != "/transfer" {
            let fields = topics.get_mut(&message.channel.topic).unwrap();
            fields.retain(|field| values.get(field).is_some());
        }
    }
    topics
}

fn layout(name: &str) -> String {
    fs::read_to_string(format!("{}/../../docs/layouts/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

#[track_caller]
fn assert_has(topics: &BTreeMap<String, Vec<String>>, topic: &str, field: &str) {
    let fields = topics.get(topic).unwrap_or_else(|| panic!("there is no topic {topic}"));
    assert!(fields.iter().any(|known| known == field), "{topic} has no {field}, but {fields:?}");
}

#[test]
fn foxglove_finds_every_path_of_its_layout() {
    let topics = topics();
    let layout: Value = serde_json::from_str(&layout("foxglove.json")).unwrap();
    let panels = layout["configById"].as_object().unwrap();
    let mut paths = 0;
    for (id, panel) in panels {
        for path in panel["paths"].as_array().into_iter().flatten() {
            let (topic, field) = path["value"].as_str().unwrap().split_once('.').unwrap();
            assert_has(&topics, topic, field);
            paths += 1;
        }
        let keys =
            [&panel["topicPath"], &panel["topicToRender"], &panel["imageMode"]["imageTopic"]];
        for topic in keys.into_iter().filter_map(Value::as_str) {
            assert!(topics.contains_key(topic), "{id}: {topic}");
        }
        assert!(is_shown(&layout["layout"], id), "{id} is nowhere");
    }
    assert!(paths >= 17, "{paths}");
    assert_eq!(shown(&layout["layout"]), panels.len());
}

/// Whether a part of the window, or a part of this one, is the panel.
fn is_shown(part: &Value, id: &str) -> bool {
    part == id
        || ["first", "second"].iter().any(|of| !part[of].is_null() && is_shown(&part[of], id))
}

/// How many panels there are in a part of the window.
fn shown(part: &Value) -> usize {
    match part {
        Value::String(_) => 1,
        part => shown(&part["first"]) + shown(&part["second"]),
    }
}

#[test]
fn plotjuggler_finds_every_curve_of_its_layout() {
    let topics = topics();
    let layout = layout("plotjuggler.xml");
    let names: Vec<&str> = layout
        .lines()
        .filter_map(|line| line.trim().strip_prefix("<curve name=\"")?.split('"').next())
        .collect();
    assert_eq!(names.len(), layout.matches("<curve").count());
    assert!(names.len() >= 16);
    for name in names {
        let (topic, field) = name.rsplit_once('/').unwrap();
        assert_has(&topics, topic, field);
    }
}
