"""Text and bags of ROS 1 and 2: .bag, .db3, .mcap with CDR, or the folder of one; MCAP with JSON.

Fields of messages are columns, named and understood as `rostopic echo -p` writes them; the one
field of a std_msgs message bears its topic's name, such as /cable_1/length.

Source: docs.ros.org, sensor_msgs, geometry_msgs, std_msgs; ternaris.gitlab.io/rosbags.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.logs.assembly import LEFT_OUT, WORDS, Values, assemble
from cdpr_drake.analyses.logs.clocks import interpolate_poses
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

TRANSFORM = "foxglove.FrameTransform"
"""Schema of poses in MCAP with JSON."""


def renamed(cell: str, patterns: Headers) -> str:
    """The header with a unit for which one of a file stands."""
    for pattern, target in patterns:
        found = re.fullmatch(pattern, cell)
        if found:
            return target.format(*found.groups())
    return cell


@dataclass
class _Topic:
    """Messages of a topic: numbers by field, and times of their headers, 0 without, and of the
    recorder, in ns, or in s of JSON."""

    stamps: list[float] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    rows: list[dict[str, float]] = field(default_factory=list)
    joints: list[str] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)

    def clock(self) -> np.ndarray:
        """Times of the headers if these grow, else those of the recorder."""
        stamps = np.array(self.stamps)
        return stamps if np.all(np.diff(stamps) > 0) else np.array(self.times)

    def fields(self) -> list[str]:
        """Fields, in the order of the longest message: what is not finite is in none of JSON."""
        longest = max(self.rows, key=len)
        return list(dict.fromkeys([*longest, *(key for row in self.rows for key in row)]))


def _need(path: Path, package: str, extra: str) -> None:
    if find_spec(package) is None:
        words = f"needs {package}, which is not installed; {install_words(extra)}"
        raise LogFileError(f"{path}: {words}")


def read_bag(path: Path, _: str, facts: Facts) -> Log:
    """Reads numbers of all topics, or of some, at the times of the one that measures cables."""
    _need(path, "rosbags", "ros")
    log = _joined(path, _bag_topics(path), facts, bag=True)
    return replace(log, dialect="rosbag", why="it is a bag of ROS")


def _joined(
    path: Path, topics: dict[str, _Topic], facts: Facts, bag: bool, other: Collection[str] = ()
) -> Log:
    """One log of topics; fields of JSON are headers themselves, others have that of their topic."""
    missing = [name for name in facts.topics or () if name not in topics]
    chosen = {n: t for n, t in topics.items() if t.rows and n in (facts.topics or topics)}
    if missing or not any(row for topic in chosen.values() for row in topic.rows):
        accepted = f"some of {', '.join(topics)[:200] or 'a bag with messages'}"
        raise refusal(f"{path}: topic", (missing or ["no numbers"])[0], accepted)
    headers = {
        name: {key: _header(name, key) if bag else key for key in topic.fields()}
        for name, topic in chosen.items()
    }

    def weight(name: str) -> tuple[bool, int]:
        names = [f"A{k}" for k in range(MOST_CABLES)]
        columns = [read_header(header, names, 0) for header in headers[name].values()]
        cables = any(column is not None and column.kind in CABLE_QUANTITIES for column in columns)
        return cables, len(chosen[name].rows)

    first = max(chosen, key=weight)
    start, scale = (int(chosen[first].clock()[0]), 1e-9) if bag else (0, 1.0)
    at = scale * (chosen[first].clock() - start)
    columns: list[tuple[str, Values]] = [(SECONDS, at)]
    shown, left_out = [first if bag else SECONDS], dict[str, str]()
    remarks = [f"times count from the first message of {first}, {start} ns"] if bag else []
    for name, topic in chosen.items():
        keys = [key for key, header in headers[name].items() if header]
        table = np.array([[row.get(key, np.nan) for key in keys] for row in topic.rows])
        time = scale * (topic.clock() - start)
        if not np.array_equal(time, at):
            table = interpolate_poses(time, table, [headers[name][key] for key in keys], at)
            remarks.append(f"{name} is read between its messages, at the times of {first}")
        columns += [(headers[name][key], column) for key, column in zip(keys, table.T, strict=True)]
        shown += [f"{name}/{key}" if bag else key for key in keys]
        left_out |= {f"{name}/{key}": fate for key, fate in topic.left_out.items()}
        left_out |= {f"{name}/{key}": LEFT_OUT for key, h in headers[name].items() if not h}
        joints = ", ".join(f"{k} is {joint}" for k, joint in enumerate(topic.joints))
        remarks += [f"joints of {name}: {joints}"] if joints else []
    left_out |= {name: "another topic" for name in topics if name not in chosen}
    left_out |= dict.fromkeys(sorted(other), "no numbers in JSON")
    remarks += [f"left out, no numbers in JSON: {', '.join(sorted(other))}"] if other else []
    return assemble(path, columns, facts, shown=shown, remarks=remarks, left_out=left_out)


def _bag_topics(path: Path) -> dict[str, _Topic]:
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
                values = dict(_fields(message, ""))
                topic.rows.append({k: v for k, v in values.items() if not isinstance(v, str)})
                topic.left_out |= {k: v for k, v in values.items() if isinstance(v, str)}
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
    else:
        yield key, WORDS if isinstance(value, str | bytes) else float(value)


def _header(topic: str, key: str) -> str:
    """Header of a field; the data of std_msgs bear the topic's name."""
    if re.fullmatch(r"data(\[.*)?", key):
        key = topic.strip("/").replace("/", "_") + key.removeprefix("data").strip("[]")
    return renamed(key, ROS_COLUMNS)


