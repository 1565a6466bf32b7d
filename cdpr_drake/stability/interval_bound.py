"""A lower bound of the stability margin by interval arithmetic: the natural extension of Pi.

Every error is an interval for each of its three numbers, so that a ball becomes the cube around it,
and the errors of several points that share one shift become independent. The criterion is written
as

  Pi = (K_l M [c_i x u_i, u_i] diag(C, C)) (diag(e^g, e^g) K_r^),  u_i = q_i / |q_i|,
  c_i = b_i + db_i - t - dt,  q_i = e^-f R' (p + dp - a_i - da_i) + b_i + db_i,

in the axes of the believed platform, where q_i has each error once, and evaluated operation by
operation in that order, which of all orders gives the narrowest product, with ends rounded outwards
(`numerics.interval_arithmetic`). M is enclosed together with
the rounding of the nominal Jacobian. A matrix that lies within the radii Delta of its midpoint has
its smallest eigenvalue at most |Delta| below that of the midpoint.

The box may be cut: each axis of the platform's and the camera's turn and of the platform's shift
into equal parts; the margin is then the least one of all parts.

Source: R. E. Moore, R. B. Kearfott and M. J. Cloud, Introduction to Interval Analysis, SIAM 2009,
chapters 5 to 7; J. Rohn, Bounds on eigenvalues of interval matrices, ZAMM 78 (1998).
"""

from __future__ import annotations

import math
from itertools import pairwise
from itertools import product as combinations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.interval_arithmetic import (
    Interval,
    cross,
    left_inverse,
    product,
    rotation,
    stacked,
    total,
)
from cdpr_drake.stability.criterion_at_pose_kernel import CaseArrays, PoseRows
from cdpr_drake.stability.nominal_matrices_kernel import NominalMatrices, nominal_matrices
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import packed_case, refuse_unproven

ENTRY_ERROR = 1e-14
"""Relative to the largest entry, what the computed R, K_l and K_r may differ by from exact ones:
some roundings of 1.1e-16 each, and two places to spare."""

EIGENVALUE_ERROR = 1e-13
"""Of eigenvalues of symmetric matrices of six rows, relative to the largest one: LAPACK is
within a small multiple of 1.1e-16 times the number of rows."""


def interval_margins(
    case: StabilityCase, bounds: PerturbationBounds, poses: Array, parts: int = 1
) -> Array:
    """Lower bounds of the margin over all perturbations; stable where they are positive.

    Args:
        case: Robot, scheme, target.
        bounds: What limits the perturbations.
        poses: Nominal platform poses X_WP, rows (qw, qx, qy, qz, x, y, z), shape (N, 7) [-, m].
        parts: Parts into which the box is cut along each of up to nine axes.

    Returns:
        Shape (N,) [-]; minus infinity where nothing is bounded.

    Raises:
        StabilityError: As `judge_stability` for a certificate.
    """
    refuse_unproven(case, bounds)
    arrays, rows = packed_case(case, bounds, poses)
    known = nominal_matrices(arrays, rows)
    nominal = _Nominal(arrays, rows, known)
    least = np.full(len(rows.poses), np.inf)
    with np.errstate(invalid="ignore", over="ignore"):
        for turn, shift, camera in _boxes(bounds, case.planar, parts):
            least = np.minimum(least, _least_eigenvalue(nominal.criterion(turn, shift, camera)))
    return np.where(np.isnan(least), -np.inf, least)


def _boxes(
    bounds: PerturbationBounds, planar: bool, parts: int
) -> list[tuple[Interval, Interval, Interval]]:
    """Boxes of platform turn, platform shift and camera turn that cover their balls."""
    radii = (bounds.d_theta_bp, bounds.r_bp, bounds.d_theta_pc)
    cut = [_cut_ball(r, planar, block != 1, parts) for block, r in enumerate(radii)]
    return [(turn, shift, camera) for turn, shift, camera in combinations(*cut)]


def _cut_ball(radius: float, planar: bool, turn: bool, parts: int) -> list[Interval]:
    """Boxes of equal edges, shape (3,), that cover a ball, or a planar robot's part of it."""
    still = [planar and turn, planar and turn, planar and not turn]
    edges = np.linspace(-radius, radius, parts + 1)
    choices = [[(0.0, 0.0)] if fixed or radius == 0.0 else list(pairwise(edges)) for fixed in still]
    boxes = []
    for box in combinations(*choices):
        low, high = (np.array([ends[side] for ends in box]) for side in range(2))
        nearest = np.maximum(0.0, np.maximum(low, -high))
        if np.linalg.norm(nearest) <= radius * (1.0 + ENTRY_ERROR):
            boxes.append(Interval(low, high))
    return boxes


