"""Random perturbations within bounds, reproducible pose by pose.

The generator is splitmix64. Its state is a hash of the seed, the pose and the number of the draw,
so that a pose gets the same draws in whatever chunk, order or process it is judged.

Source: Steele, Lea and Flood, Fast splittable pseudorandom number generators, OOPSLA 2014;
Marsaglia, Choosing a point from the surface of a sphere, 1972.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.perturbation_bounds import DIRECTIONS, PerturbationBounds, vector_size

INDEPENDENT, COMMON, CORNERS = range(len(DIRECTIONS))
"""Codes of `DIRECTIONS`."""

_STEP = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_U30, _U27, _U31, _U32 = (np.uint64(n) for n in (30, 27, 31, 32))
_LOW = np.uint64(0xFFFFFFFF)


def direction_codes(bounds: PerturbationBounds) -> np.ndarray:
    """Codes of the directions of exit and anchor points, shape (2,)."""
    return np.array([DIRECTIONS.index(bounds.exits), DIRECTIONS.index(bounds.anchors)], np.int64)


def pose_bits(poses: Array) -> np.ndarray:
    """The numbers of poses, shape (N, 7), as whole numbers to hash, shape (N, 7)."""
    return np.ascontiguousarray(poses + 0.0).view(np.uint64)  # -0.0 is 0.0


@njit(cache=True)
def mixed(state: np.uint64) -> np.uint64:
    """Scrambles 64 bits."""
    z = state
    z = (z ^ (z >> _U30)) * _MIX_1
    z = (z ^ (z >> _U27)) * _MIX_2
    return z ^ (z >> _U31)


@njit(cache=True)
def pose_key(seed: int, bits: np.ndarray) -> np.uint64:
    """Key of a pose from a seed and the bits of its numbers, shape (7,)."""
    key = mixed(np.uint64(seed) + _STEP)
    for i in range(bits.shape[0]):
        key = mixed(key ^ (bits[i] + _STEP))
    return key


@njit(cache=True)
def _pair(state: np.uint64) -> tuple[float, float]:
    """Two numbers in (-1, 1)."""
    z = mixed(state)
    scale = 2.0 / 4294967296.0
    low, high = np.int64(z & _LOW), np.int64(z >> _U32)
    return (float(low) + 0.5) * scale - 1.0, (float(high) + 0.5) * scale - 1.0


@njit(cache=True)
def _direction(
    state: np.uint64, planar: bool, turn: bool, inside: bool, radius: float, d: Array, at: int
) -> np.uint64:
    """d[at : at + 3] <- a random vector of a ball; returns the next state."""
    if radius == 0.0:
        d[at], d[at + 1], d[at + 2] = 0.0, 0.0, 0.0
        return state
    length, power = radius, 1.0 / 3.0
    if planar and turn:
        state += _STEP
        x, _ = _pair(state)
        d[at], d[at + 1], d[at + 2] = 0.0, 0.0, radius * (x if inside else np.sign(x))
        return state
    s, x, y = 2.0, 0.0, 0.0
    while s >= 1.0 or s == 0.0:
        state += _STEP
        x, y = _pair(state)
        s = x * x + y * y
    if inside:
        state += _STEP
        u, _ = _pair(state)
        if planar:
            power = 0.5
        length *= (0.5 + 0.5 * u) ** power
    if planar:
        d[at], d[at + 1], d[at + 2] = length * (x * x - y * y) / s, length * 2.0 * x * y / s, 0.0
    else:
        root = 2.0 * np.sqrt(1.0 - s)
        d[at], d[at + 1] = length * x * root, length * y * root
        d[at + 2] = length * (1.0 - 2.0 * s)
    return state


@njit(cache=True)
def _corner(
    state: np.uint64, planar: bool, inside: bool, radius: float, d: Array, at: int
) -> np.uint64:
    state += _STEP
    x, y = _pair(state)
    state += _STEP
    z, _ = _pair(state)
    if not inside:
        x, y, z = np.sign(x), np.sign(y), np.sign(z)
    d[at], d[at + 1], d[at + 2] = radius * x, radius * y, 0.0 if planar else radius * z
    return state


@njit(cache=True)
def draw_into(
    key: np.uint64,
    number: int,
    radii: Array,
    directions: np.ndarray,
    planar: bool,
    inside: bool,
    m: int,
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
        d: Output, shape (18 + 6 m,), laid out as in `cdpr_drake.perturbation_bounds`.
    """
    state = mixed(key ^ mixed(np.uint64(number) + _STEP))
    for block in range(6):
        state = _direction(state, planar, block % 2 == 0, inside, radii[block], d, 3 * block)
    for part in range(2):
        at, radius = 18 + 3 * m * part, radii[6 + part]
        for i in range(m):
            here = at + 3 * i
            if directions[part] == CORNERS:
                state = _corner(state, planar, inside, radius, d, here)
            elif directions[part] == INDEPENDENT or i == 0:
                state = _direction(state, planar, False, inside, radius, d, here)
            else:
                d[here], d[here + 1], d[here + 2] = d[at], d[at + 1], d[at + 2]


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


@njit(cache=True)
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
    for number in range(d.shape[0]):
        draw_into(key, number, radii, directions, planar, inside, m, d[number])
