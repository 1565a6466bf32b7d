"""Constraints of the platform on AutoDiffXd: the kernels' own source in Python, as a reference.

What `planning` does by kernels with hand-written derivatives is done here by Drake's automatic
ones, slowly and independently: benchmarks and tests hold the one against the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.math import RigidTransform
from scipy.optimize import linprog

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

_point = any_scalar(path_point)
_motion = any_scalar(floating_motion)
_wrench = any_scalar(floating_wrench)
_line = any_scalar(pulley_line)


class FreeTerms:
    """Terms of a free path of one robot.

    Attributes:
        rows: Components of (g, d) that the platform can move.
    """

    def __init__(self, task: PathTask, start: RigidTransform) -> None:
        """With the pose that coordinates count from."""
        self.rows = list(task.dynamics.motions)
        self._task = task
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

    def ends(self, point: Any) -> list[Any]:
        """Anchor points p_WB, one of shape (3,) for each cable [m]."""
        return [point[4:7] + np.array(line[3:]) for line in self.lines(point)]

    def in_platform(self, point: Any, p_WQ: Array) -> Any:
        """A point of W in P, p_PQ, shape (3,) [m]."""
        X = _motion(point[:13])
        d = np.asarray(p_WQ) - point[4:7]
        return np.array([X[k] * d[0] + X[3 + k] * d[1] + X[6 + k] * d[2] for k in range(3)])

    def margin(self, point: Any) -> Any:
        """Largest s with tensions that keep s off their limits [N], a program of HiGHS.

        Its derivative is that of the balance times its multipliers.
        """
        lines = self.lines(point)
        limits, m = self._task.limits, len(lines)
        columns = np.array([
            [value(x) for x in (*np.cross([*map(value, line[3:])], [*map(value, line[:3])]),
                                *map(value, line[:3]))]
            for line in lines
        ]).T[self.rows]  # fmt: skip
        needed = np.array([value(x) for x in self.unbalanced(point, np.zeros(m))])
        one = np.ones((m, 1))
        A = np.vstack([np.hstack([-np.eye(m), one]), np.hstack([np.eye(m), one])])
        b = np.concatenate([np.full(m, -limits.lower), np.full(m, limits.upper)])
        balance = np.hstack([columns, np.zeros((len(needed), 1))])
        found = linprog(
            [*np.zeros(m), -1.0], A_ub=A, b_ub=b, A_eq=balance, b_eq=needed, bounds=(None, None)
        )
        gaps = self.unbalanced(point, found.x[:m])
        weights = -found.eqlin.marginals
        return np.array([found.x[m] + weights @ gaps])

    def cable_gaps(self, point: Any, pairs: np.ndarray) -> Any:
        """Distances of the centre lines of pairs of cables from exit points, shape (p,) [m]."""
        ends, A = self.ends(point), self.cables.p_WA.T
        plain = [np.array([value(x) for x in end]) for end in ends]
        return np.array([
            segments_gap((A[i], ends[i]), (A[j], ends[j]), [A[i], plain[i], A[j], plain[j]])
            for i, j in pairs
        ])  # fmt: skip

    def capsule_gaps(self, point: Any, start: Array, end: Array, radius: float) -> Any:
        """Distances of cables, and of Po, from a capsule, shape (m + 1,) [m]."""
        fixed, A = (start, end), self.cables.p_WA.T
        found = []
        for begin, B in zip([*A, None], [*self.ends(point), point[4:7]], strict=True):
            first = B if begin is None else begin
            numbers = [np.array([value(x) for x in p]) for p in (first, B)]
            found.append(segments_gap((first, B), fixed, [*numbers, *fixed]) - radius)
        return np.array(found)

    def view(self, point: Any, camera: RigidTransform, slopes: Array, marks: Array) -> Any:
        """How far points of W, shape (3, q) [m], are within a view; as `TargetInView`."""
        R, p = camera.rotation().matrix(), camera.translation()
        found = []
        for Q in np.asarray(marks).T:
            x, y, z = R.T @ (self.in_platform(point, Q) - p)
            found += [slopes[0] * z - x, slopes[0] * z + x]
            found += [slopes[1] * z - y, slopes[1] * z + y, z]
        return np.array(found)


def value(x: Any) -> float:
    """A number that may carry derivatives, without them."""
    return float(x.value()) if isinstance(x, AutoDiffXd) else float(x)


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
