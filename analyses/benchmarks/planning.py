"""Benchmarks of planned motions: the whole plan against one linear program a point of the path."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from cdpr_drake.analyses.benchmarks.moving_obstacles import timed_cells_row
from cdpr_drake.analyses.planning.cable_streams import cable_stream
from cdpr_drake.analyses.planning.plan_results import PlanRun
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, processor_seconds
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.planning.reconfiguration import Rails, RailTask, ReconfigurationProgram
from cdpr_drake.trajectories.pose_path import PosePath
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet

ROBOT, TENSIONS = "acrobot_large", (1.0, 60.0)

STREAMED = "maslow_4"

STATIONS = 500

POSES = [
    pose_from_angles(np.array(place), np.radians(angles))
    for place, angles in (
        ([0.0, 0.0, 0.2], [0.0, 0.0, 0.0]),
        ([0.15, -0.1, 0.4], [4.0, -3.0, 6.0]),
        ([-0.1, 0.1, 0.3], [0.0, 0.0, 0.0]),
    )
]
"""Of the path."""


def planning_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` repeats less."""
    repeats = 3 if quick else 7
    return [
        path_row(repeats),
        resistance_row(repeats),
        stream_row(repeats),
        rails_row(repeats),
        timed_cells_row(repeats),
    ]


def path_row(repeats: int) -> TimingRow:
    """A plan of 500 stations against scipy's HiGHS, one linear program for each station.

    The program is the smallest of those that a reachability analysis asks: the largest (ds/dt)^2
    that the tensions admit at the station. The plan solves three at each, over two stations.
    """
    robot = load_robot(ROBOT)
    task = path_task(robot, LimitSettings(tensions=TENSIONS, reserve=RESERVE))
    path = make_path(robot, POSES, "smooth")
    plan = plan_along_path(task, path, STATIONS)
    programs = station_programs(task, path, plan.trajectory.stations)

    def highs() -> None:
        for program in programs:
            linprog(**program, method="highs")

    def ours() -> None:
        plan_along_path(task, path, STATIONS)

    works = [lambda: 1e3 * processor_seconds(ours), lambda: 1e3 * processor_seconds(highs)]
    own, other = interleaved(works, repeats)
    name = f"{ROBOT}: plan along a path, {len(programs)} stations"
    baseline = "one LP a station, HiGHS by scipy"
    return TimingRow(name, own, "ms", baseline, other, other / own, ratio_means="times faster")


def resistance_row(repeats: int) -> TimingRow:
    """A plan that resists the 64 corners of a box of wrenches, against one that resists none."""
    robot = load_robot(ROBOT)
    box = SpatialSet(box=np.array([0.02, 0.02, 0.02, 2.0, 2.0, 1.0]))
    alone, resisting = (
        path_task(robot, LimitSettings(tensions=TENSIONS, reserve=RESERVE), resist=some)
        for some in (None, box)
    )
    path = make_path(robot, POSES, "smooth")

    def plan(task: PathTask) -> None:
        plan_along_path(task, path, STATIONS)

    plan(resisting)
    works = [
        lambda: 1e3 * processor_seconds(lambda: plan(resisting)),
        lambda: 1e3 * processor_seconds(lambda: plan(alone)),
    ]
    own, other = interleaved(works, repeats)
    name = f"{ROBOT}: plan that resists {len(resisting.resist)} wrenches"
    baseline = "the plan without"
    return TimingRow(name, own, "ms", baseline, other, own / other, ratio_means="times as long")


def stream_row(repeats: int) -> TimingRow:
    """Motor angles of a router at 100 Hz, with the check between points, against the plan."""
    places = ([2.0, 1.5, 0.0], [2.2, 1.7, 0.0], [2.4, 1.4, 0.0])
    poses = [pose_from_angles(np.array(place), np.zeros(3)) for place in places]
    robot, given = load_robot(STREAMED), LimitSettings(cable_speed=0.05, reserve=RESERVE)
    task, path = path_task(robot, given), make_path(robot, poses, "smooth")
    run = PlanRun(
        robot=robot, limits=robot_limits(robot, given), arguments={}, planning_time=0.0,
        plan=plan_along_path(task, path, STATIONS), source="three places",
    )  # fmt: skip
    stream = cable_stream(run, 100.0)
    works = [
        lambda: 1e3 * processor_seconds(lambda: cable_stream(run, 100.0)),
        lambda: 1e3 * processor_seconds(lambda: plan_along_path(task, path, STATIONS)),
    ]
    own, other = interleaved(works, repeats)
    name = f"{STREAMED}: stream of {len(stream.times)} points with its check"
    return TimingRow(name, own, "ms", "the plan", other, own / other, ratio_means="times as long")


def rails_row(repeats: int) -> TimingRow:
    """The best place of two exit points on rails, against all places of a grid of 9 by 9."""
    robot = load_robot("planar")
    bases = robot.cable_set().p_WA
    directions = np.zeros((2, *bases.shape))
    directions[0, 1, 0] = directions[1, 1, 2] = 1.0
    most = np.full(2, 0.2)
    rails = Rails(directions, -most, most, np.zeros(2), bases)
    poses = [
        pose_from_angles(np.array([x, y, robot.plane_height]), np.zeros(3))
        for x, y in ((0.15, 0.1), (-0.1, -0.15))
    ]
    task = RailTask(static_case(robot, TENSIONS, pulleys=False), rails, poses)
    places = [
        np.array([a, b]) for a in np.linspace(-0.2, 0.2, 9) for b in np.linspace(-0.2, 0.2, 9)
    ]

    def ours() -> None:
        program = ReconfigurationProgram(task)
        program.AddLargestMargin()
        program.Solve(2)

    def grid() -> None:
        for place in places:
            task.margins(place)

    works = [lambda: 1e3 * processor_seconds(ours), lambda: 1e3 * processor_seconds(grid)]
    own, other = interleaved(works, repeats)
    name = "planar: two exit points on rails, two starts"
    baseline = "81 places, HiGHS by scipy"
    return TimingRow(name, own, "ms", baseline, other, other / own, ratio_means="times faster")


def station_programs(task: PathTask, path: PosePath, places: Array) -> list[dict[str, object]]:
    """For each station: the largest x with tensions within limits, over (u, x, redundancy)."""
    stations, _ = task.stations(path.points(places))
    lim = task.limits
    programs: list[dict[str, object]] = []
    for S in stations:
        A = np.column_stack([S[1], S[2], S[5:].T])
        programs.append(
            {
                "c": np.array([0.0, -1.0, *np.zeros(len(S) - 5)]),
                "A_ub": np.vstack([A, -A]),
                "b_ub": np.concatenate([lim.upper - S[0], S[0] - lim.lower]),
                "bounds": [(None, None), (0.0, 100.0), *[(None, None)] * (len(S) - 5)],
            }
        )
    return programs
