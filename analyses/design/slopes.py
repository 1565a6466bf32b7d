"""Slopes of goals by the coordinates of a design, where a goal is the least of smooth functions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdpr_drake.analyses.design.candidates import Candidates
from cdpr_drake.analyses.design.goals import Judging
from cdpr_drake.analyses.workspaces import Asked, pose_conditions
from cdpr_drake.arrays import Array
from cdpr_drake.workspaces import SpatialSet, margin_slopes, resisting

Slopes = Callable[[Candidates, int, Array, Judging], tuple[Array, Array]]
"""Values at all poses of the grid, shape (n,), and their slopes by the coordinates, (n, size)."""


def _capacity_margin(
    candidates: Candidates, number: int, coordinates: Array, judging: Judging
) -> tuple[Array, Array]:
    robot, grid = candidates.robot(number, coordinates), judging.grid
    about = pose_conditions(robot, Asked(required=judging.required))
    positions, rotations = grid.positions(0, grid.size), grid.rotations(0, grid.size)
    demand = resisting(about.case, about.required or SpatialSet(), rotations)
    slopes = margin_slopes(about.case, positions, rotations, demand)
    kept = list(candidates.kept[number])
    m = candidates.points.reach.shape[1] // 2
    by_points = np.zeros((grid.size, 3, 2 * m))
    by_points[:, :, kept] = slopes.exits
    by_points[:, :, [m + k for k in kept]] = slopes.anchors
    found = candidates.points.slopes(by_points)
    # Of the winch, each on a scale of its own logarithm: the largest tension is what it pulls.
    pull, signs = robot.tension_limits(None)[1], {"drum_radius": -1.0}
    winch = [
        slopes.upper * pull * signs.get(name, 1.0) * np.log(high / low)
        for name, (low, high) in candidates.ranges.items()
    ]
    return slopes.found.margins, np.column_stack([found, *winch])


SLOPES: dict[str, Slopes] = {"capacity-margin": _capacity_margin}
"""By names of goals."""
