"""The kinds of workspaces and the measures of a pose, as tables, and what they need to know."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.workspaces.break_tasks import BEST, EXCURSION, SURVIVES, WORST, BreakTask
from cdpr_drake.analyses.workspaces.stability_tasks import StabilityTask
from cdpr_drake.arrays import Array
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


@dataclass(frozen=True, eq=False)
class CameraView:
    """A target and the camera on the platform that shall see it.

    Attributes:
        target: The target.
        X_WO: Where it is.
        X_PC: Camera on the platform.
        pinhole: Its intrinsic parameters.
    """

    target: Target
    X_WO: RigidTransform
    X_PC: RigidTransform
    pinhole: Pinhole


@dataclass(frozen=True, eq=False)
class PoseConditions:
    """All that kinds and measures know about a robot.

    Attributes:
        case: Platform, load and tension bounds.
        around: What cables and platform may meet.
        gravity: Acceleration along `case.down` [m/s^2].
        body: Mass [kg], centre of mass in P [m], rotational inertia about Po in P [kg m^2].
        clearance: How far cables, and the platform, must stay from what they may meet [m].
        required: Wrenches to resist beside the weight; None: none were given.
        motion: Accelerations and velocities; None: none were given.
        view: What the camera shall see; None: none was given.
        stable: The sweep task of the criterion of stability; None: it was not asked for.
        method: Name of the method of tensions for the kind `static`; None: any tensions.
        breaks: The sweep task of single breaks that are simulated; None: it was not asked for.
    """

    case: StaticCase
    around: Surroundings
    gravity: float
    body: tuple[float, Array, Array]
    clearance: float = 0.0
    required: SpatialSet | None = None
    motion: MotionDemand | None = None
    view: CameraView | None = None
    stable: StabilityTask | None = None
    method: str | None = None
    breaks: BreakTask | None = None


@dataclass(frozen=True, eq=False)
class Poses:
    """Some poses of a grid: numbers start to stop, p_WP and R_WP, shape (n, 3), (n, 3, 3)."""

    start: int
    stop: int
    positions: Array
    rotations: Array


@dataclass(frozen=True)
class Kind:
    """A kind of workspace.

    Attributes:
        title: What holds there.
        holds: Whether it does, shape (n,), at some poses.
        needs: Field of `PoseConditions` that must be given; empty: none.
    """

    title: str
    holds: Callable[[PoseConditions, Poses], np.ndarray]
    needs: str = ""


@dataclass(frozen=True)
class Measure:
    """A number per pose; NaN where it makes no sense."""

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


def _single_failure(about: PoseConditions, at: Poses) -> np.ndarray:
    return survives_breaks(about.case, at.positions, at.rotations, about.required)


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
    seen = []
    for p, R in zip(at.positions, at.rotations, strict=True):
        X_WC = RigidTransform(RotationMatrix(R), p) @ view.X_PC
        seen.append(view.target.in_view(X_WC.inverse() @ view.X_WO, view.pinhole))
    return np.array(seen, bool)


def _stable(about: PoseConditions, at: Poses) -> np.ndarray:
    assert about.stable is not None
    return about.stable(at.start, at.stop)["stable"]


def _of_breaks(about: PoseConditions, at: Poses, name: str) -> np.ndarray:
    assert about.breaks is not None
    return about.breaks(at.start, at.stop)[name]


KINDS: dict[str, Kind] = {
    "static": Kind("the weight can be held", _static),
    "wrench-feasible": Kind("every required wrench can be held", _wrench_feasible, "required"),
    "dynamic": Kind("every acceleration can be had", _dynamic, "motion"),
    "wrench-closure": Kind(
        "tensions without upper limit balance every wrench",
        lambda about, at: closure_margins(about.case, at.positions, at.rotations) > 0.0,
    ),
    "single-failure": Kind(
        "weight and required wrenches can be held with any one cable broken", _single_failure
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
        lambda about, at: _far(about, at, slice(0, 4)),
    ),
    "collision-free": Kind(
        "the platform touches neither frame nor obstacles",
        lambda about, at: _far(about, at, slice(4, 5)),
    ),
    "target-visible": Kind("the camera sees the target", _visible, "view"),
    SURVIVES: Kind(
        "whichever cable breaks, a reaction keeps the platform in the frame and ends at rest",
        lambda about, at: _of_breaks(about, at, SURVIVES),
        "breaks",
    ),
    "stable": Kind("the visual servo is stable (Z of cdpr stability)", _stable, "stable"),
}
"""Kinds of workspaces by name. Source: Gazebo thesis 2.6; servoing thesis 1.2.2, (1.25), (3.27)."""

OF_POSES = tuple(name for name in KINDS if name != SURVIVES)
"""Kinds that are decided without simulating what follows."""


def _capacity(about: PoseConditions, at: Poses) -> Array:
    demand = resisting(about.case, about.required or SpatialSet(), at.rotations)
    return capacity_margins(about.case, at.positions, at.rotations, demand).margins


def _frequency(about: PoseConditions, at: Poses) -> Array:
    found = stiffness_at(about.case, at.positions, at.rotations)
    return first_frequencies(found, about.case, about.body, at.rotations)


def _clearance(about: PoseConditions, at: Poses) -> Array:
    return np.asarray(np.min(clearances(about.around, at.positions, at.rotations), axis=1))


MEASURES: dict[str, Measure] = {
    "capacity-margin": Measure("capacity margin", "N", _capacity),
    "breaks-survived": Measure(
        "single breaks after which all is held",
        "-",
        lambda a, at: breaks_survived(a.case, at.positions, at.rotations, a.required).astype(float),
    ),
    "failure-margin": Measure(
        "least capacity margin with any one cable broken",
        "N",
        lambda a, at: break_margins(a.case, at.positions, at.rotations, a.required),
    ),
    EXCURSION: Measure(
        "largest excursion by the best reaction to the worst break",
        "m",
        lambda about, at: _of_breaks(about, at, EXCURSION),
    ),
    WORST: Measure(
        "cable whose break is worst", "number", lambda about, at: _of_breaks(about, at, WORST)
    ),
    BEST: Measure("best reaction to that", "number", lambda about, at: _of_breaks(about, at, BEST)),
    "tension-factor": Measure(
        "tension factor", "-", lambda a, at: tension_factors(a.case, at.positions, at.rotations)
    ),
    "payload": Measure(
        "largest payload",
        "kg",
        lambda a, at: largest_payloads(a.case, at.positions, at.rotations, a.gravity),
    ),
    "stiffness": Measure(
        "smallest stiffness",
        "N/m",
        lambda a, at: stiffness_at(a.case, at.positions, at.rotations).smallest,
    ),
    "frequency": Measure("first natural frequency", "Hz", _frequency),
    "dexterity": Measure(
        "dexterity", "-", lambda a, at: dexterities(a.case, at.positions, at.rotations)
    ),
    "clearance": Measure("clearance", "m", _clearance),
}
"""Measures of a pose by name."""


@dataclass(frozen=True, eq=False)
class ConditionsTask:
    """Sweep task: which kinds hold at the poses of a grid, and the measures there."""

    about: PoseConditions
    grid: WorkspaceGrid
    kinds: tuple[str, ...]
    measures: tuple[str, ...]

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Arrays by the names of kinds and measures, of the poses start to stop, shape (n,)."""
        at = Poses(start, stop, self.grid.positions(start, stop), self.grid.rotations(start, stop))
        found: Mapping[str, np.ndarray] = {
            **{name: KINDS[name].holds(self.about, at) for name in self.kinds},
            **{name: MEASURES[name].value(self.about, at) for name in self.measures},
        }
        return dict(found)
