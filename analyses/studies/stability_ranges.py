"""Study: how large errors may be before a servo's stability is lost.

A row has a combination of limits, as the servoing thesis calls it, and the largest value of one
more limit with which everything within the limits is stable: by a closed form where the robot's own
model is exact, else by a search for the worst error at sampled poses, and for part of the rows by
certificates, too. Rows of section 3.4.2 have the volume of the workspace that a single wrong
parameter leaves.

Source: servoing thesis 3.2.1, 3.2.2, 3.3.2 and 3.4.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.studies.recipe_variants import shipped_robot
from cdpr_drake.analyses.studies.rows import Call
from cdpr_drake.analyses.studies.stability_ranges_figures import (
    ANSWERS,
    PLANAR_ROBOT,
    PLANAR_VISION,
    SECTIONS,
    SINGLE,
    SPATIAL_CAMERA,
    SPATIAL_ROBOT,
    SPATIAL_VISION,
    combination_figure,
    limit_words,
    object_figure,
    single_figure,
)
from cdpr_drake.analyses.studies.stability_recipe import (
    DRAWS,
    recipe_case,
    recipe_grid,
    single_bounds,
)
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select
from cdpr_drake.analyses.workspaces.servo_stability import PRINTED
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_angles, pose_rows
from cdpr_drake.stability.criterion_closed_forms import (
    PlanarVisionLimits,
    planar_margin,
    worst_object_error,
)
from cdpr_drake.stability.desired_view import OppositeCorner, ServoTarget, TargetRows
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import (
    VERDICTS,
    VerdictOptions,
    judge_all_verdicts,
    judge_stability,
)
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, WorkspaceVolume, workspace_volume

ROBOTS = PLANAR, SPATIAL = "planar", "acrobot_small"
"""Which of ACROBOT's platforms section 3.2.2 is about is not printed; this one is that of the first
experiments."""

ANGLES = ("psi", "phi", "theta", "theta_u", "camera_turn")
"""Limits that are angles, beside those whose names begin with d_theta; the others are lengths."""

PLANAR_PRINTED = {(5.0, 0.5, 0.3): 6.0, (0.5, 0.3, 0.2): 61.0}
"""Combinations 2 and 13 of figure 3.1: limits of each component of e, of its error and of the
camera's position [m], and of the camera's turn [deg]."""

PLANAR_ERRORS = (0.5, 1.0, 2.0, 5.0)
PLANAR_PERTURBATIONS = ((0.1, 0.1), (0.3, 0.2), (0.5, 0.3), (0.7, 0.4), (0.9, 0.5))
"""Combinations of analysis II: each limit of e with each pair of limits of its error and of the
camera's position [m]; the printed ones are among them."""

OBJECT_TURNS = (0.0, 20.0, 40.0, 60.0, 80.0, 90.0, 100.0, 120.0, 140.0, 160.0)
OBJECT_TURN_ERRORS = (0.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0, 89.0)
"""Limits of theta, and of its error, for which the largest error of the object's position is sought
[deg]."""

TURN_ERRORS = (10.0, 20.0, 45.0, 90.0, 120.0)
"""Limits of theta's error for which the largest theta is sought [deg]."""

OPTIONS = VerdictOptions(draws=30, searches=4, pieces=1, margins=False)
"""How hard to look at a pose; certificates take the perturbations as a whole, for limits are sought
at poses where hardly anything is left to prove."""

TURN_STEP, TILT_STEP = 15.0, 25.0
"""Angles within a limit are tried at most so far apart: about z, and about x and y [deg]."""

CHUNK = 100
"""Poses that are judged at once; a trial ends with the first chunk that is not stable."""

CAMERAS = {
    "in the middle": (0.0, 0.0, 0.0),
    "on an edge": (0.055, 0.0, 0.0),
    "on a corner": (0.055, 0.055, 0.0),
    "turned 45 deg": (0.0, 0.0, 45.0),
    "turned 90 deg": (0.0, 0.0, 90.0),
    "turned 180 deg": (0.0, 0.0, 180.0),
}
"""Where the planar robot's camera sits: x, y [m] and angle [deg]; half of the platform is 0.055 m
wide."""

