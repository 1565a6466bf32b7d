"""Grids of poses on the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from cdpr_drake.cli.options import parse_numbers
from cdpr_drake.errors import WorkspaceError, WorkspaceGridError
from cdpr_drake.workspaces import WorkspaceGrid, axis_by_count, axis_by_step

MOST_POSES = 10_000_000
"""Largest grid: its results are some 100 MB for each bounds, and take hours at least."""


MOST_TURNS = 10_000
"""Orientations of one grid."""


def parse_grid(
    words: str | None,
    orientations: list[str],
    lower: np.ndarray,
    upper: np.ndarray,
    step: np.ndarray,
) -> WorkspaceGrid:
    """The grid of --grid and --orientation.

    Args:
        words: x,y,z, each a number of points in the box, or lower:upper:step; None: the box.
        orientations: Angles phi,theta,psi [deg]; none: unturned.
        lower: Lower corner of the default box, shape (3,) [m].
        upper: Upper corner, shape (3,) [m].
        step: Default step, shape (3,) [m].

    Raises:
        WorkspaceGridError: The words make no sense, or the grid is empty or too large.
    """
    turns = [
        np.radians(parse_numbers("--orientation", one, (3,), "phi,theta,psi [deg]"))
        for one in orientations
    ] or [np.zeros(3)]
    parts = [None] * 3 if words is None else words.split(",")
    if len(parts) != 3:
        raise _grid_error(words)
    spans = []
    for part, name, low, high, by in zip(parts, "xyz", lower, upper, step, strict=True):
        spans.append(_span(words, part, name, float(low), float(high), float(by)))
    # Looked at before any axis is made, which may not fit into memory.
    poses = math.prod((span.points for span in spans), start=float(len(turns)))
    if poses > MOST_POSES:
        raise WorkspaceGridError(
            f"--grid: found {poses:.4g} poses; accepted: at most {MOST_POSES:g}"
        )
    x, y, z = (span.axis() for span in spans)
    return WorkspaceGrid((x, y, z), np.array(turns))


@dataclass(frozen=True)
class _Span:
    """An axis of a grid that is not made yet: `points` of them, or `step` apart."""

    name: str
    lower: float
    upper: float
    points: float
    step: float | None

    def axis(self) -> np.ndarray:
        if self.step is None:
            return axis_by_count(self.lower, self.upper, int(self.points), self.name)
        return axis_by_step(self.lower, self.upper, self.step, self.name)


def _span(
    words: str | None, part: str | None, name: str, low: float, high: float, by: float
) -> _Span:
    try:
        numbers = [low, high, by] if part is None else [float(one) for one in part.split(":")]
    except ValueError:
        raise _grid_error(words) from None
    if len(numbers) == 3:
        low, high, by = numbers
        # What makes no sense is left to `axis_by_step`.
        sense = all(map(math.isfinite, numbers)) and by > 0.0 and high >= low
        return _Span(name, low, high, (high - low) / by + 1.0 if sense else 1.0, by)
    if len(numbers) != 1 or not numbers[0].is_integer():
        raise _grid_error(words)
    if numbers[0] > 1.0 and low == high:
        raise WorkspaceGridError(
            f"--grid: found {numbers[0]:g} points along {name}, where the default box is flat; "
            f"accepted: 1, at {name} = {low:g} [m]"
        )
    return _Span(name, low, high, numbers[0], None)


def _grid_error(words: str | None) -> WorkspaceGridError:
    return WorkspaceGridError(
        f"--grid: found {words!r}; accepted: x,y,z, each a number of points or lower:upper:step "
        "[m], as in 33,33,12 or -0.4:0.4:0.1,-0.4:0.4:0.1,0:1:0.2"
    )


def parse_turns(items: list[str]) -> list[str]:
    """Every orientation of --orientation with its ranges, as `parse_grid` takes them.

    Raises:
        CdprError: The words make no sense, or there are too many orientations.
    """
    found: list[str] = []
    for item in items:
        axes = []
        for name, part in zip(("phi", "theta", "psi"), item.split(","), strict=False):
            numbers = part.split(":")
            if len(numbers) == 1:
                axes.append([part])
                continue
            low, high, step = parse_numbers(
                "--orientation", ",".join(numbers), (3,), "lower:upper:step [deg]"
            )
            if step > 0.0 and (high - low) / step > MOST_TURNS:
                raise WorkspaceError(
                    f"--orientation: found {item!r}; accepted: at most {MOST_TURNS} orientations"
                )
            axes.append([repr(float(a)) for a in axis_by_step(low, high, step, name)])
        if len(item.split(",")) != 3:
            axes = [[part] for part in item.split(",")]  # refused by `parse_grid`
        if len(found) + math.prod(len(axis) for axis in axes) > MOST_TURNS:
            raise WorkspaceError(
                f"--orientation: found {item!r}; accepted: at most {MOST_TURNS} orientations"
            )
        found += [",".join(words) for words in product(*axes)]
    return found