def read_mcap(path: Path, _: str, facts: Facts) -> Log:
    """Reads channels of flat objects of numbers in JSON, whose keys are headers, at the key
    `time_s` or the times of messages; of transforms, if there are no others, the platform's pose.

    Source: mcap.dev/spec.
    """
    _need(path, "mcap", "mcap")
    from mcap.reader import make_reader

    topics: dict[str, _Topic] = {}
    transforms, other, encodings = set[str](), set[str](), set[str]()
    try:
        with path.open("rb") as stream:
            for schema, channel, message in make_reader(stream).iter_messages():
                encodings.add(channel.message_encoding)
                json = channel.message_encoding == "json"
                content: Any = load_json(message.data) if json else None
                name = channel.topic
                if json and schema is not None and schema.name == TRANSFORM:
                    name = f"{name} of {content['child_frame_id']}"
                    transforms.add(name)
                    content = _pose(content)
                if not isinstance(content, dict) or any(
                    value is not None and type(value) not in (int, float)
                    for value in content.values()
                ):
                    other.add(name)
                    continue
                row = {key: float(value) for key, value in content.items() if value is not None}
                topic = topics.setdefault(name, _Topic())
                topic.times.append(1e-9 * message.log_time)
                topic.stamps.append(row.pop(TIME_KEY, topic.times[-1]))
                topic.rows.append(row)
    except Exception as problem:  # the library raises of many kinds on damaged files
        raise unreadable(path, "MCAP", problem) from problem
    if not topics and encodings & {"cdr", "ros1"}:
        return read_bag(path, "", facts)
    if not topics:
        channels = f"channels {', '.join(sorted(other))[:120]}" if other else "no messages"
        raise refusal(path, channels, "messages in JSON")
    if facts.topics is None and set(topics) > transforms:
        facts = replace(facts, topics=tuple(name for name in topics if name not in transforms))
    return _joined(path, topics, facts, False, other)


def _pose(content: dict[str, Any]) -> dict[str, Any]:
    p, q = content["translation"], content["rotation"]
    place = dict(zip(PARTS[POSITION], (p["x"], p["y"], p["z"]), strict=True))
    return place | dict(zip(PARTS[QUATERNION], (q["w"], q["x"], q["y"], q["z"]), strict=True))
