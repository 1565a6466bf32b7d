"""What kinds and measures of workspaces have to know of a robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.workspaces.conditions import (
    KINDS,
    OF_BREAKS,
    SURVIVES,
    CameraView,
    PoseConditions,
    SimulatedBreaks,
)
from cdpr_drake.analyses.workspaces.servo_stability import (
    robot_stability,
    scenario_view,
    servo_scenario,
    visual_servo,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError, WorkspaceError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.cameras.targets import TARGETS
from cdpr_drake.tensions.methods import method_for
from cdpr_drake.workspaces.cable_interference import Obstacles, Surroundings, beams, box_row
from cdpr_drake.workspaces.demanded_wrenches import MotionDemand, SpatialSet
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.static_feasibility import StaticCase

REDUNDANT = ("wrench-closure", "single-failure", "failure-margin", "breaks-survived")
"""Kinds and measures that make sense only with more cables than degrees of freedom."""

NEEDS = {
    "required": "with required, with force or with moment", "motion": "with accelerations",
    "view": "with scenario",
}  # fmt: skip
"""Arguments that give what a kind needs."""

ANCHOR_DIAMETERS = 10.0
"""Next to its anchor point a cable is not compared with the platform over so many diameters, and
as far as the deepest anchor point lies within the platform's box."""

BREAKING = "acrobot_broken_redistributed"
"""The scenario whose sections count for the kind `dynamic-single-failure` by default."""


def static_case(
    robot: Robot, limits: tuple[float, float] | None = None, mass: float | None = None,
    wrench: Array | None = None, pulleys: bool = True,
) -> StaticCase:  # fmt: skip
    """A robot's platform on its cables.

    Args:
        robot: The robot; a planar one balances (moment about z, f_x, f_y) only.
        limits: Smallest and largest tension [N]; None: the robot's.
        mass: Mass of the platform [kg]; None: the robot's.
        wrench: External wrench on the platform about Po in W, beside its weight, shape (6,)
            (moment, force) [N m, N].
        pulleys: True: cables run over the robot's pulleys. False: pulleys are ignored.

    Raises:
        TensionProblemError: Too few cables, or a number makes no sense.
    """
    low, high = robot.tension_limits(limits)
    if not (np.isfinite(high) and 0.0 <= low <= high):
        raise TensionProblemError(
            f"tension limits: found {low:g} to {high:g}; accepted: 0 <= lower <= upper [N]"
        )
    load = np.zeros(6) if wrench is None else np.asarray(wrench, float)
    if load.shape != (6,) or not np.all(np.isfinite(load)):
        raise TensionProblemError(
            f"wrench: found shape {load.shape}, or numbers that are not finite; accepted: 6 "
            "(moment [N m], force [N])"
        )
    m, rows = len(robot.cables), robot.motion_type().rows
    if rows is None:
        raise TensionProblemError(
            f"robot {robot.name}: found {robot.motion} with axis {robot.motion_type().axis}; "
            "accepted for workspaces: motions along axes of W, and not 2R3T"
        )
    weight = (robot.platform.mass if mass is None else mass) * robot.gravity
    return StaticCase(
        robot.cable_set(pulleys), np.full(m, low), np.full(m, high), weight,
        robot.center_of_mass(), wrench=load, rows=rows, down=robot.down(),
    )  # fmt: skip


