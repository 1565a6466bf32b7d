"""Benchmark of proofs over poses and time, against exact checks of one pose at one time each."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, processor_seconds
from cdpr_drake.analyses.workspaces.robot_conditions import interference_bodies
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.worlds.motions import PathBody
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.workspaces.moving_clearances import moving_clearances
from cdpr_drake.workspaces.moving_shapes import MovingShape
from cdpr_drake.workspaces.timed_cells import PoseRaster, clear_cells

ROBOT = "acrobot_large"

SHAPE, STEPS, HORIZON = (16, 16, 8), 32, 8.0
"""Cells of poses, steps of time, and how long it is [s]."""


def timed_cells_row(repeats: int) -> TimingRow:
    """Cells of poses and time proven clear of a box that passes, against one sample of each."""
    robot = load_robot(ROBOT)
    around = interference_bodies(robot, pulleys=True)
    size, middle = np.array([0.7, 0.7, 0.5]), np.array([0.0, 0.0, 0.4])
    raster = PoseRaster(
        middle - 0.5 * size, size / SHAPE, np.arange(3), np.zeros(6), np.ones(SHAPE, bool)
    )
    ends = (RigidTransform([0.0, -0.6, 0.2]), RigidTransform([0.0, 0.6, 0.2]))
    things = [
        MovingShape(
            ConvexShape.box_at(np.zeros(3), np.array([0.1, 0.1, 0.4])),
            PathBody(PoseTrajectory(ends, (HORIZON,))),
            "box",
        )
    ]
    cells = np.indices(SHAPE).reshape(3, -1).T
    places = raster.lower + raster.width * (cells + 0.5)
    turned = np.repeat(np.eye(3)[np.newaxis], len(places), axis=0)
    times = (np.arange(STEPS) + 0.5) * HORIZON / STEPS

    def proofs() -> None:
        clear_cells(raster, around, things, 0.0, HORIZON, STEPS)

    def samples() -> None:
        moving_clearances(around, things, times, places, turned)

    proofs()
    samples()
    works = [lambda: 1e3 * processor_seconds(proofs), lambda: 1e3 * processor_seconds(samples)]
    own, other = interleaved(works, repeats)
    name = f"{ROBOT}: {len(places) * STEPS} cells of poses and time proven clear"
    baseline = "an exact check in the middle of each, which proves nothing"
    return TimingRow(name, own, "ms", baseline, other, other / own, ratio_means="times faster")
