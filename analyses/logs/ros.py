"""Text and bags of ROS 1 and 2: .bag, .db3, .mcap with CDR, or the folder of one; MCAP with JSON.

Fields of messages are columns, named and understood as `rostopic echo -p` writes them; the one
field of a std_msgs message bears its topic's name, such as /cable_1/length.

Source: docs.ros.org, sensor_msgs, geometry_msgs, std_msgs; ternaris.gitlab.io/rosbags.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.logs.assembly import WORDS, Cells, assemble
from cdpr_drake.analyses.logs.columns import (
    CABLE_QUANTITIES,
    MOST_CABLES,
    PARTS,
    POSITION,
    QUATERNION,
    SECONDS,
    read_header,
)
from cdpr_drake.analyses.logs.log import Facts, Log, refusal, unreadable
from cdpr_drake.analyses.reporting.mcap_log import TIME_KEY
from cdpr_drake.errors import LogFileError, install_words
from cdpr_drake.numerics.clock_alignment import interpolate_rows
from cdpr_drake.schema.json_text import load_json

ROS1, SQLITE = b"#ROSBAG V2.0", b"SQLite format 3\0"

Headers = tuple[tuple[str, str], ...]

ROS_COLUMNS: Headers = (
    (r"%time|(?:field\.)?header\.stamp", "time_ns"), (r"__time", "time_s"),
    (r"(?:.*[./])?(?:position|translation|point)[./]([xyz])", "{}_m"),
    (r"(?:.*[./])?(?:orientation|rotation|quaternion)[./]([xyzw])", "q{}"),
    (r"(?:.*[./])?position(?:\.|\[)?(\d+)\]?", "cable{}_motor_rad"),
    (r"(?:.*[./])?effort(?:\.|\[)?(\d+)\]?", "cable{}_torque_nm"),
    (r"(?:.*[./])?(?:layout[./].*|header[./].*|name\d*|child_frame_id|velocity.*)", ""),
)  # fmt: skip
"""rostopic echo -p writes field.pose.position.x, PlotJuggler /topic/pose/position/x; joints are
position0, position1, ..."""

MOST_NUMBERS = 64
"""Longer arrays, as of images and point clouds, are left out."""


def renamed(cell: str, patterns: Headers) -> str:
    """The header with a unit for which one of a file stands."""
    for pattern, target in patterns:
        found = re.fullmatch(pattern, cell)
        if found:
            return target.format(*found.groups())
    return cell


@dataclass
class _Topic:
    """Messages of a topic: times of their headers, 0 without, and of the recorder [ns], numbers."""

    stamps: list[int] = field(default_factory=list)
    times: list[int] = field(default_factory=list)
    rows: list[dict[str, float]] = field(default_factory=list)
    joints: list[str] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)

    def clock(self) -> np.ndarray:
        """Times of the headers if these grow, else those of the recorder [ns]."""
        stamps = np.array(self.stamps, np.int64)
        return stamps if np.all(np.diff(stamps) > 0) else np.array(self.times, np.int64)


def read_bag(path: Path, _: str, facts: Facts) -> Log:
    """Reads numbers of all topics, or of some, at the times of the one that measures cables."""
    if find_spec("rosbags") is None:
        raise LogFileError(f"{path}: needs rosbags, which is not installed; {install_words('ros')}")
    topics = _topics(path)
    missing = [name for name in facts.topics or () if name not in topics]
    chosen = {n: t for n, t in topics.items() if t.rows and n in (facts.topics or topics)}
    if missing or not any(row for topic in chosen.values() for row in topic.rows):
        accepted = f"some of {', '.join(topics)[:200] or 'a bag with messages'}"
        raise refusal(f"{path}: topic", (missing or ["no numbers"])[0], accepted)
    headers = {
        name: {key: renamed(_header(name, key), ROS_COLUMNS) for row in topic.rows for key in row}
        for name, topic in chosen.items()
    }

    def weight(name: str) -> tuple[bool, int]:
        names = [f"A{k}" for k in range(MOST_CABLES)]
        columns = [read_header(header, names, 0) for header in headers[name].values()]
        cables = any(column is not None and column.kind in CABLE_QUANTITIES for column in columns)
        return cables, len(chosen[name].rows)

    first = max(chosen, key=weight)
    start = int(chosen[first].clock()[0])
    at = 1e-9 * (chosen[first].clock() - start)
    columns: list[tuple[str, Cells]] = [(SECONDS, at)]
    shown, left_out = [first], dict[str, str]()
    remarks = [f"times count from the first message of {first}, {start} ns"]
    for name, topic in chosen.items():
        keys = [key for key, header in headers[name].items() if header]
        table = np.array([[row.get(key, np.nan) for key in keys] for row in topic.rows])
        if name != first:
            time = 1e-9 * (topic.clock() - start)
            lonely = np.full((len(at), table.shape[1]), np.nan)
            table = interpolate_rows(time, table, at) if len(time) > 1 else lonely
            remarks.append(f"{name} is read between its messages, at the times of {first}")
        columns += [(headers[name][key], column) for key, column in zip(keys, table.T, strict=True)]
        shown += [f"{name}/{key}" for key in keys]
        left_out |= {f"{name}/{key}": fate for key, fate in topic.left_out.items()}
        left_out |= {f"{name}/{key}": "left out" for key, h in headers[name].items() if not h}
        joints = ", ".join(f"{k} is {joint}" for k, joint in enumerate(topic.joints))
        remarks += [f"joints of {name}: {joints}"] if joints else []
    left_out |= {name: "another topic" for name in topics if name not in chosen}
    return assemble(
        path, "rosbag", "it is a bag of ROS", columns, facts, shown=shown, remarks=remarks,
        left_out=left_out,
    )  # fmt: skip


def _topics(path: Path) -> dict[str, _Topic]:
    """Messages by topic."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    topics: dict[str, _Topic] = {}
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for connection, time, raw in reader.messages():
                message: Any = reader.deserialize(raw, connection.msgtype)
                topic = topics.setdefault(connection.topic, _Topic())
                stamp = getattr(getattr(message, "header", None), "stamp", None)
                topic.stamps.append(0 if stamp is None else 10**9 * stamp.sec + stamp.nanosec)
                topic.times.append(time)
                if "JointState" in connection.msgtype:
                    topic.joints = list(message.name)
                row: dict[str, float] = {}
                for key, value in _fields(message, ""):
                    if isinstance(value, str):
                        topic.left_out[key] = value
                    else:
                        row[key] = value
                topic.rows.append(row)
    except Exception as problem:  # the library raises of many kinds on damaged files
        raise unreadable(path, "a bag of ROS", problem) from problem
    return topics


