"""Logs that are no text: files of MATLAB, and MCAP with messages in JSON."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.logs.assembly import LEFT_OUT, Cells, assemble
from cdpr_drake.analyses.logs.columns import (
    COMMANDED,
    LENGTH,
    PARTS,
    POSITION,
    QUATERNION,
    RPY,
    SECONDS,
    SWIVEL,
    TENSION,
)
from cdpr_drake.analyses.logs.log import Facts, Log, refusal
from cdpr_drake.analyses.logs.ros import read_bag
from cdpr_drake.analyses.reporting.mcap_log import MAGIC, TIME_KEY
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError, install_words
from cdpr_drake.schema.json_text import load_json

MAT, MCAP = b"MATLAB 5.0 MAT-file", MAGIC

GRAB_VARIABLES = {
    "t": SECONDS, "epsilon": ",".join(PARTS[RPY]), "epsilon_r": "roll_deg,pitch_deg,yaw_deg",
    "cable_length": f"{{c}}_{LENGTH}", "swivel": f"{{c}}_{SWIVEL}", "tensions": f"{{c}}_{TENSION}",
    "target_tensions": f"{COMMANDED}{{c}}_{TENSION}",
}  # fmt: skip
"""Headers of the variables of GRAB's tools; with _r behind they are at 1 kHz, epsilon in degrees.

Source: github.com/fzoffoli/UACDPR_SelfCalibration, CdprViconDataHandling/CdprDataHandling.m and
CdprViconDataHandling.m, which makes radians of epsilon_r."""

_ROBOT = {"EndEffector", "Trasmission"}
"""Fields of their robots, as the files spell them."""


def read_mat(path: Path, _: str, facts: Facts) -> Log:
    """Reads a log of GRAB's tools, or the variables that a mapping names, as
    `st.tensions: "{c}_tension_n"` with {c} for the names of cables.
    """
    from scipy.io import loadmat

    try:
        content = loadmat(str(path), squeeze_me=True, struct_as_record=False)
    except Exception as problem:  # scipy raises of all kinds on damaged files
        words = " ".join(str(problem).split())[:160] or type(problem).__name__
        raise LogFileError(f"{path}: cannot be read as a file of MATLAB: {words}") from problem
    variables = dict(_flat("", {k: v for k, v in content.items() if not k.startswith("__")}))
    if {name.split(".")[1] for name in variables if "." in name} >= _ROBOT:
        raise refusal(path, "a robot of GRAB's tools", "logs; see cdpr import")
    wanted = _wanted(path, variables, facts)
    tables = {name: _table(path, name, variables[name]) for name in wanted}
    count = max(len(table) for table in tables.values())
    columns: dict[str, Cells] = {}
    for name, headers in wanted.items():
        table = tables[name]
        if len(table) != count:
            raise refusal(f"{path}: {name}", f"{len(table)} rows", f"{count}, as the others have")
        for header, column in zip(_spread(path, name, headers, table, facts), table.T, strict=True):
            if header in columns:
                raise refusal(f"{path}: {name}", f"{header} twice", "once")
            columns[header] = column
    columns = dict(sorted(columns.items(), key=lambda item: item[0] != SECONDS))
    rest = [name for name in variables if name not in wanted]
    by = "m, rad, N, s by the format"
    by += "; epsilon_r in deg" if any("roll_deg" in headers for headers in wanted.values()) else ""
    return assemble(
        path, "mat", f"it begins with {MAT.decode()}", list(columns.items()), facts,
        units={"variables": by if facts.mapping is None else "by the mapping"},
        remarks=[f"variables left out: {', '.join(rest)}"] if rest else [],
        left_out=dict.fromkeys(rest, LEFT_OUT),
    )  # fmt: skip


def _flat(prefix: str, content: dict[str, Any], depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Variables by name, those of structures by structure.name."""
    for name, value in content.items():
        names = getattr(value, "_fieldnames", None)
        if names is not None and depth < 8:
            inner = {key: getattr(value, key) for key in names}
            yield from _flat(f"{prefix}{name}.", inner, depth + 1)
        else:
            yield f"{prefix}{name}", value


