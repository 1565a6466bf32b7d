"""Pieces of the set of perturbations, each with a centre: what a proof by cases goes over.

Only the turns of platform and camera and the shift of the platform are cut; the rest keeps its ball
around zero. A common shift of the exit points counts as a shift of the platform, so that its ball
has the radius r_bp + r_A then.

**Coordinates.** A turn by the angle theta about the unit vector u has the coordinates
2 tan(theta / 2) u (Rodrigues), the shift those of W; both are taken along orthonormal axes Q whose
first one points to the worst perturbation that a search has found, so that pieces end where the
worst case is. The ball of each becomes a ball again, of radius R = 2 tan(F / 2) for angles up to F.
Pieces are boxes of these coordinates, less what is outside the balls.

**Cuts.** A point s of the box [lo, hi] and of the ball has s_k^2 <= R^2 - sum_(j != k) min s_j^2,
which moves lo and hi inwards; a box without such points is empty. With the midpoint c and half the
edges h, such a point has |s - c| <= |h|, and |s - c|^2 = |s|^2 + |c|^2 - 2 s . c <=
R^2 - |c|^2 + 2 sum_k |c_k| h_k.

**Turns about a centre.** If c, s are the coordinates of two turns, delta = s - c, then the turn
exp(f') = exp(f_c)' exp(f) has the coordinates y = (delta - c x delta / 2) / (1 + c . s / 4), and f'
points along y with |f'| = 2 atan(|y| / 2). Hence with k <= 1 + c . s / 4

  |y| <= Y = rho sqrt(1 + |c|^2 / 4) / k for |delta| <= rho, |f'| <= 2 atan(Y / 2),
  |f' - (delta - c x delta / 2)| <= eta = |c| R Y / 4 + Y^3 / 12,

as |y - 2 atan(|y| / 2) y / |y|| <= |y|^3 / 12. The map B = Q - c x Q / 2 shortens nothing, so that
f' = B sigma with |sigma| <= |f'| and |sigma_k| <= h_k + eta.

Source: the composition of Rodrigues vectors, e.g. Shuster, A survey of attitude representations,
J. Astronautical Sciences 41 (1993), section on the Rodrigues (Gibbs) vector.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import copy_vector
from cdpr_drake.stability.criterion_at_pose_kernel import CaseArrays
from cdpr_drake.stability.perturbation_samples_kernel import COMMON

BOXES = 3
"""What is cut: turn of the platform, its shift, turn of the camera."""

BETTER_HALF_WEIGHT = 0.2
"""Weight of the better half when a cut is chosen."""

LEAST_SAVED_SHARE = 0.1
"""Share of a radius' part that a cut has to save, or else the longest edge is cut."""

WIDEST_CUT_TURN = 1.2
"""Turns above this are not cut [rad]."""


class Piece(NamedTuple):
    """A piece as the proof takes it; three blocks: platform turn, platform shift, camera turn.

    Attributes:
        d: The centre as a perturbation, shape (18 + 6 m,).
        axes: Matrices B from the piece's coordinates about the centre to f' in the centre's P, dp'
            in W, g' in the centre's C, shape (BOXES, 3, 3).
        radius: Bounds of their norms, shape (BOXES,) [rad, m, rad].
        half: Half the edges of the boxes of their coordinates, shape (BOXES, 3).
        middle: Midpoints of the boxes, seen from the centre, shape (BOXES, 3).
    """

    d: Array
    axes: Array
    radius: Array
    half: Array
    middle: Array


@njit(cache=True, error_model="numpy")
def new_piece(m: int) -> Piece:
    """Room for a piece with m cables."""
    return Piece(
        np.zeros(18 + 6 * m),
        np.zeros((BOXES, 3, 3)),
        np.zeros(BOXES),
        np.zeros((BOXES, 3)),
        np.zeros((BOXES, 3)),
    )


@njit(cache=True, error_model="numpy")
def whole_radius(case: CaseArrays, block: int) -> float:
    """Radius of a block's ball [rad, m, rad]."""
    if block == 1:
        shift: float = case.radii[1]
        for part in range(2):
            if case.directions[part] == COMMON:
                shift += case.radii[6 + part]
        return shift
    turn: float = case.radii[block]
    return turn


@njit(cache=True, error_model="numpy")
def is_cut(case: CaseArrays, block: int) -> bool:
    """Whether a block can be cut."""
    radius = whole_radius(case, block)
    return radius > 0.0 and (block == 1 or radius < WIDEST_CUT_TURN)


