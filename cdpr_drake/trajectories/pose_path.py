"""Geometric paths of the platform: where it goes, and not when.

A `PosePath` consists of pieces: polynomials of degree 5 for the seven numbers of a pose row,
quaternion wxyz and origin, by the parameter s [m]. The quaternion may have any length but zero.
`smooth_path` and `straight_path` make paths through poses; `path_point` evaluates a piece in
kernels: pose X and its derivatives by the parameter, X' and X''. Along a motion s(t) the platform's
velocity is X' ds/dt, and its acceleration X' d2s/dt2 + X'' (ds/dt)^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numba import njit
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TrajectoryError
from cdpr_drake.geometry.poses import pose_from_row, pose_row

DEGREE = 5
"""Of the polynomials."""

POSE_NUMBERS = 7
"""Quaternion wxyz and origin."""

PIECE_NUMBERS = (DEGREE + 1) * POSE_NUMBERS
"""Coefficients of a piece: ascending powers of s, for each the seven numbers."""

POINT_SIZE = 19
"""Of a point of a path: pose row (7), X' (6), X'' (6)."""

LARGEST_TURN = 0.2
"""A piece of a straight line turns by no more than this, so that its polynomial turns at a constant
rate to rounding [rad]."""

SHORTEST_STRETCH = 1e-9
"""Poses closer than this, lengths and turns by the length scale, are one pose [m]."""

LONGEST_BLEND = 0.5
"""Of the shorter of two lines that meet, the share that the rounding of their corner may take."""

BLEND_SHARE = 3.0 / 16.0
"""The rounding of a corner passes it at this share of |t_2 - t_1| times the length it takes."""

Corners = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class PosePath:
    """A path of poses X_WP(s), twice continuously differentiable but where the platform rests.

    The parameter s is a length: of the way of Po and, for turns, of the angle times a length scale,
    ds^2 = dp^2 + (L dtheta)^2, along straight lines exactly and along splines about.

    Attributes:
        breaks: Where pieces begin and the last one ends, shape (k + 1,), from 0 on, growing [m].
        pieces: Their coefficients as `path_point` takes them, shape (k, 42).
        rests: Numbers of the breaks, beside the first and the last, at which the direction jumps,
            so that the platform must rest there.
        speeds: Largest speed of Po on each piece, shape (k,) [m/s]; None: none is asked for.
    """

    breaks: Array
    pieces: Array
    rests: Corners = field(default=())
    speeds: Array | None = None

    def __post_init__(self) -> None:
        """Checks the sizes.

        Raises:
            TrajectoryError: They do not fit, or breaks do not grow.
        """
        k = len(self.pieces)
        if self.pieces.shape != (k, PIECE_NUMBERS) or self.breaks.shape != (k + 1,) or k == 0:
            raise TrajectoryError(
                f"a path of {len(self.breaks)} breaks and pieces of shape {self.pieces.shape}; "
                f"accepted: k + 1 breaks and pieces of shape (k, {PIECE_NUMBERS}), k >= 1"
            )
        if not np.all(np.diff(self.breaks) > 0.0) or not np.all(np.isfinite(self.pieces)):
            raise TrajectoryError("a path: found breaks that do not grow, or NaN; accepted: others")
        if self.speeds is not None and (self.speeds.shape != (k,) or not np.all(self.speeds > 0.0)):
            raise TrajectoryError(
                f"a path of {k} pieces: found speeds of shape {self.speeds.shape}, or one that is "
                "not above 0; accepted: one above 0 for each piece [m/s]"
            )

    @property
    def length(self) -> float:
        """Where it ends [m]."""
        return float(self.breaks[-1])

    def points(self, parameters: Array) -> Array:
        """Pose rows, X' and X'' at parameters [m], shape (n, 19), as `path_point`.

        At a break they are those of the piece that begins there.
        """
        out = np.empty((len(parameters), POINT_SIZE))
        path_points(self.breaks, self.pieces, np.asarray(parameters, float), out)
        return out

    def pose(self, s: float) -> RigidTransform:
        """X_WP at a parameter [m]."""
        return pose_from_row(self.points(np.array([s]))[0, :7])

    def legs(self) -> list[PosePath]:
        """Its parts from rest to rest, each with the parameters that it has here."""
        ends = [0, *self.rests, len(self.pieces)]
        most = self.speeds
        return [
            PosePath(
                self.breaks[a : b + 1], self.pieces[a:b], (), None if most is None else most[a:b]
            )
            for a, b in pairwise(ends)
        ]

    def largest_speeds(self, parameters: Array) -> Array:
        """Largest speed of Po that is asked for at parameters [m], the least at breaks [m/s]."""
        if self.speeds is None:
            return np.full(len(parameters), np.inf)
        last = len(self.speeds) - 1
        found = [
            self.speeds[np.clip(np.searchsorted(self.breaks, parameters, side) - 1, 0, last)]
            for side in ("left", "right")
        ]
        return np.minimum(*found)


