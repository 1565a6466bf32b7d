"""Logs in MCAP with messages in JSON, as `--log-format mcap` leaves them.

Each channel but that of transforms is flat objects of numbers; their keys are headers of columns,
known as those of text are. Rows of all channels are of the same times, those of the key `time_s`,
or else of the messages. A file with transforms alone tells the platform's pose.

Source: mcap.dev/spec.
"""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.logs.column_log import columns_of_text
from cdpr_drake.analyses.logs.log_request import LogRequest
from cdpr_drake.analyses.logs.recorded_log import POSITION, QUATERNION, TIME, RecordedLog
from cdpr_drake.analyses.logs.text_tables import MOST_BYTES
from cdpr_drake.analyses.reporting.mcap_log import MAGIC, TIME_KEY
from cdpr_drake.errors import LogFileError, install_words
from cdpr_drake.schema.json_text import load_json

TRANSFORM = "foxglove.FrameTransform"
"""Schema of poses."""


def knows_mcap(raw: bytes) -> str:
    """Why a file is one of these; empty where it is not."""
    return "it begins with the magic bytes of MCAP" if raw.startswith(MAGIC) else ""


def read_mcap(path: Path, asked: LogRequest) -> RecordedLog:
    """Reads a log.

    Raises:
        LogFileError: It cannot be read, has no messages in JSON, or channels of other times.
    """
    if find_spec("mcap") is None:
        raise LogFileError(f"{path}: needs mcap, which is not installed; {install_words('mcap')}")
    if path.stat().st_size > MOST_BYTES:
        raise LogFileError(f"{path}: found more than {MOST_BYTES:,} bytes; accepted: fewer")
    channels, poses, other = _messages(path)
    chosen = channels or poses
    if not chosen:
        found = f"channels {', '.join(sorted(other))[:120]}" if other else "no messages"
        raise LogFileError(f"{path}: found {found}; accepted: messages in JSON")
    (first, rows), *rest = chosen.items()
    times = list(rows)
    for topic, others in rest:
        if list(others) != times:
            raise LogFileError(
                f"{path}: {topic}: found {len(others)} messages at other times than the "
                f"{len(times)} of {first}; accepted: the same times"
            )
    headers = {topic: _keys(each) for topic, each in chosen.items()}
    lines = [",".join([TIME, *(name for names in headers.values() for name in names)])]
    for t in times:
        cells = [repr(t)]
        for topic, names in headers.items():
            row = [chosen[topic][t].get(name) for name in names]
            cells += ["" if value is None else repr(float(value)) for value in row]
        lines.append(",".join(cells))
    log = columns_of_text(path, "\n".join(lines) + "\n", asked)
    remarks = log.remarks
    if other:
        remarks = (*remarks, f"Left out, no numbers in JSON: {', '.join(sorted(other))}.")
    return replace(log, format="mcap", why=knows_mcap(MAGIC), remarks=remarks)


_Rows = dict[float, dict[str, Any]]


def _keys(rows: _Rows) -> list[str]:
    """All keys of a channel, in the order of the first message that has them all, else as they
    come: what is not finite, or not known, is in no message."""
    known = dict.fromkeys(name for row in rows.values() for name in row)
    whole = next((row for row in rows.values() if len(row) == len(known)), known)
    return list(whole)


def _messages(path: Path) -> tuple[dict[str, _Rows], dict[str, _Rows], set[str]]:
    """Rows by time of channels of numbers, those of transforms, and channels of something else."""
    from mcap.reader import make_reader

    channels: dict[str, _Rows] = {}
    poses: dict[str, _Rows] = {}
    other: set[str] = set()
    try:
        with path.open("rb") as stream:
            for schema, channel, message in make_reader(stream).iter_messages():
                if channel.message_encoding != "json":
                    other.add(channel.topic)
                    continue
                told = load_json(message.data)
                time = 1e-9 * message.log_time
                if schema is not None and schema.name == TRANSFORM:
                    name = f"{channel.topic} of {told['child_frame_id']}"
                    poses.setdefault(name, {})[time] = _pose(told)
                elif isinstance(told, dict) and all(map(_is_number, told.values())):
                    time = float(told.pop(TIME_KEY, time))
                    channels.setdefault(channel.topic, {})[time] = told
                else:
                    other.add(channel.topic)
    except Exception as problem:  # the library raises of many kinds on damaged files
        words = " ".join(str(problem).split())[:160] or type(problem).__name__
        raise LogFileError(f"{path}: cannot be read as MCAP: {words}") from problem
    return channels, poses, other


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _pose(told: dict[str, Any]) -> dict[str, Any]:
    p, q = told["translation"], told["rotation"]
    place = dict(zip(POSITION, (p["x"], p["y"], p["z"]), strict=True))
    return place | dict(zip(QUATERNION, (q["w"], q["x"], q["y"], q["z"]), strict=True))