def interference_bodies(
    robot: Robot, obstacles: Array | Obstacles | None = None, exit_free: float | None = None,
    anchor_free: float | None = None, pulleys: bool = True,
) -> Surroundings:  # fmt: skip
    """What a robot's cables and platform may meet: the platform's box, beams and obstacles.

    Args:
        robot: The robot.
        obstacles: Boxes, shape (o, 15), or these and convex shapes; None: none.
        exit_free: Length next to exit points that is not compared with the frame [m]; None: the
            thickness of the beams.
        anchor_free: Length next to anchor points that is not compared with the platform [m]; None:
            as `ANCHOR_DIAMETERS` says.
        pulleys: True: cables run over the robot's pulleys. False: pulleys are ignored.

    Raises:
        WorkspaceError: A length is negative.
    """
    frame, width = robot.frame, robot.frame.beam_width()
    body = box_row(robot.box_center(), robot.platform.size)
    if anchor_free is None:
        inside = body[12:, np.newaxis] - np.abs(robot.cable_set().p_PB - body[9:12, np.newaxis])
        deepest = float(np.max(np.min(inside, axis=0)))
        anchor_free = max(deepest, 0.0) + ANCHOR_DIAMETERS * float(np.max(robot.diameters()))
    fixtures = beams(frame.lower, frame.upper, width)
    if frame.beams:
        fixtures = np.array([
            box_row((beam.start + beam.end) / 2.0, beam.size(width), beam.axes())
            for beam in frame.beams
        ])  # fmt: skip
    bodies = as_obstacles(obstacles)
    return Surroundings(
        robot.cable_set(pulleys), robot.diameters() / 2.0, body[np.newaxis], fixtures,
        bodies.boxes, width if exit_free is None else exit_free, anchor_free, bodies.solids,
    )  # fmt: skip


def as_obstacles(obstacles: Array | Obstacles | None) -> Obstacles:
    """Obstacles of boxes, shape (o, 15); None: none."""
    if isinstance(obstacles, Obstacles):
        return obstacles
    return Obstacles() if obstacles is None else Obstacles(np.asarray(obstacles, float))


def pose_conditions(
    robot: Robot, *, limits: tuple[float, float] | None = None, mass: float | None = None,
    wrench: Array | None = None, required: SpatialSet | None = None,
    accelerations: SpatialSet | None = None, velocities: Array | None = None,
    clearance: float = 0.0, around: Surroundings | None = None, scenario: Any = None,
    pulleys: bool = True, method: str | None = None,
) -> PoseConditions:  # fmt: skip
    """What kinds and measures know of a robot, without stability and simulated breaks.

    Args:
        robot: The robot.
        limits: As `static_case`, like wrench and pulleys.
        mass: Mass of the platform [kg]; None: the robot's. Its inertia is spread as the robot's.
        wrench: As `static_case`.
        required: Wrenches to resist.
        accelerations: Accelerations to have (angular, linear) [rad/s^2, m/s^2].
        velocities: Velocities at which to have them, shape (k, 6) [rad/s, m/s].
        clearance: Least clearance [m].
        around: What cables and platform may meet; None: `interference_bodies` of the robot.
        scenario: Name or path of the scenario whose camera shall see its target.
        pulleys: As `static_case`.
        method: Method whose tensions must hold the weight for the kind `static`; None: any
            tensions.

    Raises:
        CdprError: A value makes no sense for the robot.
    """
    if not (np.isfinite(clearance) and clearance >= 0.0):
        raise WorkspaceError(f"clearance: found {clearance:g}; accepted: >= 0 [m]")
    case = static_case(robot, limits, mass, wrench, pulleys)
    if method is not None:
        method_for(method, case.cables.count - len(case.rows), False)
    platform = rigid_platform(robot)
    mass = robot.platform.mass if mass is None else mass
    body = mass, platform.p_PCo, platform.I_PPo * (mass / platform.mass)
    motion = None
    if accelerations is not None or velocities is not None:
        rates = np.zeros((1, 6)) if velocities is None else velocities
        motion = MotionDemand(*body, accelerations or SpatialSet(), rates)
    return PoseConditions(
        case, around or interference_bodies(robot, pulleys=pulleys), robot.gravity, body,
        clearance, required, motion,
        None if scenario is None else _camera_view(robot, scenario), method=method,
    )  # fmt: skip


def _camera_view(robot: Robot, scenario: Any) -> CameraView:
    """The resting target of a scenario, and the camera on the platform that shall see it."""
    servo = servo_scenario(robot, scenario)
    return CameraView(
        TARGETS[servo.target.kind](servo.target), servo.target.pose.transform(),
        robot.camera_mount(servo.camera.mount).pose.transform(),
        servo_pinhole(servo.camera, robot),
    )  # fmt: skip


