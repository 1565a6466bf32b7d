"""The kinds of workspaces and the measures of a pose, as tables, and what they need to know."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.stability.verdict import judge_stability
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target
from cdpr_drake.workspaces.cable_interference import Surroundings, clearances
from cdpr_drake.workspaces.demanded_wrenches import (
    MotionDemand,
    SpatialSet,
    accelerating,
    resisting,
)
from cdpr_drake.workspaces.method_feasibility import held_by_method
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.single_failure import (
    break_margins,
    breaks_survived,
    survives_breaks,
)
from cdpr_drake.workspaces.static_feasibility import StaticCase, statically_feasible
from cdpr_drake.workspaces.stiffness import first_frequencies, stiffness_at
from cdpr_drake.workspaces.tension_factor import REGULAR, dexterities, tension_factors
from cdpr_drake.workspaces.wrench_capacity import (
    capacity_margins,
    closure_margins,
    largest_payloads,
)

if TYPE_CHECKING:
    from cdpr_drake.analyses.workspaces.break_survival import BreakRequest
    from cdpr_drake.analyses.workspaces.servo_stability import ServoStability

SURVIVES, EXCURSION, WORST, BEST = (
    "dynamic-single-failure", "break-excursion", "worst-cable", "best-reaction",
)  # fmt: skip

OF_BREAKS = (EXCURSION, WORST, BEST)
"""Measures that come with the kind `SURVIVES`."""

NUMBERED = (WORST, BEST)
"""Measures that number something, and have no range."""

ALL = "all"
"""Name of what all kinds have in common."""

RULES = {"all": "in every orientation (inclusion)", "any": "in some orientation (maximal)"}
"""Which positions belong to a workspace, with several orientations."""

SECTIONS = ("cables", "winches", "damping", "torque_control", "integration")
"""Sections of a scenario on which simulated breaks depend."""


@dataclass(frozen=True, eq=False)
class CameraView:
    """A target at X_WO, and the camera on the platform, with its intrinsics, that shall see it."""

    target: Target
    X_WO: RigidTransform
    X_PC: RigidTransform
    pinhole: Pinhole


@dataclass(frozen=True, eq=False)
class SimulatedBreaks:
    """All single breaks of a cable at the poses of a grid, with every reaction of a request."""

    robot: Robot
    request: BreakRequest
    grid: WorkspaceGrid

    def arguments(self) -> dict[str, Any]:
        """What its numbers depend on, for JSON."""
        request = self.request
        return {
            "scenario": request.scenario.name, "reactions": list(request.reactions),
            "moving_m_s": plain(np.asarray(request.velocity, float)), "after_s": request.after,
            "limits_n": None if request.limits is None else list(request.limits),
            "cable_names": [cable.name for cable in self.robot.cables],
            **{name: plain(getattr(request.scenario, name)) for name in SECTIONS},
        }  # fmt: skip

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Arrays of the poses start to stop, shape (n,).

        `SURVIVES`; `EXCURSION`, how far the best reaction to the worst break goes [m]; `WORST`,
        number of that cable, from 1; `BEST`, number of that reaction in the request, from 1.
        The last three are NaN where all cables do not hold the pose.
        """
        from cdpr_drake.analyses.workspaces.break_survival import breaks_at  # few need it

        table = np.full((stop - start, 3), np.nan)
        survives = np.zeros(stop - start, bool)
        for k, X_WP in enumerate(self.grid.poses(start, stop)):
            outcomes = breaks_at(self.robot, X_WP, self.request)
            if outcomes is not None:
                cable, reaction, excursion, survives[k] = outcomes.worst()
                table[k] = excursion, cable + 1.0, reaction + 1.0
        return {SURVIVES: survives, **dict(zip(OF_BREAKS, table.T, strict=True))}


