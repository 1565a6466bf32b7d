"""The fastest motion of a robot along a path, and a motion whose path is free."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.planning.free_motion import FreeSettings, solve_free_motion
from cdpr_drake.analyses.planning.free_plan_results import FreeRun
from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.analyses.planning.plan_results import PlanRun
from cdpr_drake.analyses.planning.plan_tracking import TrackedPlan, track_plan
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    TOLERANCE,
    LimitSettings,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.analyses.workspaces.workspace_files import load_obstacles, load_wrench_set
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, WrenchSetError
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import STATIONS, PathPlan, plan_along_path
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.trajectories.curved_path import Move
from cdpr_drake.trajectories.sampled_motion import read_motion
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Say = Callable[[str], None]
"""Told what is done now."""

Limits = LimitSettings | Mapping[str, Any] | None
"""`LimitSettings`, or some of its fields by name."""

ASKED = tuple(field.name for field in fields(FreeSettings) if field.name not in ("start", "goal"))
"""What `plan_free_motion` can be asked for by name."""


class DrawnPlan(PlanRun):
    """A `PlanRun` that draws itself."""

    def plot(self) -> Figure:
        """The phase plane: speed along the path with its limits."""
        from cdpr_drake.analyses.planning.plan_figures import phase_figure

        return phase_figure(self)


class DrawnFreePlan(FreeRun):
    """A `FreeRun` that draws itself."""

    def plot(self) -> Figure:
        """How much of each limit is used over time."""
        from cdpr_drake.analyses.planning.free_plan_figures import limits_figure

        return limits_figure(self)


@dataclass(frozen=True)
class PathPoses:
    """Poses of a path.

    Attributes:
        poses: X_WP, one after the other [m].
        source: What the path is, in words.
        remarks: What was left out of a file, a line each.
        moves: How it goes from each to the next: lines, arcs, feeds; none: not said.
    """

    poses: list[RigidTransform]
    source: str
    remarks: tuple[str, ...] = ()
    moves: tuple[Move, ...] = ()


def path_poses(robot: Robot, path: PathPoses | Path | str | Sequence[object]) -> PathPoses:
    """Poses of a path of a robot.

    Args:
        robot: The robot.
        path: A file, .csv of x,y,z[,phi,theta,psi] [m, deg] or G-code; or at least two poses, each
            as `as_pose` takes it [m].

    Raises:
        DataFileError: The file cannot be read, or a line is not accepted.
        PlanningError: There are fewer than two poses.
    """
    if isinstance(path, PathPoses):
        return path
    if isinstance(path, str | Path):
        read = read_path(Path(path), robot.plane_height)
        return PathPoses(read.poses, Path(path).name, read.remarks, read.moves)
    poses = [as_pose(robot, pose) for pose in path]
    if len(poses) < 2:
        raise PlanningError(f"path: found {len(poses)} poses; accepted: at least 2")
    return PathPoses(poses, f"{len(poses)} waypoints")


TRACKING = "computed torque, which --track asks for"


@verb()
def plan_path(
    robot: Robot | str | Path,
    path: PathPoses | Path | str | Sequence[object],
    limits: Limits = None,
    *,
    corners: str = "smooth",
    tolerance: float = TOLERANCE,
    stations: int = STATIONS,
    pulleys: bool = True,
    resist: SpatialSet | Path | str | None = None,
    track: bool = False,
    say: Say | None = None,
) -> DrawnPlan:
    """The fastest motion of a robot along a path, within limits of tensions and winches.

    Args:
        robot: The robot, or its name or path.
        path: A file or poses, as `path_poses` takes them [m].
        limits: Beside the robot's: `tensions` (2,) [N], `cable_speed` [m/s],
            `cable_acceleration` [m/s^2], `speed` [m/s], `reserve` [-], `feeds`, see
            `LimitSettings`.
        corners: At the poses: smooth (a spline), blend (rounded corners) or rest.
        tolerance: How far rounded corners may pass from a pose [m].
        stations: Points at which limits are asked.
        pulleys: Whether the cables run over the robot's pulleys.
        resist: Wrenches on the platform about Po in W [N m, N], a polytope or a box, or their file:
            at every point of the path tensions must exist for the motion alone, and with each.
        track: Whether the simulated robot also tracks the plan.
        say: Called with a line on what is done now.

    Raises:
        PlanningError: No motion keeps the limits, or something is not accepted; names the place
            and the cable.
        CdprError: The path makes no sense.
    """
    loaded, given = as_robot(robot, "plan_path"), chosen_limits(limits)
    if track:
        loaded.servo_rows(TRACKING)  # a refusal comes before the work
    task = planned_for(loaded, given, pulleys, resist)
    found = path_poses(loaded, path)
    moves = found.moves
    if not given.feeds:
        moves = tuple(replace(move, speed=np.inf) for move in moves)
    way = make_path(loaded, found.poses, corners, tolerance, moves)
    arguments = limits_told(given, pulleys) | {
        "path": str(path) if _is_file(path) else None,
        "waypoints": None if _is_file(path) else [_row(X) for X in found.poses],
        "corners": corners,
        "tolerance_m": tolerance,
        "stations": stations,
    }
    if moves:
        arguments["feeds"] = given.feeds
        arguments["arcs"] = sum(move.arc is not None for move in moves)
        known = [move.speed for move in moves if np.isfinite(move.speed)]
        arguments["feed_range_m_s"] = [min(known), max(known)] if known else None
    if resist is not None:
        arguments["resist"] = str(resist) if _is_file(resist) else task.resist.tolist()
    begin = time.perf_counter()
    plan = plan_along_path(task, way, stations)
    took = time.perf_counter() - begin
    told = _told(loaded, given, plan, say, track)
    return DrawnPlan(
        plan=plan, source=found.source, arguments=arguments, planning_time=took, **told
    )  # fmt: skip


@verb()
def plan_free_motion(
    robot: Robot | str | Path,
    start: object,
    goal: object,
    limits: Limits = None,
    *,
    pulleys: bool = True,
    track: bool = False,
    say: Say | None = None,
    **asked: Any,
) -> DrawnFreePlan:
    """A motion of a robot from one pose to another whose path is free, within limits.

    Args:
        robot: The robot, or its name or path.
        start: X_WP at its start, as `as_pose` takes it [m]; None: the home pose.
        goal: X_WP at its end, likewise.
        limits: As of `plan_path`.
        pulleys: Whether the cables run over the robot's pulleys.
        track: Whether the simulated robot also tracks the motion.
        say: Called with a line on what is done now.
        asked: Fields of `FreeSettings`: `least` (time, tension or energy), `duration` [s],
            `knots`, `clearance` [m], `obstacles` (`Obstacles`, rows of boxes or a file), `in_view`
            (3, p) [m], `camera`, `guess` (a path or motion, or motion.csv of another plan),
            `nearest` [m].

    Raises:
        PlanningError: No motion was found, or something is not accepted; names it.
    """
    check_asked(asked, ASKED)
    loaded, given = as_robot(robot, "plan_free_motion"), chosen_limits(limits)
    for name, read in (("obstacles", load_obstacles), ("guess", read_motion)):
        if name in asked:
            asked[name] = read_where_file(asked[name], read)
    settings = FreeSettings(start=as_pose(loaded, start), goal=as_pose(loaded, goal), **asked)
    task = planned_for(loaded, given, pulleys)
    begin = time.perf_counter()
    found = solve_free_motion(loaded, task, settings, say or silent)
    took = time.perf_counter() - begin
    arguments = limits_told(given, pulleys) | {
        "from": _row(settings.start),
        "to": _row(settings.goal),
        **asked_told(asked, ("obstacles", "guess")),
        **{
            name: settings.solids().boxes.tolist() if name == "obstacles" else "given"
            for name in ("obstacles", "guess")
            if asked.get(name) is not None
        },
    }
    told = _told(loaded, given, found, say, track)
    return DrawnFreePlan(
        asked=settings, solution=found, arguments=arguments, planning_time=took, **told
    )


def _told(
    robot: Robot, given: LimitSettings, found: PathPlan | FreePathSolution, say: Say | None,
    track: bool,
) -> dict[str, Any]:  # fmt: skip
    """What every `MotionRun` has; tracks the motion where that is wanted."""
    own, tracked = tracked_by(robot, given, found, say, track)
    return {"robot": robot, "limits": own, "tracked": tracked}


def tracked_by(
    robot: Robot, given: LimitSettings, found: PathPlan | FreePathSolution, say: Say | None,
    track: bool,
) -> tuple[MotionLimits, TrackedPlan | None]:  # fmt: skip
    """The robot's limits without reserve, and what it does with a motion, if that is wanted."""
    own, tracked = robot_limits(robot, given), None
    if track:
        tell, end = say or silent, found.duration
        tell(f"Tracking the plan of {robot.name}")

        def show(now: float) -> None:
            tell(f"Tracking the plan of {robot.name}: {now:.0f} of {end:.0f} s")

        tracked = track_plan(robot, found, own, show)
    return own, tracked