CAMERA_STEP = 0.0002
"""Resolution of the limits that are compared between these [m], a 500th of them; with 0.005 m, a
20th, one step decided whether they are the same."""

AREAS = (0.03, 0.1)
"""Errors of the platform's position of two bounds whose workspaces are compared [m], as figure 3.10
does with combinations 2 and 16 of figure 3.2."""

PRINTED_VOLUMES = {
    "r_pc": {0.2: 1.014, 1.0: 1.014},
    "d_theta_pc_deg": {40.0: 1.014, 55.0: 0.514, 65.0: 0.0},
    "r_s": {0.5: 1.014},
    "d_theta_s_deg": {90.0: 1.014},
    "r_A": {0.01: 0.802, 0.03: 0.503},
    "r_B": {0.01: 0.794, 0.03: 0.506},
    "d_theta_bp_deg": {3.0: 0.936, 10.0: 0.786},
    "r_bp": {0.01: 0.907, 0.1: 0.761},
}
"""Section 3.4.2: volumes with one bound and all else known exactly [m^3]."""

ASSUMPTIONS = (
    "Limits: place, low, high, psi, phi, theta: where the platform may be; error: length of e; r_, "
    "d_theta_: errors of the platform (bp), the camera (pc), the object (s), exit and anchor "
    "points (A, B).",
    "Limits of the combinations are printed for two of figure 3.1 and in part for one of figure "
    "3.4; the others are chosen here. A limit of places or angles has everything within.",
    "Section 3.2.2: the small platform of ACROBOT carries the computation.",
    "Section 3.4.2 names neither the target nor the rotation error. Of those tried, the opposite "
    "corner of the grid's box with half a turn about z comes closest to its volumes with the "
    "camera turned by 55 and 65 deg. The lower corner, the target of the tables of 3.3, and other "
    "readings are reported beside it: points each at a corner of its own cube, no rotation error, "
    "and L_s = L_s_hat, so that the object's error does not enter.",
)


# Limits of everything that a servo's stability depends on.


@dataclass(frozen=True, kw_only=True)
class RobotLimits:
    """A combination: within it, each variable may take any value, independently of the others.

    Lengths are radii of balls (planar: circles), as in the thesis' perturbation bounds; positions
    and angles of the platform are half sizes of boxes.

    Attributes:
        place: Of the platform's x and y in W, from the frame's axis [m].
        psi: Of the platform's angle about z [deg].
        phi: Of its angle about x, R = Rx(phi) Ry(theta) Rz(psi) [deg].
        theta: Of its angle about y [deg].
        error: Of e_t [m].
        r_bp: Of the error of the platform's position [m].
        d_theta_bp: Of the error of its orientation, whatever the axis [deg].
        r_s: Of the error of the object's position, that is of e_t [m].
        r_pc: Of the error of the camera's position on the platform [m].
        d_theta_pc: Of the error of the camera's orientation [deg].
        r_B: Of the error of each anchor point [m].
        low: Lowest height of the platform; of a planar robot its plane's [m].
        high: Largest height, the only other one that is tried [m].
    """

    place: float = 0.0
    psi: float = 0.0
    phi: float = 0.0
    theta: float = 0.0
    error: float = 0.0
    r_bp: float = 0.0
    d_theta_bp: float = 0.0
    r_s: float = 0.0
    r_pc: float = 0.0
    d_theta_pc: float = 0.0
    r_B: float = 0.0
    low: float = 0.0
    high: float = 0.0

    def bounds(self) -> PerturbationBounds:
        """The limits of what is wrong, in SI units."""
        lengths = {name: getattr(self, name) for name in ("r_bp", "r_pc", "r_B", "r_s")}
        turns = {name: math.radians(getattr(self, name)) for name in ("d_theta_bp", "d_theta_pc")}
        return PerturbationBounds().varied(**lengths, **turns)

    def varied(self, names: Sequence[str], value: float) -> RobotLimits:
        """The same with all the named limits at a value."""
        return replace(self, **dict.fromkeys(names, value))

    def without(self, *names: str) -> dict[str, float]:
        """The limits by name [m, deg], without these."""
        return {name: value for name, value in asdict(self).items() if name not in names}


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """A servo's target that gives each pose its own error, no rotation error.

    Attributes:
        errors: e_t in the camera frame, shape (N, 3) [m].
    """

    errors: Array

    def rows(self, R_WC: Array, p_WC: Array) -> TargetRows:
        """Features for camera orientations, shape (N, 3, 3), and positions, shape (N, 3) [m]."""
        count = len(p_WC)
        nowhere, unturned = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
        return TargetRows(np.zeros((count, 3)), np.asarray(self.errors, float), nowhere, unturned)


