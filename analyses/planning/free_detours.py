"""Ways round what stands between two poses, for a solver to start from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.planning.pose_constraint import PoseConstraint
from cdpr_drake.trajectories.pose_path import PosePath, straight_path

LOOKS = 80
"""Poses of a way that are looked at."""

DIRECTIONS = 8
"""Directions across the straight line into which ways lead."""

STEPS = 24
"""Distances from the straight line that are tried in a direction, up to its length."""

SHARES = (0.0, 0.2, 0.5)
"""Of the straight line: where a way leaves it and, from the other end, comes back to it."""

MOST_DETOURS = 4
"""Ways that are given, each in a direction of its own."""


def is_free(constraints: Sequence[PoseConstraint], path: PosePath) -> bool:
    """Whether a path keeps constraints of `BodyState` at every pose that is looked at."""
    rows = path.points(np.linspace(0.0, path.length, LOOKS))[:, :7]
    return all(not np.any(one.missed(one.evaluate(rows)[0]) > 0.0) for one in constraints)


def detours(
    constraints: Sequence[PoseConstraint],
    start: RigidTransform,
    goal: RigidTransform,
    length_scale: float,
    moves: Sequence[int] = (0, 1, 2),
) -> list[PosePath]:
    """Ways of three or four straight lines that keep constraints, the shortest first.

    They leave the straight line across, go along it, and come back; of each direction the shortest
    is kept.

    Args:
        constraints: Of `BodyState`, of poses alone or at rest.
        start: X_WP at the start [m].
        goal: X_WP at the goal [m].
        length_scale: By which turns count as lengths [m].
        moves: Axes of W along which the platform can move.
    """
    way = goal.translation() - start.translation()
    length = float(np.linalg.norm(way))
    best: list[PosePath] = []
    for across in _across(way, moves):
        found: list[PosePath] = []
        for share in SHARES:
            for step in range(1, STEPS + 1):
                off = across * (length * step / STEPS)
                corners = [start]
                first = RigidTransform(start.rotation(), start.translation() + share * way + off)
                last = RigidTransform(goal.rotation(), goal.translation() - share * way + off)
                corners += [first] if share == 0.5 else [first, last]
                path = straight_path([*corners, goal], length_scale)
                if is_free(constraints, path):
                    found.append(path)
                    break
        if found:
            best.append(min(found, key=lambda path: path.length))
    return sorted(best, key=lambda path: path.length)[:MOST_DETOURS]


def _across(way: Array, moves: Sequence[int]) -> list[Array]:
    """Unit vectors across a way, of those along which the platform can move."""
    free = np.zeros((3, 3))
    free[list(moves), list(moves)] = 1.0
    length = float(np.linalg.norm(way))
    if length > 0.0:
        free -= np.outer(way, way) / length**2
    values, vectors = np.linalg.eigh(free @ free.T)
    plane = vectors[:, values > 0.5]
    if plane.shape[1] == 0:
        return []
    if plane.shape[1] == 1:
        return [plane[:, 0], -plane[:, 0]]
    # Upwards first: the second axis of the plane is as vertical as it can be.
    up = plane @ (plane.T @ np.array([0.0, 0.0, 1.0]))
    if np.linalg.norm(up) < 1e-9:
        up = plane[:, 0]
    up = up / np.linalg.norm(up)
    side = plane @ (plane.T @ np.cross(way if length > 0.0 else [1.0, 0.0, 0.0], up))
    side = side / np.linalg.norm(side)
    angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return [np.cos(angle) * up + np.sin(angle) * side for angle in angles]
