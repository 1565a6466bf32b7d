"""What the cables of a set do at a pose by a model, and how that changes with pose and lengths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import behaviour_of
from cdpr_drake.cables.dispatch_kernel import SLACK_WEIGHTS, all_responses
from cdpr_drake.cables.models import CABLE_MODELS, cable_law, check_model
from cdpr_drake.cables.response_kernel import DERIVATIVES, damping_tension
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths, impossible_cable, motion_of
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.two_pulleys_kernel import add_platform_turning

TOO_SHORT = 1e-9
"""By how much an inextensible cable may miss its path [m]; rounding of lengths below 1 km."""


@dataclass(frozen=True, eq=False)
class CableState:
    """What m cables do at a pose.

    Attributes:
        tensions: At the platform, shape (m,) [N]. NaN: an inextensible taut cable.
        drum_tensions: At the exit point A, which the winch holds, shape (m,) [N].
        lengths: Under load, from A to B, shape (m,) [m].
        length_rates: Their rates at the velocities given, shape (m,) [m/s].
        slack: Whether the tension at the platform is at most `slack_tensions`, shape (m,); of an
            inextensible cable, whether it is longer than the straight path.
        surplus_lengths: By how much the unstrained length is longer than the straight path from A
            to B, else 0, shape (m,) [m]. A taut cable that sags may have some.
        sags: Largest distance from the chord; 0 for straight cables, shape (m,) [m].
        forces: On the platform in W, at the anchor points, shape (3, m) [N].
        wrench: Of all cables about Po in W, shape (6,) (moment, force) [N m, N].
    """

    tensions: Array
    drum_tensions: Array
    lengths: Array
    length_rates: Array
    slack: np.typing.NDArray[np.bool_]
    surplus_lengths: Array
    sags: Array
    forces: Array
    wrench: Array


@dataclass(frozen=True, eq=False)
class CableDerivatives:
    """How `CableState` at rest changes with the pose and with the unstrained lengths.

    The pose changes by a small displacement (rotation vector, translation) in W; each cable's
    numbers depend on its own unstrained length only. Attributes that end in `_by_pose` have shape
    (m, 6), per rad and per metre, those in `_by_length` shape (m,), per metre; and

    Attributes:
        wrench_by_pose: Shape (6, 6), minus the stiffness matrix; moments about the moved Po.
        wrench_by_length: Shape (6, m).
    """

    tensions_by_pose: Array
    tensions_by_length: Array
    drum_tensions_by_pose: Array
    drum_tensions_by_length: Array
    lengths_by_pose: Array
    lengths_by_length: Array
    surplus_lengths_by_pose: Array
    surplus_lengths_by_length: Array
    sags_by_pose: Array
    sags_by_length: Array
    wrench_by_pose: Array
    wrench_by_length: Array


def cable_state(
    cables: CableSet,
    model: str,
    X_WP: RigidTransform,
    l0: Array,
    V_WP: Array | None = None,
    l0_dot: Array | None = None,
) -> CableState:
    """What the cables do at a pose.

    Args:
        cables: The cables; over pulleys where their radius is positive.
        model: A name of `CABLE_MODELS`.
        X_WP: Pose of the platform.
        l0: Unstrained lengths from A to B, along the groove of a pulley, shape (m,), > 0 [m].
        V_WP: Spatial velocity of the platform in W, shape (6,) [rad/s, m/s]; None: at rest.
        l0_dot: Rates of l0, shape (m,) [m/s]; None: at rest.

    Raises:
        CableModelError: The model is unknown or cannot describe the cables, or l0 is not positive.
        CableGeometryError: An anchor point lies in the groove of its pulley or on its swivel
            axis, no catenary is found, or an inextensible cable is too short for its path.

    Source: Gazebo thesis 2.3 and servoing thesis (2.6) for straight cables; Irvine, Cable
    Structures, 1981, 1.3 for the catenary.
    """
    V = np.zeros(6) if V_WP is None else np.asarray(V_WP, float)
    rate = np.zeros(cables.count) if l0_dot is None else np.asarray(l0_dot, float)
    check_model(model, cables)
    if not CABLE_MODELS[model].extensible:
        return _inextensible(cables, X_WP, check_lengths(l0, cables), V)
    states, D = _responses(cables, model, X_WP, l0)
    arms = states[:, 8:11]
    tensions, drum = states[:, 3].copy(), states[:, 4].copy()
    pulls = states[:, 0:3].copy()
    if CABLE_MODELS[model].damped and (V_WP is not None or l0_dot is not None):
        motion = (*motion_of(X_WP), *V.tolist())
        for i, T in enumerate(cables.retardation):
            damping = damping_tension(motion, *states[i, [0, 1, 2, 3, 8, 9, 10]], D[i], T, rate[i])
            damping = max(damping, -tensions[i])
            if tensions[i] > 0.0:
                pulls[i] *= (tensions[i] + damping) / tensions[i]
            tensions[i] += damping
            drum[i] = max(drum[i] + damping, 0.0)
    moments = np.cross(arms, pulls)
    velocity = V[3:] + np.cross(V[:3], arms)
    slack = tensions <= slack_tensions(cables, model, l0)
    return CableState(
        tensions,
        drum,
        states[:, 5].copy(),
        np.sum(D[:, 5, :3] * velocity, axis=1) + D[:, 5, 3] * rate,
        slack,
        states[:, 6].copy(),
        states[:, 7].copy(),
        -pulls.T,
        -np.concatenate([np.sum(moments, axis=0), np.sum(pulls, axis=0)]),
    )


def slack_tensions(cables: CableSet, model: str, l0: Array) -> Array:
    """Tensions at the platform up to which cables count as slack, shape (m,) [N].

    A straight cable is slack where it pulls nothing, one that sags where it pulls on the platform
    with no more than its own weight.

    Args:
        cables: The cables.
        model: A name of `CABLE_MODELS`.
        l0: Unstrained lengths, shape (m,) [m].
    """
    if not CABLE_MODELS[model].sags:
        return np.zeros(cables.count)
    weight: Array = SLACK_WEIGHTS * cables.linear_weight * np.asarray(l0, float)
    return weight


def cable_derivatives(
    cables: CableSet, model: str, X_WP: RigidTransform, l0: Array
) -> CableDerivatives:
    """How what the cables do at rest changes with pose and unstrained lengths.

    One-sided where a straight cable is just taut. Arguments and errors as for `cable_state`.

    Raises:
        CableModelError: As there; also for inextensible cables, whose tensions have no derivative.
        CableGeometryError: As there.
    """
    check_model(model, cables)
    if not CABLE_MODELS[model].extensible:
        raise CableModelError("derivatives: found the inextensible model; accepted: an elastic one")
    states, D = _responses(cables, model, X_WP, l0)
    arms, pulls = states[:, 8:11], states[:, 0:3]

    def by_pose(row: int) -> Array:
        """B moves by v + w x arm."""
        gradient = D[:, row, :3]
        return np.hstack([np.cross(arms, gradient), gradient])

    wrench_by_pose, wrench_by_length = np.zeros((6, 6)), np.zeros((6, cables.count))
    motion, rows = motion_of(X_WP), cables.packed()
    for i in range(cables.count):
        arm, pull = _skew(arms[i]), _skew(pulls[i])
        pull_by_pose = np.hstack([-D[i, :3, :3] @ arm, D[i, :3, :3]])
        moment_by_pose = arm @ pull_by_pose
        moment_by_pose[:, :3] += pull @ arm  # the arm turns with the platform
        wrench_by_pose -= np.vstack([moment_by_pose, pull_by_pose])
        turning = np.zeros((6, 6))
        add_platform_turning(motion, rows[i], float(states[i, 3]), turning)
        wrench_by_pose -= turning
        wrench_by_length[:, i] = -np.concatenate([arm @ D[i, :3, 3], D[i, :3, 3]])
    parts = [(by_pose(row), D[:, row, 3].copy()) for row in range(3, DERIVATIVES)]
    (t_X, t_l), (drum_X, drum_l), (l_X, l_l), (surplus_X, surplus_l), (sag_X, sag_l) = parts
    return CableDerivatives(
        t_X, t_l, drum_X, drum_l, l_X, l_l, surplus_X, surplus_l, sag_X, sag_l,
        wrench_by_pose, wrench_by_length,
    )  # fmt: skip


def check_breaking(cables: CableSet, tensions: Array, l0: Array) -> None:
    """Checks that no cable is stretched beyond its breaking load.

    Args:
        cables: The cables.
        tensions: Tensions, shape (m,) [N].
        l0: Unstrained lengths, shape (m,) [m].

    Raises:
        CableGeometryError: One is; names it, its length and how long it would have to be.
    """
    over = tensions > cables.breaking_load
    if np.any(over):
        i = int(np.argmax(over))
        raise CableGeometryError(
            f"cable {i + 1}: unstrained length {l0[i]:.6g} m is too short for its span: it takes "
            f"{tensions[i]:.4g} N; accepted: a length that takes at most its breaking load, "
            f"{cables.breaking_load[i]:.4g} N"
        )


def crept_at_rest(cables: CableSet, X_WP: RigidTransform, l0: Array) -> Array:
    """What has crept of cables at rest for long: all of their strain, shape (m,) [-].

    Args:
        cables: The cables.
        X_WP: Pose of the platform.
        l0: Unstrained lengths, shape (m,) [m].

    Returns:
        Empty where cables do not creep.
    """
    behaviour = behaviour_of(cables)
    if behaviour.creep_stiffness == 0.0:
        return np.zeros(0)
    lengths = cable_paths(X_WP, cables).lengths
    return np.asarray(np.maximum(lengths / (behaviour.longer() * l0) - 1.0, 0.0), float)


def check_lengths(l0: Array, cables: CableSet) -> Array:
    """Unstrained lengths as a contiguous array, shape (m,) [m].

    Raises:
        CableModelError: Not one finite number above 0 a cable.
    """
    values = np.ascontiguousarray(l0, dtype=float)
    if values.shape != (cables.count,) or not np.all(np.isfinite(values) & (values > 0.0)):
        raise CableModelError(
            f"unstrained lengths: found {np.array2string(values, precision=4)}; accepted: "
            f"{cables.count} finite numbers > 0 [m]"
        )
    return values


def _responses(
    cables: CableSet, model: str, X_WP: RigidTransform, l0: Array
) -> tuple[Array, Array]:
    values, m = check_lengths(l0, cables), cables.count
    states, D = np.empty((m, 11)), np.zeros((m, DERIVATIVES, 4))
    good = all_responses(
        cable_law(model, cables),
        motion_of(X_WP),
        cables.packed(),
        values,
        np.zeros((m, 2)),
        states,
        D,
    )
    if not good:
        raise CableGeometryError(impossible_cable(X_WP, cables))
    return states, D


def _inextensible(cables: CableSet, X_WP: RigidTransform, l0: Array, V: Array) -> CableState:
    paths = cable_paths(X_WP, cables)
    missing = paths.lengths - l0
    if np.any(missing > TOO_SHORT):
        i = int(np.argmax(missing))
        raise CableGeometryError(
            f"cable {i + 1}: found a length of {l0[i]:.6g} m, {missing[i]:.3g} m too short for its "
            f"way; accepted for an inextensible cable: at least {paths.lengths[i]:.6g} m"
        )
    slack = missing < -TOO_SHORT
    tensions = np.where(slack, 0.0, np.nan)
    forces = -tensions * paths.u_W
    return CableState(
        tensions,
        tensions.copy(),
        paths.lengths,
        paths.J @ V,
        slack,
        np.where(slack, -missing, 0.0),
        np.zeros(cables.count),
        forces,
        -paths.J.T @ tensions,
    )


def _skew(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
