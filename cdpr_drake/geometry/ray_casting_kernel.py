"""Numba kernels that find the first surface on a ray.

A convex solid meets the line p + t d of a ray in one interval of t. Where the interval begins
ahead of the ray's origin, the ray meets the surface there; where it began behind, at its end: a ray
that starts inside meets the surface from inside. Quadratics are written by the distance of the line
from the centre, which loses no digits far away. Triangles are met from both sides.

Source: Ericson, Real-Time Collision Detection, 2005, 5.3; Moeller and Trumbore, 1997, for
triangles.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

BOX, SPHERE, CYLINDER, CAPSULE, ELLIPSOID, HALF_SPACE, MESH = range(7)
"""Kinds of shapes as the kernels number them."""

_EDGE = 1e-12
"""Share of a triangle's edge by which a ray may pass beside it, so that none slips between two."""


@njit(cache=True)
def _slab(p: float, d: float, half: float) -> tuple[float, float]:
    """Where -half <= p + t d <= half."""
    if d == 0.0:
        if abs(p) <= half:
            return -np.inf, np.inf
        return np.inf, -np.inf
    a, b = (-half - p) / d, (half - p) / d
    return min(a, b), max(a, b)


@njit(cache=True)
def _ball(
    px: float, py: float, pz: float, dx: float, dy: float, dz: float, r: float
) -> tuple[float, float]:  # fmt: skip
    """Where a line with a unit vector d is within r of the origin."""
    b = px * dx + py * dy + pz * dz
    x, y, z = px - b * dx, py - b * dy, pz - b * dz
    left = r * r - (x * x + y * y + z * z)
    if left < 0.0:
        return np.inf, -np.inf
    s = math.sqrt(left)
    return -b - s, -b + s


@njit(cache=True)
def _tube(px: float, py: float, dx: float, dy: float, r: float) -> tuple[float, float]:
    """Where a line is within r of the z axis."""
    a = dx * dx + dy * dy
    if a == 0.0:
        if px * px + py * py <= r * r:
            return -np.inf, np.inf
        return np.inf, -np.inf
    cross = px * dy - py * dx
    left = r * r - cross * cross / a
    if left < 0.0:
        return np.inf, -np.inf
    b, s = -(px * dx + py * dy) / a, math.sqrt(left / a)
    return b - s, b + s


@njit(cache=True)
def _interval(kind: int, size: Array, p: Array, d: Array) -> tuple[float, float]:
    """Where the line is inside a convex shape; the first is larger than the second: nowhere."""
    px, py, pz, dx, dy, dz = p[0], p[1], p[2], d[0], d[1], d[2]
    if kind == SPHERE:
        return _ball(px, py, pz, dx, dy, dz, size[0])
    if kind == BOX:
        a, b = _slab(px, dx, 0.5 * size[0])
        for i in range(1, 3):
            c, e = _slab(p[i], d[i], 0.5 * size[i])
            a, b = max(a, c), min(b, e)
        return a, b
    if kind == ELLIPSOID:
        ux, uy, uz = dx / size[0], dy / size[1], dz / size[2]
        scale = math.sqrt(ux * ux + uy * uy + uz * uz)
        a, b = _ball(
            px / size[0], py / size[1], pz / size[2], ux / scale, uy / scale, uz / scale, 1.0
        )
        return a / scale, b / scale
    if kind == HALF_SPACE:
        if dz == 0.0:
            return np.inf, -np.inf
        t = -pz / dz
        if dz < 0.0:
            return t, np.inf
        return -np.inf, t
    a, b = _tube(px, py, dx, dy, size[0])
    c, e = _slab(pz, dz, 0.5 * size[1])
    a, b = max(a, c), min(b, e)
    if kind == CAPSULE:
        if a > b:
            a, b = np.inf, -np.inf
        for sign in (-1.0, 1.0):
            c, e = _ball(px, py, pz - sign * 0.5 * size[1], dx, dy, dz, size[0])
            if c <= e:
                a, b = min(a, c), max(b, e)
    return a, b


