"""The question of a control stability workspace: all that its numbers depend on.

`make_question` fills it up with the servoing thesis' grid and bounds. `scenario_task` makes its
task of a scenario's: camera, object, desired view.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.workspaces.pose_grid import check_grid, grid_arguments, plain
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.analyses.workspaces.stability_tasks import StabilityTask
from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.models.robot_loader import as_robot, robot_reference
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.stability.desired_view import FixedObject, OppositeCorner, ServoTarget
from cdpr_drake.stability.perturbation_bounds import BOUNDS, PerturbationBounds
from cdpr_drake.stability.stability_case import OBJECT_POSE_MODELS, StabilityCase
from cdpr_drake.stability.verdict import VERDICTS, VerdictOptions
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_step
from cdpr_drake.workspaces.static_feasibility import StaticCase

BASE = "baseline"
"""Name of the servoing thesis' bounds, where the others are variations of them."""

STRAIGHT = "criterion of stability: pulleys ignored, since it is one of straight cables"
"""Part of the geometry of a result with Z, for a robot with pulleys."""

GIVEN = "given"
"""Name of bounds that were given, in the place of `BASE`."""

DEGREES = "_deg"
"""Ending of a bound given in degrees."""

USED_OPTIONS = {
    "sampled": ("draws", "seed", "magnitude", "margins"),
    "searched": ("draws", "seed", "magnitude", "margins", "searches", "steps"),
    "certified": (
        "draws", "seed", "magnitude", "margins", "searches", "steps", "rounds", "pieces",
    ),
}  # fmt: skip
"""For each verdict the fields of `VerdictOptions` that its numbers depend on."""

PRINTED, EXACT = OBJECT_POSE_MODELS
"""Interaction matrix of PBVS in the printed tables, and in a servo."""

OBJECT_DISTANCE = 0.5
"""Where a scheme needs the place of the object and none is given, it is so far straight ahead of
the camera [m]."""


