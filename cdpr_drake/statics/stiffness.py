"""How stiffly the cables hold a platform, and how it vibrates on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from scipy.linalg import eigh

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS, STRAIGHT, cable_law, check_model
from cdpr_drake.cables.states import check_lengths
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths, impossible_cable
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.statics.inextensible_equilibrium import tension_stiffness
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

SLACK_SHARE, RANK = 1e-9, 1e-9
"""Tensions below this share of the largest are none; so are singular values of a Jacobian."""


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
            cable_law(model, cables),
            X_WP.GetAsMatrix4(),
            cables.packed(),
            lengths,
            platform.packed_weight(),
            K,
        )
    if code == BAD_LENGTH:
        check_lengths(l0, cables)
    if code == NO_CABLE:
        raise CableGeometryError(impossible_cable(X_WP, cables))
    straight = cable_law(model, cables) == STRAIGHT
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
        frequencies: Shape (k,) [Hz], one for each degree of freedom that is left; NaN where the
            platform is not stable and would leave.
        shapes: Columns are displacements (turn, translation) in W, shape (6, k), of kinetic energy
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
    return _modes(K, platform, X_WP, motion.basis(R) if motion.rows is None else None)


def inextensible_modes(
    cables: CableSet, platform: RigidPlatform, X_WP: RigidTransform, tensions: Array
) -> NaturalModes:
    """Natural frequencies and modes on cables that keep their lengths: those that are left free.

    Taut cables hold as many motions as their Jacobian's rank; in the others the platform swings
    against its weight and the tensions, which turn with it.

    Args:
        cables: The cables; over pulleys where their radius is positive.
        platform: The platform.
        X_WP: Its pose, at rest.
        tensions: Shape (m,) [N]; a cable without any is slack.

    Source: Idà, Briot and Carricato, Natural oscillations of underactuated cable-driven parallel
    robots, IEEE Access 9, 2021.
    """
    R = X_WP.rotation().matrix()
    B = platform.motion.basis(R)
    J = cable_paths(X_WP, cables).J[tensions > SLACK_SHARE * max(float(np.max(tensions)), 1e-300)]
    if len(J):
        J = J @ B
        scale = np.ones(B.shape[1])
        scale[: platform.motion.num_turns] = float(np.mean(np.linalg.norm(cables.p_PB, axis=0)))
        scale[scale == 0.0] = 1.0
        _, singular, V = np.linalg.svd(J / scale)
        rank = int(np.sum(singular > RANK * singular[0]))
        B = B @ (V[rank:].T / scale[:, np.newaxis])
    K = tension_stiffness(X_WP, cables, tensions) + platform.weight_stiffness(X_WP)
    return _modes(K, platform, X_WP, B)


def _modes(
    K: Array, platform: RigidPlatform, X_WP: RigidTransform, basis: Array | None
) -> NaturalModes:
    """Modes within a space of twists, columns of a basis; None: rows of the motion type."""
    M, symmetric = platform.mass_matrix(X_WP), 0.5 * (K + K.T)
    if basis is None:
        motion, R = platform.motion, X_WP.rotation().matrix()
        squares, moving = eigh(motion.part(symmetric, R), motion.part(M, R))
        shapes = motion.twist(moving, R)
    elif basis.shape[1]:
        squares, moving = eigh(basis.T @ symmetric @ basis, basis.T @ M @ basis)
        shapes = basis @ moving
    else:
        return NaturalModes(np.zeros(0), np.zeros((6, 0)))
    floor = 1e-12 * float(np.max(np.abs(squares)))  # neutral, up to rounding
    squares = np.where(np.abs(squares) <= floor, 0.0, squares)
    stable = squares >= 0.0
    frequencies = np.full(len(squares), np.nan)
    frequencies[stable] = np.sqrt(squares[stable]) / (2.0 * np.pi)
    return NaturalModes(frequencies, shapes)
