"""Convex sets of poses and time, all of which are proven: boxes, each with an interval of time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydrake.geometry.optimization import HPolyhedron, SaveIrisRegionsYamlFile

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.proofs.cuboid_cover import cover_with
from cdpr_drake.proofs.cuboid_cover_kernel import overlapping_pairs
from cdpr_drake.proofs.proven_sets import ABOUT, NUMBER_NAMES, REGIONS
from cdpr_drake.proofs.timed_cells import BORDER, TimedCells
from cdpr_drake.proofs.timed_ways import CellWay, earliest_way

COVER, MOST_SETS = 0.9, 150
"""Usual share of the clear cells that sets cover, and sets at most, before those of ways."""

SLOWER = (0.4, 1.0, 2.0, 4.0)
"""Ways that sets are sure to hold are looked for with so many times the time that a cell takes:
from about the fastest motion on the fly to one that rests often."""


@dataclass(frozen=True, eq=False)
class TimedSets:
    """Boxes of poses and time that may overlap; every pose in one, at its time, is proven.

    Attributes:
        lower: Least numbers of a pose that vary, shape (k, d) [m, rad].
        upper: Largest, shape (k, d).
        times: From when to when, shape (k, 2) [s].
        axes: Numbers of a pose that vary, shape (d,).
        fixed: A pose with the numbers that do not, shape (6,).
        horizon: Until when anything is proven [s].
        about: Of what they are, for JSON.
    """

    lower: Array
    upper: Array
    times: Array
    axes: np.ndarray
    fixed: Array
    horizon: float
    about: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        """How many."""
        return len(self.lower)

    @cached_property
    def graph(self) -> np.ndarray:
        """Pairs of sets that share poses and times, wide along every number, shape (p, 2)."""
        low, high = (
            np.column_stack([self.lower, self.times[:, 0]]),
            np.column_stack([self.upper, self.times[:, 1]]),
        )
        return np.asarray(overlapping_pairs(low, high, low.shape[1]))

    def containing(self, pose: Array, time: float) -> np.ndarray:
        """Numbers of the sets that hold a pose, shape (6,) [m, rad], at a time [s]."""
        held = self.holding(np.asarray(pose, float)[self.axes])
        return np.flatnonzero(held & (self.times[:, 0] <= time) & (time <= self.times[:, 1]))

    def holding(self, place: Array) -> np.ndarray:
        """Which sets hold numbers of a pose that vary, shape (d,), at some time, shape (k,)."""
        held = (self.lower - BORDER <= place) & (place <= self.upper + BORDER)
        return np.asarray(np.all(held, axis=1))

    def covers(self, pose: Array, time: float) -> bool:
        """Whether a pose lies in a set at a time."""
        return len(self.containing(pose, time)) > 0

    def clear_from(self, pose: Array) -> float:
        """From when on a pose is in sets until the horizon [s]; infinite: it is not then."""
        held = self.holding(np.asarray(pose, float)[self.axes])
        since = self.horizon
        for begin, end in sorted(self.times[held].tolist(), key=lambda one: -one[1]):
            if end >= since:
                since = min(since, begin)
        return since if since < self.horizon else np.inf

    def regions(self) -> list[HPolyhedron]:
        """The sets over the numbers that vary, then time, as Drake has them."""
        return [
            HPolyhedron.MakeBox(np.append(low, span[0]), np.append(high, span[1]))
            for low, high, span in zip(self.lower, self.upper, self.times, strict=True)
        ]

    def save(self, path: Path) -> Path:
        """Writes regions as Drake's `LoadIrisRegionsYamlFile(path, "regions")` reads them."""
        names = [f"set_{number:05d}" for number in range(len(self))]
        SaveIrisRegionsYamlFile(path, dict(zip(names, self.regions(), strict=True)), REGIONS)
        axes = [*(NUMBER_NAMES[axis] for axis in self.axes), "time_s"]
        with path.open("a", encoding="utf-8") as file:
            yaml.safe_dump({ABOUT: {**self.about, "axes": axes}}, file, sort_keys=True)
        return path


def sets_in_time(
    cells: TimedCells,
    start: Array,
    goal: Array,
    speed: float,
    *,
    about: Mapping[str, Any] | None = None,
    cover: float = COVER,
    most: int = MOST_SETS,
    say: Callable[[str], None] = lambda words: None,
) -> TimedSets:
    """Merges clear cells to boxes that hold ways from a start to a goal, where there are any.

    Args:
        cells: What is clear.
        start: Pose at time 0, shape (6,) [m, rad].
        goal: Pose at the end, likewise.
        speed: Mean speed of the ways that are looked for, and of some that are slower [m/s].
        about: Of what they are.
        cover: Share of the clear cells that boxes cover.
        most: Boxes beside those of the ways, at most.
        say: Told what is done now.

    Raises:
        WorkspaceError: The start is not clear at time 0, the goal not at the end, or no way leads
            from one to the other.
    """
    ends = []
    for name, pose in (("from", start), ("to", goal)):
        cell = cells.cell_at(pose)
        at = 0 if name == "from" else -1
        if cell is None or not cells.clear[cell][at]:
            when = "at time 0" if name == "from" else f"at {cells.horizon:.4g} s"
            raise WorkspaceError(
                f"{name}: found a pose that is not proven clear of what moves {when}; accepted: "
                "one farther from it, or more cells"
            )
        ends.append(cell)
    say("Looking for ways in time")
    seconds = cells.raster.width / speed
    ways = [earliest_way(cells, ends[0], ends[1], slower * seconds) for slower in SLOWER]
    found: Sequence[CellWay] = [way for way in ways if way is not None]
    if not found:
        raise WorkspaceError(
            "from, to: found no way in time between them that is proven clear of what moves until "
            f"{cells.horizon:.4g} s; accepted: poses that one joins, or more cells"
        )
    say("Merging cells of poses and time")
    seeds = np.concatenate([way.seeds() for way in found])
    steps = cells.clear.shape[-1]
    stay = [(np.append(ends[1], steps - 1), np.append(np.array(ends[1]) + 1, steps))]
    boxes = cover_with(cells.clear, cover, np.concatenate([seeds, np.array(stay)]), most)
    d = len(cells.raster.axes)
    lower = cells.raster.lower + cells.raster.width * boxes[:, 0, :d]
    upper = cells.raster.lower + cells.raster.width * boxes[:, 1, :d]
    times = cells.step * boxes[:, :, d]
    return TimedSets(
        lower, upper, times, cells.raster.axes, cells.raster.fixed, cells.horizon,
        {
            **(about or {}),
            "clear_share": float(np.mean(cells.clear)),
            "raster": list(cells.clear.shape),
            "horizon_s": cells.horizon,
            "cuboids_judged": cells.judged,
        },
    )  # fmt: skip