def _simulated_breaks(
    robot: Robot, grid: WorkspaceGrid, scenario: Any, reactions: Sequence[str] | None,
    moving: Array | Sequence[float] | None, after: float, limits: tuple[float, float] | None,
) -> SimulatedBreaks:  # fmt: skip
    from cdpr_drake.analyses.runs.breaks import DEFAULT_SAVING
    from cdpr_drake.analyses.workspaces.break_survival import BreakRequest

    request = BreakRequest(
        scenario=visual_servo(scenario or BREAKING, f"the kind {SURVIVES}"),
        reactions=DEFAULT_SAVING if reactions is None else tuple(reactions),
        velocity=np.zeros(3) if moving is None else np.asarray(moving, float),
        after=after, limits=limits,
    )  # fmt: skip
    request.check(robot)
    return SimulatedBreaks(robot, request, grid)


def grid_conditions(
    robot: Robot | str | Path, kinds: Sequence[str], measures: Sequence[str], grid: WorkspaceGrid,
    scenario: Any = None, reactions: Sequence[str] | None = None,
    moving: Array | Sequence[float] | None = None, after: float = 2.0, **values: Any,
) -> PoseConditions:  # fmt: skip
    """What kinds and measures know of a robot at the poses of a grid.

    Scenario, reactions, moving and after are those of `compute_workspace`; `values` are further
    arguments of `pose_conditions`.

    Raises:
        CdprError: A kind or measure lacks something, or is not possible for the robot.
    """
    loaded = as_robot(robot, "a workspace")
    falls = bool({*kinds, *measures} & {SURVIVES, *OF_BREAKS})
    # The camera of a scenario whose winches and controller count has nothing to see.
    sees = not falls or bool({*kinds} & {"target-visible", "stable"})
    about = pose_conditions(loaded, scenario=scenario if sees else None, **values)
    if falls:
        alone = {name: values.get(name) for name in ("mass", "wrench", "required", "accelerations")}
        _refuse(
            f"found with kinds {SURVIVES}, which simulates the robot as its file has it; "
            "accepted: without", **alone,
        )  # fmt: skip
        limits = values.get("limits")
        breaks = _simulated_breaks(loaded, grid, scenario, reactions, moving, after, limits)
        about = replace(about, breaks=breaks)
    else:
        words = f"found kinds {','.join(kinds)}; accepted: {SURVIVES} among them"
        _refuse(words, reactions=reactions, moving=moving)
    if "stable" in kinds:
        view = None if scenario is None else scenario_view(robot, scenario)
        about = replace(about, stable=robot_stability(robot, grid, view))
    _check_kinds(loaded, kinds, measures, about)
    return about


def _refuse(why: str, **arguments: object) -> None:
    for name, value in arguments.items():
        if value is not None:
            raise WorkspaceError(f"{name}: {why}")


def _check_kinds(
    robot: Robot, kinds: Sequence[str], measures: Sequence[str], about: PoseConditions
) -> None:
    """Refuses kinds and measures that are not possible for the robot, or lack something."""
    for name in kinds:
        needs = KINDS[name].needs
        if needs and getattr(about, needs) is None:
            raise WorkspaceError(f"kinds {name}: found nothing it needs; accepted: {NEEDS[needs]}")
    if about.method is not None and "static" not in kinds:
        raise WorkspaceError(
            f"method {about.method}: found kinds {','.join(kinds)}; accepted: static among them"
        )
    n, m = len(about.case.rows), about.case.cables.count
    spare = [f"kinds {name}" for name in kinds if name in REDUNDANT]
    spare += [f"measures {name}" for name in measures if name in REDUNDANT]
    if spare and m <= n:
        raise WorkspaceError(
            f"{spare[0]}: found {m} cables of {robot.name} for {n} degrees of freedom; "
            f"accepted: robots with more than {n}"
        )
    moved = [row - 3 for row in about.case.rows if row >= 3]
    if "payload" in measures and not np.any(np.array(about.case.down)[moved]):
        raise WorkspaceError(
            f"measures payload: found the planar robot {robot.name}, whose plane carries the "
            "weight; accepted: robots that hold it by their cables"
        )