class _Nominal:
    """What all perturbations of a chunk of poses have in common, enclosed."""

    def __init__(self, case: CaseArrays, rows: PoseRows, known: NominalMatrices) -> None:
        """Encloses the nominal matrices of poses."""
        self.case, self.rows, self.kept = case, rows, known.rows
        self.R = _enclosed(known.R)
        self.C = Interval.of(case.C)[:, :, None]
        self.p = Interval.of(rows.poses[:, 4:].T)
        self.K_l, self.K_r = _enclosed(known.K_l), _enclosed(known.K_r)
        nothing = Interval.of(np.zeros((3, 1, 1)))
        still = self._rows(nothing, nothing, nothing, nothing, nothing)
        J = product(still, _both(self.C))
        self.KM = product(self.K_l, left_inverse(J[:, self.kept]))

    def criterion(self, turn: Interval, shift: Interval, camera: Interval) -> Interval:
        """Pi for boxes of errors, shape (k, k, N); the rest within its bounds."""
        radii = self.case.radii
        exits, anchors, place = (self._cube(radii[k])[:, None, None] for k in (6, 7, 3))
        rows = self._rows(turn[:, None, None], shift[:, None, None], exits, anchors, place)
        left = product(product(self.KM, rows), _both(self.C))[:, self.kept]
        turned = _both(rotation(camera, radii[2])[:, :, None])[self.kept][:, self.kept]
        return product(left, product(turned, self._right(radii[5])))

    def _cube(self, radius: float) -> Interval:
        """Of shifts; it holds whatever the directions of a set of points allow."""
        edges = radius * np.array([1.0, 1.0, 0.0 if self.case.planar else 1.0])
        return Interval(-edges, edges)

    def _rows(
        self, turn: Interval, shift: Interval, exits: Interval, anchors: Interval, camera: Interval
    ) -> Interval:
        """[c x u, u] of the cables in the believed platform, shape (m, 6, N)."""
        A, B = (Interval.of(points.T[:, :, None]) for points in (self.case.A, self.case.B))
        back = rotation(-turn[:, 0, 0], self.case.radii[0])
        way = self.p[:, None] + shift - A - exits
        R = self.R[:, :, None]
        in_P = stacked([total(stacked([R[j, k] * way[j] for j in range(3)])) for k in range(3)])
        b = B + anchors
        q = stacked([
            total(stacked([back[i, j] * in_P[j] for j in range(3)])) + b[i] for i in range(3)
        ])  # fmt: skip
        per_length = total(q.square()).root().reciprocal()
        u = (q * per_length[None]).within(-1.0, 1.0)
        vanishes = np.broadcast_to(np.isinf(per_length.high), u.low.shape)
        u = Interval(*(np.where(vanishes, np.nan, ends) for ends in (u.low, u.high)))
        c = b - Interval.of(self.case.t[:, None, None]) - camera
        levers = cross(c, u)
        both = np.concatenate([levers.low, u.low]), np.concatenate([levers.high, u.high])
        return Interval(*(np.swapaxes(ends, 0, 1) for ends in both))

    def _right(self, radius: float) -> Interval:
        """K_r^ for an object whose position is off by a radius, of PBVS, shape (k, k, N)."""
        if radius == 0.0:
            return self.K_r
        full = Interval(*(self._spatial(ends) for ends in (self.K_r.low, self.K_r.high)))
        turned = cross(self._cube(radius)[:, None, None], full[:3])
        low, high = full.low.copy(), full.high.copy()
        moved = full[3:] + turned
        low[3:], high[3:] = moved.low, moved.high
        return Interval(low, high)[self.kept]

    def _spatial(self, matrix: Array) -> Array:
        full = np.zeros((6, *matrix.shape[1:]))
        full[self.kept] = matrix
        return full


def _enclosed(matrices: Array) -> Interval:
    """Matrices of N poses, shape (N, n, m), with what computing them may have done, (n, m, N)."""
    moved = np.moveaxis(matrices, 0, -1)
    return Interval.of(moved).widened(ENTRY_ERROR * np.max(np.abs(moved), axis=(0, 1)))


def _both(C: Interval) -> Interval:
    """diag(C, C), shape (6, 6, N)."""
    ends = []
    for end in (C.low, C.high):
        full = np.zeros((6, 6, *end.shape[2:]))
        full[:3, :3], full[3:, 3:] = end, end
        ends.append(full)
    return Interval(*ends)


def _least_eigenvalue(Pi: Interval) -> Array:
    """Lower bounds of the smallest eigenvalue of the symmetric part, shape (N,)."""
    both = (Pi + Interval(*(np.swapaxes(ends, 0, 1) for ends in (Pi.low, Pi.high)))).times(0.5)
    low, high = (np.moveaxis(ends, -1, 0) for ends in (both.low, both.high))
    middle = 0.5 * (low + high)
    radius = np.nextafter(np.maximum(high - middle, middle - low), np.inf)
    good = np.all(np.isfinite(middle) & np.isfinite(radius), axis=(1, 2))
    least = np.full(len(middle), -math.inf)
    values, reach = (np.linalg.eigvalsh(X[good]) for X in (middle, radius))
    size = np.max(np.abs(values), axis=1, initial=0.0) + reach[:, -1]
    least[good] = values[:, 0] - reach[:, -1] - EIGENVALUE_ERROR * size
    return least