@dataclass(frozen=True, eq=False)
class PoseConditions:
    """All that kinds and measures know about a robot.

    Attributes:
        case: Platform, load and tension bounds.
        around: What cables and platform may meet.
        gravity: Acceleration along `case.down` [m/s^2].
        body: Mass [kg], centre of mass in P [m], rotational inertia about Po in P [kg m^2].
        clearance: How far cables, and the platform, must stay from what they may meet [m].
        required: Wrenches to resist beside the weight.
        motion: Accelerations and velocities.
        view: What the camera shall see.
        stable: The criterion of stability at the poses of the grid.
        method: Name of the method of tensions for the kind `static`; None: any tensions.
        breaks: Single breaks simulated at the poses of the grid.
    """

    case: StaticCase
    around: Surroundings
    gravity: float
    body: tuple[float, Array, Array]
    clearance: float = 0.0
    required: SpatialSet | None = None
    motion: MotionDemand | None = None
    view: CameraView | None = None
    stable: ServoStability | None = None
    method: str | None = None
    breaks: SimulatedBreaks | None = None


@dataclass(frozen=True, eq=False)
class Poses:
    """Some poses of a grid: numbers start to stop, p_WP and R_WP, shape (n, 3), (n, 3, 3)."""

    start: int
    stop: int
    positions: Array
    rotations: Array


@dataclass(frozen=True)
class Kind:
    """A kind of workspace: what holds, and if it does at some poses, shape (n,).

    `needs` is the field of `PoseConditions` without which nobody can say.
    """

    title: str
    value: Callable[[PoseConditions, Poses], np.ndarray]
    needs: str = ""


@dataclass(frozen=True)
class Measure:
    """A number per pose, shape (n,); NaN where it makes no sense."""

    title: str
    unit: str
    value: Callable[[PoseConditions, Poses], Array]


def _static(about: PoseConditions, at: Poses) -> np.ndarray:
    if about.method is not None:
        return held_by_method(about.case, at.positions, at.rotations, about.method)
    return statically_feasible(about.case, at.positions, at.rotations)


def _wrench_feasible(about: PoseConditions, at: Poses) -> np.ndarray:
    assert about.required is not None
    demand = resisting(about.case, about.required, at.rotations)
    return capacity_margins(about.case, at.positions, at.rotations, demand).feasible


def _dynamic(about: PoseConditions, at: Poses) -> np.ndarray:
    assert about.motion is not None
    demand = accelerating(about.case, about.motion, at.rotations)
    return capacity_margins(about.case, at.positions, at.rotations, demand).feasible


def _far(about: PoseConditions, at: Poses, parts: slice) -> np.ndarray:
    gaps = clearances(about.around, at.positions, at.rotations)[:, parts]
    return np.asarray(np.all(gaps > about.clearance, axis=1))  # NaN: a cable cannot run


def _visible(about: PoseConditions, at: Poses) -> np.ndarray:
    view = about.view
    assert view is not None
    visible = []
    for p, R in zip(at.positions, at.rotations, strict=True):
        X_WC = RigidTransform(RotationMatrix(R), p) @ view.X_PC
        visible.append(view.target.in_view(X_WC.inverse() @ view.X_WO, view.pinhole))
    return np.array(visible, bool)


def _stable(about: PoseConditions, at: Poses) -> np.ndarray:
    servo = about.stable
    assert servo is not None
    poses = servo.grid.pose_rows(at.start, at.stop)
    return judge_stability(servo.case, servo.bounds, poses, servo.verdict, servo.options).stable


def _of_breaks(name: str) -> Callable[[PoseConditions, Poses], np.ndarray]:
    def of_breaks(about: PoseConditions, at: Poses) -> np.ndarray:
        assert about.breaks is not None
        return about.breaks(at.start, at.stop)[name]

    return of_breaks


