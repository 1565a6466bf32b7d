"""Poses found one by one while the model stays: many at once, each with a damping of its own.

What a robot measures at a pose depends on the model and on that pose alone, so poses of all rows,
and of many starts for each row, are one batch. A row has minima of its own: it is sought from
several starts, and what is compared is a cost that a measurement cannot raise by more than an
outlier's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import IMPOSSIBLE
from cdpr_drake.calibration.parameters import CalibrationModel, parameter_layout
from cdpr_drake.calibration.pose_freedom import BODY, PoseFreedom
from cdpr_drake.calibration.stations import Point, Stations, turns_of_vectors
from cdpr_drake.calibration.terms import Term
from cdpr_drake.errors import CalibrationError

OUTLIER = 4.0
"""A residual of more sigmas is an outlier: one of 16 thousand normal ones is."""

UNUSUAL = 10.0
"""A pose whose squares are this many times the median's is sought again from turned starts."""

TURNS = (-0.6, -0.25, 0.25, 0.6)
"""By these angles [rad]."""

HUBER = 3.0
"""From how many sigmas on a residual counts linearly while outliers are sought."""

SETTLED = 1e-8
"""By how much half the sum of squares of a pose may still fall."""

MOST_AT_ONCE = 4000
"""Searches that are in memory at a time."""

MOST_STEPS = 100
ROUNDING = 1e-12
FIRST_DAMPING, SMALLEST_DAMPING, LARGEST_DAMPING = 1e-4, 1e-10, 1e10

Weights = Callable[[Array], tuple[Array, Array]]
"""From residuals over sigma to what each adds to half the squares, and the weight of its square."""


def squares(r: Array) -> tuple[Array, Array]:
    """Half the squares: every measurement counts as it is."""
    return 0.5 * r**2, np.ones(r.shape)


def huber(r: Array) -> tuple[Array, Array]:
    """Linear from `HUBER` sigmas on."""
    size = np.abs(r)
    low = np.minimum(size, HUBER)
    return 0.5 * low**2 + HUBER * (size - low), HUBER / np.maximum(size, HUBER)


def truncated(r: Array) -> tuple[Array, Array]:
    """Half the squares up to `OUTLIER` sigmas; beyond, an outlier costs as much and no more."""
    return 0.5 * np.minimum(np.abs(r), OUTLIER) ** 2, (np.abs(r) <= OUTLIER).astype(float)


@dataclass(frozen=True, eq=False)
class FoundPoses:
    """Where searches for poses ended.

    Attributes:
        stations: The poses, and tensions where they were unknown.
        costs: What measurements there cost, shape (k,) [-]; infinite where a start was impossible.
    """

    stations: Stations
    costs: Array

    def only(self, which: npt.NDArray[np.generic]) -> FoundPoses:
        """Some of them."""
        return FoundPoses(self.stations.only(which), self.costs[which])


def robust_costs(terms: Sequence[Term], at: Point) -> Array:
    """What measurements at each pose cost, shape (k,): squares over sigma, 16 for each outlier."""
    parts = [2.0 * np.sum(truncated(term.by_poses(at)[0])[0], axis=1) for term in terms]
    return np.asarray(np.sum(parts, axis=0))


