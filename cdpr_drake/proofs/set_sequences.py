"""Which sets a path goes through, one after the other: short sequences, and a bound for all.

Nodes are overlaps of two sets. A path in the sets goes from overlap to overlap, each within one
set, so a polyline with a corner in each overlap is the shortest one of its sequence: a second-order
cone program. For a start s and a goal g every path through an overlap O is at least as long as the
least |s - p| + |p - g| of its points p; so overlaps above the best length are left out, and the
largest such number that no path can avoid is a bound for all paths in the sets.

Lengths of turns are counted by a scale. All points here are scaled numbers of poses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra, yen

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError

BEND_STEPS = 60
"""Steps of the search for the point of an overlap with the least way over it; any number is valid,
since a bound is computed at what it ends with."""

HOP = 1e-4
"""What another set costs, as a share of the straight line, where ways are as long."""

SAME = 1e-9
"""Points that are nearer, relative to the straight line, are one."""

MOST_REROUTES = 8
"""Times that a path chooses its sets anew from where it lies."""


@dataclass(frozen=True, eq=False)
class SetSequence:
    """A shortest polyline through some sets.

    Attributes:
        sets: Their numbers, shape (n,).
        points: Corners, the start, one in each overlap, and the goal, shape (n + 1, d).
    """

    sets: tuple[int, ...]
    points: Array

    @property
    def length(self) -> float:
        """Of the polyline."""
        return float(np.sum(np.linalg.norm(np.diff(self.points, axis=0), axis=1)))


@dataclass(eq=False)
class OverlapGraph:
    """Overlaps of boxes between a start and a goal.

    Attributes:
        lower: Of the boxes, shape (k, d).
        upper: Shape (k, d).
        pairs: Boxes that overlap, shape (p, 2).
        start: Shape (d,).
        goal: Shape (d,).
        near: Of each overlap, a point with about the least way over it, shape (p, d).
        ways: Of each overlap, less than the length of any path through it, shape (p,).
        programs: Polylines that were solved, by their sets.
    """

    lower: Array
    upper: Array
    pairs: np.ndarray
    start: Array
    goal: Array
    near: Array = field(init=False)
    ways: Array = field(init=False)
    programs: dict[tuple[int, ...], SetSequence] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Computes ways over all overlaps."""
        low = np.maximum(self.lower[self.pairs[:, 0]], self.lower[self.pairs[:, 1]])
        high = np.minimum(self.upper[self.pairs[:, 0]], self.upper[self.pairs[:, 1]])
        self._low, self._high = low, high
        self.near, self.ways = least_ways(low, high, self.start, self.goal)

    @property
    def straight(self) -> float:
        """Length of the straight line."""
        return float(np.linalg.norm(self.goal - self.start))

    def holding(self, point: Array) -> np.ndarray:
        """Whether each box holds a point, up to rounding, shape (k,)."""
        slack = SAME * max(self.straight, 1e-300)
        held = (self.lower - slack <= point) & (point <= self.upper + slack)
        return np.asarray(np.all(held, axis=1))

    def bound(self) -> float:
        """Less than the length of any path in the boxes; infinite where there is none."""
        order = np.argsort(self.ways, kind="stable")
        begins, ends = self.holding(self.start), self.holding(self.goal)
        if np.any(begins & ends):
            return self.straight
        root = np.arange(len(self.lower) + 2)  # and the start, and the goal

        def find(node: int) -> int:
            while root[node] != node:
                root[node] = root[root[node]]
                node = int(root[node])
            return node

        first, last = len(self.lower), len(self.lower) + 1
        for node in np.flatnonzero(begins):
            root[find(int(node))] = find(first)
        for node in np.flatnonzero(ends):
            root[find(int(node))] = find(last)
        for edge in order:
            a, b = self.pairs[edge]
            root[find(int(a))] = find(int(b))
            if find(first) == find(last):
                return max(float(self.ways[edge]), self.straight)
        return np.inf

    def sequences(self, count: int, limit: float, points: Array | None = None) -> list[list[int]]:
        """Short sequences of sets, the shortest first by one point in each overlap.

        Args:
            count: How many ways over overlaps are looked at; several may have the same sets.
            limit: Overlaps whose `ways` are above it are left out.
            points: Of the overlaps; None: `near`.

        Returns:
            Their sets; empty where nothing leads from the start to the goal.
        """
        begins, ends = self.holding(self.start), self.holding(self.goal)
        both = np.flatnonzero(begins & ends)
        if len(both):
            return [[int(both[0])]]
        kept = np.flatnonzero(self.ways <= limit)
        if not len(kept):
            return []
        graph, nodes = self._graph(kept, self.near if points is None else points, begins, ends)
        n = len(nodes)
        if count == 1:
            _, before = dijkstra(graph, indices=n, return_predecessors=True)
            rows = before[np.newaxis]
        else:
            lengths, rows = yen(graph, n, n + 1, count, return_predecessors=True)
            rows = rows[np.isfinite(lengths)]
        found: list[list[int]] = []
        for row in rows:
            way = [n + 1]
            while way[-1] != n and row[way[-1]] >= 0:
                way.append(int(row[way[-1]]))
            if way[-1] != n:
                continue
            sets = self._sets([int(nodes[k]) for k in way[-2:0:-1]], begins, ends)
            if sets not in found:
                found.append(sets)
        return found

    def _graph(
        self, kept: np.ndarray, points: Array, begins: np.ndarray, ends: np.ndarray
    ) -> tuple[csr_array, np.ndarray]:
        """Ways between overlaps that share a set, then the start and the goal as nodes."""
        n, hop = len(kept), HOP * self.straight
        pairs = self.pairs[kept]
        shared = np.zeros((n, n), bool)
        for side in range(2):
            for other in range(2):
                shared |= pairs[:, side, np.newaxis] == pairs[np.newaxis, :, other]
        np.fill_diagonal(shared, False)
        places = points[kept]
        i, j = (side.astype(np.int32) for side in np.nonzero(shared))  # as scipy's yen takes them
        rows, columns = [i], [j]
        values = [np.linalg.norm(places[i] - places[j], axis=1)]
        out = np.flatnonzero(begins[pairs].any(axis=1)).astype(np.int32)
        back = np.flatnonzero(ends[pairs].any(axis=1)).astype(np.int32)
        rows += [np.full(len(out), n, np.int32), back]
        columns += [out, np.full(len(back), n + 1, np.int32)]
        values += [
            np.linalg.norm(places[out] - self.start, axis=1),
            np.linalg.norm(places[back] - self.goal, axis=1),
        ]
        weights = np.concatenate(values) + hop
        graph = csr_array(
            (weights, (np.concatenate(rows), np.concatenate(columns))), shape=(n + 2, n + 2)
        )
        return graph, kept

    def _sets(self, overlaps: list[int], begins: np.ndarray, ends: np.ndarray) -> list[int]:
        """Sets of a way over overlaps: between two of them, the one that both share."""
        pairs = [self.pairs[edge].tolist() for edge in overlaps]
        sets = [next(k for k in pairs[0] if begins[k])]
        sets += [next(k for k in a if k in b) for a, b in pairwise(pairs)]
        sets.append(next(k for k in pairs[-1] if ends[k]))
        short: list[int] = []
        for number in sets:  # a set that comes twice: all between is left out
            if number in short:
                del short[short.index(number) + 1 :]
            else:
                short.append(number)
        return short

    def shortest(self, sets: list[int]) -> SetSequence:
        """The shortest polyline through sets, without those in which it has no length.

        Raises:
            PlanningError: The program was not solved.
        """
        key = tuple(sets)
        if key not in self.programs:
            points = self._solve(sets)
            corners, kept = list(points), list(sets)
            while (k := self._idle(kept, np.array(corners))) is not None:
                del kept[k], corners[k + 1 if k + 1 < len(kept) else k]
            self.programs[key] = SetSequence(tuple(kept), np.array(corners))
        return self.programs[key]

    def _idle(self, sets: list[int], corners: Array) -> int | None:
        """The first of the sets in which a polyline has no length and that can be left out."""
        ways = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        for k in np.flatnonzero(ways <= SAME * self.straight):
            if len(sets) > 1 and k in (0, len(sets) - 1):
                return int(k)
            if 0 < k < len(sets) - 1:
                low = np.maximum(self.lower[sets[k - 1]], self.lower[sets[k + 1]])
                high = np.minimum(self.upper[sets[k - 1]], self.upper[sets[k + 1]])
                if np.all(low < high):
                    return int(k)
        return None

    def _solve(self, sets: list[int]) -> Array:
        n, d = len(sets), len(self.start)
        if n == 1:
            return np.stack([self.start, self.goal])
        program = MathematicalProgram()
        free = program.NewContinuousVariables(n - 1, d)
        for k in range(n - 1):
            low = np.maximum(self.lower[sets[k]], self.lower[sets[k + 1]])
            high = np.minimum(self.upper[sets[k]], self.upper[sets[k + 1]])
            program.AddBoundingBoxConstraint(low, high, free[k])
        line, one = np.hstack([np.eye(d), -np.eye(d)]), np.eye(d)
        program.AddL2NormCostUsingConicConstraint(one, -self.start, free[0])
        program.AddL2NormCostUsingConicConstraint(one, -self.goal, free[-1])
        for k in range(n - 2):
            program.AddL2NormCostUsingConicConstraint(
                line, np.zeros(d), np.concatenate([free[k], free[k + 1]])
            )
        result = ClarabelSolver().Solve(program)
        if not result.is_success():
            raise PlanningError(
                f"proven path: the program of {n} sets was not solved: "
                f"{result.get_solution_result().name}; accepted: other sets"
            )
        inner = result.GetSolution(free).reshape(n - 1, d)
        for k in range(n - 1):  # what the solver misses by rounding
            low = np.maximum(self.lower[sets[k]], self.lower[sets[k + 1]])
            high = np.minimum(self.upper[sets[k]], self.upper[sets[k + 1]])
            inner[k] = np.clip(inner[k], low, high)
        return np.concatenate([self.start[np.newaxis], inner, self.goal[np.newaxis]])

    def rerouted(self, found: SetSequence) -> SetSequence:
        """A path that chooses its sets anew from where it lies, until none is shorter."""
        for _ in range(MOST_REROUTES):
            points = np.clip(_nearest(found.points, self.near), self._low, self._high)
            other = self.sequences(1, found.length, points)
            if not other:
                return found
            better = self.shortest(other[0])
            if better.length >= found.length - SAME * self.straight:
                return found
            found = better
        return found

    def all_short(self, count: int) -> Iterator[SetSequence]:
        """Polylines of short sequences, as they are found; overlaps shrink with the best length.

        Raises:
            PlanningError: A program was not solved.
        """
        first = self.sequences(1, np.inf)
        if not first:
            return
        best = self.rerouted(self.shortest(first[0]))
        yield best
        seen = {best.sets}
        for sets in self.sequences(count, best.length):
            found = self.shortest(sets)
            if found.length < 1.2 * best.length:
                found = self.rerouted(found)
            if found.sets not in seen:
                seen.add(found.sets)
                yield found