@dataclass(frozen=True)
class LimitedRobot:
    """A robot that ships, under PBVS, whose limits are in question.

    Attributes:
        name: Its name.
        camera: Where the camera is on the platform: x, y [m], and its turn about z [deg].
        steps: Places along x and y on either side of the middle.
        mirrored: True if robot and camera are mirror images of themselves in x and in y, so that
            positions with x, y >= 0 stand for all.
        coarse: True to try few values of angles and errors only, to see that everything works.
    """

    name: str
    camera: tuple[float, float, float] = (0.0, 0.0, 0.0)
    steps: int = 1
    mirrored: bool = False
    coarse: bool = False

    @property
    def planar(self) -> bool:
        """True if it moves in a plane."""
        return shipped_robot(self.name).motion_type().is_horizontal_body

    def samples(self, limits: RobotLimits) -> tuple[Array, Array]:
        """Poses, shape (N, 7), and an error e_t for each, shape (N, 3) [m]: where limits are tried.

        All on the edges of the limits and some inside. Of e_t, whose sign and direction count:
        zero and full length along each axis, in a plane also between the axes.
        """
        first = 0 if self.mirrored else -self.steps
        line = limits.place * np.arange(first, self.steps + 1) / self.steps
        places = line if limits.place > 0.0 else np.zeros(1)
        wide = 4.0 if self.coarse else 1.0
        tilts = [_angles(tilt, wide * TILT_STEP) for tilt in (limits.phi, limits.theta)]
        poses = pose_rows([
            pose_from_angles(np.array([x, y, z]), np.array(turn))
            for x, y, z in product(places, places, sorted({limits.low, limits.high}))
            for turn in product(*tilts, _angles(limits.psi, wide * TURN_STEP))
        ])  # fmt: skip
        if self.coarse:
            directions = np.eye(3)[1:2]
        elif self.planar:
            around = np.arange(8) * np.pi / 4.0
            directions = np.stack([np.cos(around), np.sin(around), np.zeros(8)], axis=1)
        else:
            directions = np.concatenate([np.eye(3), -np.eye(3)])
        errors = np.zeros((1, 3))
        if limits.error > 0.0:
            errors = np.concatenate([errors, limits.error * directions])
        return np.repeat(poses, len(errors), axis=0), np.tile(errors, (len(poses), 1))

    def case(self, errors: Array) -> StabilityCase:
        """The case of poses with these errors, shape (N, 3) [m]."""
        x, y, turn = self.camera
        X_PC = RigidTransform(RotationMatrix.MakeZRotation(math.radians(turn)), [x, y, 0.0])
        cables = shipped_robot(self.name).cable_set().without_pulleys()
        return StabilityCase(
            cables, planar=self.planar, X_PC=X_PC, target=PoseErrors(errors), lever=PRINTED
        )


