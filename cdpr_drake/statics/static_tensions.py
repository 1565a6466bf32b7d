"""Tensions and unstrained lengths with which cables of any model hold a platform at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import behaviour_of, counted_lengths
from cdpr_drake.cables.models import CABLE_MODELS, check_model
from cdpr_drake.cables.states import cable_derivatives, cable_state
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import FREE, MotionType
from cdpr_drake.statics.controlled_wrenches import wrench_control
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.tensions.problem import TensionProblem

LEAST_TENSION_WEIGHTS = 1.5
"""Least tension of a sagging cable, in weights of the cable: it cannot hold itself up by less."""

ROUNDS = 200
"""Rounds after which the tensions of sagging cables are given up."""

SETTLED_CHANGE = 1e-12
"""Change of the tensions between two rounds that counts as none, relative to the largest."""

ROUNDING = 1e-10
"""A change below this that does not become smaller any more is rounding, too: it ends in a cycle of
some 1e-12 where W is badly conditioned."""


@dataclass(frozen=True, eq=False)
class StaticTensions:
    """What holds a platform at rest.

    Attributes:
        tensions: At the platform, of least 2-norm within the bounds, shape (m,) [N].
        drum_tensions: At the exit points, shape (m,) [N].
        unstrained_lengths: Shape (m,) [m].
    """

    tensions: Array
    drum_tensions: Array
    unstrained_lengths: Array


def find_static_tensions(
    cables: CableSet,
    model: str,
    X_WP: RigidTransform,
    wrench: Array,
    bounds: tuple[float, float],
    motion: MotionType = FREE,
) -> StaticTensions | None:
    """Tensions and lengths that hold the platform, or None where there are none.

    Of straight cables the tensions do not change their direction; of sagging ones they do, and so
    tensions and directions are found in turn until neither changes.

    Args:
        cables: The cables.
        model: A name of `CABLE_MODELS`; inextensible ones get the lengths of their paths.
        X_WP: Pose of the platform.
        wrench: What the cables have to balance: the platform's weight and more, about Po in W,
            shape (6,) (moment, force) [N m, N].
        bounds: Smallest and largest tension [N].
        motion: Which motions the platform has; something else balances the others.

    Raises:
        CableModelError: The model is unknown or cannot describe the cables.
        CableGeometryError: An anchor point lies in the groove of its pulley or on its swivel axis,
            or sagging cables do not settle.
        TensionProblemError: The cables, as many as degrees of freedom or more, cannot hold the
            platform in some direction there.
    """
    check_model(model, cables)
    paths, m, R = cable_paths(X_WP, cables), cables.count, X_WP.rotation().matrix()
    wanted = motion.components(wrench, R)
    lower, upper = np.full(m, bounds[0]), np.full(m, bounds[1])
    J = paths.J
    kind = CABLE_MODELS[model]
    if not kind.sags:
        tensions = _balancing(motion.components(-J.T, R), wanted, lower, upper)
        if tensions is None:
            return None
        if not kind.extensible:
            return StaticTensions(tensions, tensions, np.asarray(paths.lengths, float))
        counted = counted_lengths(paths.lengths, tensions, cables.stiffness, behaviour_of(cables))
        return StaticTensions(tensions, tensions, counted)
    lower = np.maximum(lower, LEAST_TENSION_WEIGHTS * cables.linear_weight * paths.lengths)
    arms = (R @ cables.p_PB).T
    before, last = np.zeros(m), np.inf
    for _ in range(ROUNDS):
        tensions = _balancing(motion.components(-J.T, R), wanted, lower, upper)
        if tensions is None:
            return None
        l0 = lengths_for_tensions(cables, model, X_WP, tensions)
        state = cable_state(cables, model, X_WP, l0)
        change = np.max(np.abs(tensions - before)) / np.max(tensions)
        if change <= SETTLED_CHANGE or last <= change <= ROUNDING:
            return StaticTensions(state.tensions, state.drum_tensions, l0)
        before, last = tensions, change
        u = -(state.forces / state.tensions).T
        J = np.hstack([np.cross(arms, u), u])
    raise CableGeometryError(
        "sagging cables: tensions and directions do not settle; accepted: a pose that the cables "
        "hold taut"
    )


def _balancing(W: Array, wrench: Array, lower: Array, upper: Array) -> Array | None:
    """Tensions of least 2-norm; fewer cables than rows can balance some wrenches only."""
    n, m = W.shape
    if m >= n:
        return exact_tensions(TensionProblem(W, wrench, lower, upper))
    return wrench_control(W, wrench, lower, upper, np.ones(n)).tensions


def lengths_for_tensions(
    cables: CableSet, model: str, X_WP: RigidTransform, tensions: Array
) -> Array:
    """Unstrained lengths at which the cables have these tensions at the platform, shape (m,) [m].

    Newton's method from the lengths of weightless cables, which are too short: the tension falls
    with the length ever more slowly, so that no step goes too far.

    Args:
        cables: The cables.
        model: An elastic model of `CABLE_MODELS`.
        X_WP: Pose of the platform.
        tensions: Tensions, shape (m,), of a catenary more than its weight [N].

    Raises:
        CableGeometryError: A sagging cable cannot have so little tension, or cannot run.
    """
    lengths, behaviour = cable_paths(X_WP, cables).lengths, behaviour_of(cables)
    l0 = counted_lengths(lengths, tensions, cables.stiffness, behaviour)
    if not CABLE_MODELS[model].sags:
        return l0
    for _ in range(ROUNDS):
        excess = cable_state(cables, model, X_WP, l0).tensions - tensions
        slope = cable_derivatives(cables, model, X_WP, l0).tensions_by_length
        step = -excess / slope
        if not np.all(np.isfinite(step)) or np.any(slope >= 0.0):
            break
        l0 = l0 + step
        if np.all(np.abs(step) <= 1e-15 * l0):
            return np.asarray(l0, float)
        if np.all(np.abs(excess) <= 1e-13 * cables.stiffness):
            return np.asarray(l0, float)
    i = int(np.argmax(np.abs(excess)))
    raise CableGeometryError(
        f"cable {i + 1}: no length gives it a tension of {tensions[i]:.4g} N here; accepted: more "
        f"than its weight, about {cables.linear_weight[i] * l0[i]:.4g} N"
    )
