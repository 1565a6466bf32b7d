"""A recorded log: columns with names and SI units, and what is odd about its rows."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.calibration.columns import split_unit
from cdpr_drake.analyses.reporting.exported_logs import Columns
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError
from cdpr_drake.summaries import Summarized

TIME = "time_s"

COMMANDED, ESTIMATED = "commanded_", "estimated_"
"""Before a header: what the machine was told, and what its controller believed."""

POSITION = ("x_m", "y_m", "z_m")
QUATERNION = ("qw", "qx", "qy", "qz")
ANGLES = ("roll_rad", "pitch_rad", "yaw_rad")

LENGTH, MOTOR, SWIVEL, TENSION = "length_m", "motor_angle_rad", "swivel_rad", "tension_n"
"""What follows a cable's name and _ in a header."""

GAP = 2.5
"""Steps longer than the usual one by this factor are gaps."""

DIGITS = 12
"""Of numbers in a written log; no sensor has more."""


@dataclass(frozen=True)
class RowReport:
    """What is odd about the rows of a log.

    Attributes:
        rows: How many there are.
        duration: From the first to the last [s]; None without times.
        step: The usual step [s]; None.
        gaps: Steps longer than `GAP` usual ones.
        longest_gap: [s]
        longest_gap_at: When it begins [s].
        repeated: Rows that were there twice, and of which one was left out.
        stale: Rows in which nothing but the time differs from the row before.
    """

    rows: int
    duration: float | None
    step: float | None
    gaps: int
    longest_gap: float
    longest_gap_at: float | None
    repeated: int
    stale: int

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "rows": self.rows,
            "duration_s": self.duration,
            "usual_step_s": self.step,
            "gaps": self.gaps,
            "longest_gap_s": self.longest_gap,
            "longest_gap_at_s": self.longest_gap_at,
            "repeated_rows_left_out": self.repeated,
            "rows_like_the_one_before": self.stale,
        }

    def words(self) -> str:
        """In one line."""
        if self.duration is None or self.step is None:
            return f"{self.rows} rows without times"
        said = f"{self.rows} rows, {self.duration:.6g} s, usually every {1e3 * self.step:.4g} ms"
        if self.gaps:
            said += f", {self.gaps} gaps, the longest {self.longest_gap:.4g} s at "
            said += f"{self.longest_gap_at:.6g} s"
        if self.repeated:
            said += f", {self.repeated} repeated rows left out"
        if self.stale:
            said += f", {self.stale} rows with nothing new"
        return said


