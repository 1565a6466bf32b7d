"""How wrong a servo's model may be: bounds on every perturbation, and the vector they bound.

A perturbation is one flat vector d of blocks of three numbers, in this order:

======= ============================================== ======= =============================
block   meaning                                        unit    bound
======= ============================================== ======= =============================
0       rotation of the platform pose, in P            rad     d_theta_bp
1       shift of the platform pose, in W               m       r_bp
2       rotation of the camera mounting, in C          rad     d_theta_pc
3       shift of the camera mounting, in P             m       r_pc
4       rotation of the object seen by the camera      rad     d_theta_s
5       shift of the object seen by the camera, in C   m       r_s
6 + i   shift of exit point A_i, in W                  m       r_A
6+m+i   shift of anchor point B_i, in P                m       r_B
======= ============================================== ======= =============================

Rotations are rotation vectors; a bound is the radius of a ball. Rotations multiply from the right:
R exp(d), but for the object, whose orientation error R_CdC becomes exp(d) R_CdC.

Source: servoing thesis 3.3.1.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError, accepted_names

POSE_BLOCKS = 6
"""Blocks before those of the exit points."""

DIRECTIONS = ("independent", "common", "corners", "single")
"""How a set of points is perturbed: every point in its own ball; all by the same vector of one
ball; every point in its own cube [-r, r]^3; or one point, whichever, in its ball, and no other.
What is proven for `single` is proven for `independent`, too, which contains it."""


@dataclass(frozen=True)
class PerturbationBounds:
    """Bounds on the error between the true and the estimated model; zero: known exactly.

    Attributes:
        r_bp: Platform position [m].
        r_pc: Camera position on the platform [m].
        r_A: Exit points [m].
        r_B: Anchor points [m].
        r_s: Position of the object in the camera frame [m].
        d_theta_bp: Platform orientation [rad].
        d_theta_pc: Camera orientation on the platform [rad].
        d_theta_s: Orientation of the object in the camera frame [rad].
        d_theta_joints: Rotation of a camera on joints that errors of their encoders hide, as
            `servoing.turned_view.encoder_turn` has it [rad]; it adds to d_theta_pc, in whose ball
            the rotations of both together are.
        exits: One of `DIRECTIONS`, for the exit points.
        anchors: One of `DIRECTIONS`, for the anchor points.
    """

    r_bp: float = 0.0
    r_pc: float = 0.0
    r_A: float = 0.0
    r_B: float = 0.0
    r_s: float = 0.0
    d_theta_bp: float = 0.0
    d_theta_pc: float = 0.0
    d_theta_s: float = 0.0
    d_theta_joints: float = 0.0
    exits: str = "independent"
    anchors: str = "independent"

    def __post_init__(self) -> None:
        """Refuses what is no bound.

        Raises:
            StabilityError: A bound is negative or not finite, an angle is above pi, or a direction
                is unknown.
        """
        for name in BOUNDS:
            value = getattr(self, name)
            angle = name.startswith("d_theta")
            if not (math.isfinite(value) and value >= 0.0 and not (angle and value > math.pi)):
                accepted = "0 <= angle <= pi [rad]" if angle else "a number >= 0 [m]"
                raise StabilityError(f"{name}: found {value:g}; accepted: {accepted}")
        for name in ("exits", "anchors"):
            found = getattr(self, name)
            if found not in DIRECTIONS:
                raise StabilityError(f"{name}: found {found}; {accepted_names(found, DIRECTIONS)}")

    def radii(self) -> Array:
        """Bounds in the order of the blocks, exit and anchor points once each, shape (8,)."""
        radii = np.array([getattr(self, name) for name in RADII], float)
        if self.d_theta_joints > 0.0:
            radii[CAMERA_TURN] = min(radii[CAMERA_TURN] + self.d_theta_joints, math.pi)
        return radii

    def scaled(self, share: float) -> PerturbationBounds:
        """All bounds times `share`."""
        return replace(self, **{name: share * getattr(self, name) for name in BOUNDS})

    def varied(self, **changes: Any) -> PerturbationBounds:
        """The same with some fields changed."""
        unknown = set(changes) - {field.name for field in fields(self)}
        if unknown:
            raise StabilityError(
                f"bounds: found {', '.join(sorted(unknown))}; accepted: "
                + ", ".join(field.name for field in fields(self))
            )
        return replace(self, **changes)

    def as_dict(self) -> dict[str, Any]:
        """For JSON, radians and metres; without joints where the camera has none."""
        found = asdict(self)
        if self.d_theta_joints == 0.0:
            del found["d_theta_joints"]
        return found


RADII = ("d_theta_bp", "r_bp", "d_theta_pc", "r_pc", "d_theta_s", "r_s", "r_A", "r_B")
"""Names of the bounds in the order of the blocks."""

CAMERA_TURN = RADII.index("d_theta_pc")

BOUNDS = (*RADII, "d_theta_joints")
"""Names of all bounds."""

BASELINE = PerturbationBounds(
    r_bp=0.03,
    r_pc=0.01,
    r_A=0.005,
    r_B=0.005,
    d_theta_bp=math.radians(3.0),
    d_theta_pc=math.radians(3.0),
)
"""Baseline bounds of spatial robots. Source: servoing thesis 3.3.3."""

PLANAR_BASELINE = replace(BASELINE, r_s=0.01)
"""Baseline bounds of the planar robot. Source: servoing thesis 3.3.2."""


def vector_size(m: int) -> int:
    """Numbers in a perturbation of a robot with m cables."""
    return 3 * (POSE_BLOCKS + 2 * m)
