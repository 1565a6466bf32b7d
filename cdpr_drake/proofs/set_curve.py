"""Smooth curves through a sequence of boxes: polynomials of degree 5 whose control points are in.

A polynomial in Bernstein's form lies in the convex hull of its control points. So a curve whose
piece k has its control points in box k lies in the boxes at every instant, not at samples. Pieces
meet with two continuous derivatives by their parameter. Parameters of pieces are given: then all of
this is a convex program.

Source: Marcucci, Petersen, von Wrangel and Tedrake, Motion planning around obstacles with convex
optimization, 2023; Farouki, The Bernstein polynomial basis, 2012.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import comb

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError

DEGREE = 5

MARGIN = 1e-7
"""Control points keep so far off the faces of boxes, as the solver misses constraints by less; the
start and the goal are where they are [m, or a turn by its length]."""

LONGER = 0.02
"""A smooth curve may be longer than the shortest polyline by this share."""

SHORTEST_PIECE = 0.02
"""Share of the whole parameter that a piece has at least."""


@dataclass(frozen=True, eq=False)
class SetCurve:
    """A curve in boxes.

    Attributes:
        sets: Numbers of the boxes, shape (n,).
        breaks: Parameters where pieces begin and the last one ends, shape (n + 1,) [m].
        controls: Control points, shape (n, 6, d).
        polygon: Length of the polygon of all control points, which the curve is not above.
    """

    sets: tuple[int, ...]
    breaks: Array
    controls: Array

    @property
    def polygon(self) -> float:
        """Length of the control polygon; no curve is longer than it."""
        return float(np.sum(np.linalg.norm(np.diff(self.controls, axis=1), axis=2)))

    def powers(self) -> Array:
        """Coefficients of the pieces, ascending powers of their parameters, shape (n, 6, d)."""
        ways = np.diff(self.breaks)[:, np.newaxis, np.newaxis]
        found = np.einsum("ij,njd->nid", _TO_POWERS, self.controls)
        return np.asarray(found / ways ** np.arange(DEGREE + 1)[:, np.newaxis], float)

    def at(self, piece: int, parameters: Array) -> Array:
        """Value and two derivatives, shape (n, 3, d), at parameters from the piece's beginning."""
        c = self.powers()[piece]
        rows = [np.polynomial.polynomial.polyval(parameters, c).T]
        for _ in range(2):
            c = np.polynomial.polynomial.polyder(c)
            rows.append(np.polynomial.polynomial.polyval(parameters, c).T)
        return np.stack(rows, axis=1)


def control_points(powers: Array) -> Array:
    """Control points on 0 to 1 of polynomials given by ascending powers, shape (p + 1, d)."""
    n = len(powers) - 1
    to = [[comb(i, j) / comb(n, j) if j <= i else 0.0 for j in range(n + 1)] for i in range(n + 1)]
    return np.asarray(np.array(to) @ powers, float)


_TO_POWERS = np.array(
    [
        [(-1.0) ** (i - j) * comb(DEGREE, i) * comb(i, j) if j <= i else 0.0 for j in range(6)]
        for i in range(6)
    ]
)


def shares_of(points: Array) -> Array:
    """Of a polyline: which share of the parameter each piece has, shape (n,); none is tiny."""
    ways = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return floored(ways / np.sum(ways))


def floored(shares: Array) -> Array:
    """Shares with a floor, see `SHORTEST_PIECE`, summing up to 1."""
    least = min(SHORTEST_PIECE, 0.5 / len(shares))
    found = np.maximum(shares, least)
    return np.asarray(found / np.sum(found), float)


def smooth_curve(
    lower: Array, upper: Array, sets: tuple[int, ...], points: Array, longest: float | None = None
) -> SetCurve:
    """The curve with least bending among those that are hardly longer than a polyline.

    It minimizes the squares of second derivatives (of their control points), with the control
    polygon no longer than `longest`.

    Args:
        lower: Of all boxes, shape (k, d).
        upper: Shape (k, d).
        sets: Boxes of the pieces.
        points: Corners of the polyline, shape (n + 1, d).
        longest: None: `LONGER` than the polyline.

    Raises:
        PlanningError: The program was not solved.
    """
    shares, whole = (
        shares_of(points),
        float(np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1))),
    )
    program = _CurveProgram(lower, upper, sets, points, shares)
    program.limit_polygon((1.0 + LONGER) * whole if longest is None else longest)
    program.add_bending()
    return program.solve(whole)


