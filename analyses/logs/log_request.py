"""What a user says of a log beside the file: names, units, axes, rates, what columns are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.calibration.columns import UNITS
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError, accepted_names, why_not_read
from cdpr_drake.schema.input_files import file_size
from cdpr_drake.schema.yaml_files import load_yaml

DIMENSIONS = tuple(sorted({dimension for dimension, _ in UNITS.values()}))
"""Of what a unit may be told."""

SI_OF = {"length": "m", "angle": "rad", "force": "N", "time": "s", "torque": "N m", "image": "px"}

MAPPING_KEYS = ("columns", "skip_rows", "separator", "rate_hz")

MOST_MAPPING = 1_000_000
"""Bytes of a mapping file."""


TOLD = "as told"
"""Ends what is said of times that were counted by a given rate."""


@dataclass(frozen=True)
class ColumnMapping:
    """What the columns of a file are, for files that do not say so themselves.

    Attributes:
        path: The file that says so.
        headers: Header of each column in order, empty for those that are left out; or by the
            names that the file has.
        skip_rows: Lines at the top that are no rows.
        separator: Between cells; None: told by the first row.
        rate: Rows per second, for files without times [1/s]; None.
    """

    path: Path
    headers: tuple[str, ...] | dict[str, str]
    skip_rows: int = 0
    separator: str | None = None
    rate: float | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class LogRequest:
    """What a user says of a log.

    Attributes:
        cables: Names of the cables in the order of the log; None: the file's, or C1, C2, ...
        units: By dimension, `length` and the like, for what the file does not say.
        mapping: What its columns are; None.
        body: Rigid body of a tracker that is the platform; None: the only one.
        rate: Rows per second, for files without times [1/s]; None.
        R_WF: Axes of the file's frame F in W, shape (3, 3); None: the same.
    """

    cables: tuple[str, ...] | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    mapping: ColumnMapping | None = None
    body: str | None = None
    rate: float | None = None
    R_WF: Array | None = None

    def names(self, path: Path, count: int, default: Sequence[str] | None = None) -> list[str]:
        """Names of as many cables as a file has.

        Raises:
            LogFileError: Another number of names was given.
        """
        if self.cables is None:
            return list(default) if default else ["C" + str(k + 1) for k in range(count)]
        if len(self.cables) != count:
            raise LogFileError(
                f"{path}: cables: found {count} in the log and {len(self.cables)} names "
                f"({', '.join(self.cables)[:80]}); accepted: a name for each"
            )
        return list(self.cables)

    def factor(self, dimension: str) -> float | None:
        """By which numbers of a dimension become SI; None where nothing was said of it."""
        unit = self.units.get(dimension)
        return None if unit is None else UNITS[unit][1]


def checked_units(units: Mapping[str, str]) -> dict[str, str]:
    """Units by dimension, as they were told.

    Raises:
        LogFileError: There is no such dimension, or the unit is of another one.
    """
    found = {}
    for dimension, unit in units.items():
        known = [name for name, (of, _) in UNITS.items() if of == dimension]
        if not known:
            raise LogFileError(
                f"unit: found {dimension!r}; {accepted_names(dimension, DIMENSIONS)}"
            )
        if unit.lower() not in known:
            raise LogFileError(
                f"unit of {dimension}: found {unit!r}; {accepted_names(unit, known)}"
            )
        found[dimension] = unit.lower()
    return found


def axes_rotation(words: str) -> Array:
    """R_WF from which axes of the file x, y and z of W are, as `z,x,y` or `-z,-x,y`.

    Raises:
        LogFileError: They are not three different axes, or would mirror the motion.
    """
    R = np.zeros((3, 3))
    parts = [part.strip().lower() for part in words.split(",")]
    for row, part in enumerate(parts[:3]):
        name = part.lstrip("+-")
        if name in ("x", "y", "z"):
            R[row, "xyz".index(name)] = -1.0 if part.startswith("-") else 1.0
    if len(parts) != 3 or not np.isclose(np.linalg.det(R), 1.0):
        raise LogFileError(
            f"axes: found {words!r}; accepted: the axes of the file that are x, y and z of W, "
            "right-handed, as z,x,y or x,-z,y"
        )
    return R


def read_mapping(path: Path) -> ColumnMapping:
    """Reads what columns are: YAML with `columns`, and `skip_rows`, `separator`, `rate_hz`.

    Raises:
        LogFileError: It cannot be read, or says something else.
    """
    try:
        if file_size(path) > MOST_MAPPING:
            raise LogFileError(f"{path}: found more than {MOST_MAPPING:,} bytes; accepted: fewer")
        content = load_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        words = " ".join(why_not_read(problem).split())
        raise LogFileError(f"{path}: cannot be read: {words[:200]}") from problem
    if not isinstance(content, dict) or "columns" not in content:
        raise LogFileError(f"{path}: found no columns; accepted: YAML with the key columns")
    other = [str(key) for key in content if key not in MAPPING_KEYS]
    if other:
        raise LogFileError(f"{path}: found {other[0]!r}; {accepted_names(other[0], MAPPING_KEYS)}")
    skip, mark, rate = (content.get(key) for key in ("skip_rows", "separator", "rate_hz"))
    if skip is not None and (isinstance(skip, bool) or not isinstance(skip, int) or skip < 0):
        raise LogFileError(f"{path}: skip_rows: found {skip!r}; accepted: a whole number from 0")
    if mark is not None and (not isinstance(mark, str) or len(mark) != 1 or mark in '"\n\r.'):
        raise LogFileError(f"{path}: separator: found {mark!r}; accepted: one sign, as ';'")
    if rate is not None and not is_rate(rate):
        raise LogFileError(f"{path}: rate_hz: found {rate!r}; accepted: a number above 0")
    return ColumnMapping(path, _headers(path, content["columns"]), skip or 0, mark, rate)


def is_rate(value: Any) -> bool:
    """Whether it is a finite number above 0 [1/s]."""
    kind = isinstance(value, (int, float)) and not isinstance(value, bool)
    return bool(kind and np.isfinite(value) and value > 0.0)


def _headers(path: Path, columns: Any) -> tuple[str, ...] | dict[str, str]:
    accepted = "a list of headers with their units, as [time_s, C1_length_mm, ''], or name: header"
    if isinstance(columns, list) and columns:
        if all(isinstance(header, str) or header is None for header in columns):
            return tuple(header or "" for header in columns)
    elif isinstance(columns, dict) and all(
        isinstance(h, str) or h is None for pair in columns.items() for h in pair
    ):
        return {str(name): header or "" for name, header in columns.items()}
    raise LogFileError(f"{path}: columns: found {str(columns)[:80]}; accepted: {accepted}")


def even_times(path: Path, count: int, rate: float | None) -> Array:
    """Times of rows that were recorded at one rate, shape (k,) [s].

    Raises:
        LogFileError: The rate is not known, or not above 0.
    """
    if rate is None:
        raise LogFileError(
            f"{path}: time: found no column of times; accepted: one, or --rate [1/s]"
        )
    if not is_rate(rate):
        raise LogFileError(f"{path}: rate: found {rate!r}; accepted: above 0 [1/s]")
    return np.asarray(np.arange(count) / rate, float)
