"""What a workspace is asked for: all that its numbers depend on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.workspaces.break_tasks import OF_BREAKS, SURVIVES, BreakTask
from cdpr_drake.analyses.workspaces.conditions import (
    KINDS,
    MEASURES,
    CameraView,
    ConditionsTask,
    PoseConditions,
)
from cdpr_drake.analyses.workspaces.pose_grid import check_grid, grid_arguments, plain
from cdpr_drake.analyses.workspaces.stability_question import (
    STRAIGHT,
    make_question,
    scenario_task,
)
from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.models.robot_loader import as_robot, robot_reference
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.cameras.targets import TARGETS
from cdpr_drake.tensions.methods import method_for
from cdpr_drake.workspaces.cable_interference import Obstacles, Surroundings, beams, box_row
from cdpr_drake.workspaces.demanded_wrenches import MotionDemand, SpatialSet
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid

ANCHOR_DIAMETERS = 10.0
"""Next to its anchor point a cable is not compared with the platform over so many diameters, and
as far as the deepest anchor point lies within the platform's box."""

RULES = {"all": "in every orientation (inclusion)", "any": "in some orientation (maximal)"}
"""Which positions belong to the workspace, with several orientations."""


@dataclass(frozen=True, eq=False)
class WorkspaceQuestion:
    """Where do some kinds hold, and how well?

    Attributes:
        robot: Name of the robot.
        kinds: Names of `KINDS`; the workspace is what they have in common.
        measures: Names of `MEASURES`.
        rule: One of `RULES`.
        grid: Poses of the platform.
        about: What the kinds need.
        scenario: Name of the scenario with the camera's target; empty: none.
        cables: Whether cables run over pulleys, in words.
        geometry: The same as every result names it, as `Robot.geometry_words`.
    """

    robot: str
    kinds: tuple[str, ...]
    measures: tuple[str, ...]
    rule: str
    grid: WorkspaceGrid
    about: PoseConditions
    scenario: str
    cables: str
    geometry: str

    def task(self) -> ConditionsTask:
        """The sweep task."""
        return ConditionsTask(self.about, self.grid, self.kinds, self.measures)

    def arguments(self) -> dict[str, Any]:
        """All that the numbers depend on, for JSON; two questions with the same are the same."""
        about = self.about
        cables = about.case.cables
        found: dict[str, Any] = plain(
            {
                "cables": self.cables,
                "geometry": self.geometry,
                "cdpr_drake": code_version(),
                "robot": self.robot,
                "kinds": self.kinds,
                "measures": self.measures,
                "orientations": self.rule,
                "method": about.method,
                "grid": grid_arguments(self.grid),
                "statics": about.case,
                "elasticity_n": cables.stiffness,
                "body": about.body,
                "gravity": about.gravity,
                "clearance_m": about.clearance,
                "surroundings": about.around,
                "required": about.required,
                "motion": about.motion,
                "scenario": self.scenario,
                "view": None
                if about.view is None
                else {"X_WO": about.view.X_WO, "X_PC": about.view.X_PC},
                "stable": None
                if about.stable is None
                else {
                    "case": about.stable.case,
                    "bounds": about.stable.bounds.as_dict(),
                    "verdict": about.stable.verdict,
                },
            }
        )
        if about.breaks is not None:
            found["breaks"] = about.breaks.arguments()
        return found


def interference_bodies(
    robot: Robot,
    obstacles: Array | Obstacles | None = None,
    exit_free: float | None = None,
    anchor_free: float | None = None,
    pulleys: bool = True,
) -> Surroundings:
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
    body = box_row(robot.box_center(), robot.platform.size)
    if anchor_free is None:
        inside = body[12:, np.newaxis] - np.abs(robot.cable_set().p_PB - body[9:12, np.newaxis])
        deepest = float(np.max(np.min(inside, axis=0)))
        anchor_free = max(deepest, 0.0) + ANCHOR_DIAMETERS * float(np.max(robot.diameters()))
    there = Obstacles() if obstacles is None else obstacles
    if not isinstance(there, Obstacles):
        there = Obstacles(there)
    return Surroundings(
        robot.cable_set(pulleys),
        robot.diameters() / 2.0,
        body[np.newaxis],
        _fixtures(robot),
        there.boxes,
        robot.frame.beam_width() if exit_free is None else exit_free,
        anchor_free,
        there.solids,
    )


