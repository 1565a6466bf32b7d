"""A run's log in MCAP, by the format's own reader and the schemas of its messages."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.exported_logs import LOG_WRITERS
from cdpr_drake.errors import OutputFormatError
from tests.analyses.logs.recorders import run_files

reader = pytest.importorskip("mcap.reader")


def messages(folder, log):
    """Schema, channel, message and content of each message of a run's log."""
    np.savez(folder / "log.npz", **log)
    LOG_WRITERS["mcap"](folder, folder / "log.mcap")
    with (folder / "log.mcap").open("rb") as stream:
        rows = list(reader.make_reader(stream, validate_crcs=True).iter_messages())
    return [(schema, channel, m, json.loads(m.data)) for schema, channel, m in rows]


def test_transforms_and_quantities_have_the_rows_of_the_log(tmp_path):
    log = run_files(tmp_path)
    rows = messages(tmp_path, log)
    assert {channel.topic for _, channel, _, _ in rows} == {"/tf", "/X_WP", "/tensions", "/error"}
    frames = [content for _, channel, _, content in rows if channel.topic == "/tf"]
    places = [[f["translation"][a] for a in "xyz"] for f in frames]
    turns = [[f["rotation"][a] for a in "wxyz"] for f in frames]
    np.testing.assert_array_equal(np.hstack([turns, places]), log["X_WP"])
    assert (frames[0]["parent_frame_id"], frames[0]["child_frame_id"]) == ("world", "platform")
    times = [message.log_time for _, channel, message, _ in rows if channel.topic == "/error"]
    assert times == [10_000_000 * k for k in range(40)]


def made_of(**keys):
    """A JSON schema of an object that has all of these."""
    return {"type": "object", "properties": keys, "required": list(keys)}


NUMBER, TEXT = {"type": "number"}, {"type": "string"}
FOXGLOVE = made_of(
    timestamp=made_of(
        sec={"type": "integer", "minimum": 0},
        nsec={"type": "integer", "minimum": 0, "maximum": 999_999_999},
    ),
    parent_frame_id=TEXT, child_frame_id=TEXT, translation=made_of(x=NUMBER, y=NUMBER, z=NUMBER),
    rotation=made_of(x=NUMBER, y=NUMBER, z=NUMBER, w=NUMBER),
)  # fmt: skip
"""What Foxglove's own schema of FrameTransform asks of a message (foxglove-sdk,
schemas/jsonschema/FrameTransform.json)."""


def test_every_message_is_what_its_schema_and_foxglove_s_say(tmp_path):
    """Also with numbers that are not finite, which JSON has not; such a pose has no transform."""
    jsonschema = pytest.importorskip("jsonschema")
    log = run_files(tmp_path)
    log["tensions"][3, 1], log["error"][5], log["X_WP"][7, 2] = np.nan, np.inf, np.nan
    counts = {}
    for schema, channel, message, content in messages(tmp_path, log):
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        own = json.loads(schema.data)
        assert own["type"] == "object"  # as Foxglove demands
        jsonschema.Draft202012Validator.check_schema(own)
        jsonschema.validate(content, own)
        if channel.topic == "/tensions":
            assert own["properties"]["tensions.C2"] == {"type": "number"}
        if schema.name == "foxglove.FrameTransform":
            jsonschema.validate(content, FOXGLOVE)
            stamp = content["timestamp"]["sec"] * 10**9 + content["timestamp"]["nsec"]
            assert stamp == message.log_time
        counts[channel.topic] = counts.get(channel.topic, 0) + 1
    assert counts == {"/tf": 39, "/X_WP": 40, "/tensions": 40, "/error": 40}


def test_times_before_zero_are_refused(tmp_path):
    log = run_files(tmp_path)
    with pytest.raises(OutputFormatError, match="time: found -1; accepted by mcap: >= 0"):
        messages(tmp_path, {**log, "time": log["time"] - 1.0})
