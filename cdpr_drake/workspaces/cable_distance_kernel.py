"""Distances between straight cables, boxes and each other, as numba kernels; exact, unsigned.

Segments have scalar arguments and allocate nothing. A box is a row of 15 numbers: rotation row by
row (9), middle (3), half edges (3).

Source: Ericson, Real-Time Collision Detection, 2005, 5.1.9, for two segments.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pulley_kernel import pulley_geometry

BOX_COLUMNS = 15
"""Numbers of a box: rotation, middle, half edges."""

PARTS = 5
"""Columns of `many_clearances`."""


@njit(cache=True, error_model="numpy")
def _unit(x: float) -> float:
    return min(max(x, 0.0), 1.0)


@njit(cache=True, error_model="numpy")
def _shares(a: float, b: float, c: float, e: float, f: float) -> tuple[float, float]:
    """Where p + x d and r + y g are nearest, from d.d, d.g, d.(p - r), g.g, g.(p - r)."""
    if a == 0.0 and e == 0.0:
        return 0.0, 0.0
    if a == 0.0:
        return 0.0, _unit(f / e)
    if e == 0.0:
        return _unit(-c / a), 0.0
    denominator = a * e - b * b
    # Of parallel segments any point will do to begin with.
    x = _unit((b * f - c * e) / denominator) if denominator > 1e-14 * a * e else 0.0
    y = (b * x + f) / e
    if y < 0.0:
        y, x = 0.0, _unit(-c / a)
    elif y > 1.0:
        y, x = 1.0, _unit((b - c) / a)
    return x, y


@njit(cache=True, error_model="numpy")
def segments_shares(p: Array, q: Array, r: Array, s: Array) -> tuple[float, float]:
    """Where the segments p to q and r to s, all of shape (3,) [m], are nearest, 0 to 1 on each."""
    a = b = c = e = f = 0.0
    for k in range(3):
        d, g, between = q[k] - p[k], s[k] - r[k], p[k] - r[k]
        a, b, c = a + d * d, b + d * g, c + d * between
        e, f = e + g * g, f + g * between
    return _shares(a, b, c, e, f)


@njit(cache=True, error_model="numpy")
def segments_distance(p: Array, q: Array, r: Array, s: Array) -> float:
    """Distance of the segments p to q and r to s, all of shape (3,) [m]."""
    x, y = segments_shares(p, q, r, s)
    square = 0.0
    for k in range(3):
        square += (p[k] - r[k] + x * (q[k] - p[k]) - y * (s[k] - r[k])) ** 2
    return np.sqrt(square)


@njit(cache=True, error_model="numpy")
def _cables_square(A: Array, D: Array, squares: Array, i: int, j: int) -> float:
    """Squared distance of two of the segments A to A + D, whose squared lengths are known."""
    d0, d1, d2, g0, g1, g2 = D[i, 0], D[i, 1], D[i, 2], D[j, 0], D[j, 1], D[j, 2]
    e0, e1, e2 = A[i, 0] - A[j, 0], A[i, 1] - A[j, 1], A[i, 2] - A[j, 2]
    x, y = _shares(
        squares[i], d0 * g0 + d1 * g1 + d2 * g2, d0 * e0 + d1 * e1 + d2 * e2, squares[j],
        g0 * e0 + g1 * e1 + g2 * e2,
    )  # fmt: skip
    e0, e1, e2 = e0 + x * d0 - y * g0, e1 + x * d1 - y * g1, e2 + x * d2 - y * g2
    return e0 * e0 + e1 * e1 + e2 * e2


@njit(cache=True, error_model="numpy")
def _slope(s: float, o: float, d: float, half: float) -> float:
    """Half the derivative by s of the squared distance of o + s d from [-half, half]."""
    x = o + s * d
    if x > half:
        return (x - half) * d
    if x < -half:
        return (x + half) * d
    return 0.0


@njit(cache=True, error_model="numpy")
def _nearest_to_box(p: Array, q: Array, box: Array) -> Any:
    """Where the segment p to q, shape (3,) each [m], is nearest to a box, and that point.

    The squared distance is convex along the segment, and quadratic between the crossings of the
    six planes of the box: its slope is straight there, and its zero is found exactly.
    """
    dx, dy, dz = p[0] - box[9], p[1] - box[10], p[2] - box[11]
    ex, ey, ez = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    # In the axes of the box; its rotation has them as columns.
    ox = box[0] * dx + box[3] * dy + box[6] * dz
    oy = box[1] * dx + box[4] * dy + box[7] * dz
    oz = box[2] * dx + box[5] * dy + box[8] * dz
    vx = box[0] * ex + box[3] * ey + box[6] * ez
    vy = box[1] * ex + box[4] * ey + box[7] * ez
    vz = box[2] * ex + box[5] * ey + box[8] * ez
    hx, hy, hz = box[12], box[13], box[14]
    low, high = 0.0, 1.0
    at_low = _slope(0.0, ox, vx, hx) + _slope(0.0, oy, vy, hy) + _slope(0.0, oz, vz, hz)
    at_high = _slope(1.0, ox, vx, hx) + _slope(1.0, oy, vy, hy) + _slope(1.0, oz, vz, hz)
    if at_low >= 0.0:
        s = 0.0
    elif at_high <= 0.0:
        s = 1.0
    else:
        for k in range(6):
            if k < 2:
                o, v, half = ox, vx, hx
            elif k < 4:
                o, v, half = oy, vy, hy
            else:
                o, v, half = oz, vz, hz
            if v == 0.0:
                continue
            s = ((half if k % 2 else -half) - o) / v
            if low < s < high:
                slope = _slope(s, ox, vx, hx) + _slope(s, oy, vy, hy) + _slope(s, oz, vz, hz)
                if slope <= 0.0:
                    low, at_low = s, slope
                else:
                    high, at_high = s, slope
        s = low + (high - low) * at_low / (at_low - at_high) if at_high > at_low else low
    return s, ox + s * vx, oy + s * vy, oz + s * vz


@njit(cache=True, error_model="numpy")
def segment_box_share(p: Array, q: Array, box: Array) -> float:
    """Where the segment p to q, shape (3,) each [m], is nearest to a solid box, 0 to 1."""
    s, _, _, _ = _nearest_to_box(p, q, box)
    return s


@njit(cache=True, error_model="numpy")
def segment_box_distance(p: Array, q: Array, box: Array) -> float:
    """Distance of the segment p to q, shape (3,) each [m], from a solid box, shape (15,)."""
    _, x, y, z = _nearest_to_box(p, q, box)
    gx = max(abs(x) - box[12], 0.0)
    gy = max(abs(y) - box[13], 0.0)
    gz = max(abs(z) - box[14], 0.0)
    return np.sqrt(gx * gx + gy * gy + gz * gz)


@njit(cache=True, error_model="numpy")
def _point_box_distance(p: Array, box: Array) -> float:
    """Distance of a point, the first three numbers of p [m], from a solid box, shape (15,)."""
    square, dx, dy, dz = 0.0, p[0] - box[9], p[1] - box[10], p[2] - box[11]
    for a in range(3):
        over = abs(box[a] * dx + box[3 + a] * dy + box[6 + a] * dz) - box[12 + a]
        if over > 0.0:
            square += over * over
    return np.sqrt(square)


@njit(cache=True, error_model="numpy")
def _corner(box: Array, x: float, y: float, z: float, out: Array) -> None:
    """Writes the point of a box with the coordinates x, y, z in half edges."""
    x, y, z = x * box[12], y * box[13], z * box[14]
    out[0] = box[9] + box[0] * x + box[1] * y + box[2] * z
    out[1] = box[10] + box[3] * x + box[4] * y + box[5] * z
    out[2] = box[11] + box[6] * x + box[7] * y + box[8] * z


@njit(cache=True, error_model="numpy")
def boxes_distance(one: Array, other: Array, ends: Array) -> float:
    """Distance of two solid boxes, shape (15,) each; 0 where they overlap.

    The nearest points of two convex polyhedra, and a corner of what they share, lie on an edge of
    one of them: the edges of each are tried against the other.

    Args:
        one: A box.
        other: Another.
        ends: Work space, shape (2, 3).
    """
    least = np.inf
    for turn in range(2):
        a, b = (one, other) if turn == 0 else (other, one)
        for axis in range(3):
            for k in range(4):
                u = 1.0 if k & 1 else -1.0
                v = 1.0 if k & 2 else -1.0
                if axis == 0:
                    _corner(a, -1.0, u, v, ends[0])
                    _corner(a, 1.0, u, v, ends[1])
                elif axis == 1:
                    _corner(a, u, -1.0, v, ends[0])
                    _corner(a, u, 1.0, v, ends[1])
                else:
                    _corner(a, u, v, -1.0, ends[0])
                    _corner(a, u, v, 1.0, ends[1])
                least = min(least, segment_box_distance(ends[0], ends[1], b))
                if least == 0.0:
                    return 0.0
    return least


@njit(cache=True, error_model="numpy")
def _moved(X: Array, box: Array, out: Array) -> None:
    """Writes a box of P as one of W; X is R_WP row by row (9) and p_WP (3)."""
    for i in range(3):
        for j in range(3):
            value = 0.0
            for k in range(3):
                value += X[3 * i + k] * box[3 * k + j]
            out[3 * i + j] = value
        out[9 + i] = X[9 + i]
        for k in range(3):
            out[9 + i] += X[3 * i + k] * box[9 + k]
        out[12 + i] = box[12 + i]


@njit(cache=True, nogil=True, error_model="numpy")
def many_clearances(
    first: int, past: int, positions: Array, rotations: Array, cables: Array, radius: Array,
    pairs: np.ndarray, bodies: Array, fixtures: Array, obstacles: Array, free: Array, out: Array,
) -> None:  # fmt: skip
    """Writes the clearances of many poses, for `kernel_calls.over_rows`.

    Args:
        first: First pose.
        past: One past the last.
        positions: p_WP, shape (k, 3) [m].
        rotations: R_WP, shape (k, 3, 3).
        cables: `CableSet.packed()`, shape (m, 17).
        radius: Radius of the cables, shape (m,) [m].
        pairs: Cables that are compared, shape (p, 2).
        bodies: Boxes of the platform, in P, shape (b, 15).
        fixtures: Boxes of the frame, in W, shape (f, 15).
        obstacles: Boxes in W, shape (o, 15).
        free: Lengths [m] next to the exit points that are not compared with fixtures, and next to
            the anchor points that are not compared with bodies, shape (2,).
        out: Gets cable-cable, cable-platform, cable-frame, cable-obstacle and platform-surroundings
            clearances, shape (k, 5) [m]: infinite where there is nothing to meet, NaN where a cable
            cannot run.
    """
    m = cables.shape[0]
    A, B, short = np.empty((m, 3)), np.empty((m, 3)), np.empty(3)
    D, squares = np.empty((m, 3)), np.empty(m)
    ends, moved, X = np.empty((2, 3)), np.empty((bodies.shape[0], 15)), np.empty(12)
    for pose in range(first, past):
        for i in range(3):
            for j in range(3):
                X[3 * i + j] = rotations[pose, i, j]
            X[9 + i] = positions[pose, i]
        motion = (X[0], X[1], X[2], X[3], X[4], X[5], X[6], X[7], X[8], X[9], X[10], X[11])
        runs = True
        for i in range(m):
            L, _, tx, ty, tz, _, _, _, rx, ry, rz = pulley_geometry(motion, cables[i])
            A[i, 0], A[i, 1], A[i, 2] = tx, ty, tz
            B[i, 0], B[i, 1], B[i, 2] = X[9] + rx, X[10] + ry, X[11] + rz
            runs = runs and np.isfinite(L)
        for k in range(PARTS):
            out[pose, k] = np.inf if runs else np.nan
        if not runs:
            continue
        for i in range(m):
            squares[i] = 0.0
            for j in range(3):
                D[i, j] = B[i, j] - A[i, j]
                squares[i] += D[i, j] * D[i, j]
        least = np.inf
        for k in range(pairs.shape[0]):
            i, j = pairs[k, 0], pairs[k, 1]
            square, both = _cables_square(A, D, squares, i, j), radius[i] + radius[j]
            if square < (least + both) ** 2:  # least + both > 0: least is no less than -both
                least = min(least, np.sqrt(square) - both)
        out[pose, 0] = least
        for b in range(bodies.shape[0]):
            _moved(X, bodies[b], moved[b])
        for i in range(m):
            length = np.sqrt(squares[i])
            if length > free[1]:
                for j in range(3):
                    short[j] = B[i, j] + (A[i, j] - B[i, j]) * free[1] / length
                for b in range(bodies.shape[0]):
                    gap = segment_box_distance(A[i], short, moved[b]) - radius[i]
                    out[pose, 1] = min(out[pose, 1], gap)
            if length > free[0]:
                for j in range(3):
                    short[j] = A[i, j] + (B[i, j] - A[i, j]) * free[0] / length
                for b in range(fixtures.shape[0]):
                    gap = segment_box_distance(short, B[i], fixtures[b]) - radius[i]
                    out[pose, 2] = min(out[pose, 2], gap)
            for b in range(obstacles.shape[0]):
                gap = segment_box_distance(A[i], B[i], obstacles[b]) - radius[i]
                out[pose, 3] = min(out[pose, 3], gap)
        least = np.inf
        for b in range(bodies.shape[0]):
            reach = np.sqrt(moved[b, 12] ** 2 + moved[b, 13] ** 2 + moved[b, 14] ** 2)
            for k in range(fixtures.shape[0] + obstacles.shape[0]):
                beam = k < fixtures.shape[0]
                other = fixtures[k] if beam else obstacles[k - fixtures.shape[0]]
                # Farther than another that was seen, whatever its corners do.
                if _point_box_distance(moved[b, 9:], other) - reach < least:
                    least = min(least, boxes_distance(moved[b], other, ends))
        out[pose, 4] = least
