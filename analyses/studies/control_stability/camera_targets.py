"""Which errors and goals of the camera are tried for the printed rows under PBVS.

The thesis does not print the translation error e_t of its tables. Grid I takes the same e_t at
every pose, by length and direction in the camera frame; grid II goes from every pose to one goal
in the world, or to the corner of the box that is farthest. Each may have the camera at another
height above the platform's origin, and another rotation error.

Under PBVS the interaction matrix moves the point q = p_PC + R_PC e_t of the platform; an error d of
the camera's mounting moves its estimate by R_PC (exp(d) - 1) e_t. So camera and e_t count together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.studies.published.recipe_variants import (
    CAMERA_HEIGHTS,
    HALF_TURN_DIAGONAL,
)
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.desired_view import (
    FixedError,
    FixedPlace,
    OppositeCorner,
    ServoTarget,
)
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase

SAME_ERROR, GOAL, FARTHEST = "same e_t", "goal", "farthest corner"
"""Kinds of targets: one e_t in the camera frame at every pose; one place in the world; from every
pose the corner of the grid's box that is farthest."""

LENGTHS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0)
"""Of e_t in grid I [m]; the diagonal of ACROBOT's box is 1.75 m."""

AZIMUTHS = {
    0.0: (0.0,),
    45.0: (0.0, 90.0),
    90.0: (0.0, 45.0, 90.0, 135.0),
    135.0: (0.0, 90.0),
    180.0: (0.0,),
}
"""Angles about the optical axis by the angle from it, of e_t in grid I [deg]. Below 180 deg: half a
turn about z takes ACROBOT's points to each other within 10 mm."""

HALF_TURN, NO_TURN, DIAGONAL_TURN = "half turn about z", "none", "half turn about (1, 1, 1)"
SEEN_TURNS_DEG = (130.0, 135.0, 140.0, 145.0, 150.0)
"""Rotation errors about z that are tried where what is seen is turned, too [deg]."""


def about_z(angle_deg: float) -> str:
    """Name of a rotation error about the optical axis."""
    return f"{angle_deg:g} deg about z"


TURNS: Mapping[str, tuple[float, float, float]] = {
    HALF_TURN: (0.0, 0.0, math.pi),
    NO_TURN: (0.0, 0.0, 0.0),
    DIAGONAL_TURN: HALF_TURN_DIAGONAL,
    **{about_z(angle): (0.0, 0.0, math.radians(angle)) for angle in SEEN_TURNS_DEG},
}
"""Rotation errors theta u by name [rad]; the first is that of the recipe in use."""

HEIGHT = CAMERA_HEIGHTS["acrobot"]
"""Height of ACROBOT's camera in the recipe in use [m]."""

HEIGHTS = (0.0, HEIGHT, 0.2, 0.46)
"""Heights of the camera above the platform's origin [m]."""