def least_ways(low: Array, high: Array, start: Array, goal: Array) -> tuple[Array, Array]:
    """Least |s - p| + |p - g| over boxes: points with about that, and bounds below it.

    Weighted means, clipped, are steps that never lengthen the way (majorization of norms by
    squares); the bound is that of the tangent plane at the point, which the way is above.

    Args:
        low: Shape (p, d).
        high: Shape (p, d).
        start: s, shape (d,).
        goal: g, shape (d,).

    Returns:
        Points, shape (p, d), and bounds, shape (p,).
    """
    point = np.clip(0.5 * (start + goal), low, high)
    tiny = 1e-12 * (1.0 + float(np.linalg.norm(goal - start)))
    for _ in range(BEND_STEPS):
        a, b = 1.0 / _sizes(point - start, tiny), 1.0 / _sizes(point - goal, tiny)
        point = np.clip((a * start + b * goal) / (a + b), low, high)
    to, on = point - start, point - goal
    slope = to / _sizes(to, tiny) + on / _sizes(on, tiny)
    way = np.linalg.norm(to, axis=1) + np.linalg.norm(on, axis=1)
    drop = np.sum(np.minimum(slope * (low - point), slope * (high - point)), axis=1)
    return point, way + drop - 2.0 * tiny


def _sizes(steps: Array, least: float) -> Array:
    return np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), least)


def _nearest(corners: Array, points: Array) -> Array:
    """Points of a polyline nearest to points, shape (p, d)."""
    best, found = np.full(len(points), np.inf), points.copy()
    for a, b in pairwise(corners):
        step = b - a
        square = float(step @ step)
        share = np.clip((points - a) @ step / square, 0.0, 1.0) if square > 0.0 else 0.0
        place = (
            a + np.multiply.outer(share, step) if square > 0.0 else np.broadcast_to(a, points.shape)
        )
        far = np.linalg.norm(points - place, axis=1)
        closer = far < best
        best[closer], found[closer] = far[closer], place[closer]
    return found
