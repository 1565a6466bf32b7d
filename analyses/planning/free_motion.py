"""A motion of a robot whose path is free: its program, and where the solver starts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.robot_path_task import length_scale
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, TensionProblemError, accepted_names
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import pose_error, pose_row
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import check_pose
from cdpr_drake.planning.failures import check_held
from cdpr_drake.planning.free_path import KNOTS, FreePathProgram
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.planning.place_constraints import (
    CableClearance,
    ObstacleClearance,
    PlaceWithin,
    TargetInView,
)
from cdpr_drake.planning.pose_constraint import PoseConstraint
from cdpr_drake.planning.pose_coordinates import BodyState, Coordinates
from cdpr_drake.planning.tension_constraints import TensionFeasible
from cdpr_drake.trajectories.pose_path import PosePath, straight_path
from cdpr_drake.trajectories.timed_path import TimedPath
from cdpr_drake.workspaces.cable_interference import Obstacles, box_row

LEAST = ("time", "tension", "energy")
"""What a motion has least of: its time; the mean square of the tensions, in a given time; that
integrated over a time that is free or given."""

NEAREST = 0.1  # default of the least depth of points that stay in view [m]
SHORTEST, LONGEST = 0.05, 60.0  # times of a motion [s]

GUESSED_SPEED = 0.2
"""Of Po, for a first guess of the time where the straight line cannot be followed [m/s]."""

END_MISSED = 1e-6  # an end that misses a distance by less keeps it [m]: the solver is no more exact

GUESS_WITHIN = 1e-3
"""By which the ends of a guess may be off [m, rad]: files have rounded numbers, and the solver
keeps the ends by itself."""

GUESSES = (1.3, 2.5, 5.0)
"""Times from which a solver starts, over the least along the straight line, until it succeeds."""

LOOKS = 80  # poses of a way that are looked at
DIRECTIONS = 8  # directions across the straight line into which ways lead
STEPS = 24  # distances from the straight line that are tried in a direction, up to its length

SHARES = (0.0, 0.2, 0.5)
"""Of the straight line: where a way leaves it and, from the other end, comes back to it."""

MOST_DETOURS = 4  # ways that are given, each in a direction of its own

Guess: TypeAlias = PosePath | TimedPath | None
"""Where the solver starts; None: the straight line."""


@dataclass(frozen=True, eq=False)
class View:
    """Points of W that a camera on the platform sees all along.

    Attributes:
        X_PC: Pose of the camera [m].
        slopes: Tangents of half of its view's angles along x and y of C.
        points: Shape (3, p) [m].
        nearest: Least depth of these in the camera [m].
    """

    X_PC: RigidTransform
    slopes: tuple[float, float]
    points: Array
    nearest: float = NEAREST


def camera_view(robot: Robot, name: str | None, points: Array, nearest: float = NEAREST) -> View:
    """The view of the camera of a mounting on the platform; default: the only one.

    Raises:
        PlanningError: There is none of that name, or none or several and no name, or the least
            depth is not accepted.
    """
    if not (np.isfinite(nearest) and nearest > 0.0):
        raise PlanningError(f"nearest: found {nearest:g} m; accepted: above 0")
    mounts = {mount.name: mount for mount in robot.cameras if mount.parent == "platform"}
    if name is None and len(mounts) != 1:
        raise PlanningError(
            f"camera: found {len(mounts)} on the platform of {robot.name} and no name; accepted: "
            f"{'the name of one of ' + ', '.join(mounts) if mounts else 'a robot that has one'}"
        )
    if name is not None and name not in mounts:
        raise PlanningError(
            f"camera: found {name!r}; accepted for {robot.name}: {', '.join(mounts) or 'none'}"
        )
    mount = mounts[next(iter(mounts)) if name is None else name]
    return View(mount.pose.transform(), load_camera(mount.model).view_slopes(), points, nearest)


def solve_free_motion(
    robot: Robot, task: PathTask, start: RigidTransform, goal: RigidTransform, *,
    least: str = "time", duration: float | None = None, knots: int = KNOTS,
    clearance: float | None = None, obstacles: Obstacles | None = None, view: View | None = None,
    guess: Guess = None, say: Callable[[str], None] = lambda words: None,
) -> FreePathSolution:  # fmt: skip
    """Plans a motion from rest to rest whose path is free.

    Po stays in the robot's frame; limits of tensions, winches and the speed of Po are kept at the
    knots, cable speeds also halfway between, distances and the view wherever the motion is looked
    at. The solver starts from the straight line, in times from `GUESSES` on, until it succeeds;
    where that is not free, from detours that are, the shortest first. What it finds is the best
    nearby, not of all. Where no start keeps between the knots what was asked, the first motion that
    does at the knots is given, whose `status` says what it misses.

    Args:
        robot: The robot.
        task: The robot and its limits.
        start: X_WP at the start [m].
        goal: X_WP at the end [m].
        least: One of `LEAST`.
        duration: Time from start to goal; None: free [s].
        knots: Of the program.
        clearance: Least distance of cables from each other, and of cables and platform from
            obstacles; None: not asked for [m].
        obstacles: What stands in the way.
        view: What a camera on the platform sees all along.
        guess: Where the solver starts, from start to goal; None: the straight line, or detours
            where something stands in its way.
        say: Told what is done now.

    Raises:
        PlanningError: A number is not accepted, the platform cannot rest at an end, or no motion
            was found; says where, and which cable.
    """
    _check_numbers(least, duration, clearance, obstacles)
    for where, X_WP in (("from", start), ("to", goal)):
        try:
            check_pose(robot, X_WP)
        except TensionProblemError as problem:
            raise PlanningError(f"{where}: {problem}") from problem
        check_held(task, X_WP, where)
    if max(pose_error(start, goal)) < 1e-9:
        raise PlanningError("to: found the pose of the start; accepted: another one")

    def places(coordinates: Coordinates) -> list[PoseConstraint]:
        return place_constraints(robot, task, coordinates, clearance, obstacles, view)

    blocked = None if clearance is None or obstacles is None else places(BodyState())
    guesses = _guesses(task, length_scale(robot), (start, goal), duration, guess, blocked)
    bounds = (SHORTEST, LONGEST) if duration is None else (duration, duration)
    solution = None
    for number, (path, time) in enumerate(guesses, 1):
        say(f"Planning for {robot.name}: start {number} of {len(guesses)}")
        program = FreePathProgram(task, start, goal, knots, bounds)
        program.AddCableSpeedLimits()
        program.AddWinchLimits()
        if least == "time":
            program.AddLeastTime()
        elif least == "tension":
            program.AddTensionCost()
        else:
            program.AddEnergyCost()
        for constraint in places(program.pose_coordinates):
            program.Add(constraint)
        candidate = program.Solve(float(np.clip(time, SHORTEST, LONGEST)), path)
        if solution is None or solution.trajectory is None or candidate.success:
            solution = candidate
        if candidate.success:
            break
    assert solution is not None
    solution.motion()  # raises where there is none
    return solution


def _check_numbers(
    least: str, duration: float | None, clearance: float | None, obstacles: Obstacles | None
) -> None:
    if least not in LEAST:
        raise PlanningError(f"least: found {least!r}; {accepted_names(least, LEAST)}")
    if least == "time" and duration is not None:
        raise PlanningError("duration: found one with the least time; accepted: none")
    if least == "tension" and duration is None:
        raise PlanningError(
            "duration: found none with the least tension, which longer motions always have "
            "less of; accepted: a time [s]"
        )
    if duration is not None and not SHORTEST <= duration <= LONGEST:
        raise PlanningError(
            f"duration: found {duration:g} s; accepted: {SHORTEST:g} to {LONGEST:g}"
        )
    if clearance is not None and not 0.0 <= clearance < np.inf:
        raise PlanningError(f"clearance: found {clearance:g} m; accepted: at least 0")
    if obstacles is not None and clearance is None:
        raise PlanningError("clearance: found none for the obstacles; accepted: one [m]")


def place_constraints(
    robot: Robot, task: PathTask, coordinates: Coordinates, clearance: float | None,
    obstacles: Obstacles | None, view: View | None,
) -> list[PoseConstraint]:  # fmt: skip
    """What is asked of poses alone: the frame, cables apart, obstacles, the view."""
    cables, names = task.cables, [task.name(i) for i in range(task.cables.count)]
    constraints: list[PoseConstraint] = []
    if not robot.frame.assumed:
        constraints.append(PlaceWithin(coordinates, *robot.frame.bounds()))
    if clearance is not None:
        radius = 0.5 * float(np.max(robot.diameters()))
        constraints.append(CableClearance(cables, coordinates, clearance + 2.0 * radius, names))
        shapes = () if obstacles is None else obstacles.shapes()
        if shapes:
            bodies = [ConvexShape.box(box_row(robot.box_center(), robot.platform.size))]
            constraints.append(
                ObstacleClearance(
                    cables, coordinates, shapes, bodies, clearance + radius, clearance, names=names
                )
            )
    if view is not None:
        constraints.append(
            TargetInView(coordinates, view.X_PC, view.slopes, view.points, view.nearest)
        )
    return constraints


def _guesses(
    task: PathTask, scale: float, ends: tuple[RigidTransform, RigidTransform],
    duration: float | None, guess: Guess, places: list[PoseConstraint] | None,
) -> list[tuple[Guess, float]]:  # fmt: skip
    """Where the solver starts, one after the other, and in what time.

    `places` is what poses have to keep where obstacles stand; None without obstacles.
    """
    shares = GUESSES if duration is None else (1.0,)
    straight = straight_path(ends, scale)

    def timed(path: PosePath) -> float:
        return _time_along(task, path) if duration is None else duration

    if isinstance(guess, TimedPath):  # which the solver starts from in its own time
        _check_guess(ends, guess.pose(guess.start_time), guess.pose(guess.end_time))
        return [(guess, guess.end_time - guess.start_time)]
    if guess is not None:
        _check_guess(ends, guess.pose(0.0), guess.pose(guess.length))
        least = timed(guess)
        return [(guess, share * least) for share in shares]
    if places is not None:
        for where, X_WP in zip(("from", "to"), ends, strict=True):
            _check_clear(places, X_WP, where)
    least = timed(straight)
    lines: list[tuple[Guess, float]] = [(None, share * least) for share in shares]
    if places is None:
        return lines
    held = [*places, TensionFeasible(task, BodyState())]
    if is_free(held, straight):
        return lines
    moves = [row - 3 for row in task.dynamics.motions if row >= 3]
    ways = detours(held, *ends, scale, moves)
    return [*((path, shares[0] * timed(path)) for path in ways), *lines[:1]]


def _check_guess(
    ends: tuple[RigidTransform, RigidTransform], first: RigidTransform, last: RigidTransform
) -> None:
    for word, X_guess, X_end in zip(("begins", "ends"), (first, last), ends, strict=True):
        way, angle = pose_error(X_guess, X_end)
        if max(way, angle) > GUESS_WITHIN:
            raise PlanningError(
                f"guess: {word} {way:.4g} m and {np.degrees(angle):.4g} deg from there; "
                "accepted: a path or motion from the start to the goal"
            )


def _check_clear(places: list[PoseConstraint], X_WP: RigidTransform, where: str) -> None:
    for place in places:
        values, _ = place.evaluate(pose_row(X_WP)[np.newaxis])
        gaps = place.missed(values)[0]
        row = int(np.argmax(gaps))
        if gaps[row] > END_MISSED:
            raise PlanningError(
                f"{where}: found {values[0, row]:.4g} m of {place.rows[row]} "
                f"({place.description}); accepted: at least {place.lower[row]:.4g} m"
            )


def _time_along(task: PathTask, path: PosePath) -> float:
    """Least time along a path, or a guess where it cannot be followed [s]."""
    try:
        return plan_along_path(task, path).duration
    except PlanningError:
        return path.length / GUESSED_SPEED


def is_free(constraints: Sequence[PoseConstraint], path: PosePath) -> bool:
    """Whether a path keeps constraints of `BodyState` at every pose that is looked at."""
    rows = path.points(np.linspace(0.0, path.length, LOOKS))[:, :7]
    return all(not np.any(each.missed(each.evaluate(rows)[0]) > 0.0) for each in constraints)


def detours(
    constraints: Sequence[PoseConstraint], start: RigidTransform, goal: RigidTransform,
    length_scale: float, moves: Sequence[int] = (0, 1, 2),
) -> list[PosePath]:  # fmt: skip
    """Ways of three or four straight lines that keep constraints, the shortest first.

    They leave the straight line across, go along it, and come back; of each direction the shortest
    is kept.

    Args:
        constraints: Of `BodyState`, of poses alone or at rest.
        start: X_WP at the start [m].
        goal: X_WP at the goal [m].
        length_scale: By which turns count as lengths [m].
        moves: Axes of W along which the platform can move.
    """
    way = goal.translation() - start.translation()
    length = float(np.linalg.norm(way))
    best: list[PosePath] = []
    for across in _across(way, moves):
        ways: list[PosePath] = []
        for share in SHARES:
            for step in range(1, STEPS + 1):
                off = across * (length * step / STEPS)
                first = RigidTransform(start.rotation(), start.translation() + share * way + off)
                last = RigidTransform(goal.rotation(), goal.translation() - share * way + off)
                corners = [first] if share == 0.5 else [first, last]
                path = straight_path([start, *corners, goal], length_scale)
                if is_free(constraints, path):
                    ways.append(path)
                    break
        if ways:
            best.append(min(ways, key=lambda path: path.length))
    return sorted(best, key=lambda path: path.length)[:MOST_DETOURS]


def _across(way: Array, moves: Sequence[int]) -> list[Array]:
    """Unit vectors across a way, of those along which the platform can move."""
    free = np.zeros((3, 3))
    free[list(moves), list(moves)] = 1.0
    length = float(np.linalg.norm(way))
    if length > 0.0:
        free -= np.outer(way, way) / length**2
    values, vectors = np.linalg.eigh(free @ free.T)
    plane = vectors[:, values > 0.5]
    if plane.shape[1] == 0:
        return []
    if plane.shape[1] == 1:
        return [plane[:, 0], -plane[:, 0]]
    # Upwards first: the second axis of the plane is as vertical as it can be.
    up = plane @ (plane.T @ np.array([0.0, 0.0, 1.0]))
    if np.linalg.norm(up) < 1e-9:
        up = plane[:, 0]
    up = up / np.linalg.norm(up)
    side = plane @ (plane.T @ np.cross(way if length > 0.0 else [1.0, 0.0, 0.0], up))
    side = side / np.linalg.norm(side)
    angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return [np.cos(angle) * up + np.sin(angle) * side for angle in angles]
