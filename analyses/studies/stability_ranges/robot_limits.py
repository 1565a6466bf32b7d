"""Limits of everything that a servo's stability depends on, and the largest one that is stable."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from functools import cache
from itertools import product

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.studies.stability_ranges.question import bisected
from cdpr_drake.analyses.workspaces.stability_question import PRINTED
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_angles, pose_rows
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.stability.desired_view import TargetRows
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability

CHUNK = 100
"""Poses judged at once; a question ends with the first chunk that is not stable throughout."""

OPTIONS = VerdictOptions(draws=30, searches=4, pieces=1, margins=False)
"""How hard to look at every pose; certificates take the perturbations as a whole, for a limit is
sought at poses where hardly anything is left to prove."""

TURN_STEP, TILT_STEP = 15.0, 25.0
"""Angles within a limit are tried at most so far apart: about z, and about x and y [deg]."""


@cache
def _robot(name: str) -> Robot:
    return load_robot(name)


@dataclass(frozen=True, eq=False)
class GivenErrors:
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
        r_A: Of the error of each exit point [m].
        r_B: Of the error of each anchor point [m].
        low: Lowest height of the platform; of a planar robot its plane's [m].
        high: Largest height [m].
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
    r_A: float = 0.0
    r_B: float = 0.0
    low: float = 0.0
    high: float = 0.0

    def bounds(self) -> PerturbationBounds:
        """The limits of what is wrong, in SI units."""
        return PerturbationBounds(
            r_bp=self.r_bp,
            r_pc=self.r_pc,
            r_A=self.r_A,
            r_B=self.r_B,
            r_s=self.r_s,
            d_theta_bp=math.radians(self.d_theta_bp),
            d_theta_pc=math.radians(self.d_theta_pc),
        )

    def varied(self, names: tuple[str, ...], value: float) -> RobotLimits:
        """The same with all the named limits at a value."""
        return replace(self, **dict.fromkeys(names, value))

    def given(self, *others: str) -> dict[str, float]:
        """Those that are not zero, without some others."""
        numbers = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in numbers.items() if value and name not in others}


@dataclass(frozen=True, eq=False)
class LimitedRobot:
    """A robot of the catalogue under PBVS whose limits are in question.

    Attributes:
        name: Name in the catalogue.
        X_PC: Pose of the camera on the platform.
        steps: Places along x and y on either side of the middle.
        mirrored: Whether robot and camera are mirror images of themselves in x and in y, so that
            positions with x, y >= 0 stand for all.
        coarse: Whether to try few values of angles and errors only, to see that everything works.
    """

    name: str
    X_PC: RigidTransform = field(default_factory=RigidTransform)
    steps: int = 1
    mirrored: bool = False
    coarse: bool = False

    @property
    def planar(self) -> bool:
        """Whether it moves in a plane."""
        return _robot(self.name).motion_type().is_horizontal_body

    def samples(self, limits: RobotLimits) -> tuple[Array, Array]:
        """Poses, shape (N, 7), and an error e_t for each, shape (N, 3) [m]: where limits are tried.

        All on the edges of the limits and some inside. Of e_t, whose sign and direction count:
        zero and full length along each axis, in a plane also between the axes.
        """
        first = 0 if self.mirrored else -self.steps
        line = limits.place * np.arange(first, self.steps + 1) / self.steps
        places = line if limits.place > 0.0 else np.zeros(1)
        heights = sorted({limits.low, limits.high})
        wide = 4.0 if self.coarse else 1.0
        angles = [
            _angles(limits.phi, wide * TILT_STEP),
            _angles(limits.theta, wide * TILT_STEP),
            _angles(limits.psi, wide * TURN_STEP),
        ]
        poses = pose_rows(
            [
                pose_from_angles(np.array([x, y, z]), np.array(turn))
                for x, y, z in product(places, places, heights)
                for turn in product(*angles)
            ]
        )
        errors = limits.error * self._directions() if limits.error > 0.0 else np.zeros((1, 3))
        return np.repeat(poses, len(errors), axis=0), np.tile(errors, (len(poses), 1))

    def _directions(self) -> Array:
        if self.coarse:
            return np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        if self.planar:
            around = np.arange(8) * np.pi / 4.0
            ring = np.stack([np.cos(around), np.sin(around), np.zeros(8)], axis=1)
            return np.concatenate([np.zeros((1, 3)), ring])
        return np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])

    def case(self, errors: Array) -> StabilityCase:
        """The case of poses with these errors, shape (N, 3) [m]."""
        robot = _robot(self.name)
        return StabilityCase(
            robot.cable_set().without_pulleys(),
            planar=self.planar,
            X_PC=self.X_PC,
            target=GivenErrors(errors),
            lever=PRINTED,
        )


class RangeSearch:
    """Asks whether limits are stable, and remembers which sample failed last, to try it first."""

    def __init__(self, robot: LimitedRobot, verdict: str = "searched") -> None:
        """Begins.

        Args:
            robot: Whose limits.
            verdict: Verdict that every sample has to pass.
        """
        self.robot = robot
        self.verdict = verdict
        self.samples = 0
        self._suspect = 0

    def stable(self, limits: RobotLimits) -> bool:
        """Whether every sample of the limits passes."""
        poses, errors = self.robot.samples(limits)
        self.samples = len(poses)
        for rows in self._chunks(len(poses)):
            case = self.robot.case(errors[rows])
            found = judge_stability(
                case, limits.bounds(), poses[rows], self.verdict, OPTIONS
            ).stable
            if not np.all(found):
                self._suspect = int(rows[np.argmin(found)])
                return False
        return True

    def _chunks(self, count: int) -> Iterator[np.ndarray]:
        order = np.arange(count)
        if self._suspect < count:
            yield order[self._suspect : self._suspect + 1]
        # Neighbours fail together: a stride brings samples from everywhere into every chunk.
        chunks = -(-count // CHUNK)
        for start in range(chunks):
            yield order[start::chunks]

    def largest(
        self, limits: RobotLimits, names: tuple[str, ...], high: float, step: float
    ) -> float:
        """The largest multiple of `step` up to `high` at which limits are stable, by bisection.

        It is 0 where not even that is stable, and what is below is taken to be stable, too, which
        holds for the verdict up to its luck, since larger limits contain the smaller ones.

        Args:
            limits: The others.
            names: Limits that get the value, all the same.
            high: Largest value [m, deg].
            step: Resolution [m, deg].
        """
        return bisected(lambda x: self.stable(limits.varied(names, x)), high, step)


def _angles(limit: float, step: float) -> Array:
    """Angles from -limit to limit [deg], not more than step apart and with 0, shape (n,) [rad]."""
    count = math.ceil(limit / step)
    if count == 0:
        return np.zeros(1)
    return np.asarray(math.radians(limit) * np.arange(-count, count + 1) / count)


def camera_at(x: float, y: float, angle_deg: float) -> RigidTransform:
    """X_PC of a camera at (x, y) [m] on the platform, turned about z [deg]."""
    return RigidTransform(RotationMatrix.MakeZRotation(math.radians(angle_deg)), [x, y, 0.0])