@njit(cache=True)
def _block_is_missed(box: Array, p: Array, d: Array, nearest: float) -> bool:
    """Whether the ray misses an axis-aligned box (lower, upper), or meets it beyond `nearest`."""
    a, b = 0.0, nearest
    for i in range(3):
        middle, half = 0.5 * (box[i] + box[3 + i]), 0.5 * (box[3 + i] - box[i])
        # A little wider, so that a flat block is not missed by rounding.
        c, e = _slab(p[i] - middle, d[i], half + 1e-9 * (1.0 + abs(middle)))
        a, b = max(a, c), min(b, e)
    return a > b


@njit(cache=True)
def _triangle(v: Array, p: Array, d: Array) -> float:
    """Distance to a triangle (corner, edge, edge), from either side; infinite: it is missed."""
    ax, ay, az, bx, by, bz = v[3], v[4], v[5], v[6], v[7], v[8]
    hx, hy, hz = d[1] * bz - d[2] * by, d[2] * bx - d[0] * bz, d[0] * by - d[1] * bx
    det = ax * hx + ay * hy + az * hz
    if det == 0.0:
        return np.inf
    sx, sy, sz = p[0] - v[0], p[1] - v[1], p[2] - v[2]
    u = (sx * hx + sy * hy + sz * hz) / det
    if u < -_EDGE or u > 1.0 + _EDGE:
        return np.inf
    qx, qy, qz = sy * az - sz * ay, sz * ax - sx * az, sx * ay - sy * ax
    w = (d[0] * qx + d[1] * qy + d[2] * qz) / det
    if w < -_EDGE or u + w > 1.0 + _EDGE:
        return np.inf
    t = (bx * qx + by * qy + bz * qz) / det
    return t if t >= 0.0 else np.inf


@njit(cache=True)
def cast_rays(
    origins: Array, directions: Array, kinds: Array, sizes: Array, poses: Array, reach: Array,
    blocks: Array, boxes: Array, triangles: Array, block_size: int, ranges: Array, hits: Array,
) -> None:  # fmt: skip
    """Writes the distance to the first surface on each ray, infinite where there is none.

    Args:
        origins: In W, shape (k, 3) [m].
        directions: Unit vectors in W, shape (k, 3).
        kinds: Kind of each shape, shape (n,).
        sizes: Box: edges; sphere: radius; cylinder and capsule: radius, length of the straight
            part; ellipsoid: half axes; shape (n, 3) [m].
        poses: R_WG row by row and p_WG of the shapes' frames G, shape (n, 12) [m].
        reach: Radius round Go that holds all of a shape, shape (n,) [m].
        blocks: First block of triangles of each shape, and one number more, shape (n + 1,).
        boxes: Axis-aligned boxes of the blocks in G, lower and upper corner, shape (b, 6) [m].
        triangles: A corner and two edges in G, in blocks of `block_size`, of which what is left
            over is zero, shape (b block_size, 9) [m].
        block_size: Triangles of a block.
        ranges: Where distances are written, shape (k,) [m].
        hits: Where the number of the shape is written, -1 for none, shape (k,).
    """
    p, d = np.empty(3), np.empty(3)
    for k in range(origins.shape[0]):
        nearest, hit = np.inf, -1
        for n in range(kinds.shape[0]):
            X = poses[n]
            x, y, z = origins[k, 0] - X[9], origins[k, 1] - X[10], origins[k, 2] - X[11]
            dx, dy, dz = directions[k, 0], directions[k, 1], directions[k, 2]
            if reach[n] < np.inf:
                along = -(x * dx + y * dy + z * dz)
                away = x * x + y * y + z * z - along * along
                if along < -reach[n] or along - reach[n] > nearest or away > reach[n] ** 2:
                    continue
            for i in range(3):
                p[i] = X[i] * x + X[3 + i] * y + X[6 + i] * z
                d[i] = X[i] * dx + X[3 + i] * dy + X[6 + i] * dz
            t = np.inf
            if kinds[n] == MESH:
                for b in range(blocks[n], blocks[n + 1]):
                    if _block_is_missed(boxes[b], p, d, min(t, nearest)):
                        continue
                    for row in range(b * block_size, (b + 1) * block_size):
                        t = min(t, _triangle(triangles[row], p, d))
            else:
                begin, end = _interval(kinds[n], sizes[n], p, d)
                if begin <= end:
                    if begin >= 0.0:
                        t = begin
                    elif end >= 0.0:
                        t = end
            if t < nearest:
                nearest, hit = t, n
        ranges[k], hits[k] = nearest, hit