def _angles(limit: float, step: float) -> Array:
    """Angles from -limit to limit [deg], not more than step apart and with 0, shape (n,) [rad]."""
    count = math.ceil(limit / step)
    if count == 0:
        return np.zeros(1)
    return np.asarray(math.radians(limit) * np.arange(-count, count + 1) / count)


def failing_sample(
    robot: LimitedRobot, limits: RobotLimits, verdict: str = "searched", first: int = 0
) -> int | None:
    """Number of a sample of the limits that does not pass a verdict, None if all pass; the sample
    `first` is tried before all others."""
    poses, errors = robot.samples(limits)
    order = np.arange(len(poses))
    strides = -(-len(poses) // CHUNK)  # neighbours fail together: chunks have some of everywhere
    for numbers in (order[first : first + 1], *(order[k::strides] for k in range(strides))):
        case = robot.case(errors[numbers])
        stable = judge_stability(case, limits.bounds(), poses[numbers], verdict, OPTIONS).stable
        if not np.all(stable):
            return int(numbers[np.argmin(stable)])
    return None


@dataclass(frozen=True)
class Sought:
    """What the largest is sought of.

    Attributes:
        names: Limits, all with the same value.
        high: Largest value looked at [m, deg].
        step: Resolution [m, deg].
    """

    names: tuple[str, ...]
    high: float
    step: float


def largest_limit(
    robot: LimitedRobot, limits: RobotLimits, sought: Sought, verdict: str = "searched"
) -> float:
    """The largest value of the sought limits at which limits are stable, by bisection.

    It is 0 where not even one step is stable, and what is below is taken to be stable, too, which
    holds for the verdict up to its luck, since larger limits contain the smaller ones.
    """
    suspect = 0

    def stable(value: float) -> bool:
        nonlocal suspect
        failing = failing_sample(robot, limits.varied(sought.names, value), verdict, suspect)
        suspect = suspect if failing is None else failing
        return failing is None

    return bisected(stable, sought.high, sought.step)


def bisected(stable: Callable[[float], bool], high: float, step: float) -> float:
    """The largest multiple of step up to high at which `stable` holds, by bisection; 0 if none."""
    low, top = 0, round(high / step)
    if stable(top * step):
        return top * step
    while top - low > 1:
        middle = (low + top) // 2
        low, top = (middle, top) if stable(middle * step) else (low, middle)
    return low * step


# Cases.


def cases(form: Form) -> Iterator[Case]:
    """All combinations; in the quick form fewer and coarser ones."""
    yield from vision_cases(form.quick)
    yield from robot_cases(form.quick)
    for name, volumes in PRINTED_VOLUMES.items():
        for value, volume in volumes.items():
            limits = {name.removesuffix("_deg"): value}
            call = partial(single_row, name, value, form.quick)
            yield range_case(SINGLE, name, "workspace", limits, call, printed_m3=volume)


def range_case(
    section: str, group: str, sought: str, limits: Mapping[str, float], call: Call, **keys: Any
) -> Case:
    """A combination: limits by name without unit [m, deg]; `keys` are more columns."""
    columns = {f"{name}_{unit_of_limit(name)}": value for name, value in limits.items()}
    return Case(
        keys={"section": section, "group": group, "sought": sought, **columns, **keys}, call=call
    )


def unit_of_limit(limit: str) -> str:
    """Unit of a limit, as names of columns end with it."""
    return "deg" if limit in ANGLES or limit.startswith("d_theta") else "m"


# Analyses I and II, where the robot's own model is exact.


def vision_cases(quick: bool) -> Iterator[Case]:
    """Analyses I and II, planar and spatial; `quick`: about every third of each group."""
    step = 3 if quick else 1
    yield range_case(PLANAR_VISION, "I", "r_s", {}, partial(planar_place_row))
    planar = [(e, *pair) for e in PLANAR_ERRORS for pair in PLANAR_PERTURBATIONS]
    for number, lengths in enumerate(planar):
        if number % step == 0 or lengths in PLANAR_PRINTED:
            limits = dict(zip(("error", "r_s", "r_pc"), lengths, strict=True))
            call, printed = partial(planar_turn_row, *lengths), PLANAR_PRINTED.get(lengths)
            yield range_case(PLANAR_VISION, "II", "d_theta_pc", limits, call, printed_deg=printed)
    for turn, error in product(OBJECT_TURNS[::step], OBJECT_TURN_ERRORS[::step]):
        angles = {"theta_u": turn, "d_theta_s": error}
        call = partial(object_place_row, turn, error)
        yield range_case(SPATIAL_VISION, "place", "r_s", angles, call)
    for error in TURN_ERRORS[::step]:
        call = partial(object_turn_row, error)
        yield range_case(SPATIAL_VISION, "turn", "theta_u", {"d_theta_s": error}, call)
    for group, base, varied, values, *rest in OBJECT_SERIES:
        some = values[:: 2 if quick else 1]
        yield from series_cases(
            SPATIAL_CAMERA, LimitedRobot(SPATIAL), group, base, varied, some, *rest
        )


def planar_place_row() -> dict[str, float]:
    """Planar analysis I: the largest error of the object's position."""
    return {"found_m": bisected(lambda d: planar_margin(0.0, d) > 0.0, 4.0, 1e-3)}


def planar_turn_row(error: float, d_error: float, shift: float) -> dict[str, float]:
    """Planar analysis II: the largest turn of the camera with which no value fails in boxes of
    these half sizes [m]."""
    limits = PlanarVisionLimits(error, d_error, shift)
    return {"found_deg": bisected(lambda a: limits.worst_margin(math.radians(a)) > 0.0, 90.0, 0.1)}


def object_place_row(turn: float, error: float) -> dict[str, float]:
    """Spatial analysis I: the largest error of the object's position; angles [deg]."""
    return {"found_m": worst_object_error(math.radians(turn), math.radians(error))}


def object_turn_row(error: float) -> dict[str, float]:
    """Spatial analysis I: the largest theta under an error of it [deg], the object's position
    exact."""
    wrong = math.radians(error)
    found = bisected(lambda turn: worst_object_error(math.radians(turn), wrong) > 0.0, 180.0, 1.0)
    return {"found_deg": found}


# Analysis III, where the robot's model is wrong, too.


PLANAR_FINE = RobotLimits(
    place=0.2, psi=10.0, error=0.5, r_bp=0.01, d_theta_bp=3.0, r_s=0.05, r_pc=0.01,
    d_theta_pc=3.0, r_B=0.004,
)  # fmt: skip
PLANAR_COARSE = replace(
    PLANAR_FINE, error=1.0, r_bp=0.05, d_theta_bp=5.0, r_s=0.2, d_theta_pc=10.0, r_B=0.008
)
SPATIAL_FINE = RobotLimits(
    place=0.1, error=0.5, r_bp=0.03, d_theta_bp=3.0, r_s=0.05, r_pc=0.01, d_theta_pc=3.0,
    r_B=0.008, low=0.3, high=0.3,
)  # fmt: skip
SPATIAL_COARSE = replace(
    SPATIAL_FINE, error=1.0, r_bp=0.06, d_theta_bp=5.0, r_s=0.3, d_theta_pc=10.0
)
"""Limits of the combinations of a series, but for those that vary: errors known well, and coarsely;
r_B of the spatial robot as printed in 3.2.2."""

OBJECT = RobotLimits(low=0.3, high=0.3, error=0.5, r_s=0.1, r_pc=0.02, d_theta_pc=10.0)
"""The same in the spatial analysis II."""


TURN, WIDE_TURN = Sought(("psi",), 90.0, 1.0), Sought(("psi",), 150.0, 2.0)
CAMERA_TURN = Sought(("d_theta_pc",), 120.0, 1.0)
TILT, PLACE = Sought(("phi", "theta"), 60.0, 1.0), Sought(("r_bp",), 1.0, 0.01)

PLACES, CAMERA_ERRORS = (0.0, 0.1, 0.2, 0.3, 0.4), (0.0, 0.01, 0.03, 0.05)
POINT_ERRORS, HEIGHTS = (0.0, 0.05, 0.1, 0.2), (0.0, 0.3, 0.6, 0.8, 1.0)
"""Values of limits that series vary [m]."""

OBJECT_SERIES: Sequence[Any] = (
    ("error", OBJECT, ("error",), (0.1, 0.5, 1.0, 1.5, 2.0, 3.0),
     Sought(("r_s",), 3.0, 0.02), "steps"),
    ("r_s", OBJECT, ("r_s",), (0.0, 0.25, 0.5, 1.0, 1.5), CAMERA_TURN, "steps"),
    ("r_pc", OBJECT, ("r_pc",), (0.0, 0.05, 0.1, 0.2, 0.5), CAMERA_TURN, "steps"),
)  # fmt: skip
"""Of the spatial analysis II; theta u is zero."""

PLANAR_SERIES: Sequence[Any] = (
    ("place", PLANAR_FINE, ("place",), (*PLACES, 0.45), Sought(("r_bp",), 0.4, 0.005), "eighths"),
    ("error", PLANAR_FINE, ("error",), (0.05, 0.1, 0.5, 1.0, 2.0), Sought(("r_s",), 2.0, 0.02)),
    ("r_pc", PLANAR_FINE, ("r_pc",), CAMERA_ERRORS, TURN),
    ("r_pc coarse", PLANAR_COARSE, ("r_pc",), CAMERA_ERRORS, TURN),
    ("r_B", PLANAR_FINE, ("r_B",), (0.0, 0.004, 0.008, 0.016, 0.03),
     Sought(("d_theta_bp",), 90.0, 1.0), "eighths"),
    ("psi", PLANAR_FINE, ("place",), (*PLACES, 0.45), TURN),
)  # fmt: skip
CENTRED = replace(SPATIAL_FINE, place=0.0)
SPATIAL_SERIES: Sequence[Any] = (
    *(
        (f"{name} {motion}{words}", base, (name,), POINT_ERRORS, sought)
        for words, base in (("", SPATIAL_COARSE), (" well", SPATIAL_FINE))
        for name in ("r_bp", "r_pc")
        for motion, sought in (("psi", WIDE_TURN), ("tilt", TILT))
    ),
    ("psi tilt", SPATIAL_FINE, ("psi",), (0.0, 15.0, 30.0, 45.0, 60.0), TILT),
    ("place r_bp", SPATIAL_FINE, ("place",), PLACES, PLACE, "eighths"),
    ("height r_bp", CENTRED, ("low", "high"), HEIGHTS, PLACE),
    ("place psi", SPATIAL_COARSE, ("place",), PLACES, WIDE_TURN),
    ("place tilt", SPATIAL_FINE, ("place",), PLACES, TILT),
    ("height tilt", CENTRED, ("low", "high"), HEIGHTS, TILT),
)
"""Of analysis III. Places and angles are limits, each with everything within; heights are single
ones."""


def robot_cases(quick: bool) -> Iterator[Case]:
    """Analysis III; `quick`: the first and last combination of each series, coarsely."""
    planar = LimitedRobot(PLANAR, steps=1 if quick else 2, mirrored=True, coarse=quick)
    for series in PLANAR_SERIES:
        yield from series_cases(PLANAR_ROBOT, planar, *series, ends=quick)
    limits, sought = replace(PLANAR_FINE, place=0.3), Sought(("r_bp",), 0.4, CAMERA_STEP)
    for camera, place in CAMERAS.items():
        at = dict(zip(("camera_x", "camera_y", "camera_turn"), place, strict=True))
        columns = {**at, **limits.without("r_bp")}
        call = partial(limit_row, LimitedRobot(PLANAR, place, coarse=quick), limits, sought)
        yield range_case(PLANAR_ROBOT, "camera", "r_bp", columns, call, camera=camera)
    for r_bp in AREAS:
        limits = replace(PLANAR_FINE, r_bp=r_bp)
        columns, call = limits.without("place", "psi"), partial(area_row, limits, quick)
        yield range_case(PLANAR_ROBOT, "area", "workspace", columns, call)
    robot = LimitedRobot(SPATIAL, coarse=quick)
    for series in SPATIAL_SERIES:
        yield from series_cases(SPATIAL_ROBOT, robot, *series, ends=quick)


def series_cases(
    section: str, robot: LimitedRobot, group: str, base: RobotLimits, varied: Sequence[str],
    values: Sequence[float], sought: Sought, proof: str = "", *, ends: bool = False,
) -> Iterator[Case]:  # fmt: skip
    """Combinations that differ in one limit.

    Args:
        section: Of the thesis.
        robot: The robot.
        group: Name of the series.
        base: Limits that are the same.
        varied: Limits that vary, all with the same value.
        values: Values [m, deg].
        sought: What is sought in each.
        proof: Resolution of what is certified: the same "steps", or "eighths" of what is searched;
            empty: nothing is certified.
        ends: True to take the first and last alone, at a fifth of the resolution, uncertified.
    """
    if ends:
        values, proof = (values[0], values[-1]), ""
        sought = replace(sought, step=5.0 * sought.step)
    for value in values:
        limits = base.varied(varied, value)
        call = partial(limit_row, robot, limits, sought, proof)
        columns = limits.without(*sought.names)
        yield range_case(section, group, ", ".join(sought.names), columns, call)


def limit_row(
    robot: LimitedRobot, limits: RobotLimits, sought: Sought, proof: str = ""
) -> dict[str, float]:
    """The largest of the sought limits: searched_m or searched_deg, by a search for the worst;
    certified_m or certified_deg, see `series_cases`."""
    unit = unit_of_limit(sought.names[0])
    searched = largest_limit(robot, limits, sought)
    row = {f"searched_{unit}": searched}
    if proof and searched > 0.0:
        step = searched / 8.0 if proof == "eighths" else sought.step
        within = replace(sought, high=searched, step=step)
        row[f"certified_{unit}"] = largest_limit(robot, limits, within, "certified")
    return row


def area_row(limits: RobotLimits, coarse: bool) -> dict[str, float]:
    """Share of the planar grid that is stable within the limits, by verdict."""
    case, grid = recipe_case(PLANAR, "pbvs"), recipe_grid(PLANAR, coarse)
    options = VerdictOptions(draws=DRAWS, margins=False)
    row = {}
    for verdict in ("sampled", "searched"):
        stable = judge_stability(case, limits.bounds(), grid.pose_rows(), verdict, options).stable
        row[f"{verdict}_percent"] = 100.0 * _volume(grid, stable).share
    return row


def _volume(grid: WorkspaceGrid, stable: np.ndarray) -> WorkspaceVolume:
    return workspace_volume(np.reshape(stable, grid.shape)[0], grid.axes, VolumeRule.CORNERS)


# Section 3.4.2: one wrong parameter.


def single_row(name: str, value: float, coarse: bool) -> dict[str, float]:
    """Volume of the workspace with one bound, by verdict and reading.

    An error of the object alone meets no robot: the Jacobians of robot and estimate cancel, and
    with them the position, so that a coarse grid is enough.

    Args:
        name: Bound, angles with _deg.
        value: Its value [m, deg].
        coarse: True to take the coarse grid.

    Returns:
        sampled_m3, searched_m3, certified_m3: volumes by verdict; sampled_lower_corner_m3: with the
        target of the tables of 3.3; sampled_cubes_m3: with points each at a corner of its own cube;
        sampled_no_turn_m3: without rotation error; sampled_known_object_m3: with L_s = L_s_hat.
    """
    of_object = name in ("r_s", "d_theta_s_deg")
    bounds = single_bounds(PerturbationBounds(), name, value)
    grid = recipe_grid(SPATIAL, coarse or of_object)
    poses, corner = grid.pose_rows(), OppositeCorner(grid.lower, grid.upper)
    robot = recipe_case(SPATIAL, "pbvs")
    options = VerdictOptions(draws=DRAWS, pieces=1, margins=False)  # pieces would take an hour

    def case(target: ServoTarget) -> StabilityCase:
        return StabilityCase(robot.cables, target=target, lever=PRINTED)

    if name == "d_theta_s_deg":  # no certificate covers it
        chunks = {
            verdict: judge_stability(case(corner), bounds, poses, verdict, options)
            for verdict in VERDICTS[:2]
        }
    else:
        chunks = judge_all_verdicts(case(corner), bounds, poses, options)
    readings: dict[str, tuple[PerturbationBounds, ServoTarget]] = {
        "lower_corner": (bounds, robot.target)
    }
    if name in ("r_A", "r_B"):
        readings["cubes"] = (bounds.varied(exits="corners", anchors="corners"), corner)
    if of_object:
        readings["no_turn"] = (bounds, OppositeCorner(grid.lower, grid.upper, np.zeros(3)))
        readings["known_object"] = (PerturbationBounds(), corner)
    chunks |= {
        f"sampled_{reading}": judge_stability(case(target), errors, poses, "sampled", options)
        for reading, (errors, target) in readings.items()
    }
    return {f"{column}_m3": _volume(grid, chunk.stable).value for column, chunk in chunks.items()}


# What is made of the rows.


def limits_table(rows: Frame, section: str) -> Frame:
    """Combinations of a section: limits in words, what is printed, and the largest that is
    stable."""
    combinations = select(rows, section=section)
    if section == SPATIAL_VISION:  # the others are a table of their own
        combinations = select(combinations, group="turn")
    words = [limit_words(row) for row in combinations.to_dict("records")]
    answers = combinations[[name for name in combinations if name.startswith(ANSWERS)]]
    table = combinations[["group", "sought"]].assign(limits=words)
    return table.join(answers.dropna(axis=1, how="all").astype(object).fillna(""))


def object_table(rows: Frame) -> Frame:
    """Spatial analysis I: largest error of the object's position [m] by the limits of theta
    (rows) and of its error (columns) [deg]."""
    places = select(rows, section=SPATIAL_VISION, group="place")
    table = places.pivot_table("found_m", "theta_u_deg", "d_theta_s_deg")
    table = table.rename(columns="error of {:g} deg".format)
    return table.rename_axis(columns=None).reset_index()


STUDY = Study(
    name="stability-ranges",
    title="How large errors may be before a servo's stability is lost",
    source="servoing thesis 3.2.1, 3.2.2, 3.3.2 and 3.4.2",
    cases=cases,
    parameters=lambda form: {
        "single errors": {"draws": DRAWS, "seed": 0, "robot": SPATIAL},
        "combinations": {
            "options": asdict(OPTIONS), "turn_step_deg": TURN_STEP, "tilt_step_deg": TILT_STEP,
            "robots": list(ROBOTS),
        },
    },
    assumptions=ASSUMPTIONS,
    coarse=True,
    tables={
        "3.2.2, spatial: analysis I, largest error of the object's place [m]": object_table,
        **{f"{section} [m, deg]": partial(limits_table, section=section) for section in SECTIONS},
    },
    figures={
        "ranges_planar_II": partial(
            combination_figure, section=PLANAR_VISION, title="Planar, camera and object wrong",
            width=11.0, left_out=("I",),
        ),
        "ranges_planar_III": partial(
            combination_figure, section=PLANAR_ROBOT, title="Planar robot, all errors",
            left_out=("camera", "area"),
        ),
        "ranges_spatial_I": object_figure,
        "ranges_spatial_III": partial(
            combination_figure, section=SPATIAL_ROBOT, title="ACROBOT, small platform, all errors",
        ),
        "single_errors": single_figure,
    },
)  # fmt: skip
