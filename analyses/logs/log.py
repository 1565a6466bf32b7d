"""A log of a machine: a table in SI units, and what became of each column of its file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.logs.columns import (
    CABLE_QUANTITIES,
    COMMANDED,
    ESTIMATED,
    PARTS,
    POSITION,
    ROTATIONS,
    SECONDS,
    SHOWN,
    UNITS,
)
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError, OutputFolderError, why_not_read

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GAP = 2.5
"""Steps longer than the usual one by this factor are gaps."""

DENSE, MOST_PANELS, MOST_NAMED = 200, 6, 8
"""Logs of fewer rows are drawn with a point a row; panels of a figure; columns that it names."""

AS_TOLD = "as told"
"""Ends words on units and times that a user said."""


def refusal(place: object, value: object, accepted: object) -> LogFileError:
    """The error of a value in a log; `place` is its file, line or row, and field."""
    return LogFileError(f"{place}: found {value}; accepted: {accepted}")


def unreadable(path: Path, kind: str, problem: Exception) -> LogFileError:
    """The error of a damaged file, in the words of the library that reads its kind."""
    words = " ".join(str(problem).split())[:160] or type(problem).__name__
    return LogFileError(f"{path}: cannot be read as {kind}: {words}")


@dataclass(frozen=True, eq=False, kw_only=True)
class Facts:
    """What a user says of a log beside its file.

    Attributes:
        cables: Names of the cables in the order of the log; None: the file's, or C1, C2, ...
        units: Unit by dimension, `length` and the like, for what the file does not say.
        mapping: Header of each column in order, or by the names in the file; None.
        skip_rows: Lines at the top that are no rows.
        separator: Sign between cells; None: by the first row.
        rate: Rows per second, for files without times [1/s]; None.
        body: Rigid body of a tracker that is the platform; None: the only one.
        topics: Topics of a bag that are read; None: all of the first one's times.
        R_WF: Axes of the file's frame F in W, shape (3, 3); None: the same.
        robot_cables: Names of a robot's cables, which headers may bear.
    """

    cables: tuple[str, ...] | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    mapping: Sequence[str] | Mapping[str, str] | None = None
    skip_rows: int = 0
    separator: str | None = None
    rate: float | None = None
    body: str | None = None
    topics: tuple[str, ...] | None = None
    R_WF: Array | None = None
    robot_cables: tuple[str, ...] = ()

    def names(self, path: Path, count: int, default: Sequence[str] = ()) -> list[str]:
        """Names of as many cables as a file has; another number of names is refused."""
        if self.cables is not None and len(self.cables) != count:
            named = f"{len(self.cables)} names ({', '.join(self.cables)[:80]})"
            raise refusal(f"{path}: cables", f"{count} in the log and {named}", "a name for each")
        return list(self.cables or default or [f"C{k + 1}" for k in range(count)])


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Log(Result):
    """A log of a machine.

    Attributes:
        path: The file, or the first of two.
        dialect: Name of its dialect.
        why: How the dialect was recognised.
        frame: A column for each quantity, with its SI unit in its name, NaN where nothing was
            measured; `time_s` where there are times. `commanded_` and `estimated_` stand before
            names of what was no measurement.
        ledger: A row for each column of the file: `header`, `name` in the frame, `kind`, `unit`,
            `by` (header, told, format or assumed), and `fate` (read, or why it was not).
        units: Units and their origins, in words.
        remarks: What was left out or read otherwise, a sentence each.
        repeated: Rows that were there twice, and of which one was left out.
        clocks: How the clock of a second recorder was read, for JSON; None without one.
        written: File that was written; None.
    """

    path: Path
    dialect: str = ""
    why: str = ""
    frame: pd.DataFrame
    ledger: pd.DataFrame
    units: dict[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    repeated: int = 0
    clocks: dict[str, Any] | None = None
    written: Path | None = None

    @property
    def time(self) -> Array | None:
        """Shape (k,) [s]; None without times."""
        return self.frame[SECONDS].to_numpy() if SECONDS in self.frame else None

    def of_cables(self, ending: str) -> list[str]:
        """Columns of what was measured of cables: `LENGTH` and the like."""
        return [
            name for name in self.frame
            if name.endswith(f"_{ending}") and not name.startswith((COMMANDED, ESTIMATED))
        ]  # fmt: skip

    def cables(self) -> list[str]:
        """Names of the cables of which anything was measured, in the order of columns."""
        stems = {
            name: name.removesuffix(f"_{ending}")
            for ending, _ in CABLE_QUANTITIES.values() for name in self.of_cables(ending)
        }  # fmt: skip
        return list(dict.fromkeys(stems[name] for name in self.frame if name in stems))

    def table(self, names: Sequence[str]) -> Array:
        """Some columns beside each other, shape (k, n)."""
        return self.frame[list(names)].to_numpy(float)

    def rows_summary(self) -> dict[str, Any]:
        """What is odd about the rows, for JSON."""
        rest = self.frame.drop(columns=SECONDS, errors="ignore").to_numpy(float)
        summary: dict[str, Any] = {
            "rows": len(self.frame), "duration_s": None, "usual_step_s": None, "gaps": 0,
            "longest_gap_s": 0.0, "longest_gap_at_s": None, "repeated_rows_left_out": self.repeated,
            "rows_like_the_one_before": int(same_as_before(rest).sum()) if rest.shape[1] else 0,
        }  # fmt: skip
        time = self.time
        if time is not None and len(time) > 1:
            steps = np.diff(time)
            usual, k = float(np.median(steps)), int(np.argmax(steps))
            wide = steps > GAP * usual
            summary |= {"duration_s": float(time[-1] - time[0]), "usual_step_s": usual,
                        "gaps": int(np.count_nonzero(wide))}  # fmt: skip
            if wide.any():
                summary |= {"longest_gap_s": float(steps[k]), "longest_gap_at_s": float(time[k])}
        return summary

    def rows_words(self) -> str:
        """What is odd about the rows, in one line."""
        n = self.rows_summary()
        if n["duration_s"] is None:
            return f"{n['rows']} rows without times"
        step = f"usually every {1e3 * n['usual_step_s']:.4g} ms"
        words = [f"{n['rows']} rows, {n['duration_s']:.6g} s, {step}"]
        if n["gaps"]:
            longest = f"the longest {n['longest_gap_s']:.4g} s at {n['longest_gap_at_s']:.6g} s"
            words.append(f"{n['gaps']} gaps, {longest}")
        if n["repeated_rows_left_out"]:
            words.append(f"{n['repeated_rows_left_out']} repeated rows left out")
        if n["rows_like_the_one_before"]:
            words.append(f"{n['rows_like_the_one_before']} rows with nothing new")
        return ", ".join(words)

    def with_remarks(self, *remarks: str) -> Log:
        """The same log with more remarks."""
        return replace(self, remarks=(*self.remarks, *remarks))

    def part(self, start: float | None = None, end: float | None = None, every: int = 1) -> Log:
        """Every n-th row from one instant to another [s].

        Raises:
            LogFileError: There are no times, or no rows between them.
        """
        frame, time = self.frame, self.time
        if start is not None or end is not None:
            if time is None:
                raise refusal(f"{self.path}: time", "no column of times", "one, for a part")
            low, high = -np.inf if start is None else start, np.inf if end is None else end
            frame = frame[(time >= low) & (time <= high)]
            if not len(frame):
                words = "no rows" if start is None else f"no rows from {start:g} s"
                words += "" if end is None else f" until {end:g} s"
                raise refusal(self.path, words, f"a part of {time[0]:g} to {time[-1]:g} s")
        return replace(self, frame=frame.iloc[::every].reset_index(drop=True))

    def write(self, path: Path | str) -> None:
        """Writes it as text with columns, which all commands read; unmeasured cells are empty.

        Raises:
            OutputFolderError: The file cannot be written.
        """
        try:
            with whole_file(Path(path)) as part:
                self.frame.to_csv(part, index=False, float_format="%.12g", lineterminator="\n")
        except OSError as problem:
            words = why_not_read(problem)
            raise OutputFolderError(f"{path}: cannot be written: {words}") from problem

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON but the rows."""
        numbers = self.frame.agg(["count", "min", "max"])
        return {
            "file": str(self.path), "format": self.dialect, "why": self.why,
            "rows": self.rows_summary(),
            "columns": {
                name: {"rows": int(count), "least": least if count else None,
                       "largest": largest if count else None}
                for name, (count, least, largest) in numbers.items()
            },
            "units": self.units, "remarks": list(self.remarks), "clocks": self.clocks,
            "ledger": self.ledger.to_dict("records"),
            "written": None if self.written is None else str(self.written),
        }  # fmt: skip

    def tables(self) -> list[Table]:
        """The ledger."""
        rows = [tuple(map(str, row)) for row in self.ledger.itertuples(index=False)]
        headings = ("header", "read as", "kind", "unit", "unit by", "fate")
        return [Table(f"Columns of {self.path.name}", headings, rows)]

    def lines(self) -> list[str]:
        """Its rows, columns, units and remarks, a line each."""
        lines = [f"{self.path}: {self.dialect}, as {self.why}", f"  rows: {self.rows_words()}"]
        if self.clocks is not None:
            lines.append(f"  clocks: {self.clocks['words']}")
        names: dict[int, list[str]] = {}
        for name, rows in self.frame.count().items():
            names.setdefault(int(rows), []).append(str(name))
        lines += [f"  in {rows} rows: {', '.join(each)}" for rows, each in names.items()]
        lines += [f"  {what}: {words}" for what, words in self.units.items()]
        lines += [f"  note: {words}" for words in self.remarks]
        return lines + ([] if self.written is None else [str(self.written)])

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Each kind of column over time, or over rows if there are no times."""
        return {"log": self._draw}

    def _draw(self) -> Figure:
        from cdpr_drake.analyses.frame.figures import curves, few_ticks, panels, shade, styled
        from cdpr_drake.palette import nth_look

        groups, time = self._panels()[:MOST_PANELS], self.time
        names = {SECONDS, *(name for _, group in groups for name in group)}
        left = [name for name in self.frame if name not in names]
        more = f" and {len(left) - MOST_NAMED} more" * (len(left) > MOST_NAMED)
        title = f"{self.path.name}: {self.rows_words()}"
        title += f"\nnot drawn: {', '.join(left[:MOST_NAMED])}{more}" if left else ""
        t = np.arange(1.0, len(self.frame) + 1.0) if time is None else time
        figure, rows = panels(len(groups), 1, (9.0, 1.2 + 2.1 * max(len(groups), 1)), title)
        with styled():
            for axes, (label, group) in zip(rows, groups, strict=False):
                stems = [name.rpartition("_")[0] or name for name in group]
                if len(t) > DENSE:
                    curves(axes, t, self.table(group), stems)
                else:
                    for k, (name, stem) in enumerate(zip(group, stems, strict=True)):
                        look = nth_look(k)
                        axes.plot(
                            t, self.frame[name], color=look.color, marker=look.marker or "o",
                            linestyle="none", markersize=4.5, markerfacecolor="white", label=stem,
                        )  # fmt: skip
                if time is not None and len(time) > 1:
                    steps = np.diff(time)
                    wide = np.append(steps > GAP * np.median(steps), False)
                    shade(axes, t, wide, "gap in time" if wide.any() else None)
                axes.set_ylabel(label)
                axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
                few_ticks(axes.yaxis)
                end = float(t[-1]) if len(t) > 1 else float(t[0]) + 1.0
                axes.set_xlim(*((0.5, len(t) + 0.5) if time is None else (float(t[0]), end)))
            rows[-1].set_xlabel("time [s]" if time is not None else "row")
        return figure

    def _panels(self) -> list[tuple[str, list[str]]]:
        """Label and columns of each panel."""
        groups = [
            (f"{kind.removesuffix('s')} [{unit_of(ending)}]", self.of_cables(ending))
            for kind, (ending, _) in CABLE_QUANTITIES.items()
        ]
        for prefix, title in (("", "position"), (ESTIMATED, "estimated"), (COMMANDED, "commanded")):
            groups.append((f"{title} [m]", [f"{prefix}{name}" for name in PARTS[POSITION]]))
        for kind in ROTATIONS:
            unit = unit_of(PARTS[kind][0]) or "-"
            title = {"rpy": "roll, pitch, yaw"}.get(kind, kind)
            groups.append((f"{title} [{unit}]", list(PARTS[kind])))
        present = [(label, [n for n in names if n in self.frame]) for label, names in groups]
        return [(label, names) for label, names in present if names]


def same_as_before(table: Array) -> np.typing.NDArray[np.bool_]:
    """True for each row but the first that equals the row before, shape (k - 1,)."""
    before, after = table[:-1], table[1:]
    return np.all((before == after) | (np.isnan(before) & np.isnan(after)), axis=1)


def unit_of(name: str) -> str:
    """Unit of a column of a log as figures and tables write it; empty: none."""
    last = name.rpartition("_")[2]
    return SHOWN.get(last, last) if last in UNITS else ""
