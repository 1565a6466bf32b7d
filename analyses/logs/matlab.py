"""Logs in files of MATLAB."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.logs.assembly import LEFT_OUT, Cells, assemble
from cdpr_drake.analyses.logs.columns import (
    COMMANDED,
    LENGTH,
    PARTS,
    RPY,
    SECONDS,
    SWIVEL,
    TENSION,
)
from cdpr_drake.analyses.logs.log import Facts, Log, refusal, unreadable
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError

MAT = b"MATLAB 5.0 MAT-file"

GRAB_VARIABLES = {
    "t": SECONDS, "epsilon": ",".join(PARTS[RPY]), "epsilon_r": "roll_deg,pitch_deg,yaw_deg",
    "cable_length": f"{{c}}_{LENGTH}", "swivel": f"{{c}}_{SWIVEL}", "tensions": f"{{c}}_{TENSION}",
    "target_tensions": f"{COMMANDED}{{c}}_{TENSION}",
}  # fmt: skip
"""Headers of the variables of GRAB's tools; with _r behind they are at 1 kHz, epsilon in degrees.

Source: github.com/fzoffoli/UACDPR_SelfCalibration, CdprViconDataHandling/CdprDataHandling.m and
CdprViconDataHandling.m, which makes radians of epsilon_r."""


def read_mat(path: Path, _: str, facts: Facts) -> Log:
    """Reads a log of GRAB's tools, or the variables that a mapping names, as
    `st.tensions: "{c}_tension_n"` with {c} for the names of cables.
    """
    from scipy.io import loadmat

    try:
        content = loadmat(str(path), squeeze_me=True, struct_as_record=False)
    except Exception as problem:  # scipy raises of all kinds on damaged files
        raise unreadable(path, "a file of MATLAB", problem) from problem
    variables = dict(_flat("", {k: v for k, v in content.items() if not k.startswith("__")}))
    fields = {name.split(".")[1] for name in variables if "." in name}
    if fields >= {"EndEffector", "Trasmission"}:  # as their files spell them
        raise refusal(path, "a robot of GRAB's tools", "logs; see cdpr import")
    wanted = _wanted(path, variables, facts)
    tables = {name: _table(path, name, variables[name]) for name in wanted}
    count = max(len(table) for table in tables.values())
    columns: dict[str, Cells] = {}
    for name, headers in wanted.items():
        table, width = tables[name], tables[name].shape[1]
        if len(table) != count:
            raise refusal(f"{path}: {name}", f"{len(table)} rows", f"{count}, as the others have")
        if len(headers) == 1 and "{c}" in headers[0]:
            headers = [headers[0].replace("{c}", cable) for cable in facts.names(path, width)]
        if len(headers) != width:
            words = f"{len(headers)}: {', '.join(headers)}"
            raise refusal(f"{path}: {name}", f"{width} columns", words)
        for header, column in zip(headers, table.T, strict=True):
            if header in columns:
                raise refusal(f"{path}: {name}", f"{header} twice", "once")
            columns[header] = column
    columns = dict(sorted(columns.items(), key=lambda item: item[0] != SECONDS))
    rest = [name for name in variables if name not in wanted]
    by = "m, rad, N, s by the format"
    by += "; epsilon_r in deg" if any("roll_deg" in headers for headers in wanted.values()) else ""
    return assemble(
        path, list(columns.items()), facts,
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
        known = {n: GRAB_VARIABLES.get(w, GRAB_VARIABLES.get(w.removesuffix("_r"), ""))
                 for n, w in last.items()}  # fmt: skip
        mapping = known if len(list(filter(None, known.values()))) > 1 else {}
    missing = [name for name in mapping if name not in variables]
    wanted = {name: headers for name, headers in mapping.items() if headers}
    if missing or not wanted:
        place = f"{path}: mapping: columns" if missing else path
        words = f"{missing[0]!r}; variables are" if missing else "the variables"
        accepted = f"{', '.join(GRAB_VARIABLES)}, or a mapping that says what they are"
        raise refusal(place, f"{words} {', '.join(variables)[:120] or 'none'}", accepted)
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
