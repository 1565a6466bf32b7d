"""Planned motions against linear programs by HiGHS, one for each station of the path."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.optimize import linprog

from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.trajectories.pose_path import PosePath
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from tests.benchmarks.ratios import Ratio, per_call, ratios

STATIONS = 500

POSES = [
    pose_from_angles(np.array(place), np.radians(angles))
    for place, angles in (
        ([0.0, 0.0, 0.2], [0.0, 0.0, 0.0]),
        ([0.15, -0.1, 0.4], [4.0, -3.0, 6.0]),
        ([-0.1, 0.1, 0.3], [0.0, 0.0, 0.0]),
    )
]
"""Poses of the path."""

WRENCHES = np.array([0.02, 0.02, 0.02, 2.0, 2.0, 1.0])
"""Half widths of a box of wrenches, which has 64 corners [N m, N]."""


def benchmark() -> Iterator[Ratio]:
    """Plans of 500 stations.

    The program of a station is the smallest of a reachability analysis: the largest (ds/dt)^2 that
    the tensions admit. The plan solves three at each, over two stations.
    """
    robot = load_robot("acrobot_large")
    limits, path = robot_limits(robot, (1.0, 60.0)), make_path(robot, POSES, "smooth")
    task = path_task(robot, limits, reserve=RESERVE)
    resisting = path_task(robot, limits, reserve=RESERVE, resist=SpatialSet(box=WRENCHES))
    places = plan_along_path(task, path, STATIONS).trajectory.stations
    programs = station_programs(task, path, places)
    plan = per_call(lambda: plan_along_path(task, path, STATIONS))
    yield from ratios({
        "plan": plan,
        f"{len(programs)} linear programs, HiGHS": per_call(
            lambda: [linprog(**program, method="highs") for program in programs]
        ),
    })  # fmt: skip
    yield from ratios({
        f"plan that resists {len(resisting.resist)} wrenches": per_call(
            lambda: plan_along_path(resisting, path, STATIONS)
        ),
        "the plan that resists none": plan,
    })  # fmt: skip


def station_programs(task: PathTask, path: PosePath, places: Array) -> list[dict[str, Any]]:
    """Arguments of `linprog` for each station: largest x with tensions within their limits.

    Variables are u = d2s/dt2, x = (ds/dt)^2, at most 100, and the redundancy of the cables.
    """
    stations, _ = task.stations(path.points(places))
    lower, upper = task.limits.lower, task.limits.upper
    programs = []
    for S in stations:
        A = np.column_stack([S[1], S[2], S[5:].T])
        free = len(S) - 5
        programs.append({
            "c": np.array([0.0, -1.0, *np.zeros(free)]),
            "A_ub": np.vstack([A, -A]),
            "b_ub": np.concatenate([upper - S[0], S[0] - lower]),
            "bounds": [(None, None), (0.0, 100.0), *[(None, None)] * free],
        })  # fmt: skip
    return programs
