"""Reads a recording with the package `mcap`, as a user would, and prints what it finds as JSON."""

import json
import struct
import sys

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap.stream_reader import StreamReader


def read(reader):
    counts, inputs = {}, []
    for schema, channel, message in reader.iter_messages():
        assert schema.encoding == "jsonschema" and channel.message_encoding == "json"
        values = json.loads(message.data)
        properties = json.loads(schema.data)["properties"]
        assert set(values) <= set(properties), (channel.topic, values)
        counts[channel.topic] = counts.get(channel.topic, 0) + 1
        if channel.topic == "/TXT/inputs":
            inputs.append(values["I1"])
    return {"counts": counts, "inputs": inputs}


def read_cut_off(file):
    """A file without its end has no index: it is read from the beginning."""
    inputs, channels = [], {}
    try:
        for record in StreamReader(file).records:
            name = type(record).__name__
            if name == "Channel":
                channels[record.id] = record.topic
            elif name == "Message" and channels[record.channel_id] == "/TXT/inputs":
                inputs.append(json.loads(record.data)["I1"])
    except (McapError, EOFError, struct.error):
        pass
    return inputs


with open(sys.argv[1], "rb") as file:
    whole = read(make_reader(file))
    file.seek(0)
    assert read(NonSeekingReader(file)) == whole
    file.seek(0)
    whole["profile"] = make_reader(file).get_header().profile
with open(sys.argv[2], "rb") as file:
    whole["cut_off"] = read_cut_off(file)
print(json.dumps(whole))