@njit(cache=True, error_model="numpy")
def whole_piece(case: CaseArrays, piece: Piece) -> None:
    """piece <- everything within the bounds."""
    piece.d[:] = 0.0
    piece.axes[:] = 0.0
    piece.middle[:] = 0.0
    for block in range(BOXES):
        r = whole_radius(case, block)
        piece.radius[block] = r
        for k in range(3):
            piece.axes[block, k, k] = 1.0
            piece.half[block, k] = r


@njit(cache=True, error_model="numpy")
def whole_box(case: CaseArrays, ball: Array, lo: Array, hi: Array) -> None:
    """ball, lo, hi <- radii and the box of the coordinates, shapes (BOXES,), (BOXES, 3) twice."""
    for block in range(BOXES):
        r = whole_radius(case, block)
        ball[block] = r if block == 1 or not r < WIDEST_CUT_TURN else 2.0 * np.tan(0.5 * r)
        for k in range(3):
            flat = case.planar and (k == 2) == (block == 1)
            hi[block, k] = 0.0 if flat else ball[block]
            lo[block, k] = -hi[block, k]


@njit(cache=True, error_model="numpy")
def _identity(Q: Array) -> None:
    for i in range(3):
        for j in range(3):
            Q[i, j] = 1.0 if i == j else 0.0


