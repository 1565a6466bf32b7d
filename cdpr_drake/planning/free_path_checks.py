"""What a free path misses between its knots, how far it might at most, and words for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.planning.failures import MOST_NAMED
from cdpr_drake.planning.free_path_pieces import samples
from cdpr_drake.planning.path_task import PathTask, pose_words
from cdpr_drake.planning.pose_constraint import PoseConstraint
from cdpr_drake.planning.pose_coordinates import RelativePose
from cdpr_drake.planning.tension_constraints import LengthRates, accelerations_of

MISSED = 1e-6
"""What is missed by more is named."""

AT_LIMIT = 1e-3
"""Of a limit: cables that are nearer are at it."""

Place = tuple[int, float]
"""A knot, and a share of the time from it to the next."""

Asked = tuple[str, int, float]
"""The name of a constraint, and where between knots it was asked for."""

Found = tuple[Array, Array, Array, float]
"""Coordinates at knots and their two derivatives, shape (k, n) each, and the time [s]."""


@dataclass(frozen=True)
class BetweenKnots:
    """What a constraint misses between knots.

    Attributes:
        missed: By how much at most, at the instants that were looked at, in its own unit.
        kept: Whether it is missed by no more than its kind may be, `PoseConstraint.kept_within`.
        where: When that was, as a share of the time from start to goal.
        who: Which of its rows.
        bound: What it can miss by at most at any instant, for distances of what moves no farther
            from one instant to the next than the platform's outermost point; None for others.
    """

    missed: float
    kept: bool
    where: float
    who: str
    bound: float | None


@dataclass(frozen=True)
class Refinement:
    """How a motion is looked at between knots.

    Attributes:
        instants: Parts into which the time from knot to knot is cut.
        rounds: How often the program is solved again with what was missed, at most; 0: never.
    """

    instants: int = 40
    rounds: int = 10

    def __post_init__(self) -> None:
        """Checks the numbers.

        Raises:
            PlanningError: One is not accepted.
        """
        if not (2 <= self.instants <= 1000 and 0 <= self.rounds <= 100):
            raise PlanningError(
                f"refine: found {self.instants} instants, {self.rounds} rounds; accepted: 2 to "
                "1000, 0 to 100"
            )

    def missed(
        self, constraints: Sequence[PoseConstraint], found: Found, asked: set[Asked]
    ) -> list[tuple[PoseConstraint, Place]]:
        """Where constraints shall be asked for besides, since they are missed between two knots.

        A stretch that misses something is halved, and so are those beside it. Where it misses it
        again, it is asked for at the worst instant and halfway from there to what was asked.

        Args:
            constraints: That hold at the knots.
            found: The motion.
            asked: What was asked for between knots already; gets what is new.
        """
        places = []
        for constraint in constraints:
            gaps = np.max(self._gaps(constraint, found), axis=2)
            name, last, new = constraint.description, len(gaps) - 1, []
            for k in np.flatnonzero(np.max(gaps, axis=1) > constraint.kept_within).tolist():
                halves = [(j, 0.5) for j in (k, k - 1, k + 1) if 0 <= j <= last]
                before = [share for one, j, share in asked if one == name and j == k]
                if before:
                    worst = int(np.argmax(gaps[k])) / self.instants
                    ends = np.sort([0.0, *before, 1.0])
                    low, high = ends[ends < worst], ends[ends > worst]
                    new += [(k, 0.5 * (worst + low[-1]))] if len(low) else []
                    new += [(k, 0.5 * (worst + high[0]))] if len(high) else []
                    new.append((k, worst))
                new += halves
            for k, share in dict.fromkeys(new):
                if 0.0 < share < 1.0 and (name, k, share) not in asked:
                    asked.add((name, k, share))
                    places.append((constraint, (k, share)))
        return places

    def look(
        self, constraints: Sequence[PoseConstraint], found: Found
    ) -> Mapping[str, BetweenKnots]:
        """What constraints miss anywhere, by their names."""
        told = {}
        for constraint in constraints:
            gaps = self._gaps(constraint, found)
            k, i, row = np.unravel_index(int(np.argmax(gaps)), gaps.shape)
            told[constraint.description] = BetweenKnots(
                missed=float(gaps[k, i, row]),
                kept=bool(gaps[k, i, row] <= constraint.kept_within),
                where=float((k + i / self.instants) / len(gaps)),
                who=constraint.rows[row],
                bound=self._bound(constraint, found),
            )
        return told

    def _numbers(self, constraint: PoseConstraint, found: Found) -> Array:
        q, v, a, T = found
        n = (constraint.highest + 1) * q.shape[1]
        return np.ascontiguousarray(samples(q, v, a, T, self.instants)[:, :, :n])

    def _gaps(self, constraint: PoseConstraint, found: Found) -> Array:
        """By how much every row is missed, shape (k - 1, instants + 1, r)."""
        x = self._numbers(constraint, found)
        values, _ = constraint.evaluate(x.reshape(-1, x.shape[2]))
        return constraint.missed(values).reshape(*x.shape[:2], -1)

    def _bound(self, constraint: PoseConstraint, found: Found) -> float | None:
        """What distances miss at most: from instant to instant they change by a way at most.

        Of a function that changes by no more than w from one instant to the next, with values x and
        y there, the least between them is (x + y - w) / 2 or more. Numbers and their derivatives
        are polynomials of time: those of a cubic by those of its control points (Bernstein).
        """
        reach = constraint.reach()
        if reach is None:
            return None
        q, v, a, T = found
        x = self._numbers(constraint, found)
        values, _ = constraint.evaluate(x.reshape(-1, x.shape[2]))
        room = np.min(values - constraint.lower, axis=1).reshape(x.shape[:2])
        step = T / (len(q) - 1) / self.instants
        way = step * reach * fastest(constraint.coordinates, q, v, a, T, constraint.radius)
        least = 0.5 * (room[:, :-1] + room[:, 1:] - way[:, np.newaxis])
        return float(max(0.0, -np.min(least)))


def fastest(coordinates: object, q: Array, v: Array, a: Array, T: float, radius: float) -> Array:
    """No point of the platform within a radius of Po is faster between two knots, shape (k - 1,).

    The quaternion (1, g) turns by at most 2 |dg/dt|, and each number of a quadratic lies between
    its control points.

    Args:
        coordinates: `RelativePose`, which says which of (g, d) the numbers are.
        q: At the knots, shape (k, n).
        v: Their derivatives.
        a: Their second derivatives.
        T: Time of the motion [s].
        radius: [m].
    """
    if not isinstance(coordinates, RelativePose):
        raise PlanningError("a free path: found other coordinates; accepted: RelativePose")
    h = T / (len(q) - 1)
    # v is a quadratic: its control points are both ends and v + h a / 2.
    control = np.array([v[:-1], v[:-1] + 0.5 * h * a[:-1], v[1:]])
    six = np.zeros((*control.shape[:2], 6))
    six[..., coordinates.rows] = control
    turn = np.max(np.linalg.norm(six[..., :3], axis=2), axis=0)
    move = np.max(np.linalg.norm(six[..., 3:], axis=2), axis=0)
    return np.asarray(move + 2.0 * turn * radius)


def missed_most(missed: Mapping[str, tuple[float, int, int]]) -> str | None:
    """The name of what is missed most; None where nothing is."""
    name = max(missed, key=lambda key: missed[key][0])
    return name if missed[name][0] > MISSED else None


def missed_words(task: PathTask, coordinates: RelativePose, motion: Array, t: Array, k: int) -> str:
    """Where a knot is, and which cables are at a limit there or else on the way.

    Args:
        task: The robot and its limits.
        coordinates: Of the motion.
        motion: Coordinates and both derivatives at the knots, shape (N, 3 n).
        t: Tensions as shares of the largest one, shape (N, m).
        k: The knot.
    """
    here = at_limit(task, coordinates, motion, t)
    common = Counter(i for cables in here for i in cables).most_common()
    cables = here[k] or [i for i, _ in common]
    names = ", ".join(task.name(i) for i in cables[:MOST_NAMED]) or "none"
    place = pose_words(coordinates.points(motion[k : k + 1])[0][0])
    return f"at {place}; cables at a limit {'there' if here[k] else 'on the way'}: {names}"


def at_limit(task: PathTask, coordinates: RelativePose, motion: Array, t: Array) -> list[list[int]]:
    """Of each knot the cables of which something has come to a limit, the furthest first."""
    lim = task.limits
    points, _ = coordinates.points(motion)
    rates = LengthRates(task.cables, coordinates, lim.cable_speed).at_points(points, t)[0]
    growth, _ = accelerations_of(points, task.cables.packed())
    left = np.minimum(t - lim.lower / lim.upper, 1.0 - t)
    left = np.minimum(left, 1.0 - np.abs(rates))
    left = np.minimum(left, 1.0 - np.abs(growth) / lim.cable_acceleration)
    return [[int(i) for i in np.argsort(row) if row[i] < AT_LIMIT] for row in left]