@dataclass(frozen=True, eq=False, repr=False)
class RecordedLog(Summarized):
    """A log as it is kept: every column has a name with its SI unit.

    Attributes:
        path: The file, or the first of two.
        format: Name of the reader.
        why: Why that one reads it.
        columns: Shape (k,) each, by header, NaN where not measured; `time_s` where there are
            times. `commanded_` and `estimated_` stand before what was no measurement.
        units: What the file had, and who said so, by what it was said of.
        remarks: What was left out or read otherwise, a sentence each.
        repeated: Rows that were there twice, and of which one was left out.
    """

    path: Path
    format: str
    why: str
    columns: Columns
    units: dict[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    repeated: int = 0

    @property
    def count(self) -> int:
        """Rows."""
        return len(next(iter(self.columns.values())))

    @property
    def time(self) -> Array | None:
        """Shape (k,) [s]."""
        return self.columns.get(TIME)

    def cables(self) -> list[str]:
        """Names of the cables of which anything was measured, in the order of columns."""
        found: dict[str, None] = {}
        for header in self.columns:
            for ending in (LENGTH, MOTOR, SWIVEL, TENSION):
                stem = header.removesuffix(f"_{ending}")
                if stem != header and not stem.startswith((COMMANDED, ESTIMATED)):
                    found[stem] = None
        return list(found)

    def of_cables(self, what: str) -> list[str]:
        """Headers of what was measured of cables: `LENGTH` and the like."""
        return [
            header
            for header in self.columns
            if header.endswith(f"_{what}") and not header.startswith((COMMANDED, ESTIMATED))
        ]

    def table(self, headers: list[str] | tuple[str, ...]) -> Array:
        """Some columns beside each other, shape (k, n)."""
        return np.column_stack([self.columns[header] for header in headers])

    def row_report(self) -> RowReport:
        """What is odd about its rows."""
        rest = [values for header, values in self.columns.items() if header != TIME]
        same = np.ones(max(self.count - 1, 0), bool)
        for values in rest:
            before, after = values[:-1], values[1:]
            same &= (before == after) | (np.isnan(before) & np.isnan(after))
        stale = int(np.count_nonzero(same)) if rest else 0
        time = self.time
        if time is None or self.count < 2:
            return RowReport(self.count, None, None, 0, 0.0, None, self.repeated, stale)
        steps = np.diff(time)
        usual = float(np.median(steps))
        wide = steps > GAP * usual
        k = int(np.argmax(steps))
        return RowReport(
            self.count, float(time[-1] - time[0]), usual, int(np.count_nonzero(wide)),
            float(steps[k]) if wide.any() else 0.0, float(time[k]) if wide.any() else None,
            self.repeated, stale,
        )  # fmt: skip

    def measured(self) -> dict[str, int]:
        """Rows in which each column has a number."""
        return {h: int(np.count_nonzero(np.isfinite(v))) for h, v in self.columns.items()}

    def part(self, start: float | None, end: float | None, every: int = 1) -> RecordedLog:
        """Rows from one instant to another [s], each or every so manieth.

        Raises:
            LogFileError: There are no times, or no rows between them.
        """
        kept = np.ones(self.count, bool)
        if start is not None or end is not None:
            if self.time is None:
                raise LogFileError(
                    f"{self.path}: time: found no column of times; accepted: one, for a part"
                )
            kept &= self.time >= (-np.inf if start is None else start)
            kept &= self.time <= (np.inf if end is None else end)
        rows = np.flatnonzero(kept)[::every]
        if not len(rows):
            assert self.time is not None  # without, all rows are kept
            since = "" if start is None else f" from {start:g} s"
            until = "" if end is None else f" until {end:g} s"
            raise LogFileError(
                f"{self.path}: found no rows{since}{until}; accepted: a part of "
                f"{self.time[0]:g} to {self.time[-1]:g} s"
            )
        return replace(self, columns={h: v[rows] for h, v in self.columns.items()})

    def write(self, path: Path) -> None:
        """Writes it as text with columns, as `cdpr calibrate` and `cdpr identify` read it.

        Cells without a number are empty.
        """
        with whole_file(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
            file.write(",".join(self.columns) + "\n")
            table = self.table(tuple(self.columns))
            for row in table:
                cells = ("" if np.isnan(v) else f"{v:.{DIGITS}g}" for v in row)
                file.write(",".join(cells) + "\n")

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "file": str(self.path),
            "format": self.format,
            "why": self.why,
            "rows": self.row_report().as_dict(),
            "columns": {
                header: {
                    "rows": rows,
                    "least": _finite(np.nanmin, self.columns[header], rows),
                    "largest": _finite(np.nanmax, self.columns[header], rows),
                }
                for header, rows in self.measured().items()
            },
            "units": self.units,
            "remarks": list(self.remarks),
        }

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        names = [header for header in self.columns if header != TIME]
        shown = ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
        return f"Log {self.path.name}, {self.format}", [
            ("read so", self.why),
            ("rows", self.row_report().words()),
            ("columns", shown),
            *((what, words) for what, words in self.units.items()),
            *(("note", words) for words in self.remarks),
        ]


def _finite(pick: Any, values: Array, rows: int) -> float | None:
    return float(pick(values)) if rows else None


def settled(log: RecordedLog, lines: Array | None = None) -> RecordedLog:
    """A log whose times grow: rows that are there twice are left out, and counted.

    Args:
        log: As it was read.
        lines: Line of the file in which each row stands, for messages; None: its number.

    Raises:
        LogFileError: It has no rows, no columns, or times that do not grow.
    """
    if not log.columns or not log.count:
        raise LogFileError(f"{log.path}: found no rows of measurements; accepted: at least one")
    time = log.time
    if time is None:
        return log
    if not np.all(np.isfinite(time)):
        k = int(np.argmin(np.isfinite(time)))
        raise LogFileError(
            f"{log.path}:{_place(lines, k)}: time: found no number; accepted: a time in each row"
        )
    table = log.table(tuple(log.columns))
    twice = np.zeros(log.count, bool)
    before, after = table[:-1], table[1:]
    twice[1:] = np.all((before == after) | (np.isnan(before) & np.isnan(after)), axis=1)
    kept = ~twice
    steps = np.diff(time[kept])
    if np.any(steps <= 0.0):
        rows = np.flatnonzero(kept)
        k = int(np.argmax(steps <= 0.0))
        raise LogFileError(
            f"{log.path}:{_place(lines, rows[k + 1])}: time: found {time[rows[k + 1]]:.9g} s after "
            f"{time[rows[k]]:.9g} s; accepted: times that grow, and rows twice only where all of "
            "them is the same"
        )
    if not twice.any():
        return log
    columns = {header: values[kept] for header, values in log.columns.items()}
    return replace(log, columns=columns, repeated=log.repeated + int(np.count_nonzero(twice)))


def _place(lines: Array | None, row: int) -> str:
    return str(int(lines[row])) if lines is not None else f"row {row + 1}"


def quantity(header: str) -> str:
    """The unit of a column, for axes: m, rad, N, s or none."""
    unit = split_unit(header)[1]
    return {"n": "N", "nm": "N m"}.get(unit, unit)
