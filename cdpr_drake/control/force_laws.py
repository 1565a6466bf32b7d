"""Laws by which a platform answers forces: impedance, admittance, position beside force.

All give a wrench F_P_W about Po that the cables shall put on the platform, which any tension
method distributes. M is the platform's inertia, b the terms of velocity and damping less the
weight, e the error of its pose and V_D - V that of its velocity, as in
`task_space.computed_torque`; w is what pushes it. Axes are those of a task frame T that rests in W.

* **Impedance.** F = M A_D + b + D (V_D - V) + K e, so that M e'' + D e' + K e = -w: the inertia is
  the platform's own, and nothing is measured. Of a mass m on a line: omega = sqrt(K / m), and the
  damping D / (2 sqrt(K m)).
* **Admittance.** A virtual mass M_v y'' + D_v y' + K_v y = w moves the desired pose by y, which
  computed torque follows; w is estimated. `Admittance` is exact for a w that is constant over a
  period. K_v = 0: the platform stays where it was led.
* **Position and force.** Along chosen axes of T a force f is pressed, along the others computed
  torque follows. Pressing is F = b + f + k_i int (f - f_c) - D v, f_c the force on the contact by
  estimate. With D = 2 sqrt(m k_c), k_c what the contact is believed to give, mass and contact are
  critically damped; a stiffness that is wrong by a factor makes the damping wrong by its root.
* **Disturbance observer.** F - w of an estimated w, added to any of these but what is pressed.

Sources: N. Hogan, Impedance control, ASME Journal of Dynamic Systems, Measurement, and Control
107, 1985; M. H. Raibert and J. J. Craig, Hybrid position/force control of manipulators, same
journal 103, 1981; for cables, W. Kraus, P. Miermeister, V. Schmidt, A. Pott, Hybrid position-force
control of a cable-driven parallel robot with experimental evaluation, Mechanical Sciences 6, 2015.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ControlGainError


def pose_deviation(X_WP: RigidTransform, X_WD: RigidTransform) -> Array:
    """e as `task_space.computed_torque` has it, (turn, translation) in W, shape (6,) [rad, m]."""
    q = (X_WD.rotation() @ X_WP.rotation().inverse()).ToQuaternion().wxyz()
    turn = 2.0 * (1.0 if q[0] >= 0.0 else -1.0) * q[1:]
    return np.concatenate([turn, X_WD.translation() - X_WP.translation()])


def in_world(R_WT: RotationMatrix, diagonal: Array) -> Array:
    """diag(diagonal) of a task frame in axes of W, shape (6, 6)."""
    R = np.kron(np.eye(2), R_WT.matrix())
    return np.asarray((R * np.asarray(diagonal, float)) @ R.T)


def impedance_wrench(
    feedforward: Array, e: Array, velocity_error: Array, K: Array, D: Array
) -> Array:
    """M A_D + b + D (V_D - V) + K e.

    Args:
        feedforward: M A_D + b, computed torque without gains, shape (6,) [N m, N].
        e: Error of the pose, shape (6,) [rad, m].
        velocity_error: V_D - V, shape (6,) [rad/s, m/s].
        K: Stiffness in W, shape (6, 6).
        D: Damping in W, shape (6, 6).
    """
    return np.asarray(feedforward + D @ velocity_error + K @ e)


class Admittance:
    """A virtual mass, damper and spring on each axis of a task frame, moved by a wrench."""

    def __init__(self, mass: Array, damping: Array, stiffness: Array, period: float) -> None:
        """With numbers of each axis, shape (6,) each, and the time between steps [s].

        Raises:
            ControlGainError: A mass is not above 0, or another number below 0.
        """
        self._numbers = tuple(np.asarray(x, float) for x in (mass, damping, stiffness))
        self._steps = np.empty((6, 2, 3))
        for axis, (m, d, k) in enumerate(zip(mass, damping, stiffness, strict=True)):
            if not (m > 0.0 and d >= 0.0 and k >= 0.0):
                raise ControlGainError(
                    f"admittance, axis {axis + 1} of 6: found mass {m:g}, damping {d:g}, stiffness "
                    f"{k:g}; accepted: a mass above 0, the others at least 0"
                )
            A = np.array([[0.0, 1.0, 0.0], [-k / m, -d / m, 1.0 / m], [0.0, 0.0, 0.0]])
            self._steps[axis] = scipy.linalg.expm(A * period)[:2]

    def acceleration(self, y: Array, rate: Array, wrench: Array) -> Array:
        """y'' of a displacement, its rate and a wrench, all in T, shape (6,)."""
        mass, damping, stiffness = self._numbers
        return np.asarray((wrench - damping * rate - stiffness * y) / mass)

    def step(self, y: Array, rate: Array, wrench: Array) -> tuple[Array, Array]:
        """Displacement and its rate after a period, of those before and a wrench, all in T."""
        known = np.stack([y, rate, wrench], axis=1)
        moved = np.einsum("aij,aj->ai", self._steps, known)
        return moved[:, 0], moved[:, 1]


def displaced(X_WD: RigidTransform, y: Array) -> RigidTransform:
    """A pose moved by a rotation vector and a translation in W, shape (6,) [rad, m]."""
    angle = float(np.linalg.norm(y[:3]))
    turn = RotationMatrix()
    if angle > 0.0:
        c, s = np.cos(angle), np.sin(angle)
        u = y[:3] / angle
        cross = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
        R = c * np.eye(3) + s * cross + (1.0 - c) * np.outer(u, u)
        turn = RotationMatrix.ProjectToRotationMatrix(R)
    return RigidTransform(turn @ X_WD.rotation(), X_WD.translation() + y[3:])


def hybrid_wrench(follows: Array, presses: Array, R_WT: RotationMatrix, pressed: Array) -> Array:
    """One wrench along pressed axes of T, another one along the others.

    Args:
        follows: Wrench of the position law in W, shape (6,) [N m, N].
        presses: Wrench of the force law in W, shape (6,) [N m, N].
        R_WT: Axes of the task frame.
        pressed: 1 for axes of T along which force is controlled, else 0, shape (6,).
    """
    S = in_world(R_WT, pressed)
    return np.asarray(follows + S @ (presses - follows))


def port_energy(poses: Array, wrenches: Array) -> Array:
    """Work that a wrench has done on a platform so far, at each row, shape (n,) [J].

    Args:
        poses: (quaternion wxyz, position of Po), shape (n, 7).
        wrenches: About Po in W, shape (n, 6) [N m, N].
    """
    q, p = poses[:, :4], poses[:, 4:]
    w, x, y, z = q.T
    a, b, c, d = q[:-1, 0], -q[:-1, 1], -q[:-1, 2], -q[:-1, 3]
    w1, x1, y1, z1 = w[1:], x[1:], y[1:], z[1:]
    turn = np.stack(
        [
            w1 * b + x1 * a + y1 * d - z1 * c,
            w1 * c - x1 * d + y1 * a + z1 * b,
            w1 * d + x1 * c - y1 * b + z1 * a,
        ],
        axis=1,
    )
    sign = np.sign(w1 * a - x1 * b - y1 * c - z1 * d)[:, np.newaxis]
    moves = np.hstack([2.0 * sign * turn, np.diff(p, axis=0)])
    mean = 0.5 * (wrenches[1:] + wrenches[:-1])
    return np.concatenate([[0.0], np.cumsum(np.sum(mean * moves, axis=1))])
