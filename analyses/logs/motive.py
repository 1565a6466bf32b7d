"""OptiTrack Motive's CSV: rigid bodies and markers over time.

Above the rows stand a line of settings in pairs, and lines of types, names, identities and what
each column is. Quaternions have their real part last. If the settings name no `Length Units`, as in
format version 1.1, the user has to.

Source: OptiTrack, Data Export: CSV, docs.optitrack.com/motive/data-export/data-export-csv.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.logs.assembly import (
    LEFT_OUT,
    Cells,
    assemble,
    numbers,
    read_cells,
    refuse_other_lengths,
)
from cdpr_drake.analyses.logs.columns import PARTS, QUATERNION, SECONDS
from cdpr_drake.analyses.logs.log import AS_TOLD, Facts, Log, refusal
from cdpr_drake.errors import LogFileError, accepted_names

FIRST, BODY, MARKER = "Format Version", "Rigid Body", "Marker"
_UNITS = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}

_MOST_HEAD = 12
"""Lines above the rows; there are seven or eight."""

_POSITION = tuple(f"Position {axis}" for axis in "XYZ")
_PARTS = {
    BODY: (*_POSITION, *(f"Rotation {axis}" for axis in "XYZW")), MARKER: _POSITION,
    "Rigid Body Marker": _POSITION,
}  # fmt: skip
"""Columns of a body or marker, by its type."""

Groups = dict[tuple[str, str], dict[str, int]]
"""Columns by type and name, and there by part and axis."""


def knows_motive(head: str) -> str:
    """Recognises the first cell."""
    return f"its first cell is {FIRST!r}" if head.startswith(f"{FIRST},") else ""


def read_motive(path: Path, text: str, facts: Facts) -> Log:
    """Reads poses of the platform's rigid body, and markers that belong to no body."""
    lines = text.split("\n")
    place = next((k for k, line in enumerate(lines[:_MOST_HEAD]) if line.startswith("Frame,")), -1)
    if place < 0:
        raise refusal(path, "no line that begins with Frame", "one above rows")
    pairs, *above, axes = (
        [cell.strip().strip('"') for cell in line.split(",")] for line in lines[: place + 1]
    )
    head = [(row + [""] * len(axes))[: len(axes)] for row in above if any(row)]
    types = next((row for row in head if any(BODY in c or c == MARKER for c in row)), None)
    parts = next((row for row in head if "Position" in row), None)
    if types is None or parts is None:
        raise refusal(path, "no types or no Position above the rows", "both")
    settings = dict(zip(pairs[::2], pairs[1::2], strict=False))
    if settings.get("Rotation Type", "Quaternion") != "Quaternion":
        raise refusal(f"{path}: Rotation Type", settings["Rotation Type"], "Quaternion")
    names = head[min(head.index(types) + 1, len(head) - 1)]
    cells = read_cells(path, text, ",", skip=place + 1)
    if len(cells.rows[0]) != len(axes):
        raise refusal(f"{path}:{cells.lines[0]}", f"{len(cells.rows[0])} cells", len(axes))
    unit, words = _unit(path, settings, facts)
    groups = _groups(path, types, names, [f"{p} {a}" for p, a in zip(parts, axes, strict=True)])
    body = _platform(path, groups, cells, facts)
    wanted = {SECONDS: 1}
    if body:
        part = groups[BODY, body]
        wanted |= {f"{axis.lower()}_{unit}": part[f"Position {axis}"] for axis in "XYZ"}
        wanted |= {f"q{axis.lower()}": part[f"Rotation {axis}"] for axis in "WXYZ"}
    for (kind, name), part in groups.items():
        if kind == MARKER and _rows_with(cells, part):
            stem = "marker_" + re.sub(r"\W+", "_", name).strip("_")
            wanted |= {f"{stem}_{a.lower()}_{unit}": part[f"Position {a}"] for a in "XYZ"}
    columns = {header: [row[j] for row in cells.rows] for header, j in wanted.items()}
    if body:
        q = np.column_stack([numbers(columns[name])[0] for name in PARTS[QUATERNION]])
        refuse_other_lengths(path, q, cells.lines)
    shown = [" ".join(filter(None, (names[j], parts[j], axes[j]))) for j in range(len(axes))]
    return assemble(
        path, list(columns.items()), facts, lines=cells.lines,
        shown=[shown[j] for j in wanted.values()], units={"positions": words},
        remarks=_remarks(groups, body),
        left_out={shown[j]: LEFT_OUT for j in range(len(axes)) if j not in wanted.values()},
    )  # fmt: skip


def _unit(path: Path, settings: dict[str, str], facts: Facts) -> tuple[str, str]:
    """Unit of lengths, and who said so."""
    named, told = settings.get("Length Units", ""), facts.units.get("length")
    known = _UNITS.get(named.lower())
    if known and told not in (None, known):
        raise refusal(f"{path}: Length Units", f"{named}, and {told} with unit", "one of them")
    if known:
        return known, f"{named.lower()} by the file's Length Units"
    if told:
        return told, f"{told}, {AS_TOLD}"
    accepted = f"{accepted_names(named, _UNITS)}, or use unit length=m, mm or cm"
    raise LogFileError(f"{path}: Length Units: found {named or 'none'}; {accepted}")


def _groups(path: Path, types: list[str], names: list[str], parts: list[str]) -> Groups:
    """Columns of each body and marker."""
    groups: Groups = {}
    for j, (kind, name, part) in enumerate(zip(types, names, parts, strict=True)):
        if j > 1 and part in _PARTS.get(kind, ()):
            groups.setdefault((kind, name), {}).setdefault(part, j)
    for (kind, name), present in groups.items():
        missing = [part for part in _PARTS[kind] if part not in present]
        if missing:
            words = f"no column {', '.join(missing)}"
            raise refusal(f"{path}: {kind} {name!r}", words, ", ".join(_PARTS[kind]))
    return groups


def _rows_with(cells: Cells, part: dict[str, int]) -> int:
    """Number of rows in which a body or marker was seen."""
    return sum(bool(row[part[_POSITION[0]]]) for row in cells.rows)


def _platform(path: Path, groups: Groups, cells: Cells, facts: Facts) -> str:
    """Name of the rigid body that is the platform; empty where there are markers alone."""
    bodies = {name: _rows_with(cells, part)
              for (kind, name), part in groups.items() if kind == BODY}  # fmt: skip
    words = ", ".join(f"{name!r} ({count} rows)" for name, count in bodies.items())
    if facts.body is not None:
        if facts.body not in bodies:
            raise refusal(f"{path}: body", f"{facts.body!r}", words or "none")
        return facts.body
    visible = [name for name, count in bodies.items() if count]
    if len(visible) > 1:
        raise refusal(f"{path}: body", words, "one of them; use body")
    if not visible and not any(kind == MARKER for kind, _ in groups):
        raise refusal(path, "no rigid body and no marker", "one at least")
    return visible[0] if visible else ""


def _remarks(groups: Groups, body: str) -> list[str]:
    remarks = [f"the platform is the rigid body {body!r}"] if body else [
        "no rigid body: markers only"
    ]  # fmt: skip
    parts = sum(1 for kind, _ in groups if kind == "Rigid Body Marker")
    others = ", ".join(name for kind, name in groups if kind == BODY and name != body)
    remarks += [f"{parts} markers that make up rigid bodies were left out"] if parts else []
    return remarks + ([f"other rigid bodies were left out: {others}"] if others else [])