def settle_poses(
    terms: Sequence[Term],
    at: Point,
    weights: Weights,
    *,
    freedom: PoseFreedom,
    most: int = MOST_STEPS,
    without: npt.NDArray[np.bool_] | None = None,
) -> FoundPoses:
    """The nearest minimum of each pose, the model as it is: damped Gauss-Newton.

    Args:
        terms: What was measured, a row for each pose.
        at: The model, and where each search begins.
        weights: How residuals count.
        freedom: Which coordinates of poses are unknown.
        most: Steps at most.
        without: Residuals that do not count, shape (k, rows); None: all do.
    """
    scale = freedom.scale(at.stations.width)
    stations, layout = at.stations, at.layout
    counts = None if without is None else ~without
    r, B = _evaluated(terms, at, counts)
    costs = np.sum(weights(r)[0], axis=1)
    costs[~np.isfinite(costs)] = np.inf
    damping = np.full(stations.count, FIRST_DAMPING)
    going = np.isfinite(costs)
    for _ in range(most):
        now = np.flatnonzero(going)
        if not len(now):
            break
        w = weights(r[now])[1]
        J = freedom.narrow(B[now], stations.R[now]) * scale
        Jt = np.swapaxes(J * w[:, :, None], 1, 2)
        H, g = Jt @ J, np.einsum("kqr,kr->kq", Jt, r[now])
        # What nothing tells stays where it is, and rounding makes no matrix singular.
        floor = ROUNDING * np.trace(H, axis1=1, axis2=2)
        damped = H + (damping[now] + floor)[:, None, None] * np.eye(len(scale))
        told = -np.linalg.solve(damped, g[:, :, None])[:, :, 0]
        expected = -0.5 * np.sum(told * g, axis=1)
        steps = freedom.widen(told * scale, stations.R[now], stations.width)
        moved = stations.only(now).moved(steps)
        mine = [term.only(now) for term in terms]
        some = None if counts is None else counts[now]
        new_r, new_B = _evaluated(mine, Point(at.model, moved, layout), some)
        new = np.sum(weights(new_r)[0], axis=1)
        better = new <= costs[now]
        done = expected <= SETTLED * (1.0 + 1e-6 * costs[now])
        gain = np.where(better, costs[now] - new, 0.0)
        done |= better & (gain <= 1e-14 * costs[now])
        which = now[better]
        stations = stations.put(which, moved.only(better))
        r[which], B[which], costs[which] = new_r[better], new_B[better], new[better]
        damping[now] = np.where(
            better, np.maximum(damping[now] / 10.0, SMALLEST_DAMPING), 10.0 * damping[now]
        )
        going[now[done | (damping[now] > LARGEST_DAMPING)]] = False
    return FoundPoses(stations, costs)


def _evaluated(
    terms: Sequence[Term], at: Point, counts: npt.NDArray[np.bool_] | None
) -> tuple[Array, Array]:
    parts = [term.by_poses(at) for term in terms]
    r, B = (np.concatenate([part[i] for part in parts], axis=1) for i in (0, 1))
    return (r, B) if counts is None else (np.where(counts, r, 0.0), B * counts[:, :, None])


def robust_poses(
    terms: Sequence[Term],
    at: Point,
    *,
    freedom: PoseFreedom,
    outliers: bool = True,
    without: npt.NDArray[np.bool_] | None = None,
) -> FoundPoses:
    """As `settle_poses`, with outliers left out as a program leaves them out, if they are sought.

    Costs are sums of squares over sigma, in which an outlier costs 16.

    Args:
        terms: What was measured, a row for each pose.
        at: The model, and where each search begins.
        freedom: Which coordinates of poses are unknown.
        outliers: Whether outliers are sought.
        without: Residuals that do not count on the way there, shape (k, rows): a bad one may lead
            into a wrong minimum, though it is an outlier there, too.
    """
    count = at.stations.count
    if count > MOST_AT_ONCE:
        parts = [slice(k, k + MOST_AT_ONCE) for k in range(0, count, MOST_AT_ONCE)]
        return _joined([
            robust_poses(
                [term.only(some) for term in terms], at.only(some), freedom=freedom,
                outliers=outliers, without=None if without is None else without[some],
            )
            for some in parts
        ])  # fmt: skip
    if not outliers:
        found = settle_poses(terms, at, squares, freedom=freedom, without=without)
        return FoundPoses(found.stations, 2.0 * found.costs)
    begun = settle_poses(terms, at, huber, freedom=freedom, without=without)
    there = Point(at.model, begun.stations, at.layout)
    found = settle_poses(terms, there, truncated, freedom=freedom)
    return FoundPoses(found.stations, 2.0 * found.costs)


def turned_starts(R: Array, *, freedom: PoseFreedom) -> Array:
    """A rotation turned to both sides about each axis in which the platform turns, (s, 3, 3)."""
    axes = freedom.turn_axes()
    return (
        turns_of_vectors(
            np.array([angle * axis for axis in axes for angle in TURNS]).reshape(-1, 3)
        )
        @ R
    )


