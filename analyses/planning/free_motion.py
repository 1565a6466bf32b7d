"""What users ask of a motion whose path is free, and its program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.robot_path_task import length_scale
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, TensionProblemError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import check_pose
from cdpr_drake.planning.failures import check_held
from cdpr_drake.planning.free_path import KNOTS, FreePathProgram
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.planning.free_path_terms import Capsule
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.trajectories.pose_path import straight_path

LEAST = ("time", "tension", "energy")
"""What a motion has least of: its time; the mean square of the tensions, in a given time; that
integrated over a time that is free or given."""

NEAREST = 0.1
"""Least depth of points that stay in view, where nobody says [m]."""

LONGEST = 60.0
"""Longest time of a motion whose time is free [s]."""

SHORTEST = 0.05

GUESSED_SPEED = 0.2
"""Of Po, for a first guess of the time where the straight line cannot be followed [m/s]."""

GUESSES = (1.3, 2.5, 5.0)
"""Times from which a solver starts, over the least along the straight line, until it succeeds."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeSettings:
    """What is asked of a free motion.

    Attributes:
        start: X_WP at its start [m].
        goal: X_WP at its end [m].
        least: One of `LEAST`.
        duration: Time from start to goal; None: free [s].
        knots: Of the program.
        clearance: Least distance of cables from each other, and of cables and platform from
            obstacles; None: not asked for [m].
        obstacles: Boxes, rows of `cable_interference.box_row`, shape (o, 15).
        in_view: Points of W that a camera on the platform sees all along, shape (3, p); None: no.
        camera: Name of the camera's mounting; None: the only one on the platform.
        nearest: Least depth of these points in the camera [m].
    """

    start: RigidTransform
    goal: RigidTransform
    least: str = "time"
    duration: float | None = None
    knots: int = KNOTS
    clearance: float | None = None
    obstacles: Array | None = None
    in_view: Array | None = None
    camera: str | None = None
    nearest: float = NEAREST

    def __post_init__(self) -> None:
        """Checks what belongs together.

        Raises:
            PlanningError: It is not accepted; names it.
        """
        if self.least not in LEAST:
            raise PlanningError(f"least: found {self.least!r}; accepted: {', '.join(LEAST)}")
        if self.least == "time" and self.duration is not None:
            raise PlanningError("duration: found one with the least time; accepted: none")
        if self.least == "tension" and self.duration is None:
            raise PlanningError(
                "duration: found none with the least tension, which longer motions always have "
                "less of; accepted: a time [s]"
            )
        if self.duration is not None and not SHORTEST <= self.duration <= LONGEST:
            raise PlanningError(
                f"duration: found {self.duration:g} s; accepted: {SHORTEST:g} to {LONGEST:g}"
            )
        if self.clearance is not None and not 0.0 <= self.clearance < np.inf:
            raise PlanningError(f"clearance: found {self.clearance:g} m; accepted: at least 0")
        if self.obstacles is not None and self.clearance is None:
            raise PlanningError("clearance: found none for the obstacles; accepted: one [m]")
        if not (np.isfinite(self.nearest) and self.nearest > 0.0):
            raise PlanningError(f"nearest: found {self.nearest:g} m; accepted: above 0")


@dataclass(frozen=True, eq=False)
class View:
    """A camera on the platform as a plan takes it.

    Attributes:
        X_PC: Its pose [m].
        slopes: Tangents of half of its view's angles along x and y of C.
    """

    X_PC: RigidTransform
    slopes: tuple[float, float]


