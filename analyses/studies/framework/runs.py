"""Runs of a study: rows of named columns, which are picked, counted and written.

A row is what one measurement gave. Its key columns describe its case, its measured columns hold
numbers, words, truth values, None, lists, tables of names, and arrays. A column of numbers with a
unit ends with it, in SI: `distance_m`, `peak_rad`, `tension_n`.
"""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdpr_drake.analyses.reporting.log_files import write_whole
from cdpr_drake.arrays import Array
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.typed_yaml import closest

UNITS = {
    "m": "m", "m2": "m^2", "m3": "m^3", "rad": "rad", "deg": "deg", "px": "px", "s": "s", "n": "N",
    "n_m": "N m", "n2": "N^2", "m_s": "m/s", "rad_s": "rad/s", "m_s2": "m/s^2", "kg": "kg",
    "hz": "Hz", "us": "us", "percent": "%",
}  # fmt: skip
"""Units by what names of columns end with."""

Row = Mapping[str, Any]
"""What a measurement gives, by the names of columns."""


class MissingRuns(Exception):
    """Runs that were planned and are not there yet, or not in the quick form."""


class UnknownName(LookupError):
    """A column, or a value of a key column, that is in no plan of the study: a misspelling."""


@dataclass(frozen=True)
class Run:
    """One row.

    Attributes:
        case: Name of its case.
        seed: Its seed; None in a study without.
        keys: What describes its case.
        measured: What was measured.
        printed: By column what the source prints, in its words.
    """

    case: str
    seed: int | None
    keys: Mapping[str, Any]
    measured: Row
    printed: Mapping[str, str] = field(default_factory=dict)

    def __getitem__(self, column: str) -> Any:
        """A value.

        Raises:
            UnknownName: It has no such column.
        """
        for values in (self.measured, self.keys):
            if column in values:
                return values[column]
        if column == "seed" and self.seed is not None:
            return self.seed
        raise UnknownName(f"column {column!r} is unknown; {closest(column, self.columns())}")

    def has_column(self, column: str) -> bool:
        """Whether it has a column, without a list of all: picking asks this of every row."""
        if column in self.keys or column in self.measured.keys():  # noqa: SIM118 - as `columns` has it
            return True
        return column == "seed" and self.seed is not None

    def columns(self) -> list[str]:
        """Names of its columns."""
        seed = [] if self.seed is None else ["seed"]
        return [*self.keys, *seed, *self.measured]