def chosen_limits(limits: Limits) -> LimitSettings:
    """Settings of limits by name, with a plan's reserve; raises PlanningError for unknown names."""
    if not isinstance(limits, LimitSettings):
        known = [field.name for field in fields(LimitSettings)]
        for name in limits or {}:
            if name not in known:
                raise PlanningError(f"limits: {name!r} is unknown; {closest(name, known)}")
        limits = LimitSettings(**(limits or {}))
    return replace(limits, reserve=RESERVE) if limits.reserve is None else limits


def planned_for(
    robot: Robot,
    given: LimitSettings,
    pulleys: bool,
    resist: SpatialSet | Path | str | None = None,
) -> PathTask:
    """The robot as it is planned with; `resist` is a set of wrenches, or its file."""
    cables = robot.cable_set(pulleys)
    if not isinstance(resist, str | Path):
        return path_task(robot, given, cables, resist)
    wrenches = load_wrench_set(Path(resist))
    try:
        return path_task(robot, given, cables, wrenches)
    except WrenchSetError as problem:
        raise WrenchSetError(f"{resist}: {problem}") from problem


def limits_told(given: LimitSettings, pulleys: bool) -> dict[str, Any]:
    """What was asked of limits, for JSON."""
    return {
        "limits_n": given.tensions,
        "cable_speed_m_s": given.cable_speed,
        "cable_acceleration_m_s2": given.cable_acceleration,
        "speed_m_s": given.speed,
        "reserve": given.reserve,
        "pulleys": pulleys,
    }