def _fields(value: Any, key: str) -> Iterator[tuple[str, float | str]]:
    """Numbers of a message by field; for others, why they are left out."""
    if hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if not name.startswith("__") and (key or name != "header"):
                yield from _fields(getattr(value, name), f"{key}.{name}" if key else name)
    elif isinstance(value, np.ndarray | list):
        if len(value) > MOST_NUMBERS or key.endswith("covariance"):
            yield key, f"an array of {len(value)} numbers"
            return
        for k, each in enumerate(value):
            yield from _fields(each, f"{key}[{k}]")
    elif isinstance(value, str | bytes):
        yield key, WORDS
    else:
        yield key, float(value)


def _header(topic: str, key: str) -> str:
    """Header of a field; the data of std_msgs bear the topic's name."""
    if key == "data" or key.startswith("data["):
        return topic.strip("/").replace("/", "_") + key.removeprefix("data").strip("[]")
    return key


TRANSFORM = "foxglove.FrameTransform"
"""Schema of poses."""

Rows = dict[float, dict[str, Any]]


def read_mcap(path: Path, _: str, facts: Facts) -> Log:
    """Reads channels of flat objects of numbers in JSON, whose keys are headers, all of the same
    times: those of the key `time_s`, or of the messages. A file with transforms alone tells the
    platform's pose.

    Source: mcap.dev/spec.
    """
    if find_spec("mcap") is None:
        raise LogFileError(f"{path}: needs mcap, which is not installed; {install_words('mcap')}")
    channels, poses, other, encodings = _messages(path)
    chosen = channels or poses
    if not chosen and encodings & {"cdr", "ros1"}:
        return read_bag(path, "", facts)
    if not chosen:
        found = f"channels {', '.join(sorted(other))[:120]}" if other else "no messages"
        raise refusal(path, found, "messages in JSON")
    (first, rows), *rest = chosen.items()
    times = list(rows)
    for topic, others in rest:
        if list(others) != times:
            words = f"{len(others)} messages at other times than the {len(times)} of {first}"
            raise refusal(f"{path}: {topic}", words, "the same times")
    columns: list[tuple[str, Cells]] = [(SECONDS, np.array(times))]
    for each in chosen.values():
        for name in _keys(each):
            columns.append((name, np.array([each[t].get(name, np.nan) for t in times])))
    log = assemble(
        path, "mcap", "it begins with the magic bytes of MCAP", columns, facts,
        left_out=dict.fromkeys(sorted(other), "no numbers in JSON"),
    )  # fmt: skip
    words = f"Left out, no numbers in JSON: {', '.join(sorted(other))}."
    return log.with_remarks(words) if other else log


def _keys(rows: Rows) -> list[str]:
    """All keys of a channel, in the order of the first message that has them all, else as they
    come: what is not finite, or not known, is in no message."""
    known = dict.fromkeys(name for row in rows.values() for name in row)
    return list(next((row for row in rows.values() if len(row) == len(known)), known))


def _messages(path: Path) -> tuple[dict[str, Rows], dict[str, Rows], set[str], set[str]]:
    """Rows by time of channels of numbers, those of transforms, other channels, and encodings."""
    from mcap.reader import make_reader

    channels: dict[str, Rows] = {}
    poses: dict[str, Rows] = {}
    other, encodings = set[str](), set[str]()
    try:
        with path.open("rb") as stream:
            for schema, channel, message in make_reader(stream).iter_messages():
                encodings.add(channel.message_encoding)
                if channel.message_encoding != "json":
                    other.add(channel.topic)
                    continue
                content = load_json(message.data)
                time = 1e-9 * message.log_time
                if schema is not None and schema.name == TRANSFORM:
                    name = f"{channel.topic} of {content['child_frame_id']}"
                    poses.setdefault(name, {})[time] = _pose(content)
                elif isinstance(content, dict) and all(
                    value is None or type(value) in (int, float) for value in content.values()
                ):
                    row = {name: float(v) for name, v in content.items() if v is not None}
                    channels.setdefault(channel.topic, {})[row.pop(TIME_KEY, time)] = row
                else:
                    other.add(channel.topic)
    except Exception as problem:  # the library raises of many kinds on damaged files
        raise unreadable(path, "MCAP", problem) from problem
    return channels, poses, other, encodings


def _pose(content: dict[str, Any]) -> dict[str, Any]:
    p, q = content["translation"], content["rotation"]
    place = dict(zip(PARTS[POSITION], (p["x"], p["y"], p["z"]), strict=True))
    return place | dict(zip(PARTS[QUATERNION], (q["w"], q["x"], q["y"], q["z"]), strict=True))
