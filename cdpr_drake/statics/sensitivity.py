"""How the pose of rest changes with every constant of the robot: implicit function theorem."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.dispatch_kernel import all_responses
from cdpr_drake.cables.models import CABLE_MODELS, STRAIGHT, cable_law, check_model
from cdpr_drake.cables.response_kernel import DERIVATIVES
from cdpr_drake.cables.states import cable_derivatives
from cdpr_drake.errors import CableGeometryError, CableModelError, EquilibriumError
from cdpr_drake.geometry.cable_paths import impossible_cable, motion_of
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import cross_matrix
from cdpr_drake.geometry.pulley_kernel import LINEAR_WEIGHT, PULLEY_RADIUS
from cdpr_drake.geometry.two_pulleys_kernel import add_platform_turning
from cdpr_drake.statics.rigid_platform import RigidPlatform

RADIUS_STEP = 1e-6
"""Step of the difference by the pulley radius [m]; forward from 0, where there is no behind."""

RELATIVE_STEP = 1e-5
"""Step of the central difference by weight per length, relative to it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseSensitivity:
    """Derivatives of the pose of rest: displacement (turn, translation) in W per unit.

    The first axis is the displacement, shape 6 [rad, m]; motions that the platform does not
    have are 0.

    Attributes:
        exit_points: By p_WA, shape (6, 3, m) [1/m, -].
        anchor_points: By p_PB in P, shape (6, 3, m) [1/m, -].
        lengths: By the unstrained lengths, shape (6, m) [1/m, -].
        pulley_radius: Shape (6, m) [1/m, -].
        stiffness: By E S, shape (6, m) [1/N].
        linear_weight: By the cables' weight per length, shape (6, m) [m/N].
        mass: By the platform's mass, shape (6,) [1/kg].
        center_of_mass: By p_PCo, shape (6, 3) [1/m, -].
    """

    exit_points: Array
    anchor_points: Array
    lengths: Array
    pulley_radius: Array
    stiffness: Array
    linear_weight: Array
    mass: Array
    center_of_mass: Array


def pose_sensitivity(
    cables: CableSet, model: str, platform: RigidPlatform, X_WP: RigidTransform, l0: Array
) -> PoseSensitivity:
    """Derivatives of the pose of rest at a pose of rest.

    Where the wrench w(X, c) is 0 at pose X with a constant c, dX/dc = K^-1 dw/dc, K the stiffness.
    One-sided where a straight cable is just taut. By pulley radius and weight of the cables, the
    wrench is differentiated by differences.

    Args:
        cables: The cables.
        model: An elastic model of `cables.CABLE_MODELS`.
        platform: The platform.
        X_WP: A pose of rest, as `equilibrium.equilibrium_near` finds it.
        l0: Unstrained lengths, shape (m,) [m].

    Raises:
        CableModelError: An unknown model, or inextensible cables.
        CableGeometryError: A cable cannot run so.
        EquilibriumError: Nothing holds the platform in some direction.
    """
    check_model(model, cables)
    kind = CABLE_MODELS[model]
    if not kind.extensible:
        raise CableModelError("sensitivity: found the inextensible model; accepted: an elastic one")
    R, motion, m = X_WP.rotation().matrix(), platform.motion, cables.count
    by = cable_derivatives(cables, model, X_WP, l0)
    K = motion.part(platform.weight_stiffness(X_WP) - by.wrench_by_pose, R)
    if np.linalg.cond(K) > 1e14:
        raise EquilibriumError(
            "sensitivity: nothing holds the platform in some direction; accepted: a pose of rest "
            "that is stable or unstable, not neutral"
        )

    def poses(wrenches: Array) -> Array:
        """Displacements of wrenches, the first axis of both, shape (6, ...)."""
        flat = wrenches.reshape(6, -1)
        moved = motion.twist(np.asarray(np.linalg.solve(K, motion.components(flat, R)), float), R)
        return moved.reshape(wrenches.shape)

    packed, law = cables.packed(), cable_law(model, cables)
    states, D = _responses(cables, packed, law, X_WP, l0)
    arms = states[:, 8:11]
    exit_points, anchor_points = np.empty((6, 3, m)), np.empty((6, 3, m))
    for i in range(m):
        arm, by_B = cross_matrix(arms[i]), D[i, :3, :3]
        exit_points[:, :, i] = np.vstack([arm @ by_B, by_B])  # the pull depends on B - A
        beyond = np.zeros((6, 6))
        add_platform_turning(motion_of(X_WP), packed[i], float(states[i, 3]), beyond)
        exit_points[:, :, i] += beyond[:, 3:]
        by_arm = np.vstack([cross_matrix(states[i, 0:3]), np.zeros((3, 3))])
        anchor_points[:, :, i] = (by_arm - exit_points[:, :, i]) @ R

    def by_column(column: int, steps: Array) -> Array:
        """Wrench by one constant of each cable, shape (6, m); it changes that cable's pull only."""
        ahead, behind = packed.copy(), packed.copy()
        ahead[:, column] += steps
        behind[:, column] = np.maximum(behind[:, column] - steps, 0.0)
        taken = ahead[:, column] - behind[:, column]
        pulls = [_responses(cables, each, law, X_WP, l0)[0][:, 0:3] for each in (ahead, behind)]
        slope = (pulls[0] - pulls[1]) / taken[:, np.newaxis]
        return -np.vstack([np.cross(arms, slope).T, slope.T])

    def by_stiffness() -> Array:
        if law != STRAIGHT:
            return by_column(6, RELATIVE_STEP * cables.stiffness)
        slope = states[:, 0:3] / cables.stiffness[:, np.newaxis]  # straight: proportional to E S
        return -np.vstack([np.cross(arms, slope).T, slope.T])

    weight = np.zeros((6, m))
    if kind.sags:
        steps = RELATIVE_STEP * np.maximum(cables.linear_weight, 1e-3)
        weight = by_column(LINEAR_WEIGHT, steps)
    load = np.zeros((6, 3))
    load[:3] = -cross_matrix(platform.mass * platform.acceleration()) @ R
    unit = replace(platform, mass=1.0)
    return PoseSensitivity(
        exit_points=poses(exit_points),
        anchor_points=poses(anchor_points),
        lengths=poses(by.wrench_by_length),
        pulley_radius=poses(by_column(PULLEY_RADIUS, np.full(m, RADIUS_STEP))),
        stiffness=poses(by_stiffness()),
        linear_weight=poses(weight),
        mass=poses(unit.weight_wrench(X_WP)),
        center_of_mass=poses(load),
    )


def _responses(
    cables: CableSet, packed: Array, law: int, X_WP: RigidTransform, l0: Array
) -> tuple[Array, Array]:
    m = len(packed)
    states, D = np.empty((m, 11)), np.zeros((m, DERIVATIVES, 4))
    lengths = np.ascontiguousarray(l0, float)
    if not all_responses(law, motion_of(X_WP), packed, lengths, np.zeros((m, 2)), states, D):
        raise CableGeometryError(impossible_cable(X_WP, cables))
    return states, D
