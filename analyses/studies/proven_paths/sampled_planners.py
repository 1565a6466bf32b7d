"""RRT* and shortcuts: what paths in proven sets are compared with. They see samples only.

Source: Karaman and Frazzoli, Sampling-based algorithms for optimal motion planning, 2011;
Geraerts and Overmars, Creating high-quality paths for motion planning, 2007.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array

Good = Callable[[Array], np.ndarray]
"""Says of positions, shape (n, 3) [m], which are accepted, shape (n,)."""

CHECK_STEP = 0.005
"""Way between checked states, as a share of the extent of the space."""

REACH = 0.2
"""Longest edge of the tree, as a share of the extent."""

TO_GOAL = 0.05
"""Share of the samples that are the goal."""

NEIGHBOURS = 1.1
"""Radius within which edges are rewired, by the least one that makes the length tend to the best
(Karaman and Frazzoli, theorem 38)."""

SHORTCUTS = 300
"""Pairs of points of a path that a shortcut is tried between."""

OMPL_SECONDS = 4.0
"""Processor time of OMPL's RRT* [s]."""


@dataclass(frozen=True, eq=False)
class Space:
    """Positions in a box, of which some are accepted.

    Attributes:
        lower: Shape (3,) [m].
        upper: Shape (3,) [m].
        good: Says which are accepted.
    """

    lower: Array
    upper: Array
    good: Good

    @property
    def extent(self) -> float:
        """Length of its diagonal [m]."""
        return float(np.linalg.norm(self.upper - self.lower))

    def clear(self, start: Array, ends: Array) -> np.ndarray:
        """Of which of some straight lines from a point all checked states are accepted, (n,)."""
        ends = np.atleast_2d(ends)
        ways = np.linalg.norm(ends - start, axis=1)
        counts = np.maximum(np.ceil(ways / (CHECK_STEP * self.extent)).astype(int), 1)
        owner = np.repeat(np.arange(len(ends)), counts)
        share = np.concatenate([np.arange(1, n + 1) / n for n in counts])
        held = self.good(start + share[:, np.newaxis] * (ends - start)[owner])
        return np.asarray(np.bincount(owner, ~held, len(ends)) == 0)


def rrt_star(space: Space, start: Array, goal: Array, count: int, seed: int) -> Array | None:
    """Corners of the shortest path of a tree of about so many samples, shape (n, 3); None: none.

    Args:
        space: The space.
        start: Shape (3,) [m].
        goal: Likewise.
        count: Samples that are drawn.
        seed: Of the samples.
    """
    random = np.random.default_rng(seed)
    points, cost, parent = np.empty((count + 1, 3)), np.zeros(count + 1), np.zeros(count + 1, int)
    points[0], n = start, 1
    reach = REACH * space.extent
    volume = float(np.prod(space.upper - space.lower)) / (4.0 / 3.0 * np.pi)
    radius = NEIGHBOURS * 2.0 * (4.0 / 3.0 * volume) ** (1.0 / 3.0)
    arrived: list[int] = []
    for _ in range(count):
        to = goal if random.random() < TO_GOAL else random.uniform(space.lower, space.upper)
        ways = np.linalg.norm(points[:n] - to, axis=1)
        first = int(np.argmin(ways))
        if ways[first] < 1e-9 * space.extent:
            continue
        new = points[first] + min(1.0, reach / ways[first]) * (to - points[first])
        ways = np.linalg.norm(points[:n] - new, axis=1)
        near = np.flatnonzero(ways <= min(reach, radius * (np.log(n + 1) / (n + 1)) ** (1 / 3)))
        near = np.union1d(near, [first])
        clear = space.clear(new, points[near])
        if not np.any(clear) or not space.good(new[np.newaxis])[0]:
            continue
        near = near[clear]
        best = near[np.argmin(cost[near] + ways[near])]
        points[n], parent[n], cost[n] = new, best, cost[best] + ways[best]
        for other in near[cost[n] + ways[near] < cost[near]]:
            parent[other] = n
            _pass_on(cost, parent, n + 1, int(other), cost[n] + ways[other])
        if np.linalg.norm(goal - new) <= reach and space.clear(new, goal)[0]:
            arrived.append(n)
        n += 1
    if not arrived:
        return None
    last = min(arrived, key=lambda k: cost[k] + float(np.linalg.norm(goal - points[k])))
    way = [goal, points[last]]
    while last != 0:
        last = int(parent[last])
        way.append(points[last])
    return np.array(way[::-1])


def _pass_on(cost: Array, parent: np.ndarray, n: int, vertex: int, now: float) -> None:
    """A vertex costs so much now, and all that hang on it so much less."""
    less, waiting = cost[vertex] - now, [vertex]
    while waiting:
        one = waiting.pop()
        cost[one] -= less
        children = np.flatnonzero(parent[1:n] == one) + 1
        waiting += [int(k) for k in children]


def shortcut(space: Space, corners: Array, seed: int) -> Array:
    """Corners of a path after straight lines between points of it, where they are accepted."""
    random = np.random.default_rng(seed)
    for _ in range(SHORTCUTS):
        ways = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
        a, b = np.sort(random.uniform(0.0, ways[-1], 2))
        i, j = np.searchsorted(ways, [a, b], side="right") - 1
        if i == j:
            continue
        ends = along(corners, np.array([a, b]))
        if space.clear(ends[0], ends[1])[0]:
            corners = np.concatenate([corners[: i + 1], ends, corners[j + 1 :]])
    return corners


def along(corners: Array, places: Array) -> Array:
    """Points of a polyline at lengths from its start, shape (n, 3) [m]."""
    ways = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
    return np.column_stack([np.interp(places, ways, corners[:, k]) for k in range(3)])


def length_of(corners: Array) -> float:
    """Of a polyline [m]."""
    return float(np.sum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))


def ompl_path(space: Space, start: Array, goal: Array) -> Array | None:
    """Corners of OMPL's RRT* after its shortcuts, shape (n, 3); None: no path.

    Raises:
        ImportError: OMPL is not installed.
    """
    base, geometric = (importlib.import_module(f"ompl.{name}") for name in ("base", "geometric"))
    util = importlib.import_module("ompl.util")
    util.setLogLevel(util.LogLevel.LOG_ERROR)
    states = base.RealVectorStateSpace(3)
    bounds = base.RealVectorBounds(3)
    for k in range(3):
        bounds.setLow(k, float(space.lower[k]))
        bounds.setHigh(k, float(space.upper[k]))
    states.setBounds(bounds)
    setup = geometric.SimpleSetup(states)

    def valid(state: Any) -> bool:
        return bool(space.good(np.array([[state[0], state[1], state[2]]]))[0])

    setup.setStateValidityChecker(valid)
    setup.getSpaceInformation().setStateValidityCheckingResolution(CHECK_STEP)
    ends = []
    for point in (start, goal):
        state = states.allocState()
        for k in range(3):
            state[k] = float(point[k])
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTstar(setup.getSpaceInformation()))
    begin = time.process_time()

    def over() -> bool:
        return time.process_time() - begin > OMPL_SECONDS

    setup.solve(base.PlannerTerminationCondition(over))
    if not setup.haveExactSolutionPath():
        return None
    path = setup.getSolutionPath()
    geometric.PathSimplifier(setup.getSpaceInformation()).simplifyMax(path)
    return np.array([[state[0], state[1], state[2]] for state in path.getStates()])