def _fixtures(robot: Robot) -> Array:
    """The frame's beams as boxes in W, shape (f, 15): its own, or those on the edges of its box."""
    frame, width = robot.frame, robot.frame.beam_width()
    if not frame.beams:
        return beams(frame.lower, frame.upper, width)
    rows = [
        box_row((beam.start + beam.end) / 2.0, beam.size(width), beam.axes())
        for beam in frame.beams
    ]
    return np.array(rows)


@dataclass(frozen=True, eq=False)
class WorkspaceRequest:
    """Options of a question; None where nothing was said.

    Attributes:
        limits: Smallest and largest tension [N]; the robot's.
        mass: Mass of the platform [kg]; the robot's.
        wrench: External wrench beside the weight, shape (6,) [N m, N].
        required: Wrenches to resist.
        accelerations: Accelerations to have (angular, linear) [rad/s^2, m/s^2].
        velocities: Velocities at which, shape (k, 6) [rad/s, m/s].
        clearance: Least clearance [m].
        around: What cables and platform may meet.
        scenario: Whose camera shall see its target.
        pulleys: True: cables run over the robot's pulleys. False: pulleys are ignored.
        method: Name of the method whose tensions must hold the weight, of `tensions.METHODS`, for
            the kind `static`; None: any tensions.
        reactions: For the kind `dynamic-single-failure`, names of `break_report.SAVING`; None:
            stop, redistribute, brake, retreat.
        moving: For the kind `dynamic-single-failure`, velocity of Po in W when a cable breaks,
            shape (3,) [m/s]; None: at rest.
        after: For the kind `dynamic-single-failure`, how long runs go on after a break [s].
    """

    limits: tuple[float, float] | None = None
    mass: float | None = None
    wrench: Array | None = None
    required: SpatialSet | None = None
    accelerations: SpatialSet | None = None
    velocities: Array | None = None
    clearance: float = 0.0
    around: Surroundings | None = None
    scenario: str | None = None
    pulleys: bool = True
    method: str | None = None
    reactions: Sequence[str] | None = None
    moving: Array | Sequence[float] | None = None
    after: float = 2.0


DEFAULT_REQUEST = WorkspaceRequest()

REDUNDANT = ("wrench-closure", "single-failure", "failure-margin", "breaks-survived")
"""Kinds and measures that make sense only with more cables than degrees of freedom."""

HINTS = {
    "required": "required, force or moment",
    "motion": "accelerations",
    "view": "the argument scenario",
}
"""Which argument gives what a kind needs."""


