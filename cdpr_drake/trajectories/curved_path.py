"""Paths of straight lines and arcs, with rests or rounded corners between them.

An arc is a circle about an axis, a helix where the axis is also followed. A piece of a path is a
polynomial; those of an arc meet it in value and two derivatives at both ends and span at most
`LARGEST_TURN`, so that they leave it by no more than `ARC_ERROR` of its radius.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TrajectoryError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.trajectories.pose_path import (
    BLEND_SHARE,
    LARGEST_TURN,
    LONGEST_BLEND,
    SHORTEST_STRETCH,
    Line,
    PosePath,
    change_size,
    hermite,
    pose_rows,
)

ARC_ERROR = 2e-9
"""Of its radius, by which pieces leave an arc: h^6 / 46080 by the error of Hermite interpolation of
degree 5, with h = `LARGEST_TURN` 1.4e-9; the rest is rounding."""

FEWEST_TURNS = 1e-6
"""Arcs that turn by less are none [rad]."""

SAMPLES = 9
"""Points of a rounded corner at which its distance from the corner is looked at; odd: the largest
is in the middle or near it."""

CLOSE = 0.98
"""Rounded corners take at least this share of their tolerance where there is room."""

MOST_TRIES = 30
"""Of lengths for a rounded corner, each nearer to the tolerance."""


@dataclass(frozen=True, eq=False)
class Arc:
    """Po turns about an axis of W, and goes along it evenly.

    Where the end is not as far from the axis as the start, the distance changes evenly, too.

    Attributes:
        center: A point of the axis, shape (3,) [m].
        axis: Its direction, a unit vector, shape (3,).
        angle: By which Po turns, positive by the right-hand rule, not zero [rad].
    """

    center: Array
    axis: Array
    angle: float

    def length(self, start: Array, end: Array) -> float:
        """Way of Po from a point to another, shape (3,) [m]; exact where both are as far away."""
        a, b = (self._radial(p) for p in (start, end))
        along = float(self.axis @ (end - start))
        radius = 0.5 * float(np.linalg.norm(a) + np.linalg.norm(b))
        return float(np.hypot(self.angle * radius, along))

    def _radial(self, p: Array) -> Array:
        d = np.asarray(p, float) - self.center
        return d - (self.axis @ d) * self.axis

    def at(self, start: Array, end: Array, share: float) -> tuple[Array, Array, Array]:
        """Point and its derivatives at a share of the way from 0 to 1, by that share."""
        first, last = self._radial(start), self._radial(end)
        r0, r1 = float(np.linalg.norm(first)), float(np.linalg.norm(last))
        unit = first / r0
        across = np.cross(self.axis, unit)
        phi, growth = self.angle, r1 - r0
        c, s, r = np.cos(phi * share), np.sin(phi * share), r0 + growth * share
        out, along = c * unit + s * across, c * across - s * unit
        rise = self.axis @ (end - start)
        place = self.center + (self.axis @ (start - self.center) + rise * share) * self.axis
        return (
            place + r * out,
            growth * out + r * phi * along + rise * self.axis,
            2.0 * growth * phi * along - r * phi**2 * out,
        )


@dataclass(frozen=True, eq=False)
class Move:
    """How a path goes from one pose to the next.

    Attributes:
        arc: On which arc Po goes; None: on a straight line.
        speed: Largest speed of Po [m/s].
    """

    arc: Arc | None = None
    speed: float = np.inf


STRAIGHT = Move()
"""A straight line at any speed."""


def curved_path(
    poses: Sequence[RigidTransform],
    moves: Sequence[Move],
    length_scale: float,
    tolerance: float = 0.0,
) -> PosePath:
    """Lines and arcs from pose to pose; P turns about one axis at a constant rate on each.

    Args:
        poses: X_WP, at least two [m].
        moves: How it goes from each to the next.
        length_scale: L, by which turns count as lengths, above 0 [m].
        tolerance: How far from lines and arcs it may be where one gives way to the other, at least
            0, as of `pose_path.straight_path` [m]; 0: on them, at rest wherever direction or
            curvature jumps.

    Raises:
        TrajectoryError: There are fewer than two poses, one is twice the same in a row without an
            arc between them, or numbers of moves and poses do not fit.
    """
    curves = _curves(poses, moves, length_scale)
    count = len(curves)
    cut, jumps = np.zeros(count + 1), np.zeros(count + 1, bool)
    for i in range(1, count):
        cut[i] = _cut(curves[i - 1], curves[i], length_scale, tolerance)
        jumps[i] = cut[i] < 0.0
    cut = np.maximum(cut, 0.0)
    lengths: list[float] = []
    pieces: list[Array] = []
    speeds: list[float] = []
    rests: list[int] = []
    for i, (curve, move) in enumerate(zip(curves, moves, strict=True)):
        begin, end = cut[i], curve.way - cut[i + 1]
        if jumps[i]:
            rests.append(len(pieces))
        if end - begin > SHORTEST_STRETCH:
            parts = int(np.ceil(curve.angle * (end - begin) / curve.way / LARGEST_TURN)) or 1
            for a, b in pairwise(np.linspace(begin, end, parts + 1).tolist()):
                lengths.append(b - a)
                pieces.append(hermite(b - a, curve.at(a), curve.at(b)))
                speeds.append(move.speed)
        if i + 1 < count and cut[i + 1] > 0.0:
            lengths.append(2.0 * cut[i + 1])
            pieces.append(hermite(lengths[-1], curve.at(end), curves[i + 1].at(cut[i + 1])))
            speeds.append(min(move.speed, moves[i + 1].speed))
    breaks = np.concatenate([[0.0], np.cumsum(lengths)])
    limits = np.array(speeds) if np.any(np.isfinite(speeds)) else None
    return PosePath(breaks, np.array(pieces), tuple(rests), limits)


def points_on_arcs(
    poses: Sequence[RigidTransform], moves: Sequence[Move], length_scale: float, step: float
) -> tuple[list[RigidTransform], list[Move]]:
    """The poses, and more of them on arcs, at most an angle [rad] apart; with a move to each.

    Raises:
        TrajectoryError: As `curved_path`.
    """
    found, ways = [poses[0]], list[Move]()
    for i, curve in enumerate(_curves(poses, moves, length_scale)):
        arc = moves[i].arc
        parts = 1 if arc is None else int(np.ceil(abs(arc.angle) / step))
        for k in range(1, parts):
            row = curve.at(curve.way * k / parts)[0]
            found.append(
                pose_from_row(np.concatenate([row[:4] / np.linalg.norm(row[:4]), row[4:]]))
            )
        found.append(poses[i + 1])
        ways += [moves[i]] * parts
    return found, ways


class _Curve(Line):
    """A line, or an arc: seven numbers by the length, and their derivatives."""

    def __init__(self, start: Array, end: Array, way: float, arc: Arc | None) -> None:
        super().__init__(start, end, way)
        self.arc, self._ends = arc, (start[4:], end[4:])
        if arc is not None:
            self.angle = max(self.angle, abs(arc.angle))

    def at(self, s: float) -> tuple[Array, Array, Array]:
        """The row, its first and its second derivative at a length from the start."""
        found = super().at(s)
        if self.arc is not None:
            parts = self.arc.at(*self._ends, s / self.way)
            for power, (row, part) in enumerate(zip(found, parts, strict=True)):
                row[4:] = part / self.way**power
        return found


def _curves(
    poses: Sequence[RigidTransform], moves: Sequence[Move], length_scale: float
) -> list[_Curve]:
    rows, ways = pose_rows(poses, length_scale)
    if len(moves) != len(ways):
        raise TrajectoryError(
            f"a path: found {len(moves)} moves and {len(rows)} poses; accepted: one between poses"
        )
    curves = []
    for i, move in enumerate(moves):
        way = float(ways[i])
        if move.arc is not None:
            if not abs(move.arc.angle) >= FEWEST_TURNS:
                raise TrajectoryError(
                    f"a path: move {i + 1}: found an arc of {move.arc.angle:g} rad; accepted: one "
                    "that turns"
                )
            straight = float(np.linalg.norm(rows[i + 1, 4:] - rows[i, 4:]))
            turn = np.sqrt(max(way**2 - straight**2, 0.0))
            way = float(np.hypot(move.arc.length(rows[i, 4:], rows[i + 1, 4:]), turn))
        if way <= SHORTEST_STRETCH:
            raise TrajectoryError(
                f"a path: poses {i + 1} and {i + 2} are the same; accepted: poses that differ"
            )
        curves.append(_Curve(rows[i], rows[i + 1], way, move.arc))
    return curves


def _cut(before: _Curve, after: _Curve, length_scale: float, tolerance: float) -> float:
    """How much of both curves the rounding of their corner takes; 0: none, below 0: a rest."""
    first, second = before.at(before.way), after.at(0.0)
    kink = change_size(second[1] - first[1], length_scale)
    bend = change_size(second[2] - first[2], length_scale)
    room = LONGEST_BLEND * min(before.way, after.way)
    straight = before.arc is None and after.arc is None
    if kink <= SHORTEST_STRETCH and (straight or bend * room <= SHORTEST_STRETCH):
        return 0.0
    if tolerance == 0.0:
        return -1.0
    if straight:
        return min(tolerance / (BLEND_SHARE * kink), room)
    cut, power = room, 1.0 if kink > SHORTEST_STRETCH else 0.5
    for _ in range(MOST_TRIES):
        away = _away(before, after, cut, length_scale)
        if away <= tolerance and (away >= CLOSE * tolerance or cut == room):
            break
        # By a share of the tolerance, so that what it tends to is allowed.
        wanted = 0.5 * (1.0 + CLOSE) * tolerance
        cut = min(cut * (wanted / max(away, 1e-3 * wanted)) ** power, room)
    while _away(before, after, cut, length_scale) > tolerance:
        cut *= 0.5
    return cut


def _away(before: _Curve, after: _Curve, cut: float, length_scale: float) -> float:
    """How far a rounded corner is from the curves, at most, point by point."""
    piece = hermite(2.0 * cut, before.at(before.way - cut), after.at(cut)).reshape(-1, 7)
    worst = 0.0
    for s in np.linspace(0.0, 2.0 * cut, SAMPLES)[1:-1]:
        row = s ** np.arange(len(piece)) @ piece
        there = before.at(before.way - cut + s) if s < cut else after.at(s - cut)
        worst = max(worst, change_size(row - there[0], length_scale))
    return worst