def _is_file(path: object) -> bool:
    return isinstance(path, str | Path)


def _row(X_WP: RigidTransform) -> list[float]:
    """x, y, z [m], phi, theta, psi [deg]."""
    return in_degrees(pose_numbers(X_WP))


def pose_numbers(X_WP: RigidTransform) -> np.ndarray:
    """Position [m] and angles (phi, theta, psi) [rad], shape (6,)."""
    return np.concatenate([X_WP.translation(), angles_from_rotation(X_WP.rotation())])


def in_degrees(numbers: Array) -> list[float]:
    """x, y, z [m], phi, theta, psi [deg] of position and angles, shape (6,) [m, rad]."""
    return [*numbers[:3].tolist(), *np.degrees(numbers[3:]).tolist()]


def check_asked(asked: Mapping[str, Any], known: Sequence[str]) -> None:
    """Raises PlanningError for a name that is not known."""
    for name in asked:
        if name not in known:
            raise PlanningError(f"{name!r} is unknown; {closest(name, known)}")


def asked_told(asked: Mapping[str, Any], without: Sequence[str]) -> dict[str, Any]:
    """What was asked for by name, for JSON, but some of it."""
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in asked.items()
        if name not in without
    }


def read_where_file(value: Any, read: Callable[[Path], Any]) -> Any:
    """What a file has where its path is given; else the value."""
    return read(Path(value)) if _is_file(value) else value


def silent(words: str) -> None:
    """Tells nobody."""