def make_workspace_question(
    robot: Robot | str | Path,
    kinds: Sequence[str],
    grid: WorkspaceGrid,
    measures: Sequence[str] = (),
    rule: str = "all",
    asked: WorkspaceRequest = DEFAULT_REQUEST,
) -> WorkspaceQuestion:
    """The question for a robot.

    Args:
        robot: The robot, or its name or path.
        kinds: Names of `KINDS`, at least one.
        grid: Poses of the platform.
        measures: Names of `MEASURES`.
        rule: One of `RULES`.
        asked: What the kinds shall be asked for.

    Raises:
        CdprError: Something is unknown, missing, out of range, or not possible for the robot.
    """
    for name in kinds:
        if name not in KINDS:
            raise WorkspaceError(f"kinds {name!r} is unknown; {closest(name, KINDS)}")
    for name in measures:
        if name not in MEASURES:
            raise WorkspaceError(f"measures {name!r} is unknown; {closest(name, MEASURES)}")
    if rule not in RULES:
        raise WorkspaceError(f"orientations {rule!r} is unknown; {closest(rule, RULES)}")
    if not kinds:
        raise WorkspaceError(f"kinds: found none; accepted: {', '.join(KINDS)}")
    if not (np.isfinite(asked.clearance) and asked.clearance >= 0.0):
        raise WorkspaceError(f"clearance: found {asked.clearance:g}; accepted: >= 0 [m]")
    given, robot = robot, as_robot(robot, "a workspace")
    check_grid(robot, grid)
    falls = SURVIVES in kinds or bool({*measures} & {*OF_BREAKS})
    if falls:
        measures = [*measures, *(name for name in OF_BREAKS if name not in measures)]
    # Of a scenario whose winches and controller count, nothing is to be seen.
    sees = not falls or bool({*kinds} & {"target-visible", "stable"})
    about = pose_conditions(robot, asked if sees else replace(asked, scenario=None))
    if falls:
        about = replace(about, breaks=_break_task(robot, asked, grid))
    elif asked.reactions is not None or asked.moving is not None:
        given = "moving" if asked.reactions is None else "reactions"
        raise WorkspaceError(
            f"{given}: found kinds {','.join(kinds)}; accepted: {SURVIVES} among them"
        )
    if "stable" in kinds:
        task = None if asked.scenario is None else scenario_task(given, asked.scenario)
        stability = make_question(given, grid=grid, task=task)
        about = replace(about, stable=stability.task(next(iter(stability.bounds))))
    for name in kinds:
        needs = KINDS[name].needs
        if needs and getattr(about, needs) is None:
            raise WorkspaceError(f"kinds {name}: needs {HINTS[needs]}")
    if asked.method is not None and "static" not in kinds:
        raise WorkspaceError(
            f"method {asked.method}: found kinds {','.join(kinds)}; accepted: static among them"
        )
    n, m = len(about.case.rows), about.case.cables.count
    redundant = [f"kinds {name}" for name in kinds if name in REDUNDANT]
    redundant += [f"measures {name}" for name in measures if name in REDUNDANT]
    if redundant and m <= n:
        raise WorkspaceError(
            f"{redundant[0]}: found {m} cables of {robot.name} for {n} degrees of freedom; "
            f"accepted: robots with more than {n}"
        )
    moved = [row - 3 for row in about.case.rows if row >= 3]
    if "payload" in measures and not np.any(np.array(about.case.down)[moved]):
        raise WorkspaceError(
            f"measures payload: found the planar {robot.name}, whose plane carries the weight; "
            "accepted: robots that hold it by their cables"
        )
    return WorkspaceQuestion(
        robot.name,
        tuple(dict.fromkeys(kinds)),
        tuple(dict.fromkeys(measures)),
        rule,
        grid,
        about,
        asked.scenario or "",
        _cable_words(robot, about.case.cables.has_pulleys(), "stable" in kinds),
        _geometry_words(robot, about, "stable" in kinds),
    )


BREAKING = "acrobot_broken_redistributed"
"""The scenario whose sections count for the kind `dynamic-single-failure` where none is given."""


def _break_task(robot: Robot, asked: WorkspaceRequest, grid: WorkspaceGrid) -> BreakTask:
    """The sweep task of single breaks.

    Raises:
        WorkspaceError: Something is asked for that is not simulated, or makes no sense.
        ScenarioError: There is no such scenario, or it is no visual servo.
    """
    from cdpr_drake.analyses.simulation.break_report import DEFAULT_SAVING
    from cdpr_drake.analyses.simulation.break_survival import BreakRequest
    from cdpr_drake.systems.diagrams.load import load_scenario  # most questions have none
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

    for name in ("mass", "wrench", "required", "accelerations"):
        if getattr(asked, name) is not None:
            raise WorkspaceError(
                f"{name}: found with kinds {SURVIVES}, which simulates the robot as its file has "
                "it; accepted: without"
            )
    scenario = load_scenario(asked.scenario or BREAKING)
    if not isinstance(scenario, Scenario):
        raise WorkspaceError(
            f"scenario {asked.scenario}: found kind {scenario.kind}; accepted for the kind "
            f"{SURVIVES}: a visual servo"
        )
    request = BreakRequest(
        scenario=scenario,
        reactions=DEFAULT_SAVING if asked.reactions is None else tuple(asked.reactions),
        velocity=np.zeros(3) if asked.moving is None else np.asarray(asked.moving, float),
        after=asked.after,
        limits=asked.limits,
    )
    request.check(robot)
    return BreakTask(robot, request, grid)


