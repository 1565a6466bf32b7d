"""Benchmarks of all poses of rest, and of judging a design."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.settings import DesignSettings, GoalSettings
from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, seconds_per_call
from cdpr_drake.analyses.workspaces.conditions import conditions_at
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.equilibrium_enumeration import enumerate_equilibria
from cdpr_drake.statics.equilibrium_search import sample_equilibria
from cdpr_drake.statics.inextensible_problem import HangingPlatform
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.pose_grid import grid_by_count

ROBOT = "acrobot_large"

EXITS = np.array([[1.0, 0.0, 2.0], [-0.5, 0.8, 2.0], [-0.5, -0.8, 2.0]])
ANCHORS = np.array([[0.2, 0.0, 0.0], [-0.1, 0.15, 0.02], [-0.1, -0.17, 0.0]])
LENGTHS = np.array([1.5, 1.5, 1.7])
"""A platform on three cables with six poses of rest, 228 paths."""


def design_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` times fewer searches and poses."""
    repeats = 1 if quick else 5
    return [rests_row(20 if quick else 100, repeats), judged_row(3 if quick else 7, repeats)]


def rests_row(searches: int, repeats: int) -> TimingRow:
    """All poses of rest along paths, with their proofs, against a multi-start that proves none."""
    platform = HangingPlatform(
        cables=CableSet.make(EXITS.T, ANCHORS.T, 1e5),
        weight_W=np.array([0.0, 0.0, -10.0]),
        p_PCo=np.array([0.03, 0.0, -0.1]),
        home=RigidTransform(),
    )

    def search() -> object:
        return sample_equilibria(platform, LENGTHS, elastic=False, most=searches)

    paths, starts = interleaved(
        [
            lambda: 1e6 * seconds_per_call(lambda: enumerate_equilibria(platform, LENGTHS), 1),
            lambda: 1e6 * seconds_per_call(search, 1),
        ],
        repeats,
    )
    name = f"multi-start, {searches} searches at most"
    return TimingRow(
        "all poses of rest, 3 cables", paths, "us", name, starts, starts / paths,
        ratio_means="times faster",
    )  # fmt: skip


def judged_row(points: int, repeats: int) -> TimingRow:
    """A design judged as the robot file that it would be, against the kernels alone."""
    settings = DesignSettings(goals=[GoalSettings(name="wrench-feasible")])
    settings.exit_points.reach = np.full(3, 0.1)
    candidates = make_candidates(ROBOT, settings, "bench")
    robot = load_robot(ROBOT)
    lower, upper = np.array([-0.4, -0.4, 0.05]), np.array([0.4, 0.4, 0.9])
    grid = grid_by_count(lower, upper, (points,) * 3)
    required = SpatialSet(box=np.array([0.0, 0.0, 0.0, 5.0, 5.0, 5.0]))
    middle = np.full(candidates.size, 0.5)
    about = pose_conditions(robot, required=required)

    def kernels() -> object:
        return conditions_at(about, grid, ["wrench-feasible"], 0, grid.size)

    def whole() -> object:
        design = pose_conditions(candidates.robot(0, middle), required=required)
        return conditions_at(design, grid, ["wrench-feasible"], 0, grid.size)

    file, alone = interleaved(
        [
            lambda: 1e6 * seconds_per_call(whole, 3),
            lambda: 1e6 * seconds_per_call(kernels, 3),
        ],
        repeats,
    )
    return TimingRow(
        f"a design judged at {grid.size} poses", file, "us", "without its robot file", alone,
        file / alone, ratio_means="times as long",
    )  # fmt: skip
