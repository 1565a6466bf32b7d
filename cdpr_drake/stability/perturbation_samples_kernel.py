"""Random perturbations within bounds, reproducible pose by pose.

The generator is splitmix64. Its state is a hash of the seed, the pose and the number of the draw,
so that a pose gets the same draws in whatever chunk, order or process it is judged. Directions take
an even height and an even longitude, since zones of a sphere of equal height have equal areas
(Archimedes).

Source: Steele, Lea and Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.stability.perturbation_bounds import DIRECTIONS, PerturbationBounds, vector_size

LANES = 8
"""Vectors are drawn in multiples of this, as many as a processor may take at a time."""

INDEPENDENT, COMMON, CORNERS, SINGLE = range(len(DIRECTIONS))
"""Codes of `DIRECTIONS`."""

_STEP = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_U30, _U27, _U31, _U32 = (np.uint64(n) for n in (30, 27, 31, 32))
_LOW = np.uint64(0xFFFFFFFF)
_SCALE = 2.0 / 4294967296.0


def direction_codes(bounds: PerturbationBounds) -> np.ndarray:
    """Codes of the directions of exit and anchor points, shape (2,)."""
    return np.array([DIRECTIONS.index(bounds.exits), DIRECTIONS.index(bounds.anchors)], np.int64)


def pose_bits(poses: Array) -> np.ndarray:
    """The numbers of poses, shape (N, 7), as whole numbers to hash, shape (N, 7)."""
    return np.ascontiguousarray(poses + 0.0).view(np.uint64)  # -0.0 is 0.0


@njit(cache=True, error_model="numpy")
def mixed(state: np.uint64) -> np.uint64:
    """Scrambles 64 bits."""
    z = state
    z = (z ^ (z >> _U30)) * _MIX_1
    z = (z ^ (z >> _U27)) * _MIX_2
    return z ^ (z >> _U31)


@njit(cache=True, error_model="numpy")
def pose_key(seed: int, bits: np.ndarray) -> np.uint64:
    """Key of a pose from a seed and the bits of its numbers, shape (7,)."""
    key = mixed(np.uint64(seed) + _STEP)
    for i in range(bits.shape[0]):
        key = mixed(key ^ (bits[i] + _STEP))
    return key


@njit(cache=True, error_model="numpy")
def draw_room(m: int) -> Array:
    """Work space of `draw_into` for m cables, shape (3, n)."""
    return np.empty((3, LANES * ((6 + 2 * m + LANES - 1) // LANES)))


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _unit_vectors(base: np.uint64, count: int, flat: float, X: Array, Y: Array, Z: Array) -> None:
    """X, Y, Z <- coordinates of `count` random unit vectors, shape (n,); flat: 0 for z = 0, else 1.

    Two numbers in (-1, 1) are the height and, times pi, the longitude, whose half has its sine from
    the series. Without branches and with plain indices, so that the compiler takes many at a time.
    """
    for i in range(count):
        z = mixed(base + np.uint64(i + 1) * _STEP)
        height = flat * ((float(np.int64(z & _LOW)) + 0.5) * _SCALE - 1.0)
        y = 0.5 * np.pi * ((float(np.int64(z >> _U32)) + 0.5) * _SCALE - 1.0)
        q = y * y
        s = -1.0 / 51090942171709440000.0  # 1 / 21!
        s = s * q + 1.0 / 121645100408832000.0
        s = s * q - 1.0 / 355687428096000.0
        s = s * q + 1.0 / 1307674368000.0
        s = s * q - 1.0 / 6227020800.0
        s = s * q + 1.0 / 39916800.0
        s = s * q - 1.0 / 362880.0
        s = s * q + 1.0 / 5040.0
        s = s * q - 1.0 / 120.0
        s = s * q + 1.0 / 6.0
        s = y - y * q * s
        root = np.sqrt(1.0 - height * height)
        X[i] = root * (1.0 - 2.0 * s * s)
        Y[i] = root * 2.0 * s * np.sqrt(1.0 - s * s)
        Z[i] = height


@njit(cache=True, error_model="numpy")
def _fill_balls(base: np.uint64, first: int, count: int, power: float, d: Array, at: int) -> None:
    """Shortens vectors from d[at] on, as long as their balls allow, to fill the balls evenly."""
    for i in range(count):
        z = mixed(mixed(base + np.uint64(first + i + 1) * _STEP) + _STEP)
        share = ((float(np.int64(z >> _U32)) + 0.5) * 0.5 * _SCALE) ** power
        for k in range(3):
            d[at + 3 * i + k] *= share


@njit(cache=True, error_model="numpy")
def _corners(
    base: np.uint64, m: int, planar: bool, inside: bool, radius: float, d: Array, at: int
) -> None:
    """d[at :] <- corners of cubes, or points inside."""
    for i in range(m):
        z = mixed(base + np.uint64(1000 + at + i) * _STEP)  # none of the numbers above
        for k in range(3):
            z = mixed(z + _STEP)
            x = (float(np.int64(z >> _U32)) + 0.5) * _SCALE - 1.0
            d[at + 3 * i + k] = radius * (x if inside else np.sign(x))
        if planar:
            d[at + 3 * i + 2] = 0.0


@shared(
    types.void(
        types.uint64, types.int64, VECTOR, types.int64[::1], types.boolean, types.boolean,
        types.int64, MATRIX, VECTOR,
    )
)  # fmt: skip
@njit(cache=True, error_model="numpy")
def draw_into(
    key: np.uint64,
    number: int,
    radii: Array,
    directions: np.ndarray,
    planar: bool,
    inside: bool,
    m: int,
    room: Array,
    d: Array,
) -> None:
    """d <- draw `number` of the pose with `key`.

    Args:
        key: Of `pose_key`.
        number: Which draw.
        radii: `PerturbationBounds.radii`, shape (8,).
        directions: `direction_codes`, shape (2,).
        planar: Whether shifts stay in the xy plane and rotations are about z.
        inside: Whether magnitudes fill the balls evenly instead of being full.
        m: Number of cables.
        room: Of `draw_room`.
        d: Output, shape (18 + 6 m,), laid out as in `perturbation_bounds`.
    """
    base = mixed(key ^ mixed(np.uint64(number) + _STEP))
    total = 6
    for part in range(2):
        if directions[part] != CORNERS:
            total += m if directions[part] == INDEPENDENT else 1
    total = LANES * ((total + LANES - 1) // LANES)
    _unit_vectors(base, total, 0.0 if planar else 1.0, room[0], room[1], room[2])
    power = 0.5 if planar else 1.0 / 3.0
    for i in range(6):
        turn = planar and i % 2 == 0
        if turn:
            room[2, i] = 1.0 if room[0, i] > 0.0 else -1.0
            room[0, i], room[1, i] = 0.0, 0.0
        for k in range(3):
            d[3 * i + k] = radii[i] * room[k, i]
        if inside:
            _fill_balls(base, i, as_number(1), 1.0 if turn else power, d, 3 * i)
    first = as_number(6)
    for part in range(2):
        at, radius = 18 + 3 * m * part, radii[6 + part]
        if directions[part] == CORNERS:
            _corners(base, m, planar, inside, radius, d, at)
            continue
        count = m if directions[part] == INDEPENDENT else 1
        for i in range(count):
            for k in range(3):
                d[at + 3 * i + k] = radius * room[k, first + i]
        if inside:
            _fill_balls(base, first, count, power, d, at)
        for i in range(count, m):
            for k in range(3):
                d[at + 3 * i + k] = d[at + k]
        if directions[part] == SINGLE:
            # None of the numbers above; others than those of the first are zero.
            z = mixed(base + np.uint64(2000 + at) * _STEP)
            which = int(z % np.uint64(m))
            for i in range(m):
                if i != which:
                    for k in range(3):
                        d[at + 3 * i + k] = 0.0
        first += count


def draw_perturbations(
    pose: Array,
    bounds: PerturbationBounds,
    m: int,
    draws: int,
    seed: int = 0,
    planar: bool = False,
    inside: bool = False,
) -> Array:
    """The draws that a pose is judged with, shape (draws, 18 + 6 m) [rad, m].

    Args:
        pose: Quaternion (w, x, y, z) and position [m], shape (7,).
        bounds: What limits them.
        m: Number of cables.
        draws: How many.
        seed: Start of the random numbers.
        planar: Whether shifts stay in the xy plane and rotations are about z.
        inside: Whether magnitudes fill the balls evenly; otherwise all are full.
    """
    d = np.empty((draws, vector_size(m)))
    bits = pose_bits(np.reshape(np.asarray(pose, float), (1, 7)))[0]
    _draw_all(seed, bits, bounds.radii(), direction_codes(bounds), planar, inside, m, d)
    return d


@njit(cache=True, error_model="numpy")
def _draw_all(
    seed: int,
    bits: np.ndarray,
    radii: Array,
    directions: np.ndarray,
    planar: bool,
    inside: bool,
    m: int,
    d: Array,
) -> None:
    key = pose_key(seed, bits)
    room = draw_room(m)
    for number in range(d.shape[0]):
        draw_into(key, number, radii, directions, planar, inside, m, room, d[number])
