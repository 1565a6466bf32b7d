"""Words for a path that cannot be followed: where it fails, and by which cable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.margin_kernel import ROUNDING, TENSION_USE, margin, rest_margins
from cdpr_drake.planning.path_task import PathTask, pose_words, samples_at
from cdpr_drake.planning.reachability_kernel import feasible_point, row_count, write_program
from cdpr_drake.planning.resistance import (
    bound_words,
    resistance_bounds,
    responses,
    wrench_words,
)
from cdpr_drake.planning.resistance_kernel import resistance_margins
from cdpr_drake.planning.station_kernel import BASIS, T_0
from cdpr_drake.trajectories.pose_path import POINT_SIZE

ABOUT = 1e-3
"""Limits that are missed by nearly as much as the worst, relative to it, are named with it."""

MOST_NAMED = 3
"""Cables that a message names."""


def held_badly(task: PathTask, point: Array, s: float, whole: float) -> str:
    """Of a point of a path at which the cables cannot hold the platform at rest."""
    return f"path: at s = {s:.4g} m of {whole:.4g} m, {not_held(task, point)}"


def not_held(task: PathTask, point: Array) -> str:
    """Pose and cables of a point, shape (19,), at which the cables cannot hold the platform.

    Where they can, but not under the wrenches to resist: the wrench that they resist least.
    """
    zero = np.zeros(1)
    alone = replace(task, resist=np.empty((0, 6)))
    held = samples_at(alone, point[np.newaxis], zero, zero, zero, zero)
    tensions, torques, under = held.tensions[0], held.torques[0], ""
    if len(task.resist) and held.uses[0, TENSION_USE] <= 1.0 + ROUNDING:
        tensions, wrench = _least_resisted(task, point)
        torques = -task.limits.ratio * tensions
        under = f" under the wrench {wrench_words(wrench)} to resist"
    lim = task.limits
    half = 0.5 * (lim.upper - lim.lower)
    missed = np.maximum(lim.lower - tensions, tensions - lim.upper) / half
    if np.isfinite(lim.torque):
        missed = np.maximum(missed, np.abs(torques) / lim.torque - 1.0)
    worst = np.flatnonzero(missed >= (1.0 - ABOUT) * np.max(missed))[:MOST_NAMED]
    found = ", ".join(f"{task.name(i)} {tensions[i]:.4g} N" for i in worst)
    return (
        f"pose {pose_words(point)}: the cables cannot hold the platform{under}; the nearest they "
        f"come: {found}; accepted: {_tension_words(lim)}"
    )


def _least_resisted(task: PathTask, point: Array) -> tuple[Array, Array]:
    """Tensions nearest to their limits at rest under the wrench that is worst, and the wrench."""
    stations, _ = task.stations(point[np.newaxis])
    S, limits, least = stations[0], task.limits.packed(), np.inf
    still, eta = np.zeros(task.cables.count), np.zeros(len(S) - BASIS)
    for response, corner in zip(responses(task, point[np.newaxis])[0], task.resist, strict=True):
        t = S[T_0] + response
        if (d := margin(t, still, S[BASIS:], limits, eta)) < least:
            least, tensions, wrench = d, t + eta @ S[BASIS:], corner
    return tensions, wrench


def check_held(task: PathTask, X_WP: RigidTransform, where: str) -> None:
    """Makes sure that a platform can rest at a pose.

    Args:
        task: The robot and its limits.
        X_WP: The pose [m].
        where: What it is, for the message.

    Raises:
        PlanningError: It cannot; names pose and cables.
    """
    point = np.concatenate([pose_row(X_WP), np.zeros(POINT_SIZE - 7)])
    stations, _ = task.stations(point[np.newaxis])
    margins = np.empty(1)
    rest_margins(stations, task.limits.packed(), np.zeros((1, stations.shape[1] - BASIS)), margins)
    bounds = resistance_bounds(task, point[np.newaxis], stations)
    resisting, zero = np.empty(1), np.zeros(1)
    resistance_margins(bounds, zero, zero, resisting, np.empty(1, np.int64))
    if not min(margins[0], resisting[0]) >= -ROUNDING:
        raise PlanningError(f"{where}: {not_held(task, point)}")


def stuck(
    task: PathTask, points: Array, stations: Array, places: Array, whole: float, fastest: float,
    goal: Array,
) -> str:  # fmt: skip
    """Of two stations of which the second cannot be reached from the first at any speed.

    Args:
        task: The robot.
        points: Of the path, shape (2, 19).
        stations: What they ask.
        places: s of both, shape (2,) [m].
        whole: Where the path ends [m].
        fastest: Largest (ds/dt)^2 at the first [m^2/s^2].
        goal: Smallest and largest at the second, shape (2,) [m^2/s^2].
    """
    limits, way = task.limits.packed(), float(places[1] - places[0])
    bounds = resistance_bounds(task, points, stations)
    p, k = row_count(task.cables.count, limits, bounds.shape[1]), 2 + 2 * (len(stations[0]) - BASIS)
    rows, low, high, z = np.empty((p, k)), np.empty(p), np.empty(p), np.empty(k)
    write_program(stations[0], stations[1], bounds, way, limits, fastest, goal, rows, low, high)
    missed = feasible_point(rows, low, high, way, limits, z)
    where = (
        f"path: at s = {places[0]:.4g} m of {whole:.4g} m, pose {pose_words(points[0])}: no speed "
        "leads on from there"
    )
    if not missed > 0.0:
        return f"{where}; accepted: a path that goes on, or more stations"
    values, half = rows @ z, 0.5 * (high - low)
    half[np.isinf(half)] = 0.5 * (task.limits.upper - task.limits.lower)
    share = np.maximum(values - high, low - values)[:-2] / half[:-2]
    named: list[str] = []
    for row in np.argsort(-share):
        if share[row] < (1.0 - ABOUT) * missed or len(named) == MOST_NAMED:
            break
        words = _row_words(task, int(row) % (p // 2 - 1), values[row] > high[row])
        if words not in named:
            named.append(words)
    return f"{where}: {', '.join(named)}; accepted: {_tension_words(task.limits)}"


def _row_words(task: PathTask, row: int, above: bool) -> str:
    """Which limit a row of a station in a program of `write_program` is."""
    lim, m = task.limits, task.cables.count
    kinds_count = 1 + int(np.isfinite(lim.torque)) + int(np.isfinite(lim.cable_acceleration))
    if row >= m * kinds_count:
        return bound_words(task, row - m * kinds_count)
    kinds = [f"needs {'more than its largest' if above else 'less than its smallest'} tension"]
    if np.isfinite(lim.torque):
        kinds.append("needs more than the torque of its motor")
    if np.isfinite(lim.cable_acceleration):
        kinds.append("is accelerated too much")
    return f"{task.name(row % m)} {kinds[row // m]}"


def _tension_words(lim: MotionLimits) -> str:
    words = f"{lim.lower:.4g} to {lim.upper:.4g} N"
    if np.isfinite(lim.torque):
        words += f" and {lim.torque:.4g} N m"
    if np.isfinite(lim.cable_acceleration):
        words += f", cable accelerations to {lim.cable_acceleration:.4g} m/s^2"
    return words
