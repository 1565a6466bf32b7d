"""Capacity margin, wrench closure, largest payload: measures by the facets of what cables give."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.workspaces.demanded_wrenches import Demand, SpatialSet, resisting
from cdpr_drake.workspaces.static_feasibility import StaticCase, wrench_matrices
from cdpr_drake.workspaces.wrench_facets_kernel import (
    many_closures,
    many_margins,
    many_reaches,
    wedge_terms,
)

NUDGE = 1e-6
"""Step of central differences of wrench matrices, which are smooth: errors of 1e-10 [m, -]."""

SPANS = 1e-9
"""Cables whose wrenches are along a facet to within this share of the largest span it."""

FLAT = 1e-9
"""Thinner sets of wrenches, relative to cables of unit force, are flat: W has not full rank."""


@dataclass(frozen=True, eq=False)
class CapacityMargins:
    """How much room demanded wrenches have within those that the cables can give.

    Attributes:
        margins: Least distance of a demanded wrench from a facet, positive where all lie inside;
            otherwise minus the farthest that one lies beyond a facet, shape (n,) [N], moments
            divided by `StaticCase.arm`. Not above 0 where W is singular, minus infinity where
            nothing can be said (a cable cannot run, or W has rank n - 2 or less).
        normals: Outward normals of these facets, in rows divided likewise, shape (n, rows).
        points: Numbers of the demanded points that are nearest to it, shape (n,).
        regular: Whether W has full rank, shape (n,).
    """

    margins: Array
    normals: Array
    points: np.ndarray
    regular: np.ndarray

    @property
    def feasible(self) -> np.ndarray:
        """Where all demanded wrenches can be given, and W is regular, shape (n,)."""
        return self.regular & (self.margins >= 0.0)


def scaled_matrices(case: StaticCase, positions: Array, rotations: Array) -> Array:
    """W in the balanced rows, moments divided by `case.arm`, shape (n, rows, m)."""
    W = wrench_matrices(
        np.asarray(positions, float).reshape(-1, 3),
        np.asarray(rotations, float).reshape(-1, 3, 3),
        case.cables,
    )
    return np.ascontiguousarray(W[:, list(case.rows)] / case.row_scale()[:, np.newaxis])


def capacity_margins(
    case: StaticCase, positions: Array, rotations: Array, demand: Demand | None = None
) -> CapacityMargins:
    """Capacity margins at poses, signed and exact.

    Args:
        case: Platform, load and tension bounds.
        positions: p_WP, shape (n, 3) [m].
        rotations: R_WP, shape (n, 3, 3).
        demand: What is demanded there; None: to bear weight and wrench of `case`.

    Raises:
        TensionProblemError: The tension bounds make no sense.

    Source: Guay et al., Measuring how well a structure supports varying external wrenches, 2014.
    """
    case.check_bounds()
    demand = resisting(case, SpatialSet(), rotations) if demand is None else demand
    W, scale = scaled_matrices(case, positions, rotations), case.row_scale()
    count, n, _ = W.shape
    points = np.ascontiguousarray(demand.points / scale)
    spread = np.array(demand.spread, float, order="C")
    spread[:, :n] /= scale[:, np.newaxis]
    margins, full = np.empty(count), np.empty(count)
    worst = np.empty((count, n + 1))
    over_rows(
        many_margins, count, None, W, *case.bounds(), points, spread, *wedge_terms(n),
        margins, worst, full,
    )  # fmt: skip
    regular = full > FLAT
    margins[~regular] = np.minimum(margins[~regular], 0.0)
    return CapacityMargins(margins, worst[:, :n], worst[:, n].astype(int), regular)


@dataclass(frozen=True, eq=False)
class MarginSlopes:
    """How capacity margins change as a robot does, exact where one facet alone is the nearest.

    Attributes:
        found: The margins.
        exits: By p_WA of each cable, shape (n, 3, m) [N/m].
        anchors: By p_PB of each cable, with the arm by which moments are divided, (n, 3, m) [N/m].
        upper: By the largest tension of all cables, shape (n,) [-].
    """

    found: CapacityMargins
    exits: Array
    anchors: Array
    upper: Array


def margin_slopes(
    case: StaticCase, positions: Array, rotations: Array, demand: Demand
) -> MarginSlopes:
    """Capacity margins and their derivatives by the points of the cables and the largest tension.

    A margin is c (sum_i t_i w_i - d) for the unit normal c of a facet: t_i is the largest tension
    where c w_i > 0, the smallest where it is below, and any for the cables that span the facet.
    With those by which the sum is the foot of the perpendicular from the demanded point d, a turn
    of c changes nothing to first order, and the derivative is c sum_i t_i dw_i. Each cable's wrench
    depends on its own two points alone: twelve evaluations of W give the derivatives of all poses
    by all points. Arguments and errors as of `capacity_margins`.
    """
    found = capacity_margins(case, positions, rotations, demand)
    rows, scale = list(case.rows), case.row_scale()
    c, (lower, upper) = found.normals / scale, case.bounds()
    cables = case.cables

    def wrenches(points: CableSet) -> Array:
        return np.asarray(wrench_matrices(positions, rotations, points)[:, rows])

    W = wrenches(cables)
    along = np.einsum("nr,nrm->nm", c, W)
    spans = np.abs(along) <= SPANS * np.max(np.abs(along), axis=1, keepdims=True)
    t = np.where(spans, 0.0, np.where(along > 0.0, upper, lower))
    nearest = np.array([_nearest(*one) for one in zip(found.normals, *_sets(demand, scale,
                        found.points), strict=True)])  # fmt: skip
    foot = nearest + found.margins[:, np.newaxis] * found.normals
    for k, on in enumerate(spans):
        Ws = W[k] / scale[:, np.newaxis]
        if np.any(on) and np.all(np.isfinite(Ws)) and np.all(np.isfinite(foot[k])):
            t[k, on] = np.linalg.lstsq(Ws[:, on], foot[k] - Ws @ t[k], rcond=None)[0]
    slopes = np.empty((2, len(W), 3, cables.count))
    for which, name in enumerate(("p_WA", "p_PB")):
        for axis in range(3):
            sides = []
            for step in (NUDGE, -NUDGE):
                points = getattr(cables, name).copy()
                points[axis] += step
                sides.append(wrenches(replace(cables, **{name: points})))
            dW = (sides[0] - sides[1]) / (2.0 * NUDGE)
            slopes[which, :, axis] = t * np.einsum("nr,nrm->nm", c, dW)
    # The arm s, by which the rows of moments are divided, is one of the anchor points.
    s = case.arm()
    moments = np.array([row < 3 for row in rows])
    change = [
        np.einsum("nr,nrm,nm->n", by, W, t) - _demanded(by, demand, found.points)
        for by in (np.where(moments, c * s / (s + e), c) for e in (NUDGE * s, -NUDGE * s))
    ]
    by_arm = (change[0] - change[1]) / (2.0 * NUDGE * s)
    if np.any(cables.p_PB):
        slopes[1] += by_arm[:, np.newaxis, np.newaxis] * cables.p_PB / (cables.count * s)
    return MarginSlopes(found, slopes[0], slopes[1], np.sum(np.maximum(along, 0.0), axis=1))


def _sets(demand: Demand, scale: Array, points: np.ndarray) -> tuple[Array, Array]:
    """Demanded points of these numbers and the sets round them, in rows divided by a scale."""
    count, n = len(demand.points), len(scale)
    spread = np.broadcast_to(demand.spread, (count, *demand.spread.shape[1:])).copy()
    spread[:, :n] /= scale[:, np.newaxis]
    return demand.points[np.arange(count), points] / scale, spread


def _nearest(c: Array, point: Array, spread: Array) -> Array:
    """The wrench of the set round a point that is farthest along c, shape (rows,)."""
    n = len(c)
    y, half, axes = spread[:n].T @ c, spread[n], spread[n + 1]
    length = float(np.linalg.norm(axes * y))
    round_it = axes**2 * y / length if length > 0.0 else 0.0 * y
    return np.asarray(point + spread[:n] @ (half * np.sign(y) + round_it))


def _demanded(c: Array, demand: Demand, points: np.ndarray) -> Array:
    """What is demanded along c, shape (n, rows), at the points of these numbers, shape (n,)."""
    n = c.shape[1]
    spread = np.broadcast_to(demand.spread, (len(c), *demand.spread.shape[1:]))
    y = np.einsum("nrj,nr->nj", spread[:, :n], c)
    reach = np.sum(np.abs(y) * spread[:, n], axis=1) + np.linalg.norm(y * spread[:, n + 1], axis=1)
    nearest = demand.points[np.arange(len(c)), points]
    return np.asarray(np.sum(c * nearest, axis=1) + reach)


def closure_margins(case: StaticCase, positions: Array, rotations: Array) -> Array:
    """How far poses are from losing wrench closure, shape (n,) [-]; closed where positive.

    The least reach, over all directions of wrenches, of the cable that reaches farthest along it
    at a tension of 1, moments divided by `case.arm`. It does not depend on loads or bounds.
    Arguments as `capacity_margins`. Source: Gazebo thesis 2.6.3.
    """
    W = scaled_matrices(case, positions, rotations)
    out = np.empty(len(W))
    over_rows(many_closures, len(W), None, W, *wedge_terms(W.shape[1]), out)
    out[np.abs(out) <= FLAT] = 0.0
    return out


def largest_payloads(case: StaticCase, positions: Array, rotations: Array, gravity: float) -> Array:
    """Largest mass at the platform's centre of mass that can be held beside its own, (n,) [kg].

    NaN where not even the platform can be held, infinite where gravity does not act along any of
    the balanced rows.

    Args:
        case: Platform, load and tension bounds.
        positions: p_WP, shape (n, 3) [m].
        rotations: R_WP, shape (n, 3, 3).
        gravity: Acceleration along `case.down` [m/s^2].

    Raises:
        TensionProblemError: The tension bounds make no sense.
    """
    case.check_bounds()
    R = np.asarray(rotations, float).reshape(-1, 3, 3)
    W, scale = scaled_matrices(case, positions, R), case.row_scale()
    demand = resisting(case, SpatialSet(), R)
    up = -gravity * np.array(case.down)
    lift = np.concatenate([np.cross(R @ case.p_PCo, up), np.broadcast_to(up, (len(R), 3))], axis=-1)
    along = np.ascontiguousarray(lift[:, list(case.rows)] / scale)
    points = np.ascontiguousarray(demand.points[:, 0] / scale)
    out = np.empty(len(W))
    over_rows(
        many_reaches, len(W), None, W, *case.bounds(), points, along, *wedge_terms(W.shape[1]), out
    )
    return out