def camera_view(robot: Robot, name: str | None) -> View:
    """The camera of a mounting on the platform.

    Raises:
        PlanningError: There is none of that name, or none or several and no name.
    """
    mounts = [mount for mount in robot.cameras if mount.parent == "platform"]
    names = [mount.name for mount in mounts]
    if name is None and len(mounts) != 1:
        raise PlanningError(
            f"camera: found {len(mounts)} on the platform of {robot.name} and no name; accepted: "
            f"{'the name of one of ' + ', '.join(names) if names else 'a robot that has one'}"
        )
    if name is not None and name not in names:
        raise PlanningError(
            f"camera: found {name!r}; accepted for {robot.name}: {', '.join(names) or 'none'}"
        )
    mount = mounts[0] if name is None else next(one for one in mounts if one.name == name)
    camera = load_camera(mount.model)
    angles = camera.view_angle_horizontal_deg, camera.view_angle_vertical_deg
    slopes = [float(np.tan(0.5 * np.radians(angle))) for angle in angles]
    return View(mount.pose.transform(), (slopes[0], slopes[1]))


def solve_free_motion(
    robot: Robot,
    task: PathTask,
    asked: FreeSettings,
    say: Callable[[str], None] = lambda words: None,
) -> FreePathSolution:
    """Plans a motion from rest to rest whose path is free.

    Po stays in the robot's frame; limits of tensions, winches and the speed of Po are kept at the
    knots, cable speeds also halfway between. The solver starts from the straight line, in times
    from `GUESSES` on, until it succeeds; what it finds is the best nearby, not of all.

    Args:
        robot: The robot.
        task: The robot and its limits.
        asked: What is asked.
        say: Told what is done now.

    Raises:
        PlanningError: A number is not accepted, the platform cannot rest at an end, or no motion
            was found; says where, and which cable.
    """
    for where, X_WP in (("from", asked.start), ("to", asked.goal)):
        try:
            check_pose(robot, X_WP)
        except TensionProblemError as problem:
            raise PlanningError(f"{where}: {problem}") from problem
        check_held(task, X_WP, where)
    if max(pose_error(asked.start, asked.goal)) < 1e-9:
        raise PlanningError("to: found the pose of the start; accepted: another one")
    least = _straight_time(robot, task, asked)
    guesses = [least * share for share in GUESSES] if asked.duration is None else [asked.duration]
    solution = None
    for number, guess in enumerate(guesses, 1):
        say(f"Planning for {robot.name}: start {number} of {len(guesses)}")
        bounds = (SHORTEST, LONGEST) if asked.duration is None else (asked.duration,) * 2
        program = _program(robot, task, asked, bounds)
        solution = program.Solve(float(np.clip(guess, SHORTEST, LONGEST)))
        if solution.success:
            break
    assert solution is not None
    solution.motion()  # raises where there is none
    return solution


def _program(
    robot: Robot, task: PathTask, asked: FreeSettings, bounds: tuple[float, ...]
) -> FreePathProgram:
    program = FreePathProgram(task, asked.start, asked.goal, asked.knots, (bounds[0], bounds[1]))
    program.AddCableSpeedLimits()
    program.AddWinchLimits()
    program.AddPlaceBounds(robot.frame.lower, robot.frame.upper)
    if asked.least == "time":
        program.AddLeastTime()
    elif asked.least == "tension":
        program.AddTensionCost()
    else:
        program.AddEnergyCost()
    if asked.clearance is not None:
        radius = 0.5 * float(np.max(robot.diameters()))
        program.AddCableClearance(asked.clearance + 2.0 * radius)
        if asked.obstacles is not None:
            capsules = [Capsule.around(box) for box in asked.obstacles]
            ball = robot.box_center(), 0.5 * float(np.linalg.norm(robot.platform.size))
            program.AddObstacles(capsules, asked.clearance + radius, ball)
    if asked.in_view is not None:
        view = camera_view(robot, asked.camera)
        program.AddFieldOfView(view.X_PC, view.slopes, asked.in_view, asked.nearest)
    return program


def _straight_time(robot: Robot, task: PathTask, asked: FreeSettings) -> float:
    """Least time along the straight line, or a guess where that cannot be followed [s]."""
    scale = length_scale(robot)
    try:
        return plan_along_path(task, straight_path([asked.start, asked.goal], scale)).duration
    except PlanningError:
        distance, angle = pose_error(asked.start, asked.goal)
        return float(np.hypot(distance, scale * angle)) / GUESSED_SPEED