KINDS: dict[str, Kind] = {
    "static": Kind("the weight can be held", _static),
    "wrench-feasible": Kind("every required wrench can be held", _wrench_feasible, "required"),
    "dynamic": Kind("every acceleration can be had", _dynamic, "motion"),
    "wrench-closure": Kind(
        "tensions without upper limit balance every wrench",
        lambda about, at: closure_margins(about.case, at.positions, at.rotations) > 0.0,
    ),
    "single-failure": Kind(
        "weight and required wrenches can be held with any one cable broken",
        lambda about, at: survives_breaks(
            about.case, at.positions, at.rotations, about.required
        ),
    ),
    "statically-stable": Kind(
        "held with a regular Jacobian and a positive definite stiffness",
        lambda about, at: stiffness_at(about.case, at.positions, at.rotations).stable,
    ),
    "singularity-free": Kind(
        f"the dexterity is above {REGULAR:g}",
        lambda about, at: dexterities(about.case, at.positions, at.rotations) > REGULAR,
    ),
    "interference-free": Kind(
        "cables touch neither each other nor platform, frame or obstacles",
        partial(_far, parts=slice(0, 4)),
    ),
    "collision-free": Kind(
        "the platform touches neither frame nor obstacles",
        partial(_far, parts=slice(4, 5)),
    ),
    "target-visible": Kind("the camera sees the target", _visible, "view"),
    SURVIVES: Kind(
        "whichever cable breaks, a reaction keeps the platform in the frame and ends at rest",
        _of_breaks(SURVIVES), "breaks",
    ),
    "stable": Kind("the visual servo is stable (Z of cdpr stability)", _stable, "stable"),
}  # fmt: skip
"""Kinds of workspaces by name. Source: Gazebo thesis 2.6; servoing thesis 1.2.2, (1.25), (3.27)."""

OF_POSES = tuple(name for name in KINDS if name != SURVIVES)
"""Kinds that are decided without simulating what follows."""


def _capacity(about: PoseConditions, at: Poses) -> Array:
    demand = resisting(about.case, about.required or SpatialSet(), at.rotations)
    return capacity_margins(about.case, at.positions, at.rotations, demand).margins


def _frequency(about: PoseConditions, at: Poses) -> Array:
    stiffness = stiffness_at(about.case, at.positions, at.rotations)
    return first_frequencies(stiffness, about.case, about.body, at.rotations)


MEASURES: dict[str, Measure] = {
    "capacity-margin": Measure("capacity margin", "N", _capacity),
    "breaks-survived": Measure(
        "single breaks after which all is held", "-",
        lambda about, at: breaks_survived(
            about.case, at.positions, at.rotations, about.required
        ).astype(float),
    ),
    "failure-margin": Measure(
        "least capacity margin with any one cable broken", "N",
        lambda about, at: break_margins(about.case, at.positions, at.rotations, about.required),
    ),
    EXCURSION: Measure(
        "largest excursion by the best reaction to the worst break", "m", _of_breaks(EXCURSION)
    ),
    WORST: Measure("cable whose break is worst", "number", _of_breaks(WORST)),
    BEST: Measure("best reaction to that", "number", _of_breaks(BEST)),
    "tension-factor": Measure(
        "tension factor", "-",
        lambda about, at: tension_factors(about.case, at.positions, at.rotations),
    ),
    "payload": Measure(
        "largest payload", "kg",
        lambda about, at: largest_payloads(about.case, at.positions, at.rotations, about.gravity),
    ),
    "stiffness": Measure(
        "smallest stiffness", "N/m",
        lambda about, at: stiffness_at(about.case, at.positions, at.rotations).smallest,
    ),
    "frequency": Measure("first natural frequency", "Hz", _frequency),
    "dexterity": Measure(
        "dexterity", "-", lambda about, at: dexterities(about.case, at.positions, at.rotations)
    ),
    "clearance": Measure(
        "clearance", "m",
        lambda about, at: np.min(clearances(about.around, at.positions, at.rotations), axis=1),
    ),
}  # fmt: skip
"""Measures of a pose by name."""


CONDITIONS: dict[str, Kind | Measure] = {**KINDS, **MEASURES}


def conditions_at(
    about: PoseConditions, grid: WorkspaceGrid, names: Iterable[str], span: tuple[int, int]
) -> dict[str, np.ndarray]:
    """Kinds and measures at the poses of a span of a grid, by name, shape (n,)."""
    at = Poses(*span, grid.positions(*span), grid.rotations(*span))
    arrays = {} if about.breaks is None else about.breaks(*span)  # once for all of them
    for name in names:
        if name not in arrays:
            arrays[name] = CONDITIONS[name].value(about, at)
    return arrays
