"""Signed distance of two convex hulls of points, as a numba kernel that allocates nothing.

Hulls are those of the rows of P, shape (k, 3), and of Q, shape (l, 3). Their difference {p - q} is
the hull of all w = P_i - Q_j. Hulls that are apart: the point of the difference nearest to the
origin, on simplices whose corners are its farthest points the other way (Gilbert, Johnson and
Keerthi). Hulls that touch or overlap: the hull of some w grows where its facet is nearest to the
origin, until that is a facet of the difference. The distance is then less than 0: how far one must
be moved until the other lets go of it.

Source: Gilbert, Johnson and Keerthi, A fast procedure for computing the distance between complex
objects in three-dimensional space, 1988; van den Bergen, Proximity queries and penetration depth
computation on 3D game objects, 2001.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

COLUMNS = 7
"""Numbers in a row of the work space."""

MOST_CORNERS = 1024
"""Corners of the difference that a depth is found with, at most."""

CONTACT = 1e-10
"""Share of the size below which a distance is found as a depth, whose normal has more digits."""

FLAT = 1e-13
"""Share of the size below which the difference has no thickness, and a corner is not a new one."""

SAME_PLANE = 1e-12
"""Less than 1 by so much is the product of the normals of two facets in one plane."""

SETTLED = 1e-15
"""Share of a squared distance by which a next corner must come nearer."""

ROUNDS = 256
"""Simplices that are tried, at most; a dozen is usual."""

_P, _Q, _WEIGHT = 3, 4, 5  # after w: number in P, number in Q, share of it in the nearest point


def convex_work(k: int, l: int) -> Array:  # noqa: E741
    """The work space of `convex_distance` for up to k points and up to l points.

    Four rows are a simplex, then come v corners, 2 v facets and 3 v edges.
    """
    return np.empty((4 + 6 * (min(k * l, MOST_CORNERS) + 4), COLUMNS))


@njit(cache=True, error_model="numpy")
def convex_distance(P: Array, Q: Array, p: Array, q: Array, n: Array, work: Array) -> float:
    """Signed distance of the hulls of P and Q [m], 0 where they touch, below 0 where they overlap.

    p - q = distance n, and no plane normal to another n keeps them so far apart. Rounding is some
    1e-15 of the coordinates. Of hulls that overlap in more than `MOST_CORNERS` corners of their
    difference the depth may be found too large, never too small.

    Args:
        P: Points, shape (k, 3) [m], k > 0.
        Q: Points, shape (l, 3) [m], l > 0.
        p: Gets a nearest point of P's hull, or the deepest one, shape (3,) [m].
        q: Gets that of Q's hull, shape (3,) [m].
        n: Gets the unit normal from Q to P, shape (3,).
        work: Of `convex_work`.
    """
    size, count = 0.0, 1
    for a in range(3):
        low, high = P[0, a] - Q[0, a], P[0, a] - Q[0, a]
        least, most = Q[0, a], Q[0, a]
        for j in range(Q.shape[0]):
            least, most = min(least, Q[j, a]), max(most, Q[j, a])
        for i in range(P.shape[0]):
            low, high = min(low, P[i, a] - most), max(high, P[i, a] - least)
        size += max(abs(low), abs(high))
    if size == 0.0:
        p[:], q[:], n[:] = P[0], Q[0], 0.0
        n[2] = 1.0
        return 0.0
    for a in range(3):
        n[a] = -(P[0, a] - Q[0, a])
    _extreme(P, Q, n, work, 0)
    work[0, _WEIGHT] = 1.0
    square = _square(work[0])
    for a in range(3):
        p[a] = work[0, a]
    for _ in range(ROUNDS):
        if square <= (CONTACT * size) ** 2:
            break
        for a in range(3):
            n[a] = -p[a]
        _extreme(P, Q, n, work, count)
        nearer = square
        known = False
        for i in range(count):
            known = known or (
                work[i, _P] == work[count, _P] and work[i, _Q] == work[count, _Q]
            )  # fmt: skip
        for a in range(3):
            nearer -= p[a] * work[count, a]
        if known or nearer <= SETTLED * square:
            break
        for i in range(4):
            for a in range(COLUMNS):
                work[4 + i, a] = work[i, a]
        count = _nearest(work, count + 1, q)
        now = q[0] * q[0] + q[1] * q[1] + q[2] * q[2]
        if not now < square:  # no more digits: that before was as near
            for i in range(4):
                for a in range(COLUMNS):
                    work[i, a] = work[4 + i, a]
            count = _used(work)
            break
        square = now
        for a in range(3):
            p[a] = q[a]
    if square > (CONTACT * size) ** 2:
        distance = np.sqrt(square)
        for a in range(3):
            n[a] = p[a] / distance
        _witnesses(P, Q, work, count, p, q)
        return distance
    return _depth(P, Q, size, p, q, n, work)


@njit(cache=True, error_model="numpy")
def _used(work: Array) -> int:
    """Corners of the simplex with a share above 0; they come first."""
    count = 0
    for i in range(4):
        if count == i and work[i, _WEIGHT] > 0.0:
            count += 1
    return count


@njit(cache=True, error_model="numpy")
def _square(w: Array) -> float:
    return w[0] * w[0] + w[1] * w[1] + w[2] * w[2]


@njit(cache=True, error_model="numpy")
def _extreme(P: Array, Q: Array, d: Array, work: Array, row: int) -> float:
    """Writes the corner of the difference farthest along d into a row; how far it is, times |d|."""
    i_most, j_most, most, least = 0, 0, -np.inf, np.inf
    for i in range(P.shape[0]):
        x = d[0] * P[i, 0] + d[1] * P[i, 1] + d[2] * P[i, 2]
        if x > most:
            i_most, most = i, x
    for j in range(Q.shape[0]):
        x = d[0] * Q[j, 0] + d[1] * Q[j, 1] + d[2] * Q[j, 2]
        if x < least:
            j_most, least = j, x
    for a in range(3):
        work[row, a] = P[i_most, a] - Q[j_most, a]
    work[row, _P], work[row, _Q], work[row, _WEIGHT] = i_most, j_most, 0.0
    return d[0] * work[row, 0] + d[1] * work[row, 1] + d[2] * work[row, 2]


@njit(cache=True, error_model="numpy")
def _witnesses(P: Array, Q: Array, work: Array, count: int, p: Array, q: Array) -> None:
    """Writes the points of P and Q that the shares of the first corners stand for."""
    p[:], q[:] = 0.0, 0.0
    for i in range(count):
        share, one, other = work[i, _WEIGHT], int(work[i, _P]), int(work[i, _Q])
        for a in range(3):
            p[a] += share * P[one, a]
            q[a] += share * Q[other, a]


@njit(cache=True, error_model="numpy")
def _on_segment(work: Array, i: int, j: int) -> tuple[float, float]:
    """Share of corner j in the point of a segment nearest to the origin, and its square."""
    along = length = 0.0
    for a in range(3):
        d = work[j, a] - work[i, a]
        along -= work[i, a] * d
        length += d * d
    share = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    square = 0.0
    for a in range(3):
        square += (work[i, a] + share * (work[j, a] - work[i, a])) ** 2
    return share, square


@njit(cache=True, error_model="numpy")
def _on_triangle(work: Array, i: int, j: int, k: int) -> tuple[float, float, float]:
    """Shares of the corners j and k in the nearest point, if it is within, and its square; else
    infinite."""
    x0, x1, x2 = work[i, 0], work[i, 1], work[i, 2]
    b0, b1, b2 = work[j, 0] - x0, work[j, 1] - x1, work[j, 2] - x2
    c0, c1, c2 = work[k, 0] - x0, work[k, 1] - x1, work[k, 2] - x2
    m0, m1, m2 = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
    whole = m0 * m0 + m1 * m1 + m2 * m2
    if whole == 0.0:
        return 0.0, 0.0, np.inf
    # (-x) = s b + t c + off m
    s = -(m0 * (x1 * c2 - x2 * c1) + m1 * (x2 * c0 - x0 * c2) + m2 * (x0 * c1 - x1 * c0)) / whole
    t = -(m0 * (b1 * x2 - b2 * x1) + m1 * (b2 * x0 - b0 * x2) + m2 * (b0 * x1 - b1 * x0)) / whole
    if not (s >= 0.0 and t >= 0.0 and s + t <= 1.0):
        return 0.0, 0.0, np.inf
    y0, y1, y2 = x0 + s * b0 + t * c0, x1 + s * b1 + t * c1, x2 + s * b2 + t * c2
    return s, t, y0 * y0 + y1 * y1 + y2 * y2


@njit(cache=True, error_model="numpy")
def _side(work: Array, i: int, j: int, k: int, other: int) -> float:
    """Below 0: the origin and another corner lie on two sides of a facet; 0: no volume."""
    b0, b1, b2 = work[j, 0] - work[i, 0], work[j, 1] - work[i, 1], work[j, 2] - work[i, 2]
    c0, c1, c2 = work[k, 0] - work[i, 0], work[k, 1] - work[i, 1], work[k, 2] - work[i, 2]
    m0, m1, m2 = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
    origin = -(m0 * work[i, 0] + m1 * work[i, 1] + m2 * work[i, 2])
    inner = (
        m0 * (work[other, 0] - work[i, 0])
        + m1 * (work[other, 1] - work[i, 1])
        + m2 * (work[other, 2] - work[i, 2])
    )
    return origin * np.sign(inner)


@njit(cache=True, error_model="numpy")
def _nearest(work: Array, count: int, v: Array) -> int:
    """Writes the point of a simplex nearest to the origin and its shares; corners without one go.

    Returns:
        How many corners are left.
    """
    best = np.inf
    one, two, three, s, t = 0, 0, 0, 0.0, 0.0
    whole = count == 4
    for skipped in range(count if count == 4 else 1):
        if count < 4:
            i, j, k = 0, 1, 2
        else:
            i, j, k = (skipped + 1) % 4, (skipped + 2) % 4, (skipped + 3) % 4
            if _side(work, i, j, k, skipped) > 0.0:
                continue
            whole = False
        if count > 2:
            x, y, square = _on_triangle(work, i, j, k)
            if square < best:
                best, one, two, three, s, t = square, i, j, k, x, y
        for edge in range(3 if count > 2 else 1):
            a = i if edge < 2 else j
            b = k if edge > 0 else j
            x, square = _on_segment(work, a, b)
            if square < best:
                best, one, two, three, s, t = square, a, b, a, x, 0.0
    if whole:
        v[:] = 0.0
        return 4
    shares = (1.0 - s - t, s, t)
    left = 0
    for number in range(3):  # kept in rows behind the simplex, then moved to its front
        if shares[number] > 0.0:
            row = one if number == 0 else (two if number == 1 else three)
            for a in range(_WEIGHT):
                work[8 + left, a] = work[row, a]
            work[8 + left, _WEIGHT] = shares[number]
            left += 1
    v[:] = 0.0
    for i in range(4):
        for a in range(_WEIGHT + 1):
            work[i, a] = work[8 + i, a] if i < left else 0.0
        if i < left:
            for a in range(3):
                v[a] += work[i, _WEIGHT] * work[i, a]
    return left


@njit(cache=True, error_model="numpy")
def _add_facet(work: Array, first: int, row: int, i: int, j: int, k: int, inner: Array) -> bool:
    """Writes a facet with the corners i, j, k and its normal; False: that points to an inner point.

    One without a normal is never the nearest, and goes with the next corner that is taken in.
    """
    x, y, z = first + i, first + j, first + k
    b0, b1, b2 = work[y, 0] - work[x, 0], work[y, 1] - work[x, 1], work[y, 2] - work[x, 2]
    c0, c1, c2 = work[z, 0] - work[x, 0], work[z, 1] - work[x, 1], work[z, 2] - work[x, 2]
    m0, m1, m2 = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
    size = np.sqrt(m0 * m0 + m1 * m1 + m2 * m2)
    above = 0.0
    work[row, 0], work[row, 1], work[row, 2] = i, j, k
    work[row, 3], work[row, 4], work[row, 5], work[row, 6] = 0.0, 0.0, 0.0, np.inf
    if size > 0.0:
        work[row, 3], work[row, 4], work[row, 5] = m0 / size, m1 / size, m2 / size
        work[row, 6] = (m0 * work[x, 0] + m1 * work[x, 1] + m2 * work[x, 2]) / size
        above = m0 * (inner[0] - work[x, 0]) + m1 * (inner[1] - work[x, 1])
        above += m2 * (inner[2] - work[x, 2])
    if above >= 0.0:
        work[row, 6] = np.inf
    return above < 0.0


@njit(cache=True, error_model="numpy")
def _normal_to(work: Array, first: int, corners: int, turn: int, d: Array) -> None:
    """Writes a direction in which the hull of some corners has no extent yet."""
    d[:] = 0.0
    if corners == 1:
        d[turn] = 1.0
        return
    b0 = work[first + 1, 0] - work[first, 0]
    b1 = work[first + 1, 1] - work[first, 1]
    b2 = work[first + 1, 2] - work[first, 2]
    if corners == 2:
        size = np.sqrt(b0 * b0 + b1 * b1 + b2 * b2)
        b0, b1, b2 = b0 / size, b1 / size, b2 / size
        small = 0
        if abs(b1) < abs(b0):
            small = 1
        if abs(b2) < min(abs(b0), abs(b1)):
            small = 2
        d[small] = 1.0
        e0, e1, e2 = d[0], d[1], d[2]
        d[0], d[1], d[2] = b1 * e2 - b2 * e1, b2 * e0 - b0 * e2, b0 * e1 - b1 * e0
        if turn == 1:
            x0, x1, x2 = d[0], d[1], d[2]
            d[0], d[1], d[2] = b1 * x2 - b2 * x1, b2 * x0 - b0 * x2, b0 * x1 - b1 * x0
    else:
        c0 = work[first + 2, 0] - work[first, 0]
        c1 = work[first + 2, 1] - work[first, 1]
        c2 = work[first + 2, 2] - work[first, 2]
        d[0], d[1], d[2] = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
    size = np.sqrt(_square(d))
    for a in range(3):
        d[a] /= size


@njit(cache=True, error_model="numpy")
def _first_corners(P: Array, Q: Array, size: float, d: Array, work: Array, first: int) -> int:
    """Writes up to four corners that span the difference; fewer where it is flat, then d is a
    normal of it."""
    d[0], d[1], d[2] = 1.0, 0.0, 0.0
    _extreme(P, Q, d, work, first)
    for corners in range(1, 4):
        farthest, best_turn, best_sign = FLAT * size, -1, 1.0
        for turn in range(4 - corners):
            for sign in (1.0, -1.0):
                _normal_to(work, first, corners, turn, d)
                start = 0.0
                for a in range(3):
                    d[a] *= sign
                    start += d[a] * work[first, a]
                far = _extreme(P, Q, d, work, first + corners) - start
                if far > farthest:
                    farthest, best_turn, best_sign = far, turn, sign
        _normal_to(work, first, corners, max(best_turn, 0), d)
        if best_turn < 0:
            return corners
        for a in range(3):
            d[a] *= best_sign
        _extreme(P, Q, d, work, first + corners)
    return 4


@njit(cache=True, error_model="numpy")
def _depth(P: Array, Q: Array, size: float, p: Array, q: Array, n: Array, work: Array) -> float:
    """As `convex_distance` of hulls that touch or overlap."""
    most = (work.shape[0] - 4) // 6
    first, facets, edges = 4, 4 + most, 4 + 3 * most
    corners = _first_corners(P, Q, size, n, work, first)
    if corners < 4:  # no thickness along n: nothing to move it out of
        _witnesses(P, Q, work, _used(work), p, q)
        return 0.0
    inner = p
    for a in range(3):
        inner[a] = 0.25 * (
            work[first, a] + work[first + 1, a] + work[first + 2, a] + work[first + 3, a]
        )
    for skipped in range(4):
        i, j, k = (skipped + 1) % 4, (skipped + 2) % 4, (skipped + 3) % 4
        if not _add_facet(work, first, facets + skipped, i, j, k, inner):
            _add_facet(work, first, facets + skipped, i, k, j, inner)
    count, nearest, depth = 4, facets, 0.0
    while True:
        depth = np.inf
        for row in range(facets, facets + count):
            if work[row, 6] < depth:
                depth, nearest = work[row, 6], row
        for a in range(3):
            n[a] = work[nearest, 3 + a]
        if corners == most:
            depth = _extreme(P, Q, n, work, 3)  # no plane is nearer than one that holds all
            break
        far = _extreme(P, Q, n, work, first + corners)
        if far <= depth + FLAT * size or _is_known(work, first, corners):
            break
        count = _grow(work, first, facets, edges, count, corners, FLAT * size, inner)
        corners += 1
    # The point of this plane nearest to the origin is in one of the facets that lie in the plane.
    best = -np.inf
    for row in range(facets, facets + count):
        along = n[0] * work[row, 3] + n[1] * work[row, 4] + n[2] * work[row, 5]
        if row == nearest or (along > 1.0 - SAME_PLANE and work[row, 6] <= depth + FLAT * size):
            least = _least_share(work, first, row, n, depth)
            if least > best:
                best, nearest = least, row
    for k in range(3):
        row = first + int(work[nearest, k])
        for a in range(_WEIGHT):
            work[k, a] = work[row, a]
    _shares_on(work, n, depth)
    _witnesses(P, Q, work, 3, p, q)
    for a in range(3):
        n[a] = -n[a]
    return -depth


@njit(cache=True, error_model="numpy")
def _is_known(work: Array, first: int, corner: int) -> bool:
    """Whether a corner is one of those before it."""
    for row in range(first, first + corner):
        if work[row, _P] == work[first + corner, _P] and work[row, _Q] == work[first + corner, _Q]:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _grow(
    work: Array, first: int, facets: int, edges: int, count: int, corner: int, slip: float,
    inner: Array,
) -> int:  # fmt: skip
    """Takes a corner into the hull; returns how many facets there are now."""
    w0, w1, w2 = work[first + corner, 0], work[first + corner, 1], work[first + corner, 2]
    sides, kept = 0, 0
    for row in range(facets, facets + count):
        height = work[row, 3] * w0 + work[row, 4] * w1 + work[row, 5] * w2 - work[row, 6]
        # Facets in one plane with the corner go, too: no facet of three points in line is left.
        if height > -slip or work[row, 6] == np.inf:
            for side in range(3):
                i, j = work[row, side], work[row, (side + 1) % 3]
                twin = -1
                for e in range(edges, edges + sides):
                    if work[e, 0] == j and work[e, 1] == i:
                        twin = e
                if twin >= 0:
                    sides -= 1
                    work[twin, 0], work[twin, 1] = work[edges + sides, 0], work[edges + sides, 1]
                else:
                    work[edges + sides, 0], work[edges + sides, 1] = i, j
                    sides += 1
        else:
            if facets + kept != row:
                for a in range(COLUMNS):
                    work[facets + kept, a] = work[row, a]
            kept += 1
    for e in range(edges, edges + sides):
        _add_facet(work, first, facets + kept, int(work[e, 0]), int(work[e, 1]), corner, inner)
        kept += 1
    return kept


@njit(cache=True, error_model="numpy")
def _area(work: Array, i: int, j: int, n: Array, depth: float) -> float:
    """Twice the area of the triangle of two corners and the point depth n, with its sign from n."""
    b0, b1, b2 = (
        work[i, 0] - depth * n[0], work[i, 1] - depth * n[1], work[i, 2] - depth * n[2]
    )  # fmt: skip
    c0, c1, c2 = (
        work[j, 0] - depth * n[0], work[j, 1] - depth * n[1], work[j, 2] - depth * n[2]
    )  # fmt: skip
    return n[0] * (b1 * c2 - b2 * c1) + n[1] * (b2 * c0 - b0 * c2) + n[2] * (b0 * c1 - b1 * c0)


@njit(cache=True, error_model="numpy")
def _least_share(work: Array, first: int, row: int, n: Array, depth: float) -> float:
    """The least of a facet's corners' shares in the point depth n; below 0: it is not within."""
    least, total = np.inf, 0.0
    for k in range(3):
        i, j = first + int(work[row, k]), first + int(work[row, (k + 1) % 3])
        area = _area(work, i, j, n, depth)
        least, total = min(least, area), total + area
    return least / total if total > 0.0 else -np.inf


@njit(cache=True, error_model="numpy")
def _shares_on(work: Array, n: Array, depth: float) -> None:
    """Writes shares of the first three corners in the point depth n of their plane."""
    total = 0.0
    for k in range(3):
        work[k, _WEIGHT] = max(_area(work, (k + 1) % 3, (k + 2) % 3, n, depth), 0.0)
        total += work[k, _WEIGHT]
    for k in range(3):
        work[k, _WEIGHT] = work[k, _WEIGHT] / total if total > 0.0 else 1.0 / 3.0
