"""What is asked about stability: a geometry, a scheme, a target, and whose model is wrong."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError, accepted_names
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.stability.desired_view import FixedError, ServoTarget

SCHEMES = ("pbvs", "pbvs-line", "2.5d", "ibvs")
"""Visual servoing schemes; their index is their code in the kernels."""

PBVS, PBVS_LINE, TWO_HALF_D, IBVS = range(len(SCHEMES))

SPATIAL_SCHEMES = ("2.5d", "ibvs")
"""Schemes that a planar robot cannot have."""

SIDES = ("estimate", "truth")
"""Which model is the nominal one plus the perturbation; the other one is nominal."""

OBJECT_POSE_MODELS = ("error", "object")
"""Lever of PBVS' interaction matrix: e_t as the servoing thesis' stability analysis has it, or p_CO
as the exact matrix, with which a controller works."""


@dataclass(frozen=True, eq=False)
class StabilityCase:
    """A robot under visual servoing, its nominal model and what is unknown about it.

    A planar robot moves in the xy plane of W: the z of points and poses is ignored, and the camera
    looks along z of P, up or down.

    Attributes:
        cables: Nominal cables, without pulleys: the kernels are for straight cables.
        scheme: One of `SCHEMES`.
        planar: Whether the platform moves in a plane, 2T1R.
        X_PC: Nominal pose of the camera on the platform.
        target: What gives error and object at a pose.
        p_OK: Points of the object for IBVS, shape (3, k) [m]; None: not known, which is enough as
            long as the object is not perturbed.
        perturbed: One of `SIDES`.
        lever: One of `OBJECT_POSE_MODELS`.
        taut: Cables that count, shape (m,) bool; None: all. Slack ones leave the Jacobians.

    Source: servoing thesis 3.2, 3.3; slack cables: 5.3.1.
    """

    cables: CableSet
    scheme: str = "pbvs"
    planar: bool = False
    X_PC: RigidTransform = field(default_factory=RigidTransform)
    target: ServoTarget = field(default_factory=FixedError)
    _: KW_ONLY
    p_OK: Array | None = None
    perturbed: str = "estimate"
    lever: str = "error"
    taut: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Refuses what cannot be judged.

        Raises:
            StabilityError: Cables with pulleys, unknown names, shapes that do not fit, too few taut
                cables, or a scheme that the robot's dimension excludes.
        """
        for name, accepted in (
            ("scheme", SCHEMES),
            ("perturbed", SIDES),
            ("lever", OBJECT_POSE_MODELS),
        ):
            found = getattr(self, name)
            if found not in accepted:
                raise StabilityError(f"{name}: found {found}; {accepted_names(found, accepted)}")
        if self.planar and self.scheme in SPATIAL_SCHEMES:
            raise StabilityError(
                f"scheme: found {self.scheme} for a planar robot; accepted: pbvs, pbvs-line"
            )
        if self.cables.has_pulleys():
            raise StabilityError(
                "cables: found pulleys; accepted: straight cables, as from cables.without_pulleys()"
            )
        if self.taut is not None and np.shape(self.taut) != (self.cables.count,):
            raise StabilityError(
                f"taut: found shape {np.shape(self.taut)}; accepted: ({self.cables.count},)"
            )
        count, needed = len(self.taut_cables()), 3 if self.planar else 6
        if count < needed:
            raise StabilityError(f"cables: found {count} taut; accepted: at least {needed}")
        if self.planar:
            z = self.X_PC.rotation().matrix()[:, 2]
            if np.hypot(z[0], z[1]) > 1e-9:
                raise StabilityError(
                    f"X_PC: found a camera of a planar robot that looks along {np.round(z, 3)} of "
                    "P; accepted: along z"
                )
        if self.p_OK is not None and (np.ndim(self.p_OK) != 2 or np.shape(self.p_OK)[0] != 3):
            raise StabilityError(f"p_OK: found shape {np.shape(self.p_OK)}; accepted: (3, k)")

    def taut_cables(self) -> np.ndarray:
        """Numbers of the cables that count."""
        if self.taut is None:
            return np.arange(self.cables.count)
        return np.flatnonzero(self.taut)

    @property
    def m(self) -> int:
        """Number of cables that count."""
        return len(self.taut_cables())