@dataclass(frozen=True, eq=False)
class CameraTask:
    """What a servo's camera sees and shall see; by default the servoing thesis' longest way.

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


@dataclass(frozen=True, eq=False)
class StabilityQuestion:
    """Where is a robot's servo stable, and can it be held there?

    Attributes:
        robot: Name of the robot.
        case: Geometry, scheme, camera and target.
        statics: What the cables have to hold.
        grid: Poses of the platform.
        bounds: Perturbation bounds by name, the first is what the others vary.
        verdict: How stability is judged.
        options: How hard to look.
        geometry: Geometry of the cables in words: where the platform can be held, and where the
            servo is judged.
    """

    robot: str
    case: StabilityCase
    statics: StaticCase
    grid: WorkspaceGrid
    bounds: Mapping[str, PerturbationBounds]
    verdict: str
    options: VerdictOptions
    geometry: str

    def task(self, name: str) -> StabilityTask:
        """The sweep task of the bounds of one name."""
        return StabilityTask(self.case, self.bounds[name], self.grid, self.options, self.verdict)

    def arguments(self) -> dict[str, Any]:
        """All that the numbers depend on, for JSON; two questions with the same are the same."""
        found: dict[str, Any] = plain(
            {
                "cdpr_drake": code_version(),
                "robot": self.robot,
                "geometry": self.geometry,
                "scheme": self.case.scheme,
                "verdict": self.verdict,
                "options": {
                    name: getattr(self.options, name) for name in USED_OPTIONS[self.verdict]
                },
                "bounds": {name: bounds.as_dict() for name, bounds in self.bounds.items()},
                "grid": grid_arguments(self.grid),
                "case": self.case,
                "statics": self.statics,
            }
        )
        return found


def stability_case(
    robot: Robot,
    scheme: str,
    grid: WorkspaceGrid,
    task: CameraTask | None = None,
) -> StabilityCase:
    """A robot under a scheme, its cables from fixed exit points, as the thesis computes workspaces.

    Args:
        robot: The robot.
        scheme: One of `stability.SCHEMES`.
        grid: Its box is where the servo has to go.
        task: What the camera sees and shall see; None: as in the servoing thesis.

    Raises:
        StabilityError: Too few cables, several on one winch, or a scheme that the robot's dimension
            excludes.
    """
    if robot.winch_groups().are_shared():
        raise StabilityError(
            f"robot: found {robot.name} with several cables on one winch; accepted: a winch for "
            "each cable, as the criterion has them"
        )
    task = task or CameraTask()
    target, lever = task.target, task.lever if scheme == "pbvs" else PRINTED
    ahead = np.array([0.0, 0.0, OBJECT_DISTANCE])
    if target is None and scheme == "2.5d":
        target = OppositeCorner(grid.lower, grid.upper, np.zeros(3), ahead, np.eye(3))
    elif target is None and lever == EXACT:
        target = OppositeCorner(grid.lower, grid.upper, p_CO=ahead, R_CO=np.eye(3))
    elif target is None:
        target = OppositeCorner(grid.lower, grid.upper)
    cables = robot.cable_set().without_pulleys()
    planar = robot.servo_rows("stability") == PLANAR_ROWS
    return StabilityCase(cables, scheme, planar, task.X_PC, target, lever=lever)


def make_question(
    robot: Robot | str | Path,
    *,
    scheme: str = "pbvs",
    verdict: str = "searched",
    bounds: PerturbationBounds | None = None,
    vary: Mapping[str, Sequence[float]] | None = None,
    grid: WorkspaceGrid | None = None,
    options: VerdictOptions | None = None,
    statics: StaticCase | None = None,
    task: CameraTask | None = None,
    printed_matrix: bool = False,
) -> StabilityQuestion:
    """The question for a robot, filled up with the servoing thesis' grid and bounds.

    Args:
        robot: The robot, or its name or path.
        scheme: Visual servoing scheme.
        verdict: One of `stability.verdict.VERDICTS`.
        bounds: Perturbation bounds, named `GIVEN`; None: those of `defaults`, `BASE`.
        vary: Values of single bounds, each with the others as they are; in m and rad, or in
            degrees where the name ends in _deg.
        grid: Poses; None: those of `defaults`.
        options: How hard to look.
        statics: What the cables have to hold; None: `static_case` of the robot.
        task: What the camera sees and shall see; None: as in the servoing thesis.
        printed_matrix: Whether pbvs is judged with the interaction matrix of the thesis' tables
            instead of the exact one, which the simulated servo uses.

    Raises:
        CdprError: Something is unknown, out of range, or not possible for the robot.
    """
    if printed_matrix and scheme != "pbvs":
        raise StabilityError(f"printed matrix: found with {scheme}; accepted with: pbvs")
    task = task or CameraTask()
    if printed_matrix:
        task = replace(task, lever=PRINTED)
    if verdict not in VERDICTS:
        raise StabilityError(f"verdict {verdict!r} is unknown; {closest(verdict, VERDICTS)}")
    name = robot.name if isinstance(robot, Robot) else str(robot)
    robot = as_robot(robot, "stability")
    defaults = workspace_defaults(robot, name)
    if grid is None:
        grid = grid_by_step(defaults.lower, defaults.upper, defaults.step)
    check_grid(robot, grid)
    base = defaults.bounds if bounds is None else bounds
    named = {BASE if bounds is None else GIVEN: base}
    for parameter, values in (vary or {}).items():
        for value in values:
            changed = varied(base, parameter, value)
            if named.setdefault(f"{parameter}={value:g}", changed) != changed:
                raise StabilityError(
                    f"{parameter}: found values that agree to six digits, {value!r} among them; "
                    "accepted: values further apart"
                )
    statics = statics or static_case(robot)
    over = statics.cables.has_pulleys()
    return StabilityQuestion(
        robot.name,
        stability_case(robot, scheme, grid, task),
        statics,
        grid,
        named,
        verdict,
        options or VerdictOptions(),
        robot.geometry_words(over) + (f"; {STRAIGHT}" if over else ""),
    )


def varied(base: PerturbationBounds, parameter: str, value: float) -> PerturbationBounds:
    """Bounds with one of them changed; `parameter` ends in _deg for an angle in degrees.

    Raises:
        StabilityError: There is no such bound, or the value is not accepted.
    """
    name = parameter.removesuffix(DEGREES)
    angle = name.startswith("d_theta")
    if name not in BOUNDS or (parameter != name and not angle):
        known = [one for r in BOUNDS for one in ((r, r + DEGREES) if "theta" in r else (r,))]
        raise StabilityError(f"bound {parameter!r} is unknown; {closest(parameter, known)}")
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


def scenario_task(robot: Robot | str | Path, scenario: str) -> CameraTask:
    """What a scenario's camera sees and shall see.

    Args:
        robot: The robot, or its name or path, in the place of the scenario's.
        scenario: Name or path of a visual servo's scenario.

    Returns:
        The object where the scenario has it, the view that it wants, the robot's camera mounting
        that it uses, and the interaction matrix that its servo really uses: that of the object's
        position, not of the error.

    Raises:
        StabilityError: The object moves, or the camera is not on the platform: the criterion is
            about neither.
        ScenarioError: There is no such scenario, or the robot does not fit into it.
    """
    from cdpr_drake.systems.diagrams.load import load_scenario  # most questions have none

    with robot_reference(robot, "stability") as name:
        loaded = load_scenario(scenario, [f"robot={name}"])
    where = f"scenario {scenario}"
    if loaded.target.carrier != "world":
        raise StabilityError(
            f"{where}: found target.carrier {loaded.target.carrier}; accepted: world, with the "
            "camera on the platform"
        )
    if loaded.target.motion is not None:
        raise StabilityError(f"{where}: found target.motion; accepted: an object that rests")
    return CameraTask(
        FixedObject(loaded.target.pose.transform(), loaded.desired.transform()),
        as_robot(robot, "stability").camera_mount(loaded.camera.mount).pose.transform(),
    )
