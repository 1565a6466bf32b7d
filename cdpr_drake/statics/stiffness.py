"""How stiffly the cables hold a platform, and how it vibrates on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from scipy.linalg import eigh

from cdpr_drake.arrays import Array
from cdpr_drake.cables import CABLE_MODELS, STRAIGHT, check_lengths, check_model
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry import CableSet, impossible_cable
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.statics.stiffness_kernel import (
    BAD_LENGTH,
    CABLES,
    ELASTIC,
    NO_CABLE,
    TENSION,
    TOTAL,
    WEIGHT,
    stiffness_into,
)


@dataclass(frozen=True, eq=False)
class PlatformStiffness:
    """Stiffness of a platform: minus the derivative of the wrench about Po by a displacement.

    All of shape (6, 6), rows (moment, force), columns (turn, translation) in W. At rest the total
    is symmetric, and the platform is statically stable where it is positive definite.

    Attributes:
        total: Of cables and weight.
        cables: Of the cables.
        weight: Of the weight, whose arm turns with the platform.
        elastic: The part of the cables that stretch, J' diag(E S / l0) J; None if they sag.
        tension: The part of the tensions that turn with the platform; None if they sag.

    Source: Gazebo thesis (2.25) to (2.28); `elastic` is its passive, `tension` its active part.
    """

    total: Array
    cables: Array
    weight: Array
    elastic: Array | None
    tension: Array | None


def platform_stiffness(
    cables: CableSet, model: str, platform: RigidPlatform, X_WP: RigidTransform, l0: Array
) -> PlatformStiffness:
    """Stiffness at a pose with unstrained lengths.

    Args:
        cables: The cables; over pulleys where their radius is positive.
        model: An elastic model of `cables.CABLE_MODELS`.
        platform: The platform.
        X_WP: Its pose.
        l0: Unstrained lengths, shape (m,) [m].

    Raises:
        CableModelError: An unknown model, inextensible cables, which are rigid, or lengths that are
            not above 0.
        CableGeometryError: A cable cannot run so.
    """
    check_model(model, cables)
    kind = CABLE_MODELS[model]
    if not kind.extensible:
        raise CableModelError("derivatives: found the inextensible model; accepted: an elastic one")
    lengths, K = np.ascontiguousarray(l0, float), np.empty((5, 6, 6))
    code = BAD_LENGTH
    if lengths.shape == (cables.count,):
        code = stiffness_into(
            kind.law, X_WP.GetAsMatrix4(), cables.packed(), lengths, platform.packed_weight(), K
        )
    if code == BAD_LENGTH:
        check_lengths(l0, cables)
    if code == NO_CABLE:
        raise CableGeometryError(impossible_cable(X_WP, cables))
    straight = kind.law == STRAIGHT
    return PlatformStiffness(
        K[TOTAL],
        K[CABLES],
        K[WEIGHT],
        K[ELASTIC] if straight else None,
        K[TENSION] if straight else None,
    )


@dataclass(frozen=True, eq=False)
class NaturalModes:
    """Undamped small vibrations about rest, the slowest first.

    Attributes:
        frequencies: Shape (n,) [Hz]; NaN where the platform is not stable and would leave.
        shapes: Columns are displacements (turn, translation) in W, shape (6, n), of kinetic energy
            1/2 J at 1 rad/s.
    """

    frequencies: Array
    shapes: Array


def natural_modes(K: Array, platform: RigidPlatform, X_WP: RigidTransform) -> NaturalModes:
    """Natural frequencies and modes: K s = (2 pi f)^2 M s.

    Args:
        K: Stiffness at rest, shape (6, 6); its symmetric part counts.
        platform: The platform; it has as many modes as degrees of freedom.
        X_WP: Its pose.
    """
    motion, R = platform.motion, X_WP.rotation().matrix()
    M = motion.part(platform.mass_matrix(X_WP), R)
    squares, moving = eigh(motion.part(0.5 * (K + K.T), R), M)
    shapes = motion.twist(moving, R)
    floor = 1e-12 * float(np.max(np.abs(squares)))  # neutral, up to rounding
    squares = np.where(np.abs(squares) <= floor, 0.0, squares)
    stable = squares >= 0.0
    frequencies = np.full(motion.freedom, np.nan)
    frequencies[stable] = np.sqrt(squares[stable]) / (2.0 * np.pi)
    return NaturalModes(frequencies, shapes)