@njit(cache=True, error_model="numpy")
def worst_axes(case: CaseArrays, R: Array, worst: Array, Q: Array) -> None:
    """Q <- axes that point to a perturbation, shape (BOXES, 3, 3), as columns."""
    a = np.empty(3)
    for block in range(BOXES):
        copy_vector(worst[3 * block : 3 * block + 3], a)
        if block == 1 and case.directions[0] == COMMON:
            for k in range(3):
                a[k] -= worst[18 + k]
        if block == 1 and case.directions[1] == COMMON:
            at = (len(worst) + 18) // 2
            for k in range(3):
                a[k] += R[k, 0] * worst[at] + R[k, 1] * worst[at + 1] + R[k, 2] * worst[at + 2]
        norm = np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
        _identity(Q[block])
        if not norm > 0.0 or (case.planar and block != 1):
            continue
        for k in range(3):
            a[k] /= norm
        if case.planar:
            a[2] = 0.0
            Q[block, 0, 0], Q[block, 1, 0] = a[0], a[1]
            Q[block, 0, 1], Q[block, 1, 1] = -a[1], a[0]
            continue
        # Reflection that takes e_1 to a, or to -a: columns are axes all the same.
        sign = 1.0 if a[0] >= 0.0 else -1.0
        a[0] += sign
        f = 2.0 / (a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
        for i in range(3):
            for j in range(3):
                Q[block, i, j] -= f * a[i] * a[j]


@njit(cache=True, error_model="numpy")
def shrink_box(ball: float, lo: Array, hi: Array) -> bool:
    """lo, hi <- the box, shape (3,), less what is outside the ball; False if nothing is left."""
    total = 0.0
    for k in range(3):
        near = max(0.0, lo[k], -hi[k])
        total += near * near
    if total > ball * ball:
        return False
    for k in range(3):
        near = max(0.0, lo[k], -hi[k])
        edge = np.sqrt(ball * ball - total + near * near) * (1.0 + 1e-12)
        lo[k], hi[k] = max(lo[k], -edge), min(hi[k], edge)
    return True


@njit(cache=True, error_model="numpy")
def place_piece(
    case: CaseArrays, Q: Array, ball: Array, lo: Array, hi: Array, piece: Piece
) -> bool:
    """piece <- that of a box; False if its centre is outside the bounds."""
    c, v, inside = np.empty(3), np.empty(3), True
    for block in range(BOXES):
        if not is_cut(case, block):
            piece.d[3 * block : 3 * block + 3] = 0.0
            piece.radius[block] = whole_radius(case, block)
            _identity(piece.axes[block])
            piece.half[block] = piece.radius[block]
            piece.middle[block] = 0.0
            continue
        R = ball[block]
        rho = centre_of(R, lo[block], hi[block], c) * (1.0 + 1e-12)
        size, least = 0.0, 0.0
        for k in range(3):
            size += c[k] * c[k]
            least += min(lo[block, k] * c[k], hi[block, k] * c[k])
            piece.half[block, k] = 0.5 * (hi[block, k] - lo[block, k])
            piece.middle[block, k] = 0.5 * (hi[block, k] + lo[block, k]) - c[k]
        inside = inside and size <= R * R
        for i in range(3):
            v[i] = Q[block, i, 0] * c[0] + Q[block, i, 1] * c[1] + Q[block, i, 2] * c[2]
            for k in range(3):
                piece.axes[block, i, k] = Q[block, i, k]
        if block == 1:
            copy_vector(v, piece.d[3:6])
            piece.radius[block] = rho
            continue
        norm = np.sqrt(size)
        Y = rho * np.sqrt(1.0 + 0.25 * size) / (1.0 + 0.25 * max(-norm * R, least))
        eta = 0.25 * norm * R * Y + Y * Y * Y / 12.0
        scale = 2.0 * np.arctan(0.5 * norm) / norm if norm > 0.0 else 1.0
        for i in range(3):
            piece.d[3 * block + i] = scale * v[i]
        piece.radius[block] = 2.0 * np.arctan(0.5 * Y)
        for k in range(3):
            piece.half[block, k] += eta
            x, y, z = Q[block, 0, k], Q[block, 1, k], Q[block, 2, k]
            piece.axes[block, 0, k] -= 0.5 * (v[1] * z - v[2] * y)
            piece.axes[block, 1, k] -= 0.5 * (v[2] * x - v[0] * z)
            piece.axes[block, 2, k] -= 0.5 * (v[0] * y - v[1] * x)
    return inside


@njit(cache=True, error_model="numpy")
def centre_of(ball: float, lo: Array, hi: Array, c: Array) -> float:
    """c <- a centre of the box less what is outside the ball; how far any of its points is."""
    best, share = np.inf, 0.0
    for number in range(3):
        part = 0.5 * number
        far = reach_of(ball, lo, hi, part, c)
        if far < best:
            best, share = far, part
    return reach_of(ball, lo, hi, share, c)


@njit(cache=True, error_model="numpy")
def reach_of(ball: float, lo: Array, hi: Array, share: float, c: Array) -> float:
    """c <- between the point next to zero and the midpoint; how far any of the points is."""
    square, size, least = 0.0, 0.0, 0.0
    for k in range(3):
        near = max(0.0, lo[k]) + min(0.0, hi[k])
        c[k] = near + share * (0.5 * (lo[k] + hi[k]) - near)
        far = max(hi[k] - c[k], c[k] - lo[k])
        square += far * far
        size += c[k] * c[k]
        least += min(lo[k] * c[k], hi[k] * c[k])
    return np.sqrt(min(square, max(ball * ball + size - 2.0 * least, 0.0)))


@njit(cache=True, error_model="numpy")
def best_cut(
    case: CaseArrays, ball: Array, lo: Array, hi: Array, slope: Array, weight: Array
) -> tuple[int, int]:
    """Block and axis whose halves promise most.

    Args:
        case: The case.
        ball: Radii, shape (BOXES,).
        lo: Lower ends of the box, shape (BOXES, 3).
        hi: Upper ends.
        slope: What the margin gains with each coordinate, shape (BOXES, 3).
        weight: What it loses with each radius, shape (BOXES,).
    """
    best, block, axis, edge = -1e-6, -1, -1, -1.0
    long_block, long_axis = 0, 0
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    total = 0.0
    for i in range(BOXES):
        if is_cut(case, i):
            total += weight[i] * centre_of(ball[i], lo[i], hi[i], c)
    for i in range(BOXES):
        if not is_cut(case, i):
            continue
        before = _promise(ball[i], lo[i], hi[i], slope[i], weight[i], c)
        reach = max(weight[i] * centre_of(ball[i], lo[i], hi[i], c), total / BOXES)
        for k in range(3):
            length = weight[i] * (hi[i, k] - lo[i, k])
            if length > edge:
                edge, long_block, long_axis = length, i, k
            if not length > 0.0:
                continue
            worse, better = -np.inf, np.inf
            for side in range(2):
                copy_vector(lo[i], a)
                copy_vector(hi[i], b)
                middle = 0.5 * (a[k] + b[k])
                if side == 0:
                    a[k] = middle
                else:
                    b[k] = middle
                change = -before
                if shrink_box(ball[i], a, b):
                    change += _promise(ball[i], a, b, slope[i], weight[i], c)
                worse, better = max(worse, change), min(better, change)
            if worse + BETTER_HALF_WEIGHT * better < best and worse < -LEAST_SAVED_SHARE * reach:
                best, block, axis = worse + BETTER_HALF_WEIGHT * better, i, k
    if block < 0:
        return long_block, long_axis
    return block, axis


@njit(cache=True, error_model="numpy")
def _promise(ball: float, lo: Array, hi: Array, slope: Array, weight: float, c: Array) -> float:
    """What the margin may lose on a box."""
    box, norm = 0.0, 0.0
    for k in range(3):
        box += max(-lo[k] * slope[k], -hi[k] * slope[k])
        norm += slope[k] * slope[k]
    return min(box, ball * np.sqrt(norm)) + weight * centre_of(ball, lo, hi, c)
