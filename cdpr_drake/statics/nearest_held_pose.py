"""The nearest pose at which tensions within bounds hold the platform's weight.

Distance of poses is |(l theta, p)|, theta being the rotation vector between them, p the way of Po
in W, and l a length that makes turns comparable. The program

    min |(l theta, p)|^2   with   W(X) t + w(X) = 0,   lower <= t <= upper

is not convex. It is solved by sequential quadratic programs (SLSQP) from several starts: the pose
itself, and others that are given, such as one that is known to be held; the nearest of what they
find is returned, a local solution. Its tensions are found again by a linear program of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
from cdpr_drake.geometry.straight_cables import gravity_wrench

BALANCED = 1e-6
"""Share of the weight by which the wrench of the tensions may miss it."""

ITERATIONS = 100
"""Of one sequence of quadratic programs; a solution takes some ten."""


@dataclass(frozen=True, eq=False)
class Load:
    """What cables have to hold.

    Attributes:
        mass: Of the platform [kg].
        p_PCo: Its centre of mass in P, shape (3,) [m].
        gravity: Acceleration in W, shape (3,) [m/s^2].
    """

    mass: float
    p_PCo: Array
    gravity: Array

    @property
    def weight(self) -> float:
        """The weight [N]."""
        return self.mass * float(np.linalg.norm(self.gravity))

    def wrench(self, X_WP: RigidTransform) -> Array:
        """The weight about Po in W, shape (6,) [N m, N]."""
        return gravity_wrench(X_WP, self.mass, self.p_PCo, self.gravity)


@dataclass(frozen=True, eq=False)
class HeldPose:
    """A pose that is held.

    Attributes:
        X_WP: The pose.
        tensions: That hold it, shape (m,) [N].
        distance: From where it was asked for [m].
    """

    X_WP: RigidTransform
    tensions: Array
    distance: float


def nearest_held_pose(
    X_WP: RigidTransform,
    cables: CableSet,
    load: Load,
    bounds: Array,
    *,
    size: float,
    starts: Sequence[RigidTransform] = (),
) -> HeldPose | None:
    """The nearest pose that is held; None where none was found.

    Args:
        X_WP: From where.
        cables: The cables, m of them, of a platform that moves freely (3R3T).
        load: What they hold.
        bounds: Smallest and largest tensions, shape (2, m) [N]; both zero of a cable that is not
            there.
        size: l, what turns are multiplied by [m].
        starts: Poses from which it is looked for, too.

    Raises:
        CableGeometryError: A cable cannot run at a pose that was tried.
    """
    found = []
    for start in (X_WP, *starts):
        at = _search(X_WP, cables, load, bounds, size, start)
        tensions = holding_tensions(at, cables, load, bounds, size)
        if tensions is not None:
            found.append(HeldPose(at, tensions, pose_distance(X_WP, at, size)))
    return min(found, key=lambda one: one.distance, default=None)


def pose_distance(X: RigidTransform, Y: RigidTransform, size: float) -> float:
    """|(l theta, p)| of two poses [m]."""
    return float(np.linalg.norm(_apart(X, Y, size)))


def _apart(X: RigidTransform, Y: RigidTransform, size: float) -> Array:
    theta = rotation_vector(Y.rotation() @ X.rotation().inverse())
    return np.concatenate([size * theta, Y.translation() - X.translation()])


def holding_tensions(
    X_WP: RigidTransform, cables: CableSet, load: Load, bounds: Array, size: float
) -> Array | None:
    """Tensions of least sum that hold a pose, to `BALANCED` of the weight, shape (m,) [N]; None
    where there are none. Arguments as of `nearest_held_pose`."""
    from scipy.optimize import linprog  # few runs come here, and each would wait for it

    scale = _scale(load, size)
    W = -cable_jacobian(X_WP, cables).T / scale[:, np.newaxis]
    w = load.wrench(X_WP) / scale
    room = np.full(6, BALANCED)
    solved = linprog(
        np.ones(cables.count), A_ub=np.vstack([W, -W]), b_ub=np.concatenate([room - w, room + w]),
        bounds=bounds.T, method="highs",
    )  # fmt: skip
    return np.asarray(solved.x) if solved.status == 0 else None


def _scale(load: Load, size: float) -> Array:
    return load.weight * np.array([size] * 3 + [1.0] * 3)


def _search(
    X_WP: RigidTransform,
    cables: CableSet,
    load: Load,
    bounds: Array,
    size: float,
    start: RigidTransform,
) -> RigidTransform:
    """Where a sequence of programs ends, held or not."""
    from scipy.optimize import lsq_linear, minimize  # few runs come here

    scale = _scale(load, size)
    own = bounds[1] > bounds[0]
    fixed = np.where(own, 0.0, bounds[0])

    def pose(z: Array) -> RigidTransform:
        turn = rotation_from_vector(z[:3] / size)
        return RigidTransform(turn @ X_WP.rotation(), X_WP.translation() + z[3:6])

    def missing(z: Array) -> Array:
        X, t = pose(z), fixed.copy()
        t[own] = load.weight * z[6:]
        return np.asarray((load.wrench(X) - cable_jacobian(X, cables).T @ t) / scale)

    apart = _apart(X_WP, start, size)
    W = -cable_jacobian(start, cables).T[:, own] / scale[:, np.newaxis]
    limits = bounds[:, own] / load.weight
    rest = (load.wrench(start) - cable_jacobian(start, cables).T @ fixed) / scale
    tensions = lsq_linear(load.weight * W, -rest, bounds=(limits[0], limits[1])).x
    solved = minimize(
        lambda z: float(z[:6] @ z[:6]),
        np.concatenate([apart, tensions]),
        jac=lambda z: np.concatenate([2.0 * z[:6], np.zeros(len(z) - 6)]),
        constraints={"type": "eq", "fun": missing},
        bounds=[(None, None)] * 6 + list(zip(*limits, strict=True)),
        method="SLSQP",
        options={"maxiter": ITERATIONS, "ftol": 1e-12},
    )
    return pose(np.asarray(solved.x))
