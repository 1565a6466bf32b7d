"""Which sets of poses and time a motion goes through: labels of length and arrival time.

Nodes are overlaps of two sets, each with a point and an interval of time in which it may be passed.
Between two overlaps of one set the motion goes straight, and waits where it is early, since a set
is a box of poses for an interval of time. A label says how long the way was and when it arrives;
one is left out where another is neither longer nor later (Dijkstra's algorithm with arrival
times). Time only goes forward.

Source: Phillips and Likhachev, SIPP: safe interval path planning for dynamic environments, 2011.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.set_sequences import least_ways
from cdpr_drake.proofs.timed_sets import TimedSets

MOST_LABELS = 4
"""Labels of an overlap that are followed, at most."""

HOP = 1e-4
"""What another set costs, as a share of the straight line, where ways are as long."""

HopTimes = Callable[[Array, Array], Array]
"""Times that ways take from a point, shape (d,), to others, shape (k, d): shape (k,) [s]."""


@dataclass(frozen=True, eq=False)
class TimedSequence:
    """A polyline through sets, with times.

    Attributes:
        sets: Sets of its pieces, shape (n,).
        points: Its corners, shape (n + 1, d).
        times: When it is there, shape (n + 1,), not falling [s].
        length: Of the polyline.
    """

    sets: tuple[int, ...]
    points: Array
    times: Array
    length: float


@dataclass(frozen=True, eq=False)
class TimedGraph:
    """Overlaps of sets between a start at time 0 and a goal.

    Attributes:
        sets: The sets.
        start: Shape (d,).
        goal: Shape (d,).
        goal_from: From when on the goal may be held until the end of time [s].
    """

    sets: TimedSets
    start: Array
    goal: Array
    goal_from: float

    def __post_init__(self) -> None:
        """Computes the overlaps and their points."""
        one, other = self.sets.graph.T
        low = np.maximum(self.sets.lower[one], self.sets.lower[other])
        high = np.minimum(self.sets.upper[one], self.sets.upper[other])
        points, _ = least_ways(low, high, self.start, self.goal)
        spans = np.column_stack([
            np.maximum(self.sets.times[one, 0], self.sets.times[other, 0]),
            np.minimum(self.sets.times[one, 1], self.sets.times[other, 1]),
        ])  # fmt: skip
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "spans", spans)
        of_set: list[list[int]] = [[] for _ in range(len(self.sets))]
        for node, pair in enumerate(self.sets.graph.tolist()):
            for number in pair:
                of_set[number].append(node)
        object.__setattr__(self, "of_set", [np.array(nodes, int) for nodes in of_set])

    points: Array = None  # type: ignore[assignment]
    spans: Array = None  # type: ignore[assignment]
    of_set: list[np.ndarray] = None  # type: ignore[assignment]

    def holds(self, point: Array, number: int) -> bool:
        """Whether a set holds a point."""
        return bool(self.sets.holding(point)[number])

    def sequences(self, hops: HopTimes, by_time: bool) -> list[TimedSequence]:
        """Sequences to the goal, the shortest first, or the earliest; none is worse in both."""
        straight = float(np.linalg.norm(self.goal - self.start))
        goal_node = len(self.points)
        heap: list[tuple[float, float, int, int]] = []
        labels: list[tuple[int, float, float, int, int]] = []  # node, length, time, set, before
        kept: dict[int, list[tuple[float, float]]] = {}

        def push(node: int, length: float, time: float, number: int, before: int) -> None:
            labels.append((node, length, time, number, before))
            first, second = (time, length) if by_time else (length, time)
            heapq.heappush(heap, (first, second, len(labels) - 1, node))

        def spread(point: Array, time: float, length: float, number: int, before: int) -> None:
            nodes = self.of_set[number]
            if len(nodes):
                arrive = np.maximum(self.spans[nodes, 0], time + hops(point, self.points[nodes]))
                ways = np.linalg.norm(self.points[nodes] - point, axis=1) + HOP * straight
                for k in np.flatnonzero(arrive <= self.spans[nodes, 1]):
                    push(int(nodes[k]), length + float(ways[k]), float(arrive[k]), number, before)
            if self.holds(self.goal, number):
                last = time + float(hops(point, self.goal[np.newaxis])[0])
                last = max(last, self.goal_from)
                if last <= self.sets.times[number, 1]:
                    way = float(np.linalg.norm(self.goal - point))
                    push(goal_node, length + way, last, number, before)

        for number in range(len(self.sets)):
            if self.holds(self.start, number) and self.sets.times[number, 0] <= 0.0:
                spread(self.start, 0.0, 0.0, number, -1)
        found = []
        while heap:
            _, _, label, node = heapq.heappop(heap)
            _, length, time, number, _ = labels[label]
            others = kept.setdefault(node, [])
            if len(others) >= MOST_LABELS or any(a <= length and b <= time for a, b in others):
                continue
            others.append((length, time))
            if node == goal_node:
                found.append(self._sequence(labels, label))
                continue
            for following in self.sets.graph[node].tolist():
                spread(self.points[node], time, length, following, label)
        return found

    def _sequence(
        self, labels: list[tuple[int, float, float, int, int]], label: int
    ) -> TimedSequence:
        sets, points, times = [], [self.goal], [labels[label][2]]
        while label >= 0:
            _, _, _, number, before = labels[label]
            sets.append(number)
            points.append(self.start if before < 0 else self.points[labels[before][0]])
            times.append(0.0 if before < 0 else labels[before][2])
            label = before
        corners = np.array(points[::-1])
        length = float(np.sum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
        return TimedSequence(tuple(sets[::-1]), corners, np.array(times[::-1]), length)
