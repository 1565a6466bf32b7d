"""Tables of runs: a row for each value of some columns, a number of its runs in each cell."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Runs, unit_of

REDUCTIONS: dict[str, Callable[[Any], Any]] = {
    "mean": np.mean, "median": np.median, "largest": np.max, "smallest": np.min, "total": np.sum,
}  # fmt: skip
"""What makes one number of a column, by name."""

FACTORS = {
    ("m", "mm"): 1e3, ("m", "cm"): 1e2, ("m", "um"): 1e6, ("rad", "deg"): 180.0 / np.pi,
    ("s", "ms"): 1e3, ("s", "us"): 1e6, ("rad/s", "deg/s"): 180.0 / np.pi, ("m/s", "mm/s"): 1e3,
}  # fmt: skip
"""From the unit of a column to that of a heading."""

EMPTY = "-"
"""Cell of no run, or of a number that is not finite."""

COARSE, FULL = "coarse", "full"
"""Values of the key column `grid`: grids of the quick form and of the full one."""


def note_coarse(table: Table, runs: Runs, words: str = "the differences mean little.") -> Table:
    """A table of runs, with a caption that says where some are of coarse grids.

    Args:
        table: The table.
        runs: What it shows.
        words: What that means for it.
    """
    if any(run.keys.get("grid") == COARSE for run in runs):
        before = [str(table.caption)] if table.caption else []
        table.caption = "\n".join([*before, f"Coarse grid: {words}"])
    return table


@dataclass(frozen=True)
class Cell:
    """What stands in a column of a summary.

    Attributes:
        reduction: Of `REDUCTIONS`, or "runs": how many there are.
        column: Which values.
        format: Of the number, in the unit of the heading.
        where: Values of columns that runs must have to count.
    """

    reduction: str
    column: str = ""
    format: str = "g"
    where: Mapping[str, Any] = field(default_factory=dict)

    def words(self, runs: Runs, unit: str) -> str:
        """The cell of some runs.

        Args:
            runs: The runs.
            unit: Of the heading, in square brackets there; empty: the column's.
        """
        some = runs(**self.where)
        if self.reduction == "runs":
            return str(len(some))
        if not len(some):
            return EMPTY
        own = unit_of(self.column)
        factor = 1.0 if unit in ("", own) else FACTORS[own, unit]
        value = factor * float(REDUCTIONS[self.reduction](some[self.column]))
        return format(value, self.format) if np.isfinite(value) else EMPTY


@dataclass(frozen=True)
class Summary:
    """A table of a study.

    Attributes:
        title: Above it.
        by: Columns by whose values rows are made.
        cells: Of each row, by heading; a heading ends with its unit in square brackets.
        where: Values of key columns of the runs that it shows.
    """

    title: str
    by: tuple[str, ...]
    cells: Mapping[str, Cell | Callable[[Runs], str]]
    where: Mapping[str, Any] = field(default_factory=dict)

    def __call__(self, runs: Runs) -> Table:
        """The table of runs.

        Raises:
            MissingRuns: There are none.
        """
        table = new_table(self.title, self.by, tuple(self.cells))
        for values, some in runs(**self.where).by(*self.by):
            words = [values] if len(self.by) == 1 else list(values)
            table.add_row(*map(str, words), *(self._cells(some)))
        return table

    def _cells(self, runs: Runs) -> list[str]:
        return [
            cell.words(runs, _unit(heading)) if isinstance(cell, Cell) else cell(runs)
            for heading, cell in self.cells.items()
        ]


def _unit(heading: str) -> str:
    """What stands in square brackets at the end of a heading."""
    before, bracket, after = heading.rpartition("[")
    return after.rstrip("]") if bracket and before and heading.endswith("]") else ""