def shifted_pieces(path: PosePath, parameters: Array) -> Array:
    """Coefficients of the pieces as they begin at these parameters, shape (n, 42)."""
    number = np.clip(
        np.searchsorted(path.breaks, parameters, side="right") - 1, 0, len(path.pieces) - 1
    )
    by = parameters - path.breaks[number]
    c = path.pieces[number].reshape(-1, DEGREE + 1, POSE_NUMBERS).copy()
    for first in range(DEGREE):  # Taylor's shift, by repeated synthetic division
        for power in range(DEGREE - 1, first - 1, -1):
            c[:, power] += by[:, np.newaxis] * c[:, power + 1]
    return c.reshape(-1, PIECE_NUMBERS)


def smooth_path(poses: Sequence[RigidTransform], length_scale: float) -> PosePath:
    """A path through poses: a cubic spline of quaternion and origin; two poses, a straight line.

    It has no curvature at its ends.

    Args:
        poses: X_WP, at least two [m].
        length_scale: L, by which turns count as lengths, above 0 [m].

    Raises:
        TrajectoryError: There are fewer than two, or one is twice the same in a row.
    """
    rows, ways = _distinct_rows(poses, length_scale)
    if len(rows) == 2:
        return straight_path(poses, length_scale)
    from scipy.interpolate import CubicSpline  # a tenth of a second, and few paths are splines

    breaks = np.concatenate([[0.0], np.cumsum(ways)])
    spline = CubicSpline(breaks, rows, bc_type="natural")
    c = np.zeros((len(ways), DEGREE + 1, POSE_NUMBERS))
    c[:, :4] = spline.c[::-1].transpose(1, 0, 2)
    return PosePath(breaks, c.reshape(-1, PIECE_NUMBERS))


def straight_path(
    poses: Sequence[RigidTransform], length_scale: float, tolerance: float = 0.0
) -> PosePath:
    """Straight lines from pose to pose: Po on a line, P about one axis at a constant rate.

    Args:
        poses: X_WP, at least two [m].
        length_scale: L, by which turns count as lengths, above 0 [m].
        tolerance: How far from its corners the path may pass, lengths and turns by the length
            scale, at least 0 [m]; 0: through them, at rest in each, unless it goes on straight.
            A corner takes up to half of the shorter line.

    Raises:
        TrajectoryError: There are fewer than two poses, or one is twice the same in a row.
    """
    rows, ways = _distinct_rows(poses, length_scale)
    lines = [Line(a, b, way) for a, b, way in zip(rows[:-1], rows[1:], ways, strict=True)]
    cut, jumps = np.zeros(len(lines) + 1), np.zeros(len(lines) + 1, bool)
    for i in range(1, len(lines)):
        _, first, _ = lines[i - 1].at(ways[i - 1])
        _, second, _ = lines[i].at(0.0)
        kink = change_size(second - first, length_scale)
        if kink > SHORTEST_STRETCH:
            room = LONGEST_BLEND * min(ways[i - 1], ways[i])
            cut[i] = min(tolerance / (BLEND_SHARE * kink), room)
            jumps[i] = cut[i] == 0.0
    lengths: list[float] = []
    pieces: list[Array] = []
    rests: list[int] = []
    for i, line in enumerate(lines):
        begin, end = cut[i], ways[i] - cut[i + 1]
        if jumps[i]:
            rests.append(len(pieces))
        if end - begin > SHORTEST_STRETCH:
            count = int(np.ceil(line.angle * (end - begin) / line.way / LARGEST_TURN)) or 1
            knots = np.linspace(begin, end, count + 1)
            for a, b in pairwise(knots.tolist()):
                lengths.append(b - a)
                pieces.append(hermite(b - a, line.at(a), line.at(b)))
        if i + 1 < len(lines) and cut[i + 1] > 0.0:
            way = 2.0 * cut[i + 1]
            lengths.append(way)
            pieces.append(hermite(way, line.at(end), lines[i + 1].at(cut[i + 1])))
    breaks = np.concatenate([[0.0], np.cumsum(lengths)])
    return PosePath(breaks, np.array(pieces), tuple(rests))