def fast_curve(
    lower: Array, upper: Array, sets: tuple[int, ...], points: Array, shares: Array,
    *, acceleration: Array, speed: float,
) -> SetCurve:  # fmt: skip
    """The curve that is fastest on the fly, if its pieces last given shares of the time.

    |d2p/dt2| of all numbers stays below `acceleration`, |dp/dt| of positions below `speed`; the
    square of the time is least, which makes a second-order cone program. Velocities at the ends are
    free: a parameter that rests there is of no use to a path that is timed afterwards.

    Args:
        lower: As of `smooth_curve`.
        upper: Likewise.
        sets: Likewise.
        points: Likewise; its ends are the start and the goal.
        shares: Of the time, shape (n,).
        acceleration: Shape (d,) [m/s^2].
        speed: Of the first numbers, up to three, which are positions [m/s].

    Raises:
        PlanningError: The program was not solved.
    """
    whole = float(np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    program = _CurveProgram(lower, upper, sets, points, shares)
    program.add_least_time(acceleration, speed)
    return program.solve(whole)


class _CurveProgram:
    """Control points of all pieces as variables, in units of the polyline's length."""

    def __init__(
        self, lower: Array, upper: Array, sets: tuple[int, ...], points: Array, shares: Array
    ) -> None:
        n, d = len(sets), points.shape[1]
        self.sets, self.shares, self.box = sets, shares, (lower, upper)
        self.program = MathematicalProgram()
        self.P = self.program.NewContinuousVariables(n * (DEGREE + 1), d).reshape(n, DEGREE + 1, d)
        self.unit = float(np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        self.origin, self.ends = points[0], (points[0], points[-1])
        for k, number in enumerate(sets):
            for j in range(DEGREE + 1):
                if (k, j) in ((0, 0), (n - 1, DEGREE)):
                    continue
                low, high = (
                    self._scaled(lower[number] + MARGIN),
                    self._scaled(upper[number] - MARGIN),
                )
                self.program.AddBoundingBoxConstraint(low, high, self.P[k, j])
        for place, end in ((self.P[0, 0], points[0]), (self.P[-1, -1], points[-1])):
            value = self._scaled(end)
            self.program.AddBoundingBoxConstraint(value, value, place)
        one = np.eye(d)
        for k in range(n - 1):
            a, b = shares[k], shares[k + 1]
            A, B = self.P[k], self.P[k + 1]
            for left, right in (
                ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
                ((0.0, -b, b), (-a, a, 0.0)),
                ((b**2, -2.0 * b**2, b**2), (a**2, -2.0 * a**2, a**2)),
            ):
                rows = np.hstack([*(x * one for x in left), *(-x * one for x in right)])
                self.program.AddLinearEqualityConstraint(
                    rows, np.zeros(d), np.concatenate([*A[3:], *B[:3]])
                )

    def _scaled(self, point: Array) -> Array:
        return np.asarray((point - self.origin) / self.unit, float)

    def limit_polygon(self, longest: float) -> None:
        """The control polygon is no longer than that."""
        d = self.P.shape[2]
        steps = self.program.NewContinuousVariables(len(self.sets) * DEGREE)
        rows = np.zeros((d + 1, 2 * d + 1))
        rows[0, 0] = 1.0
        rows[1:, 1 : d + 1], rows[1:, d + 1 :] = np.eye(d), -np.eye(d)
        for number, step in enumerate(steps):
            k, j = divmod(number, DEGREE)
            self.program.AddLorentzConeConstraint(
                rows, np.zeros(d + 1), np.concatenate([[step], self.P[k, j + 1], self.P[k, j]])
            )
        self.program.AddLinearConstraint(
            np.ones((1, len(steps))), np.array([-np.inf]), np.array([longest / self.unit]), steps
        )

    def add_bending(self) -> None:
        """Costs of second derivatives, in units in which numbers are about 1."""
        for k, share in enumerate(self.shares):
            weight = share / (DEGREE - 1) * (DEGREE * (DEGREE - 1) / share**2) ** 2
            for j in range(DEGREE - 1):
                variables = np.concatenate([self.P[k, j], self.P[k, j + 1], self.P[k, j + 2]])
                one = np.eye(self.P.shape[2])
                self.program.Add2NormSquaredCost(
                    np.sqrt(weight) * np.hstack([one, -2.0 * one, one]),
                    np.zeros(len(one)),
                    variables,
                )

    def add_least_time(self, acceleration: Array, speed: float) -> None:
        """Least square of the time, with any velocity at both ends."""
        time2 = self.program.NewContinuousVariables(1)[0]
        self.program.AddLinearCost(time2)
        d = self.P.shape[2]
        held, m = np.flatnonzero(np.isfinite(acceleration)), min(d, 3)
        one, moved = np.eye(d)[held], np.eye(d)[:m]
        bent = DEGREE * (DEGREE - 1) * np.hstack([one, -2.0 * one, one])
        for k, share in enumerate(self.shares):
            P = self.P[k]
            most = acceleration[held, np.newaxis] / self.unit * share**2
            rows = np.vstack([np.hstack([bent, -most]), np.hstack([-bent, -most])])
            for j in range(DEGREE - 1):
                self.program.AddLinearConstraint(
                    rows, np.full(len(rows), -np.inf), np.zeros(len(rows)),
                    np.concatenate([*P[j : j + 3], [time2]]),
                )  # fmt: skip
            if not np.isfinite(speed):
                continue
            step = DEGREE * self.unit / (share * speed) * moved
            cone, ones = np.zeros((m + 2, 2 * d + 1)), np.zeros(m + 2)
            cone[0, 0], ones[1] = 1.0, 1.0
            cone[2:, 1 : d + 1], cone[2:, d + 1 :] = step, -step
            for j in range(DEGREE):
                self.program.AddRotatedLorentzConeConstraint(
                    cone, ones, np.concatenate([[time2], P[j + 1], P[j]])
                )

    def solve(self, whole: float) -> SetCurve:
        """The curve.

        Raises:
            PlanningError: The program was not solved, or what was found leaves its boxes.
        """
        result = ClarabelSolver().Solve(self.program)
        if not result.is_success():
            raise PlanningError(
                f"proven path: the program of a curve in {len(self.sets)} sets was not solved: "
                f"{result.get_solution_result().name}; accepted: other sets"
            )
        found = np.array([result.GetSolution(one) for one in self.P], float)
        controls = self.origin + self.unit * found
        controls[0, 0], controls[-1, -1] = self.ends
        breaks = whole * np.concatenate([[0.0], np.cumsum(self.shares)])
        controls = joined_controls(controls, np.diff(breaks))
        low, high = (each[list(self.sets)][:, np.newaxis] for each in self.box)
        slack = 1e-12 * (1.0 + np.abs(controls))
        if np.any((controls < low - slack) | (controls > high + slack)):
            raise PlanningError(
                "proven path: the solver missed a set by more than "
                f"{MARGIN:g}; accepted: sets of other sizes"
            )
        return SetCurve(self.sets, breaks, controls)


def joined_controls(controls: Array, ways: Array) -> Array:
    """Makes value and two derivatives the same on both sides of every joint, to rounding.

    Args:
        controls: Control points of Bezier curves of degree 5, shape (k, 6, d).
        ways: Lengths of the curves' intervals, shape (k,).

    Returns:
        Control points that differ from these by what a solver left at the joints. With the means
        v, s, b there of value, slope and bend: P5 = v, P4 = v - a s, P3 = a^2 b + 2 P4 - v, where a
        is the interval, and likewise the first three of the next curve.
    """
    P = controls.copy()
    for k, (a, b) in enumerate(pairwise(ways.tolist())):
        A, B = P[k], P[k + 1]
        value = 0.5 * (A[5] + B[0])
        slope = 0.5 * ((A[5] - A[4]) / a + (B[1] - B[0]) / b)
        bend = 0.5 * ((A[5] - 2 * A[4] + A[3]) / a**2 + (B[2] - 2 * B[1] + B[0]) / b**2)
        A[5], B[0] = value, value
        A[4], B[1] = value - a * slope, value + b * slope
        A[3], B[2] = a**2 * bend + 2 * A[4] - value, b**2 * bend + 2 * B[1] - value
    return P
