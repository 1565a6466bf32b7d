"""A platform at rest on inextensible cables: generic statics keep at most six of them taut."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import INEXTENSIBLE
from cdpr_drake.cables.states import TOO_SHORT
from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.cable_paths import CablePaths, cable_paths, motion_of
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import MotionType
from cdpr_drake.geometry.poses import cross_matrix
from cdpr_drake.geometry.pulley_kernel import unit_vector_derivative
from cdpr_drake.geometry.two_pulleys_kernel import add_platform_turning
from cdpr_drake.statics.equilibrium_program import (
    displaced,
    make_equilibrium_program,
    solve_equilibrium_program,
)
from cdpr_drake.statics.rigid_platform import RigidPlatform

NEARLY_TAUT = 1e-5
"""Cables that lack less than this [m] may be taut where a program says that the platform rests."""

STEPS = 20
"""Newton steps from there; three or four are usual."""

SETTLED_UNBALANCE = 1e-10
"""Unbalanced force relative to the weight that counts as none."""


def tension_stiffness(X_WP: RigidTransform, cables: CableSet, tensions: Array) -> Array:
    """Stiffness of straight cables by their tensions alone, shape (6, 6), (turn, translation).

    Minus the derivative of the wrench -J' t at constant tensions: unit vectors and arms turn.

    Args:
        X_WP: Pose of the platform.
        cables: The cables; over pulleys where their radius is positive.
        tensions: Shape (m,) [N].

    Source: Gazebo thesis (2.27), second term.
    """
    motion, K, D = motion_of(X_WP), np.zeros((6, 6)), np.empty((3, 3))
    paths = cable_paths(X_WP, cables)
    arms = (paths.p_WT + paths.free * paths.u_W) - X_WP.translation()[:, np.newaxis]
    if not cables.has_platform_pulleys():
        arms = X_WP.rotation().matrix() @ cables.p_PB
    for i, row in enumerate(cables.packed()):
        unit_vector_derivative(motion, row, D)
        S, U = cross_matrix(arms[:, i]), cross_matrix(paths.u_W[:, i])
        K[:3, :3] += tensions[i] * (S.T @ D @ S + U @ S)
        K[:3, 3:] += tensions[i] * S @ D
        K[3:, :3] += tensions[i] * D @ S.T
        K[3:, 3:] += tensions[i] * D
        add_platform_turning(motion, row, float(tensions[i]), K)
    return K


def taut_tensions(
    paths: CablePaths, lacking: Array, wrench: Array, motion: MotionType, R_WP: Array
) -> Array:
    """Tensions of cables that lack nothing and balance a wrench best, shape (m,), >= 0 [N].

    At most as many are positive as the wrench has components.

    Args:
        paths: Where the cables run.
        lacking: What each is longer than its path, shape (m,) [m].
        wrench: On the platform beside the cables', shape (6,) [N m, N].
        motion: Which motions the platform has.
        R_WP: Its orientation, shape (3, 3).
    """
    tensions = np.zeros(len(lacking))
    near = np.flatnonzero(lacking < NEARLY_TAUT)
    if len(near):
        from scipy.optimize import nnls  # a tenth of a second, and few robots have such cables

        J = motion.columns(paths.J[near], R_WP)
        tensions[near] = nnls(J.T, motion.components(wrench, R_WP))[0]
    return tensions


def rigid_cables_rest(
    cables: CableSet, platform: RigidPlatform, l0: Array, guess: RigidTransform, arm: float
) -> tuple[RigidTransform, Array, Array, float]:
    """Rests a platform on inextensible cables, from a guess.

    A program finds the lowest pose nearby, Newton's method on forces and lengths of the taut cables
    the exact one. If more lengths than six fit one pose exactly, tensions are not unique; returned
    are some with at most six cables taut.

    Args:
        cables: The cables.
        platform: The platform.
        l0: Lengths, shape (m,) [m].
        guess: Pose to start from.
        arm: Length that makes turns comparable with translations [m].

    Returns:
        Pose, tensions (m,) [N], principal stiffnesses [N/m] of the motions that the taut cables
        leave, turns times the arm, least first, and the unbalanced force [N].

    Raises:
        EquilibriumError: None is found; says what is missing.
    """
    motion = platform.motion
    made = make_equilibrium_program(cables, INEXTENSIBLE, platform, l0, guess)
    X_WP = solve_equilibrium_program(made)
    weight = platform.mass * platform.gravity
    paths = cable_paths(X_WP, cables)
    R = X_WP.rotation().matrix()
    tensions = taut_tensions(paths, l0 - paths.lengths, platform.weight_wrench(X_WP), motion, R)
    taut = np.flatnonzero(tensions > 1e-9 * weight)
    n, k = motion.freedom, len(taut)
    for _ in range(STEPS):
        paths, R = cable_paths(X_WP, cables), X_WP.rotation().matrix()
        J = np.asfortranarray(motion.columns(paths.J[taut], R))
        force = motion.components(platform.weight_wrench(X_WP), R) - J.T @ tensions[taut]
        lacking = l0 - paths.lengths
        unbalanced = float(np.max(np.abs(force)))
        if unbalanced <= SETTLED_UNBALANCE * weight and np.all(np.abs(lacking[taut]) <= TOO_SHORT):
            break
        K = tension_stiffness(X_WP, cables, tensions) + platform.weight_stiffness(X_WP)
        A = np.block([[motion.part(K, R), J.T], [J, np.zeros((k, k))]])
        step = np.linalg.lstsq(A, np.concatenate([force, lacking[taut]]), rcond=1e-13)[0]
        X_WP = displaced(X_WP, platform, step[:n])
        tensions[taut] += step[n:]
    worst = int(np.argmin(lacking))
    if (
        unbalanced > SETTLED_UNBALANCE * weight
        or lacking[worst] < -TOO_SHORT
        or np.any(tensions < 0.0)
    ):
        raise EquilibriumError(
            f"equilibrium: none found with inextensible cables; {unbalanced:.3g} N are left "
            f"unbalanced, and cable {worst + 1} is {max(-lacking[worst], 0.0):.3g} m too short"
        )
    K = tension_stiffness(X_WP, cables, tensions) + platform.weight_stiffness(X_WP)
    scale = np.ones(n)
    scale[: motion.num_turns] = 1.0 / arm
    K = motion.part(0.5 * (K + K.T), R) * np.outer(scale, scale)
    rank = int(np.linalg.matrix_rank(J * scale)) if k else 0
    free = np.linalg.svd(J * scale)[2][rank:].T if k else np.eye(n)
    return X_WP, tensions, np.asarray(np.linalg.eigvalsh(free.T @ K @ free), float), unbalanced