@njit(cache=True)
def path_point(piece: Array, s: float, out: Array) -> None:
    """Writes pose and derivatives at a parameter within a piece.

    With q the quaternion, of any length, and h = q' q^-1, whose scalar part a is the growth of that
    length, the derivatives of the turn are

        w' = 2 vec(h),    alpha' = 2 vec(q'' q^-1) - 2 a w'.

    Args:
        piece: Coefficients, shape (`PIECE_NUMBERS`,), from the beginning of the piece.
        s: Parameter from the beginning of the piece [m].
        out: Gets unit quaternion wxyz and origin of P in W [m], X' = (w', p') [rad/m, -] and
            X'' = (alpha', p'') [rad/m^2, 1/m] in W, shape (`POINT_SIZE`,).
    """
    for k in range(7):
        value, first, second = 0.0, 0.0, 0.0
        for d in range(5, -1, -1):
            second = second * s + 2.0 * first
            first = first * s + value
            value = value * s + piece[7 * d + k]
        if k >= 4:
            out[k], out[k + 6], out[k + 12] = value, first, second
        elif k == 0:
            qw, dw, ddw = value, first, second
        elif k == 1:
            qx, dx, ddx = value, first, second
        elif k == 2:
            qy, dy, ddy = value, first, second
        else:
            qz, dz, ddz = value, first, second
    square = qw * qw + qx * qx + qy * qy + qz * qz
    scale = 1.0 / np.sqrt(square)
    out[0], out[1], out[2], out[3] = scale * qw, scale * qx, scale * qy, scale * qz
    # r times the conjugate of q over |q|^2 is r q^-1.
    a = (dw * qw + dx * qx + dy * qy + dz * qz) / square
    out[7] = 2.0 * (-dw * qx + dx * qw - dy * qz + dz * qy) / square
    out[8] = 2.0 * (-dw * qy + dx * qz + dy * qw - dz * qx) / square
    out[9] = 2.0 * (-dw * qz - dx * qy + dy * qx + dz * qw) / square
    out[13] = 2.0 * (-ddw * qx + ddx * qw - ddy * qz + ddz * qy) / square - 2.0 * a * out[7]
    out[14] = 2.0 * (-ddw * qy + ddx * qz + ddy * qw - ddz * qx) / square - 2.0 * a * out[8]
    out[15] = 2.0 * (-ddw * qz - ddx * qy + ddy * qx + ddz * qw) / square - 2.0 * a * out[9]


@njit(cache=True)
def path_points(breaks: Array, pieces: Array, parameters: Array, out: Array) -> None:
    """Writes `path_point` at many parameters of a path of pieces.

    Args:
        breaks: Where pieces begin and the last one ends, shape (k + 1,), growing [m].
        pieces: Their coefficients, shape (k, `PIECE_NUMBERS`).
        parameters: Shape (n,) [m]; beyond an end, that end's.
        out: Gets a row for each, shape (n, `POINT_SIZE`).
    """
    k = pieces.shape[0]
    for i in range(parameters.shape[0]):
        s = min(max(parameters[i], breaks[0]), breaks[k])
        first, past = 0, k  # numpy.searchsorted takes half a second to compile
        while past - first > 1:
            middle = (first + past) // 2
            if breaks[middle] <= s:
                first = middle
            else:
                past = middle
        path_point(pieces[first], s - breaks[first], out[i])


