"""The criterion of stability of a robot's visual servo at the poses of a grid.

Its task is that of the servoing thesis or a `ServoView`, such as `scenario_view` makes of a
scenario's camera, object and desired view.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.workspaces.stability_defaults import load_bounds, workspace_defaults
from cdpr_drake.errors import ScenarioError, StabilityError
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.models.robot_loader import as_robot, robot_reference
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.stability.desired_view import FixedObject, OppositeCorner, ServoTarget
from cdpr_drake.stability.perturbation_bounds import BOUNDS, PerturbationBounds
from cdpr_drake.stability.stability_case import OBJECT_POSE_MODELS, StabilityCase
from cdpr_drake.stability.verdict import VERDICTS, VerdictOptions
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid

if TYPE_CHECKING:
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

KINDS = {
    "Z": "control stability workspace",
    "S": "static feasible workspace",
    "SZ": "both",
}
"""Kinds of workspaces by name. Source: servoing thesis (1.25), (3.27), (3.28)."""

STRAIGHT = "criterion of stability: pulleys ignored, since it is one of straight cables"
"""Part of the geometry of a result with Z, for a robot with pulleys."""

DEGREES = "_deg"
"""Ending of a bound given in degrees."""

PRINTED, EXACT = OBJECT_POSE_MODELS
"""Interaction matrix of PBVS in the printed tables, and in a servo."""

OBJECT_DISTANCE = 0.5
"""Where a scheme needs the place of the object and none is given, it is so far straight ahead of
the camera [m]."""


@dataclass(frozen=True, eq=False)
class ServoStability:
    """What judges the servo of a case at the poses of a grid, under bounds of perturbations."""

    case: StabilityCase
    bounds: PerturbationBounds
    grid: WorkspaceGrid
    options: VerdictOptions = VerdictOptions()  # noqa: RUF009, it is frozen
    verdict: str = "searched"


@dataclass(frozen=True, eq=False)
class ServoView:
    """What a servo's camera sees and shall see; default: the servoing thesis' longest way.

    Attributes:
        target: What gives error and object at a pose; None: the way to the opposite corner of the
            grid's box, the longest there is, with half a turn about z, for 2.5d without a turn;
            of pbvs and 2.5d with the object `OBJECT_DISTANCE` ahead.
        X_PC: Camera on the platform; aligned with it, at Po.
        lever: One of `stability.stability_case.OBJECT_POSE_MODELS`, for pbvs: the exact matrix,
            which the simulated servo uses, or that of the printed tables.
    """

    target: ServoTarget | None = None
    X_PC: RigidTransform = field(default_factory=RigidTransform)
    lever: str = EXACT


def robot_stability(
    robot: Robot | str | Path, grid: WorkspaceGrid, view: ServoView | None = None, *,
    scheme: str = "pbvs", verdict: str = "searched",
    bounds: PerturbationBounds | Path | str | None = None,
    options: VerdictOptions | None = None, printed_matrix: bool = False,
) -> ServoStability:  # fmt: skip
    """The criterion of stability of a robot's servo at the poses of a grid.

    Args:
        robot: The robot, or its name or path.
        grid: The poses.
        view: What the camera sees and shall see; None: as in the servoing thesis.
        scheme: One of `stability.SCHEMES`.
        verdict: One of `stability.verdict.VERDICTS`.
        bounds: Perturbation bounds, or their file; None: the servoing thesis' bounds.
        options: How hard to look.
        printed_matrix: True to judge pbvs with the interaction matrix of the thesis' tables.

    Raises:
        CdprError: Something is unknown, out of range, or not possible for the robot.
    """
    if verdict not in VERDICTS:
        raise StabilityError(f"verdict {verdict!r} is unknown; {closest(verdict, VERDICTS)}")
    if printed_matrix and scheme != "pbvs":
        raise StabilityError(f"printed_matrix: found with {scheme}; accepted with: pbvs")
    if printed_matrix:
        view = replace(view or ServoView(), lever=PRINTED)
    loaded = as_robot(robot, "stability")
    if bounds is None:
        bounds = workspace_defaults(loaded, robot).bounds
    elif not isinstance(bounds, PerturbationBounds):
        bounds = load_bounds(Path(bounds))
    case = stability_case(loaded, scheme, grid, view)
    return ServoStability(case, bounds, grid, options or VerdictOptions(), verdict)


def stability_case(
    robot: Robot, scheme: str, grid: WorkspaceGrid, view: ServoView | None = None
) -> StabilityCase:
    """A robot under a scheme, its cables from fixed exit points, as the thesis computes workspaces.

    The servo has to go anywhere in the box of the grid; scheme and view as `robot_stability`.

    Raises:
        StabilityError: Too few cables, several on one winch, or a scheme that the robot's dimension
            excludes.
    """
    if robot.winch_groups().are_shared():
        raise StabilityError(
            f"robot: found {robot.name} with several cables on one winch; accepted: a winch for "
            "each cable, as the criterion has them"
        )
    view = view or ServoView()
    target, lever = view.target, view.lever if scheme == "pbvs" else PRINTED
    ahead = np.array([0.0, 0.0, OBJECT_DISTANCE])
    if target is None and scheme == "2.5d":
        target = OppositeCorner(grid.lower, grid.upper, np.zeros(3), ahead, np.eye(3))
    elif target is None and lever == EXACT:
        target = OppositeCorner(grid.lower, grid.upper, p_CO=ahead, R_CO=np.eye(3))
    elif target is None:
        target = OppositeCorner(grid.lower, grid.upper)
    cables = robot.cable_set().without_pulleys()
    planar = robot.servo_rows("stability") == PLANAR_ROWS
    return StabilityCase(cables, scheme, planar, view.X_PC, target, lever=lever)


def varied(base: PerturbationBounds, parameter: str, value: float) -> PerturbationBounds:
    """Bounds with one of them changed; `parameter` ends in _deg for an angle in degrees.

    Raises:
        StabilityError: There is no such bound, or the value is not accepted.
    """
    name = parameter.removesuffix(DEGREES)
    angle = name.startswith("d_theta")
    if name not in BOUNDS or (parameter != name and not angle):
        names = [name for r in BOUNDS for name in ((r, r + DEGREES) if "theta" in r else (r,))]
        raise StabilityError(f"bound {parameter!r} is unknown; {closest(parameter, names)}")
    if parameter != name:
        if not 0.0 <= value <= 180.0:
            raise StabilityError(f"{parameter}: found {value:g}; accepted: 0 <= angle <= 180 [deg]")
        value = math.radians(value)
    elif angle and value > math.pi:
        raise StabilityError(
            f"{parameter}: found {value:g}; accepted: 0 <= angle <= pi [rad]; "
            f"write {name}{DEGREES} for degrees"
        )
    return base.varied(**{name: value})


def visual_servo(scenario: Any, purpose: str, overrides: Sequence[str] = ()) -> Scenario:
    """A visual servo's scenario by name or path; a scenario stays as it is.

    Raises:
        ScenarioError: There is none, or it is of another kind; the purpose is what it is for.
    """
    from cdpr_drake.systems.diagrams.load import load_scenario  # few workspaces have one
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

    named = isinstance(scenario, str | Path)
    loaded = load_scenario(scenario, overrides) if named else scenario
    if not isinstance(loaded, Scenario):
        raise ScenarioError(
            f"scenario {loaded.name}: found kind {loaded.kind}; accepted for {purpose}: a visual "
            "servo"
        )
    return loaded


def servo_scenario(robot: Robot | str | Path, scenario: Any) -> Scenario:
    """A visual servo with the robot instead of its own, whose camera sees an object that rests.

    Raises:
        ScenarioError: There is none, it is of another kind, the robot does not fit into it, the
            object moves, or the camera is not on the platform.
    """
    with robot_reference(robot, "a workspace") as name:
        loaded = visual_servo(scenario, "workspaces", [f"robot={name}"])
    if loaded.target.carrier != "world":
        raise ScenarioError(
            f"scenario {loaded.name}: found target.carrier {loaded.target.carrier}; accepted: "
            "world, with the camera on the platform"
        )
    if loaded.target.motion is not None:
        raise ScenarioError(
            f"scenario {loaded.name}: found target.motion; accepted: an object that rests"
        )
    return loaded


def scenario_view(robot: Robot | str | Path, scenario: Any) -> ServoView:
    """What a scenario's camera sees and shall see, with the robot instead of the scenario's.

    The object is where the scenario has it, the view is the one that it wants, the camera is where
    the mounting of the robot has it. The interaction matrix is the one that its servo really uses:
    of the object's position, not of the error.

    Raises:
        ScenarioError: As `servo_scenario`.
    """
    loaded = servo_scenario(robot, scenario)
    mount = as_robot(robot, "stability").camera_mount(loaded.camera.mount)
    target = FixedObject(loaded.target.pose.transform(), loaded.desired.transform())
    return ServoView(target, mount.pose.transform())