@dataclass(frozen=True)
class CameraTarget:
    """What a servo sees and wants at all poses of a table, and where its camera is.

    Attributes:
        kind: SAME_ERROR, GOAL or FARTHEST.
        length: Of e_t, for SAME_ERROR [m].
        polar_deg: Angle of e_t from the optical axis, for SAME_ERROR [deg].
        azimuth_deg: Angle of e_t about the optical axis, for SAME_ERROR [deg].
        share: For GOAL: the place as a share of the box, (0, 0, 0) its lower corner, (1, 1, 1) its
            upper one.
        height: Of the camera above the platform's origin [m].
        turn: Name of the rotation error, of `TURNS`.
        seen_turned: Whether the orientation of what is seen is wrong as the camera's mounting is.
    """

    kind: str
    length: float = 0.0
    polar_deg: float = 0.0
    azimuth_deg: float = 0.0
    share: tuple[float, float, float] = (0.0, 0.0, 0.0)
    height: float = HEIGHT
    turn: str = HALF_TURN
    seen_turned: bool = False

    @property
    def name(self) -> str:
        """Words that name it alone."""
        words = {
            SAME_ERROR: f"e_t {self.length:g} m, {self.polar_deg:g} deg from the axis, "
            f"{self.azimuth_deg:g} deg about it",
            GOAL: "goal at ({:g}, {:g}, {:g}) of the box".format(*self.share),
            FARTHEST: FARTHEST,
        }[self.kind]
        seen = ", seen turned" if self.seen_turned else ""
        return f"{words}, camera {self.height:g} m, turn {self.turn}{seen}"

    def error(self) -> np.ndarray:
        """e_t in the camera frame, for SAME_ERROR, shape (3,) [m]."""
        polar, azimuth = math.radians(self.polar_deg), math.radians(self.azimuth_deg)
        lateral = math.sin(polar)
        return self.length * np.array(
            [lateral * math.cos(azimuth), lateral * math.sin(azimuth), math.cos(polar)]
        )

    def servo_target(self, lower: np.ndarray, upper: np.ndarray) -> ServoTarget:
        """The target in a box of platform positions.

        Args:
            lower: Its lower corner in W, shape (3,) [m].
            upper: Its upper corner in W, shape (3,) [m].
        """
        turn = np.array(TURNS[self.turn])
        if self.kind == SAME_ERROR:
            return FixedError(turn, self.error())
        if self.kind == FARTHEST:
            return OppositeCorner(lower, upper, turn)
        return FixedPlace(lower + np.array(self.share) * (upper - lower), turn)

    def mounting(self) -> RigidTransform:
        """The camera on the platform, facing down."""
        return RigidTransform(
            RotationMatrix.MakeXRotation(math.pi), np.array([0.0, 0.0, self.height])
        )

    def keys(self) -> Mapping[str, Any]:
        """Values of key columns of a study."""
        goal = "" if self.kind != GOAL else " ".join(f"{one:g}" for one in self.share)
        return {
            "target": self.kind, "length_m": self.length, "polar_deg": self.polar_deg,
            "azimuth_deg": self.azimuth_deg, "goal": goal, "camera_m": self.height,
            "turn": self.turn, "seen_turned": self.seen_turned,
        }  # fmt: skip

    def bounds(self, bounds: PerturbationBounds) -> PerturbationBounds:
        """Bounds of a row with what is seen as wrong as the target says."""
        return bounds.varied(d_theta_s=bounds.d_theta_pc) if self.seen_turned else bounds


IN_USE_TARGET = CameraTarget(GOAL)
"""That of the recipe in use for the suspended robots: to the lower corner of the box."""

CENTRE_TARGET = CameraTarget(GOAL, share=(0.5, 0.5, 0.5))
"""That of the recipe in use for the fully constrained robot."""


CHOSEN_TARGET = CameraTarget(SAME_ERROR, 1.75, 45.0, 90.0)
"""What the rows of d_theta_pc of A.9 and A.10 choose."""

SEEN_TARGET = replace(IN_USE_TARGET, turn=about_z(140.0), seen_turned=True)
"""What the same rows choose where what is seen is turned by an error of the mounting, too."""


def same_errors(
    lengths: Sequence[float] = LENGTHS, height: float = HEIGHT, turn: str = HALF_TURN
) -> list[CameraTarget]:
    """Grid I: every length in every direction; no length once."""
    found = [
        CameraTarget(SAME_ERROR, length, polar, azimuth, height=height, turn=turn)
        for length in lengths
        if length > 0.0
        for polar, azimuths in AZIMUTHS.items()
        for azimuth in azimuths
    ]
    none = [CameraTarget(SAME_ERROR, height=height, turn=turn)] if 0.0 in lengths else []
    return none + found


def goals(height: float = HEIGHT, turn: str = HALF_TURN) -> list[CameraTarget]:
    """Grid II: corners, centres of faces and the centre of the box, and the farthest corner."""
    steps = (0.0, 0.5, 1.0)
    shares = [
        (x, y, z)
        for x, y, z in product(steps, steps, steps)
        if (x, y, z).count(0.5) in (0, 2, 3)  # not the middles of edges
    ]
    found = [CameraTarget(GOAL, share=share, height=height, turn=turn) for share in shares]
    return [*found, CameraTarget(FARTHEST, height=height, turn=turn)]


def seen_turned() -> list[CameraTarget]:
    """The goal in use with what is seen turned, too, by the rotation error."""
    return [
        replace(IN_USE_TARGET, turn=about_z(angle), seen_turned=True) for angle in SEEN_TURNS_DEG
    ]


def with_target(case: StabilityCase, robot: str, target: CameraTarget) -> StabilityCase:
    """A case of a robot with another target and camera.

    Args:
        case: The case.
        robot: Name of its robot, whose box the goals belong to.
        target: The target.
    """
    return replace(case, target=target.servo_target(*_box(robot)), X_PC=target.mounting())


@cache
def _box(robot: str) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box of a robot's grid; reading its file for every target takes minutes."""
    known = workspace_defaults(load_robot(robot), robot)
    return np.asarray(known.lower, float), np.asarray(known.upper, float)