def hermite(way: float, start: tuple[Array, ...], end: tuple[Array, ...]) -> Array:
    """Coefficients of the piece that meets value and two derivatives at both ends, shape (42,)."""
    (x, v, a), (y, w, b) = start, end
    T = way
    D = y - x - v * T - 0.5 * a * T**2
    E = w - v - a * T
    F = b - a
    c = np.array(
        [
            x,
            v,
            0.5 * a,
            (10.0 * D - 4.0 * E * T + 0.5 * F * T**2) / T**3,
            (-15.0 * D + 7.0 * E * T - F * T**2) / T**4,
            (6.0 * D - 3.0 * E * T + 0.5 * F * T**2) / T**5,
        ]
    )
    return c.ravel()


class Line:
    """From pose row to pose row: seven numbers by the length, and their derivatives."""

    def __init__(self, start: Array, end: Array, way: float) -> None:
        self.way = way
        self._start, self._step = start, (end - start)[4:] / way
        cosine = float(np.clip(start[:4] @ end[:4], -1.0, 1.0))
        across = end[:4] - cosine * start[:4]
        sine = float(np.linalg.norm(across))
        self._half = np.arctan2(sine, cosine)
        self.angle = 2.0 * self._half
        self._across = across / sine if sine > 0.0 else across

    def at(self, s: float) -> tuple[Array, Array, Array]:
        """The row, its first and its second derivative at a length from the start."""
        rate = self._half / self.way
        c, d = np.cos(rate * s), np.sin(rate * s)
        q = c * self._start[:4] + d * self._across
        turn = rate * (c * self._across - d * self._start[:4])
        return (
            np.concatenate([q, self._start[4:] + s * self._step]),
            np.concatenate([turn, self._step]),
            np.concatenate([-(rate**2) * q, np.zeros(3)]),
        )


def pose_rows(poses: Sequence[RigidTransform], length_scale: float) -> tuple[Array, Array]:
    """Pose rows with quaternions on one side, and the straight ways between them [m].

    Raises:
        TrajectoryError: There are fewer than two, or the length scale is not accepted.
    """
    if len(poses) < 2:
        raise TrajectoryError(f"a path: found {len(poses)} poses; accepted: at least 2")
    if not (np.isfinite(length_scale) and length_scale > 0.0):
        raise TrajectoryError(f"a path's length scale: found {length_scale:g} m; accepted: > 0")
    rows = np.array([pose_row(X) for X in poses])
    for i in range(1, len(rows)):
        if rows[i, :4] @ rows[i - 1, :4] < 0.0:
            rows[i, :4] *= -1.0
    steps = np.diff(rows, axis=0)
    # |q_2 - q_1| = 2 sin(theta / 4), exactly also for small turns.
    angles = 4.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(steps[:, :4], axis=1), 0.0, 1.0))
    ways = np.hypot(np.linalg.norm(steps[:, 4:], axis=1), length_scale * angles)
    return rows, ways


def _distinct_rows(poses: Sequence[RigidTransform], length_scale: float) -> tuple[Array, Array]:
    rows, ways = pose_rows(poses, length_scale)
    if np.any(ways <= SHORTEST_STRETCH):
        i = int(np.argmin(ways))
        raise TrajectoryError(
            f"a path: poses {i + 1} and {i + 2} are the same; accepted: poses that differ"
        )
    return rows, ways


def change_size(row: Array, length_scale: float) -> float:
    """Of a change of seven numbers as a length; the quaternion's stands for half a turn [m]."""
    return float(np.hypot(np.linalg.norm(row[4:]), 2.0 * length_scale * np.linalg.norm(row[:4])))
