"""Logs in MCAP: by the format's own reader, and read back as text with the same columns is."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.logs.dialects import read_log, recognise
from cdpr_drake.analyses.reporting.exported_logs import LOG_WRITERS
from cdpr_drake.errors import LogFileError, OutputFormatError

reader = pytest.importorskip("mcap.reader")


@pytest.fixture
def run_folder(tmp_path):
    """A results folder as a run leaves it: log.npz and log.csv."""
    random, n = np.random.default_rng(3), 40
    q = random.normal(size=(n, 4))
    X_WP = np.hstack([q / np.linalg.norm(q, axis=1, keepdims=True), random.normal(size=(n, 3))])
    log = {"time": np.arange(n) * 0.01, "X_WP": X_WP, "tensions": random.uniform(1, 90, (n, 2))}
    log["error"] = random.normal(size=n)
    np.savez(tmp_path / "log.npz", **log)
    names = ["time", *(f"X_WP.{a}" for a in ("qw", "qx", "qy", "qz", "x", "y", "z"))]
    names += ["tensions.C1", "tensions.C2", "error"]
    table = np.column_stack(list(log.values()))
    rows = [",".join(map(repr, row)) for row in table.tolist()]
    (tmp_path / "log.csv").write_text("\n".join([",".join(names), *rows]) + "\n")
    return tmp_path, log


def write(folder):
    LOG_WRITERS["mcap"](folder, folder / "log.mcap")
    return folder / "log.mcap"


def test_its_own_reader_finds_transforms_and_quantities(run_folder):
    folder, log = run_folder
    with write(folder).open("rb") as stream:
        made = reader.make_reader(stream)
        messages = list(made.iter_messages())
        summary = made.get_summary()
    topics = {c.topic: summary.schemas[c.schema_id] for c in summary.channels.values()}
    assert topics["/tf"].name == "foxglove.FrameTransform"
    assert topics["/tf"].encoding == "jsonschema"
    assert set(topics) == {"/tf", "/X_WP", "/tensions", "/error"}
    assert json.loads(topics["/tensions"].data)["properties"]["tensions.C2"] == {"type": "number"}
    frames = [json.loads(m.data) for _, c, m in messages if c.topic == "/tf"]
    places = [[f["translation"][a] for a in "xyz"] for f in frames]
    turns = [[f["rotation"][a] for a in "wxyz"] for f in frames]
    np.testing.assert_array_equal(np.hstack([turns, places]), log["X_WP"])
    assert frames[7]["timestamp"] == {"sec": 0, "nsec": 70_000_000}
    assert (frames[0]["parent_frame_id"], frames[0]["child_frame_id"]) == ("world", "platform")
    times = [m.log_time for _, c, m in messages if c.topic == "/error"]
    assert times == [10_000_000 * k for k in range(40)]


def test_it_is_read_back_as_its_text_is(run_folder):
    folder, _ = run_folder
    path = write(folder)
    assert recognise(path)[0] == "mcap"
    log, text = read_log(path), read_log(folder / "log.csv")
    assert log.dialect == "mcap"
    assert list(log.frame) == list(text.frame)
    assert len(log.frame.columns) > 9
    for header, values in text.frame.items():
        np.testing.assert_array_equal(log.frame[header], values)


@pytest.mark.parametrize("row", [0, 3])
def test_what_is_not_finite_is_left_out_and_comes_back_so(run_folder, row):
    folder, log = run_folder
    log["tensions"][row, 1] = np.nan
    np.savez(folder / "log.npz", **log)
    path = write(folder)
    back = read_log(path)
    header = next(name for name in back.frame if "C2" in name)
    assert np.flatnonzero(np.isnan(back.frame[header])).tolist() == [row]


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


def test_every_message_is_what_its_schema_and_foxglove_s_say(run_folder):
    """Also with numbers that are not finite, which JSON has not; such a pose has no transform."""
    jsonschema = pytest.importorskip("jsonschema")
    folder, log = run_folder
    log["tensions"][3, 1], log["error"][5], log["X_WP"][7, 2] = np.nan, np.inf, np.nan
    np.savez(folder / "log.npz", **log)
    counts = {}
    with write(folder).open("rb") as stream:
        for schema, channel, message in reader.make_reader(
            stream, validate_crcs=True
        ).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            own = json.loads(schema.data)
            assert own["type"] == "object"  # as Foxglove demands
            jsonschema.Draft202012Validator.check_schema(own)
            told = json.loads(message.data)
            jsonschema.validate(told, own)
            if schema.name == "foxglove.FrameTransform":
                jsonschema.validate(told, FOXGLOVE)
                stamp = told["timestamp"]["sec"] * 10**9 + told["timestamp"]["nsec"]
                assert stamp == message.log_time
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
    assert counts == {"/tf": 39, "/X_WP": 40, "/tensions": 40, "/error": 40}


def test_transforms_alone_are_poses(run_folder):
    from mcap.writer import Writer

    folder, log = run_folder
    path = folder / "poses.mcap"
    with write(folder).open("rb") as source, path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("foxglove.FrameTransform", "jsonschema", b"{}")
        channel = writer.register_channel("/tf", "json", schema)
        image = writer.register_channel("/image", "protobuf", schema)
        for _, each, m in reader.make_reader(source).iter_messages():
            if each.topic == "/tf":
                writer.add_message(channel, m.log_time, m.data, m.publish_time)
        writer.add_message(image, 0, b"\1\2", 0)
        writer.finish()
    back = read_log(path)
    columns = ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m")
    np.testing.assert_allclose(back.table(columns), log["X_WP"], rtol=1e-15)
    np.testing.assert_allclose(back.time, log["time"], atol=1e-12)
    assert any("/image" in words for words in back.remarks)


def test_what_cannot_be_is_said_in_one_line(run_folder, monkeypatch):
    folder, log = run_folder
    path = write(folder)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(LogFileError, match=r"log.mcap: cannot be read as MCAP") as refused:
        read_log(path)
    assert "\n" not in str(refused.value)
    np.savez(folder / "log.npz", **{**log, "time": log["time"] - 1.0})
    with pytest.raises(OutputFormatError, match="time: found -1; accepted by mcap: >= 0"):
        write(folder)
    monkeypatch.setattr("cdpr_drake.analyses.logs.ros.find_spec", lambda name: None)
    with pytest.raises(LogFileError, match=r"pip install '\.\[mcap\]'"):
        read_log(path)