def _wanted(path: Path, variables: dict[str, Any], facts: Facts) -> dict[str, list[str]]:
    """Headers of the variables that are read."""
    mapping = facts.mapping
    if mapping is not None and not isinstance(mapping, dict):
        raise refusal(f"{path}: mapping: columns", "a list", "variable: header")
    if mapping is None:
        last = {name: name.rpartition(".")[2] for name in variables}
        known = {
            name: GRAB_VARIABLES.get(word) or GRAB_VARIABLES.get(word.removesuffix("_r"))
            for name, word in last.items()
        }
        mapping = {name: headers for name, headers in known.items() if headers}
        mapping = mapping if len(mapping) > 1 else {}
    missing = [name for name in mapping if name not in variables]
    wanted = {name: headers for name, headers in mapping.items() if headers}
    if missing or not wanted:
        first = (
            f"mapping: columns: found {missing[0]!r}; variables are " if missing else "found the "
        )
        first += "" if missing else "variables "
        raise LogFileError(
            f"{path}: {first}{', '.join(variables)[:120] or 'none'}; accepted: "
            f"{', '.join(GRAB_VARIABLES)}, or a mapping that says what they are"
        )
    return {n: [word.strip() for word in headers.split(",")] for n, headers in wanted.items()}


def _table(path: Path, name: str, value: Any) -> Array:
    """A variable with a row an instant, shape (k, n): MATLAB's have a row a cable here."""
    try:
        table = np.atleast_1d(np.asarray(value, float))
    except (TypeError, ValueError) as problem:
        raise LogFileError(f"{path}: {name}: found what are no numbers") from problem
    if table.ndim == 1:
        return table[:, None]
    if table.ndim != 2:
        raise refusal(f"{path}: {name}", f"shape {table.shape}", "rows and columns")
    return table.T if table.shape[0] < table.shape[1] else table


def _spread(path: Path, name: str, headers: list[str], table: Array, facts: Facts) -> list[str]:
    """A header for each column of a variable."""
    width = table.shape[1]
    if len(headers) == 1 and "{c}" in headers[0]:
        return [headers[0].replace("{c}", cable) for cable in facts.names(path, width)]
    if len(headers) != width:
        raise refusal(
            f"{path}: {name}", f"{width} columns", f"{len(headers)}: {', '.join(headers)}"
        )
    return headers


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
            raise LogFileError(
                f"{path}: {topic}: found {len(others)} messages at other times than the "
                f"{len(times)} of {first}; accepted: the same times"
            )
    columns: list[tuple[str, Cells]] = [(SECONDS, np.array(times))]
    for each in chosen.values():
        for name in _keys(each):
            columns.append((name, np.array([each[t].get(name, np.nan) for t in times])))
    log = assemble(
        path, "mcap", "it begins with the magic bytes of MCAP", columns, facts,
        left_out=dict.fromkeys(sorted(other), "no numbers in JSON"),
    )  # fmt: skip
    remarks = [f"Left out, no numbers in JSON: {', '.join(sorted(other))}."] if other else []
    return replace(log, remarks=(*log.remarks, *remarks))


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
                elif isinstance(content, dict) and all(map(_is_json_number, content.values())):
                    row = {name: float(v) for name, v in content.items() if v is not None}
                    channels.setdefault(channel.topic, {})[row.pop(TIME_KEY, time)] = row
                else:
                    other.add(channel.topic)
    except Exception as problem:  # the library raises of many kinds on damaged files
        words = " ".join(str(problem).split())[:160] or type(problem).__name__
        raise LogFileError(f"{path}: cannot be read as MCAP: {words}") from problem
    return channels, poses, other, encodings


def _is_json_number(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _pose(content: dict[str, Any]) -> dict[str, Any]:
    p, q = content["translation"], content["rotation"]
    place = dict(zip(PARTS[POSITION], (p["x"], p["y"], p["z"]), strict=True))
    return place | dict(zip(PARTS[QUATERNION], (q["w"], q["x"], q["y"], q["z"]), strict=True))
