"""What a free motion asks of cables, on any scalar: the kernels' own source on numbers or AutoDiff.

Coordinates of a pose are (g, d), or those of them that the platform can move: the quaternion (1, g)
turns P in W from its pose at the start, g = u tan(theta / 2), and d is the way of Po in W. They are
regular below half a turn, and polynomials of them are pieces of a `PosePath`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import floating_wrench
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.poses import pose_row, rotation_vector
from cdpr_drake.geometry.pulley_kernel import pulley_line
from cdpr_drake.numerics.kernel_calls import any_scalar
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.trajectories.pose_path import PIECE_NUMBERS, POINT_SIZE, path_point
from cdpr_drake.workspaces.cable_distance_kernel import segments_shares

LARGEST_TURN = 3.0
"""Of a goal from its start: g grows without end towards half a turn [rad]."""

TOUCHING = 1e-16
"""Added to squared distances, which have no derivative where segments cross [m^2]."""

AT_LIMIT = 1e-3
"""Of a limit: cables that are nearer are at it."""

INSTANT = 1e-4
"""Half the time between speeds of which accelerations are the difference: errors go with its square
and the third derivative of a length, and stay below 1e-6 of what limits are [s]."""

_point = any_scalar(path_point)
_motion = any_scalar(floating_motion)
_wrench = any_scalar(floating_wrench)
_line = any_scalar(pulley_line)


@dataclass(frozen=True)
class Capsule:
    """An obstacle in W: what is within a radius of a segment; of no length, a ball.

    Attributes:
        start: p_W of one end, shape (3,) [m].
        end: p_W of the other, shape (3,) [m].
        radius: Radius, at least 0 [m].
    """

    start: Array
    end: Array
    radius: float

    @staticmethod
    def around(box: Array) -> Capsule:
        """The one around a box, a row of `cable_interference.box_row`: along its longest edge."""
        R, middle, half = box[:9].reshape(3, 3), box[9:12], box[12:]
        k = int(np.argmax(half))
        radius = float(np.linalg.norm(np.delete(half, k)))
        return Capsule(middle - half[k] * R[:, k], middle + half[k] * R[:, k], radius)


class FreeTerms:
    """Terms of a free path of one robot.

    Attributes:
        rows: Components of (g, d) that the platform can move.
    """

    def __init__(self, task: PathTask, start: RigidTransform) -> None:
        """With the pose that coordinates count from."""
        self.rows = list(task.dynamics.motions)
        self._limits = task.limits
        self._cables, self._packed = task.cables, task.cables.packed()
        self._dynamics = task.dynamics.packed()
        w, x, y, z = pose_row(start)[:4]
        # (1, g) times the quaternion of the start, as a linear map of (1, g).
        self._turn = np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])
        self._place, self._start = start.translation(), start

    @property
    def cables(self) -> CableSet:
        """The cables."""
        return self._cables

    def coordinates(self, X_WP: RigidTransform) -> Array:
        """Coordinates of a pose, shape (n,).

        Raises:
            PlanningError: It is turned too far from the start, or out of the platform's plane.
        """
        theta = rotation_vector(X_WP.rotation() @ self._start.rotation().inverse())
        angle = float(np.linalg.norm(theta))
        if angle > LARGEST_TURN:
            raise PlanningError(
                f"goal: found a turn of {np.degrees(angle):.4g} deg from the start; accepted: to "
                f"{np.degrees(LARGEST_TURN):.4g} deg"
            )
        g = theta * (np.tan(0.5 * angle) / angle if angle > 0.0 else 0.5)
        six = np.concatenate([g, X_WP.translation() - self._place])
        still = np.delete(six, self.rows)
        if np.any(np.abs(still) > 1e-9):
            raise PlanningError("goal: found a pose out of the platform's plane; accepted: in it")
        return np.asarray(six[self.rows])

    def row(self, coordinates: Any, power: int) -> Any:
        """Quaternion and place, shape (7,), or with power > 0 what a derivative adds to them."""
        six = np.zeros(6, dtype=np.asarray(coordinates).dtype)
        six[self.rows] = coordinates
        one = np.array([1.0 if power == 0 else 0.0, *six[:3]], dtype=six.dtype)
        place = self._place if power == 0 else np.zeros(3)
        return np.concatenate([self._turn @ one, place + six[3:]])

    def point(self, q: Any, v: Any = None, a: Any = None) -> Any:
        """Pose row, V_WP, A_WP of coordinates and their derivatives by time, shape (19,)."""
        piece = np.zeros(PIECE_NUMBERS, dtype=np.asarray(q).dtype)
        piece[:7] = self.row(q, 0)
        if v is not None:
            piece[7:14] = self.row(v, 1)
        if a is not None:
            piece[14:21] = 0.5 * self.row(a, 2)
        out = np.zeros(POINT_SIZE, dtype=piece.dtype)
        _point(piece, 0.0, out)
        return out

    def lines(self, point: Any) -> list[tuple[Any, ...]]:
        """Of each cable the unit vector A' to B and the arm in W, (ux, uy, uz, rx, ry, rz)."""
        X = _motion(point[:13])
        return [_line(X, cable)[1:] for cable in self._packed]

    def at_limit(self, q: Array, v: Array, a: Array, t: Array) -> list[int]:
        """Cables of which tension, speed or acceleration has come to a limit, the furthest first.

        Args:
            q: Coordinates, shape (n,).
            v: Their derivatives by time.
            a: Their second derivatives.
            t: Tensions as shares of the largest one, shape (m,).
        """
        lim = self._limits
        left = np.minimum(t - lim.lower / lim.upper, 1.0 - t)
        left = np.minimum(left, 1.0 - np.abs(self.cable_speeds(self.point(q, v))) / lim.cable_speed)
        growth = np.asarray(self.cable_accelerations(q, v, a), float)
        left = np.minimum(left, 1.0 - np.abs(growth) / lim.cable_acceleration)
        return [int(i) for i in np.argsort(left) if left[i] < AT_LIMIT]

    def halfway(self, x: Any, parts: int) -> tuple[Any, Any, Any]:
        """Coordinates and derivatives in the middle between two knots.

        Args:
            x: q, v and a at the first knot, a at the second, and the time of the whole motion [s].
            parts: Times between knots of the whole motion.
        """
        n = (len(x) - 1) // 4
        q, v, a, b = (x[i * n : (i + 1) * n] for i in range(4))
        h = x[4 * n] / parts
        place = q + h * (0.5 * v + h * (5.0 * a + b) / 48.0)
        return place, v + h * (3.0 * a + b) / 8.0, 0.5 * (a + b)

    def unbalanced(self, point: Any, tensions: Any) -> Any:
        """Wrench that the cables give less what the motion needs, shape (n,) [N m, N]."""
        state = np.zeros(13, dtype=point.dtype)
        state[:] = point[:13]
        out = np.zeros(6, dtype=point.dtype)
        _wrench(state, point, self._dynamics, np.zeros(4), out)
        total = -out
        for t, (ux, uy, uz, rx, ry, rz) in zip(tensions, self.lines(point), strict=True):
            moment = (ry * uz - rz * uy, rz * ux - rx * uz, rx * uy - ry * ux)
            for k, part in enumerate((*moment, ux, uy, uz)):
                total[k] = total[k] - t * part
        return total[self.rows]

    def cable_speeds(self, point: Any) -> Any:
        """dl/dt of the cables, shape (m,) [m/s]."""
        wx, wy, wz, vx, vy, vz = point[7:13]
        return np.array([
            ux * (vx + wy * rz - wz * ry) + uy * (vy + wz * rx - wx * rz)
            + uz * (vz + wx * ry - wy * rx)
            for ux, uy, uz, rx, ry, rz in self.lines(point)
        ])  # fmt: skip

    def cable_accelerations(self, q: Any, v: Any, a: Any) -> Any:
        """d2l/dt2 of the cables, shape (m,) [m/s^2]: of speeds a little before and after.

        Differences in time of what is known exactly: with pulleys, the exit points move too, and
        these have no second derivatives of their own.
        """
        after, before = (
            self.cable_speeds(self.point(q + e * v + 0.5 * e * e * a, v + e * a))
            for e in (INSTANT, -INSTANT)
        )
        return (after - before) / (2.0 * INSTANT)

    def ends(self, point: Any) -> list[Any]:
        """Anchor points p_WB, one of shape (3,) for each cable [m]."""
        return [point[4:7] + np.array(line[3:]) for line in self.lines(point)]

    def in_platform(self, point: Any, p_WQ: Array) -> Any:
        """A point of W in P, p_PQ, shape (3,) [m]."""
        X = _motion(point[:13])
        d = np.asarray(p_WQ) - point[4:7]
        return np.array([X[k] * d[0] + X[3 + k] * d[1] + X[6 + k] * d[2] for k in range(3)])

    def from_platform(self, point: Any, p_PQ: Array) -> Any:
        """A point of P in W, p_WQ, shape (3,) [m]."""
        X, (x, y, z) = _motion(point[:13]), p_PQ
        turned = [X[k] * x + X[k + 1] * y + X[k + 2] * z for k in (0, 3, 6)]
        return point[4:7] + np.array(turned)


def segments_gap(one: tuple[Any, Any], other: tuple[Any, Any], values: Sequence[Array]) -> Any:
    """Distance of two segments, whose nearest points are found on plain numbers [m].

    The derivative of a distance is that of its nearest points as if they stayed where they are on
    their segments, so shares along these are numbers and carry no derivative.

    Args:
        one: Ends of a segment, shape (3,) each, of any scalar [m].
        other: Of the other.
        values: The four ends as numbers.
    """
    x, y = segments_shares(*values)
    apart = one[0] + x * (one[1] - one[0]) - other[0] - y * (other[1] - other[0])
    return np.sqrt(apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2] + TOUCHING)
