"""Reads recordings with the public reader of MCAP, as Foxglove does: `recording.py FOLDER`.

Each channel for Foxglove is there, and each of its messages is valid by the schema that the file holds.
"""
import json
import sys
from pathlib import Path

import jsonschema
from mcap.reader import make_reader

EXPECTED = {
    "foxglove/location": "foxglove.LocationFix",
    "foxglove/transform": "foxglove.FrameTransform",
    "foxglove/map": "foxglove.GeoJSON",
    "foxglove/scene": "foxglove.SceneUpdate",
    "foxglove/log": "foxglove.Log",
}

paths = sorted(Path(sys.argv[1]).glob("*.mcap"))
counts = dict.fromkeys(EXPECTED, 0)
for path in paths:
    with path.open("rb") as file:
        reader = make_reader(file)
        for schema, channel, message in reader.iter_messages():
            if channel.topic in EXPECTED:
                assert (schema.name, schema.encoding, channel.message_encoding) == (EXPECTED[channel.topic], "jsonschema", "json"), schema
                jsonschema.validate(json.loads(message.data), json.loads(schema.data))
                counts[channel.topic] += 1
            else:
                assert schema.encoding == "protobuf" and schema.name.startswith("kittiwake.v1."), schema
        names = {it.name for it in reader.iter_attachments()}
        assert {"kittiwake.toml", "contingencies.toml", "mission.toml", "mission.xml"} <= names, names
assert all(counts.values()), counts
print("recording:", ", ".join(f"{count} of {topic}" for topic, count in counts.items()))
