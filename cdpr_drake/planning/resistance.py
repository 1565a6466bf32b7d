"""A set of wrenches that a motion must resist all along its path.

At every point of the path tensions must exist for the motion alone, and for the motion with every
wrench of the set: those of its corners are enough, since tensions between them are sums of theirs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import TYPE_CHECKING, Protocol

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import PlatformDynamics
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.resistance_kernel import corner_margins, resistance_rows
from cdpr_drake.workspaces.static_feasibility import wrench_matrices
from cdpr_drake.workspaces.wrench_facets_kernel import wedge_terms

if TYPE_CHECKING:
    from cdpr_drake.trajectories.timed_path import TimedPath

MOST_ROWS = 10_000
"""Bounds of (u, x) that a point of a path may have: 8 cables have 112, and 896 with torques; so
many take some seconds for a path."""


class ResistingTask(Protocol):
    """What is asked of a `PathTask` here; that file asks this one."""

    @property
    def cables(self) -> CableSet:
        """The cables."""

    @property
    def dynamics(self) -> PlatformDynamics:
        """The platform."""

    @property
    def limits(self) -> MotionLimits:
        """What the motion may ask."""

    @property
    def resist(self) -> Array:
        """Wrenches on the platform, shape (k, 6) [N m, N]."""

    def name(self, cable: int) -> str:
        """Of a cable, counted from 0."""

    def stations(self, points: Array, x: Array | None = None) -> tuple[Array, Array]:
        """What points of a path ask."""


@dataclass(frozen=True, eq=False)
class CornerMargins:
    """How well a motion resists each corner of a set.

    Attributes:
        corners: Wrenches on the platform about Po in W, (moment, force), shape (k, 6) [N m, N].
        margins: Largest share of the tensions' half range (of the torque) that can be kept to all
            limits where it is least, shape (k,); below 0: limits are missed.
        parameters: s there, shape (k,) [m].
    """

    corners: Array
    margins: Array
    parameters: Array

    @property
    def worst(self) -> int:
        """The corner with the least margin."""
        return int(np.argmin(self.margins))


def check_resistance(task: ResistingTask) -> None:
    """Makes sure that a set of wrenches can be asked along a path.

    Raises:
        PlanningError: It is no list of finite wrenches, or bounds would be too many.
    """
    corners = task.resist
    if corners.ndim != 2 or corners.shape[1] != 6 or not np.all(np.isfinite(corners)):
        raise PlanningError(
            f"wrenches to resist: found shape {corners.shape}, or one that is not finite; "
            "accepted: rows of 6 finite numbers, moment and force [N m, N]"
        )
    count = row_count(task)
    if count > MOST_ROWS:
        raise PlanningError(
            f"wrenches to resist: found {task.cables.count} cables, which make {count} bounds at a "
            f"point of a path; accepted: at most {MOST_ROWS}"
        )


def row_count(task: ResistingTask) -> int:
    """Bounds that a set of wrenches makes at a point of a path."""
    if not len(task.resist):
        return 0
    f, m = len(task.dynamics.motions), task.cables.count
    ways = 2 ** (m - f + 1) if np.isfinite(task.limits.torque) else 1
    return 2 * comb(m, f - 1) * ways


def resistance_bounds(task: ResistingTask, points: Array, stations: Array) -> Array:
    """What the wrenches to resist leave (u, x), shape (n, p, 4), as `resistance_rows`; p may be 0.

    Args:
        task: The robot, its limits and the wrenches.
        points: Points of a path, shape (n, 19).
        stations: What they ask, as `PathTask.stations`.
    """
    out = np.empty((len(points), row_count(task), 4))
    if out.shape[1]:
        W, rows = _matrices(task, points), list(task.dynamics.motions)
        f, m = W.shape[1:]
        others = _others(f, m)
        corners = np.ascontiguousarray(task.resist[:, rows])
        resistance_rows(stations, W, corners, task.limits.packed(), others, *wedge_terms(f), out)
    return out


def responses(task: ResistingTask, points: Array) -> Array:
    """Tensions of least norm that balance each wrench to resist, shape (n, k, m) [N]."""
    W, rows = _matrices(task, points), list(task.dynamics.motions)
    return np.ascontiguousarray(-task.resist[:, rows] @ np.linalg.pinv(W).transpose(0, 2, 1))


def resisted(task: ResistingTask, points: Array, s: Array, u: Array, x: Array) -> CornerMargins:
    """How well points of a path, shape (n, 19), resist each corner with d2s/dt2 and (ds/dt)^2.

    Args:
        task: The robot, its limits and the wrenches.
        points: Points of a path, shape (n, 19).
        s: Their parameters, shape (n,) [m].
        u: d2s/dt2, shape (n,) [m/s^2].
        x: (ds/dt)^2, shape (n,) [m^2/s^2].

    Raises:
        PlanningError: A cable cannot run, or the wrench matrix is singular; names the pose.
    """
    stations, _ = task.stations(points, x)
    margins = np.empty(len(task.resist))
    where = np.empty(len(task.resist), np.int64)
    corner_margins(stations, responses(task, points), u, x, task.limits.packed(), margins, where)
    return CornerMargins(task.resist, margins, s[where])


def bound_words(task: ResistingTask, row: int) -> str:
    """Which cables a row of `resistance_bounds` is about."""
    f, m = len(task.dynamics.motions), task.cables.count
    ways = 2 ** (m - f + 1) if np.isfinite(task.limits.torque) else 1
    names = [task.name(j) for j in _others(f, m)[row // (2 * ways)]]
    return f"{', '.join(names)} cannot resist the wrenches together"


def _others(f: int, m: int) -> np.ndarray:
    """Of every f - 1 of m cables the others, shape (g, m - f + 1)."""
    some = combinations(range(m), f - 1)
    return np.array([[j for j in range(m) if j not in chosen] for chosen in some])


def resisted_along(task: ResistingTask, motion: TimedPath) -> CornerMargins:
    """How well a motion resists each corner, at its stations: what it asks before and after each.

    Raises:
        PlanningError: As `resisted`.
    """
    assert motion.path is not None
    s, x = motion.stations, motion.squared_speeds
    u = np.diff(x) / (2.0 * np.diff(s))
    points = motion.path.points(s)
    return resisted(
        task,
        np.concatenate([points[:-1], points[1:]]),
        np.concatenate([s[:-1], s[1:]]),
        np.concatenate([u, u]),
        np.concatenate([x[:-1], x[1:]]),
    )


def wrench_words(wrench: Sequence[float] | Array) -> str:
    """A wrench, shape (6,), as users read it."""
    words = [f"{round(value, 6) + 0.0:.4g}" for value in wrench]
    return f"({', '.join(words[:3])}) N m, ({', '.join(words[3:])}) N"


def _matrices(task: ResistingTask, points: Array) -> Array:
    """Wrench matrices of the rows that the platform moves, shape (n, f, m)."""
    R = np.array([pose_from_row(point[:7]).rotation().matrix() for point in points])
    W = wrench_matrices(points[:, 4:7], R, task.cables)
    return np.ascontiguousarray(W[:, list(task.dynamics.motions)])