Keys = Mapping[str, Sequence[Any]]
"""Values of key columns, by name."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Rows, in the order of the plan.

    Attributes:
        rows: The rows.
        planned: Gives values that key columns take in all forms of the study, so that runs that
            are missing are told from names that nobody planned.
    """

    rows: Sequence[Run]
    planned: Callable[[], Keys] = field(default=dict)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Run]:
        return iter(self.rows)

    def __call__(self, **where: Any) -> Runs:
        """Those with these values.

        Args:
            where: By column the value, or a tuple of values that are accepted.

        Raises:
            MissingRuns: Runs with a planned value of a key column are not there.
            UnknownName: A column, or a value of a key column, is in no plan.
        """
        rows = list(self.rows)
        for column, value in where.items():
            accepted = value if isinstance(value, tuple) else (value,)
            if self._is_key(column):
                self._check_planned(rows, column, accepted)
            elif rows and not any(run.has_column(column) for run in rows):
                raise self._unknown(column)
            rows = [run for run in rows if run.has_column(column) and run[column] in accepted]
        return Runs(rows, self.planned)

    def __getitem__(self, column: str) -> npt.NDArray[Any]:
        """Values of a column, shape (n,) or (n, ...); None is NaN.

        Raises:
            UnknownName: A row has no such column.
        """
        values = [run[column] for run in self.rows]
        if any(value is None for value in values):
            values = [np.nan if value is None else value for value in values]
        return np.array(values)

    def list(self, column: str) -> Sequence[Any]:
        """Values of a column as they are, such as curves of different lengths.

        Raises:
            UnknownName: A row has no such column.
        """
        return [run[column] for run in self.rows]

    def has(self, **where: Any) -> bool:
        """Whether there are runs with these values of key columns.

        Raises:
            UnknownName: A column or value is in no plan.
        """
        try:
            return len(self(**where)) > 0
        except MissingRuns:
            return False

    def by(self, *columns: str) -> Iterator[tuple[Any, Runs]]:
        """Runs with the same values, in the order in which they first come: the value and its
        runs; of several columns a tuple of values."""
        groups: dict[Any, list[Run]] = {}
        for run in self.rows:
            values = tuple(run[column] for column in columns)
            groups.setdefault(values[0] if len(columns) == 1 else values, []).append(run)
        for values, rows in groups.items():
            yield values, Runs(rows, self.planned)

    def one(self, **where: Any) -> Run:
        """The one run with these values.

        Raises:
            MissingRuns: As of a call.
            LookupError: There is not just one.
        """
        found = self(**where)
        if len(found) != 1:
            raise LookupError(f"found {len(found)} runs with {where}; accepted: one")
        return found.rows[0]

    def mean(self, column: str, **where: Any) -> float:
        """Mean of a column; NaN of no run."""
        return self._reduced(np.mean, column, where)

    def means(self, column: str, **where: Iterable[Any]) -> Array:
        """Mean of a column for each value of a key column, such as `configuration=names`.

        Raises:
            MissingRuns: Runs with one of the values are not there.
            UnknownName: A column or value is in no plan.
        """
        ((key, values),) = where.items()
        return np.array([self.mean(column, **{key: value}) for value in values])

    def median(self, column: str, **where: Any) -> float:
        """Median of a column; NaN of no run."""
        return self._reduced(np.median, column, where)

    def largest(self, column: str, **where: Any) -> float:
        """Largest value of a column; NaN of no run."""
        return self._reduced(np.max, column, where)

    def smallest(self, column: str, **where: Any) -> float:
        """Smallest value of a column; NaN of no run."""
        return self._reduced(np.min, column, where)

    def total(self, column: str, **where: Any) -> int:
        """Sum of a column of counts or truth values."""
        return int(np.sum(self(**where)[column]))

    def counts(self, column: str, **where: Any) -> Counter[Any]:
        """How often each value of a column comes."""
        return Counter(self(**where).list(column))

    def counted(self, column: str, **where: Any) -> str:
        """Words such as `3 converged, 2 target_lost`."""
        return ", ".join(f"{n} {value}" for value, n in self.counts(column, **where).items())

    def units(self) -> dict[str, str]:
        """Units of the columns whose names end with one."""
        return {name: unit for name in self.columns() if (unit := unit_of(name))}

    def columns(self) -> Sequence[str]:
        """Names of all columns, in the order in which they first come."""
        return list(dict.fromkeys(name for run in self.rows for name in run.columns()))

    def arrays(self) -> Sequence[str]:
        """Names of the columns that hold arrays."""
        return [
            name
            for name in self.columns()
            if any(isinstance(run.measured.get(name), np.ndarray) for run in self.rows)
        ]

    def table(self) -> Sequence[dict[str, Any]]:
        """A dict a row, `case` first, without arrays."""
        arrays = set(self.arrays())
        return [
            {
                "case": run.case,
                **{name: run[name] for name in run.columns() if name not in arrays},
            }
            for run in self.rows
        ]

    def frame(self) -> Any:
        """A pandas DataFrame, a row a run, without arrays.

        Raises:
            ImportError: pandas is not installed.
        """
        try:
            import pandas as pd  # type: ignore[import-untyped, import-not-found, unused-ignore]
        except ImportError as problem:
            raise ImportError("frame: pandas is not installed; runs.csv has the same") from problem
        return pd.DataFrame(self.table())

    def write_csv(self, path: Path) -> None:
        """Writes the rows without arrays; lists and tables of names are JSON in a cell.

        Raises:
            OSError: It cannot be written.
        """
        names = [name for name in self.columns() if name not in self.arrays()]
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["case", *names])
        for one in self.table():
            writer.writerow([one["case"], *(_cell(one.get(name)) for name in names)])
        write_whole(path, text.getvalue())

    def _reduced(
        self, reduce: Callable[[Array], Any], column: str, where: Mapping[str, Any]
    ) -> float:
        some = self(**where)
        return float(reduce(some[column])) if len(some) else float("nan")

    def _is_key(self, column: str) -> bool:
        if any(column in run.keys for run in self.rows):
            return True
        return not any(run.has_column(column) for run in self.rows) and column in self.planned()

    def _check_planned(self, rows: Sequence[Run], column: str, accepted: tuple[Any, ...]) -> None:
        """Raises as a call does where a key column lacks an accepted value."""
        there = [run.keys.get(column) for run in rows]
        lacking = [value for value in accepted if value not in there]
        if not lacking:
            return
        known = self.planned().get(column, ())
        for value in lacking:
            if value not in known:
                raise UnknownName(
                    f"{column}: {value!r} is unknown; {closest(str(value), map(str, known))}"
                )
        raise MissingRuns(", ".join(f"{column} {value}" for value in lacking))

    def _unknown(self, column: str) -> UnknownName:
        names = dict.fromkeys([*self.columns(), *self.planned()])
        return UnknownName(f"column {column!r} is unknown; {closest(column, names)}")


def unit_of(column: str) -> str:
    """Unit of a column, from the end of its name; empty where it has none."""
    parts = column.split("_")
    for count in (2, 1):
        if len(parts) > count and (ending := "_".join(parts[-count:])) in UNITS:
            return UNITS[ending]
    return ""


RECORD = "row"
"""Name of a row's numbers and words, as JSON, among its arrays."""


def pack_row(row: Row) -> dict[str, np.ndarray]:
    """A row as arrays, shape (1, ...) each: what is no array is one text, in which floats keep
    their bits.

    Raises:
        TypeError: A value is of a kind that a row does not hold.
    """
    plain, arrays = {}, {}
    for name, value in row.items():
        if isinstance(value, np.ndarray) and value.dtype != object:
            arrays[name] = value[None]
        else:
            plain[name] = _plain(name, value)
    return {RECORD: np.array([json.dumps(plain)]), **arrays}


def unpack_row(arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The row that `pack_row` packed."""
    row: dict[str, Any] = load_json(str(arrays[RECORD][0]))
    return row | {name: array[0] for name, array in arrays.items() if name != RECORD}


def _plain(name: str, value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or type(value) in (bool, int, float, str):
        return value
    if isinstance(value, Mapping):
        return {str(key): _plain(name, one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(name, one) for one in value]
    raise TypeError(
        f"column {name!r}: found {type(value).__name__}; accepted: numbers, words, truth values, "
        "None, lists and dicts of these, arrays"
    )


def _cell(value: Any) -> Any:
    """A value in a file of comma-separated values."""
    if value is None:
        return ""
    return json.dumps(value) if isinstance(value, (dict, list, bool)) else value
