"""Numba kernel of standard normal numbers: those of numpy's generator of a seed and a number.

To make a generator in Python takes longer than to draw what one image needs. Bits, and order, are
those of `np.random.default_rng([seed, number]).standard_normal`, whose streams NumPy keeps.

Source: O'Neill, PCG, HMC-CS-2014-0905; Marsaglia and Tsang, The ziggurat method, J. Stat. Softw. 5,
2000; NumPy, random/bit_generator.pyx, random/src/distributions.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numba.np.random._constants import (
    fi_double,
    ki_double,
    wi_double,
    ziggurat_nor_inv_r,
    ziggurat_nor_r,
)

from cdpr_drake.arrays import Array

_POOL = 4
_U32, _U64 = np.uint32, np.uint64
_MULTIPLIER_HIGH, _MULTIPLIER_LOW = _U64(0x2360ED051FC65DA4), _U64(0x4385DF649FCCF645)
_LOW_HALF, _HALF, _ONE = _U64(0xFFFFFFFF), _U64(32), _U64(1)
_TO_UNIT = 1.0 / 9007199254740992.0


def seed_words(seed: int) -> np.ndarray:
    """A seed as numpy's SeedSequence takes it, 32 bits a number, and room for an image's number."""
    words = [seed & 0xFFFFFFFF]
    while seed >> 32:
        seed >>= 32
        words.append(seed & 0xFFFFFFFF)
    return np.array([*words, 0], dtype=np.int64)


@njit(cache=True)
def _mixed_in(value: Any, constant: Any, multiplier: Any) -> Any:
    """A hashed number and the next constant."""
    value = _U32(value ^ constant)
    constant = _U32(constant * multiplier)
    value = _U32(value * constant)
    return _U32(value ^ (value >> _U32(16))), constant


@njit(cache=True)
def _mixed(x: Any, y: Any) -> Any:
    value = _U32(_U32(_U32(0xCA01F9DD) * x) - _U32(_U32(0x4973F715) * y))
    return _U32(value ^ (value >> _U32(16)))


@njit(cache=True)
def _seeded(words: np.ndarray, out: np.ndarray) -> None:
    """out, shape (4,) uint64 <- SeedSequence(words).generate_state(4, uint64)."""
    pool, constant, rise = np.empty(_POOL, _U32), _U32(0x43B0D7E5), _U32(0x931E8875)
    for k in range(_POOL):
        word = _U32(words[k]) if k < words.shape[0] else _U32(0)
        pool[k], constant = _mixed_in(word, constant, rise)
    for source in range(_POOL):
        for target in range(_POOL):
            if source != target:
                value, constant = _mixed_in(pool[source], constant, rise)
                pool[target] = _mixed(pool[target], value)
    for source in range(_POOL, words.shape[0]):
        for target in range(_POOL):
            value, constant = _mixed_in(_U32(words[source]), constant, rise)
            pool[target] = _mixed(pool[target], value)
    constant, rise = _U32(0x8B51F9DD), _U32(0x58F38DED)
    for k in range(4):
        low, constant = _mixed_in(pool[(2 * k) % _POOL], constant, rise)
        high, constant = _mixed_in(pool[(2 * k + 1) % _POOL], constant, rise)
        out[k] = _U64(low) | (_U64(high) << _HALF)


@njit(cache=True)
def _step(state: np.ndarray) -> None:
    """The next state of 128 bits: high, low; then the increment, high, low."""
    a, b = state[1] & _LOW_HALF, state[1] >> _HALF
    c, d = _MULTIPLIER_LOW & _LOW_HALF, _MULTIPLIER_LOW >> _HALF
    cross = (a * c >> _HALF) + (b * c & _LOW_HALF) + (a * d & _LOW_HALF)
    carried = b * d + (b * c >> _HALF) + (a * d >> _HALF) + (cross >> _HALF)
    high = carried + state[0] * _MULTIPLIER_LOW + state[1] * _MULTIPLIER_HIGH
    low = state[1] * _MULTIPLIER_LOW + state[3]
    over = _ONE if low < state[3] else _U64(0)
    state[0], state[1] = high + state[2] + over, low


@njit(cache=True)
def _next_bits(state: np.ndarray) -> Any:
    _step(state)
    value, turn = state[0] ^ state[1], state[0] >> _U64(58)
    return (value >> turn) | (value << ((_U64(64) - turn) & _U64(63)))


@njit(cache=True)
def _next_unit(state: np.ndarray) -> float:
    return float((_next_bits(state) >> _U64(11)) * _TO_UNIT)


@njit(cache=True)
def _normal(state: np.ndarray) -> float:
    """One standard normal number."""
    while True:
        bits = _next_bits(state)
        layer = int(bits & _U64(0xFF))
        bits >>= _U64(8)
        places = (bits >> _ONE) & _U64(0x000FFFFFFFFFFFFF)
        x = places * wi_double[layer]
        if bits & _ONE:
            x = -x
        if places < ki_double[layer]:
            return x
        if layer == 0:
            while True:
                beyond = -ziggurat_nor_inv_r * math.log1p(-_next_unit(state))
                y = -math.log1p(-_next_unit(state))
                if y + y > beyond * beyond:
                    far = ziggurat_nor_r + beyond
                    return -far if (places >> _U64(8)) & _ONE else far
        share = (fi_double[layer - 1] - fi_double[layer]) * _next_unit(state) + fi_double[layer]
        if share < math.exp(-0.5 * x * x):
            return x


@njit(cache=True)
def standard_normals(words: np.ndarray, number: int, out: Array) -> None:
    """Fills out with `np.random.default_rng([seed, number]).standard_normal(len(out))`.

    Args:
        words: `seed_words` of the seed; its last number is overwritten.
        number: Number of the stream, below 2^32.
        out: Shape (n,).
    """
    words[words.shape[0] - 1] = number
    seeded, state = np.empty(4, _U64), np.zeros(4, _U64)
    _seeded(words, seeded)
    state[2] = (seeded[2] << _ONE) | (seeded[3] >> _U64(63))
    state[3] = (seeded[3] << _ONE) | _ONE
    _step(state)
    low = state[1] + seeded[1]
    over = _ONE if low < seeded[1] else _U64(0)
    state[0], state[1] = state[0] + seeded[0] + over, low
    _step(state)
    for k in range(out.shape[0]):
        out[k] = _normal(state)