def guessed_from(
    models: Sequence[CalibrationModel],
    terms: Sequence[Term],
    firsts: Sequence[RigidTransform],
    *,
    count: int,
    tensions: Array | None = None,
    freedom: PoseFreedom = BODY,
    sure: bool = True,
) -> list[Stations]:
    """Poses that fit what was measured, each found from the one before; from several first ones.

    Args:
        models: The robot as it is believed with each start; they differ in nothing but what
            readings count from.
        terms: What was measured: lengths, and whatever else tells poses.
        firsts: Where the search for the first pose begins, X_WP [m], one a start.
        count: Number of poses k.
        tensions: Guesses of the tensions, shape (starts, k, m) [N], if a term needs them.
        freedom: Which coordinates of poses are unknown.
        sure: Whether the model is nearly right: poses that fit worse than others are then sought
            from further starts. Else each stays near the one before, as whatever is off shifts all
            of them alike.

    Raises:
        CalibrationError: A start is impossible.
    """
    base = replace(models[0], length_offset=np.zeros(0), swivel_offset=np.zeros(0))
    layout, starts = parameter_layout(base), len(models)
    first = Stations.at(firsts)

    def searched(rows: Rows, which: Rows, R: Array, p: Array) -> FoundPoses:
        """From these poses, each of a row and a start."""
        mine = [t.only(rows).counted_by([models[s] for s in which], base) for t in terms]
        t = None if tensions is None else tensions[which, rows]
        found = settle_poses(mine, Point(base, Stations(R, p, t), layout), squares, freedom=freedom)
        if not np.isfinite(found.costs).all():
            raise CalibrationError(IMPOSSIBLE)
        return found

    R, p = first.R, first.p
    along = []
    for k in range(count):
        every = np.arange(starts)
        if k and sure:
            both = searched(
                np.full(2 * starts, k), np.tile(every, 2),
                np.concatenate([R, first.R]), np.concatenate([p, first.p]),
            )  # fmt: skip
            nearer = both.costs[:starts] <= both.costs[starts:]
            here = both.only(np.where(nearer, every, every + starts))
        else:
            here = searched(np.full(starts, k), every, R, p)
        R, p = here.stations.R, here.stations.p
        along.append(here)
    return [
        _sought_again([one.only(np.array([s])) for one in along], s, searched, first, freedom)
        if sure
        else _joined([one.only(np.array([s])) for one in along]).stations
        for s in range(starts)
    ]


Rows = npt.NDArray[np.intp]
Search = Callable[[Rows, Rows, Array, Array], FoundPoses]


def _sought_again(
    found: list[FoundPoses], start: int, searched: Search, first: Stations, freedom: PoseFreedom
) -> Stations:
    """Poses of a start, those that fit worse than others sought from turned starts: perhaps they
    are in a wrong minimum."""
    whole = _joined(found)
    for k in np.flatnonzero(whole.costs > UNUSUAL * float(np.median(whole.costs))):
        here = whole.stations
        R = np.concatenate([
            here.R[k : k + 1], turned_starts(first.R[start], freedom=freedom),
            turned_starts(here.R[k], freedom=freedom),
        ])  # fmt: skip
        count = (len(R) - 1) // 2
        p = np.vstack([here.p[k], *[first.p[start]] * count, *[here.p[k]] * count])
        ends = searched(np.full(len(R), k), np.full(len(R), start), R, p)
        best = ends.only(np.array([int(np.argmin(ends.costs))]))
        whole = FoundPoses(here.put(np.array([k]), best.stations), whole.costs)
    return whole.stations


def _joined(found: Sequence[FoundPoses]) -> FoundPoses:
    at = [one.stations for one in found]
    tensions = [one.tensions for one in at if one.tensions is not None]
    stations = Stations(
        np.concatenate([one.R for one in at]), np.concatenate([one.p for one in at]),
        np.concatenate(tensions) if tensions else None,
    )  # fmt: skip
    return FoundPoses(stations, np.concatenate([one.costs for one in found]))


def guessed_stations(
    model: CalibrationModel,
    terms: Sequence[Term],
    count: int,
    first: RigidTransform,
    *,
    tensions: Array | None = None,
    freedom: PoseFreedom = BODY,
    sure: bool = True,
) -> Stations:
    """As `guessed_from`, from one first pose; tensions of shape (k, m) [N]."""
    t = None if tensions is None else tensions[None]
    return guessed_from(
        [model], terms, [first], count=count, tensions=t, freedom=freedom, sure=sure
    )[0]