def _cable_words(robot: Robot, pulleys: bool, stable: bool) -> str:
    """Whether cables run over pulleys; the criterion of stability knows none."""
    if not robot.cable_set().has_pulleys():
        return "from fixed exit points, as the robot has no pulleys"
    if not pulleys:
        return "without pulleys: from fixed exit points"
    return "over pulleys" + (", but for the kind stable: from fixed exit points" * stable)


def _geometry_words(robot: Robot, about: PoseConditions, stable: bool) -> str:
    """`Robot.geometry_words`, and where parts of the result have another geometry."""
    over = about.case.cables.has_pulleys()
    words = robot.geometry_words(over)
    if about.breaks is not None:
        simulated = robot.geometry_words(about.breaks.asked.scenario.cables.pulleys)
        words += "" if simulated == words else f"; simulated breaks: {simulated}"
    return words + (f"; {STRAIGHT}" if stable and over else "")


def pose_conditions(robot: Robot, asked: WorkspaceRequest = DEFAULT_REQUEST) -> PoseConditions:
    """What kinds and measures know of a robot, but for stability.

    Args:
        robot: The robot.
        asked: What the kinds shall be asked for.

    Raises:
        CdprError: Something asked for makes no sense for the robot.
    """
    case = static_case(robot, asked.limits, asked.mass, asked.wrench, asked.pulleys)
    if asked.method is not None:
        method_for(asked.method, case.cables.count - len(case.rows), False)
    platform = rigid_platform(robot)
    mass = robot.platform.mass if asked.mass is None else asked.mass
    # A mass that was given is spread as the robot's.
    inertia = platform.I_PPo * (mass / platform.mass)
    motion = None
    if asked.accelerations is not None or asked.velocities is not None:
        motion = MotionDemand(
            mass,
            platform.p_PCo,
            inertia,
            asked.accelerations or SpatialSet(),
            np.zeros((1, 6)) if asked.velocities is None else asked.velocities,
        )
    return PoseConditions(
        case,
        asked.around or interference_bodies(robot, pulleys=asked.pulleys),
        robot.gravity,
        (mass, platform.p_PCo, inertia),
        asked.clearance,
        asked.required,
        motion,
        None if asked.scenario is None else camera_view(robot, asked.scenario),
        method=asked.method,
    )


def camera_view(robot: Robot, scenario: str) -> CameraView:
    """What the camera of a visual servo's scenario shall see.

    Args:
        robot: The robot, in the place of the scenario's.
        scenario: Name or path of a visual servo's scenario.

    Raises:
        WorkspaceError: The camera is not on the platform, or the target does not rest.
        ScenarioError: There is no such scenario, or the robot does not fit into it.
    """
    from cdpr_drake.systems.diagrams.load import load_scenario  # most questions have none

    with robot_reference(robot, "a workspace") as name:
        loaded = load_scenario(scenario, [f"robot={name}"])
    if loaded.target.carrier != "world" or loaded.target.motion is not None:
        raise WorkspaceError(
            f"scenario {scenario}: found a target that moves; accepted: one that rests in the "
            "world, seen by a camera on the platform"
        )
    mount = robot.camera_mount(loaded.camera.mount)
    pinhole = servo_pinhole(loaded.camera, robot)
    target = TARGETS[loaded.target.kind](loaded.target)
    return CameraView(target, loaded.target.pose.transform(), mount.pose.transform(), pinhole)
