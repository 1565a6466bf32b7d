"""Questions over a grid of poses on the command line: their options, their grids, their sweep.

One set of options for all such commands (`GridWords` to `Workers`), and what their words mean:
`parse_grid` and `parse_turns` make the grid. `GridSession` shows where the sweep over it stands,
and lets Ctrl-C end it.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
import typer

from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.sweeps.sweep import STARTING
from cdpr_drake.cli.command_session import CommandSession
from cdpr_drake.cli.options import parse_numbers
from cdpr_drake.cli.process import INTERRUPTED, StopRequest
from cdpr_drake.errors import CdprError, StoppedError, WorkspaceError, WorkspaceGridError
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, axis_by_count, axis_by_step

GridWords = Annotated[
    str | None,
    typer.Option(
        "--grid",
        help="x,y,z, each a number of points in the default box, or lower:upper:step [m].",
    ),
]
Orientations = Annotated[
    list[str] | None,
    typer.Option(
        "--orientation",
        help="Angles phi,theta,psi of the platform, each a number or lower:upper:step [deg]; may "
        "be repeated.",
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        help="Results folder; default: one named by the arguments below a folder named as the "
        "command."
    ),
]
ForceToResist = Annotated[
    float | None, typer.Option(help="Largest force to resist along each axis [N].")
]
MomentToResist = Annotated[
    float | None, typer.Option(help="Largest moment to resist about each axis [N m].")
]
Workers = Annotated[
    int | None,
    typer.Option(help="Local processes; default: one for each processor, for long work."),
]


def check_workers(workers: int | None) -> None:
    """Raises a CdprError unless there is at least one."""
    if workers is not None and workers < 1:
        raise CdprError(f"--workers: found {workers}; accepted: at least 1")


def check_mass(mass: float | None, *, zero: bool) -> None:
    """Raises a CdprError unless a mass is positive, or with `zero` not negative."""
    if mass is None or (math.isfinite(mass) and (mass > 0.0 or (zero and mass == 0.0))):
        return
    raise CdprError(f"--mass: found {mass:g}; accepted: {'>=' if zero else '>'} 0 [kg]")


def default_folder(command: str, name: str, arguments: dict[str, Any]) -> Path:
    """A folder below the command's that the same arguments find again."""
    digest = hashlib.sha256(json.dumps(arguments, sort_keys=True).encode()).hexdigest()
    return Path(command) / f"{name}-{digest[:8]}"


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


STOPPING = "Stopping after the chunks under way; Ctrl-C again drops them"
"""Answer to the first Ctrl-C."""

STOPPING_BOXES = "Stopping; what is proven is kept"
"""The same while boxes are proven."""


class GridSession(CommandSession):
    """What a terminal shows of a question over a grid; Ctrl-C leaves what is finished.

    It listens to Ctrl-C and SIGTERM only while something is computed.
    """

    def __init__(self, folder: Path, name: str) -> None:
        """For one question; arguments as `CommandSession`."""
        super().__init__(STOPPING, folder, name)
        self._part = ""
        self._last: WorkProgress | None = None

    def __enter__(self) -> Self:
        return self

    @contextmanager
    def computing(self, part: str = "") -> Iterator[None]:
        """Shows the bar; what Ctrl-C ends twice before the grid is finished has been stopped."""
        self._part, self.request = part, StopRequest(STOPPING_BOXES if part else STOPPING)
        with self.request.listening():
            try:
                with super().computing(part):
                    yield
            except KeyboardInterrupt as problem:  # the second one; what is under way is lost
                if part or self._last is None:
                    raise
                raise StoppedError("stopped") from problem

    def progress(self, progress: WorkProgress) -> None:
        """Moves the bar; keeps how far the grid is."""
        self._last = self._last if self._part else progress
        super().progress(progress)

    def fields(self, progress: WorkProgress) -> dict[str, Any]:
        """Of the bar."""
        state = f"{progress.done}/{progress.total} {progress.items}, {progress.speed:.0f} per s"
        if self._part:
            state += f", {progress.what}"
        elif progress.done == progress.found:
            state = STARTING
        return {"completed": progress.done, "total": progress.total, "state": state}

    def interrupted(self) -> int:
        """Says how a grid that was stopped goes on; returns the exit code."""
        assert self._last is not None
        self.say(
            f"Interrupted after {self._last.done} of {self._last.total} poses; run again with "
            f"the same arguments to continue in {self.folder}"
        )
        return INTERRUPTED
