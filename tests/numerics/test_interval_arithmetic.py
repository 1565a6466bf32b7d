"""Interval arithmetic: what numbers inside give is inside, and what has no width stays narrow."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.numerics.interval_arithmetic import Interval, cross, dot, matrix_product, total

SHAPE = (3, 4)

NARROW = 1e-13
"""Width of the result of a few operations on numbers of size ten or less."""


def boxes(random: np.random.Generator, width: float) -> tuple[Interval, np.ndarray]:
    """Intervals and numbers inside them, at their ends too."""
    low = random.uniform(-3.0, 3.0, SHAPE)
    high = low + width * random.random(SHAPE)
    share = random.choice([0.0, 0.3, 1.0], SHAPE)
    return Interval(low, high), np.clip(low + share * (high - low), low, high)


OPERATIONS = {
    "sum": (lambda a, b: a + b, lambda a, b: a + b),
    "difference": (lambda a, b: a - b, lambda a, b: a - b),
    "product": (lambda a, b: a * b, lambda a, b: a * b),
    "negative": (lambda a, b: -a, lambda a, b: -a),
    "twice": (lambda a, b: a.times(2.0), lambda a, b: 2.0 * a),
    "minus half": (lambda a, b: a.times(-0.5), lambda a, b: -0.5 * a),
    "total": (lambda a, b: total(a), lambda a, b: a.sum(axis=0)),
    "dot": (dot, lambda a, b: np.sum(a * b, axis=0)),
    "cross": (cross, lambda a, b: np.cross(a, b, axis=0)),
    "transposed": (lambda a, b: a.transposed(), lambda a, b: a.T),
    "matrix": (
        lambda a, b: matrix_product(np.arange(9.0).reshape(3, 3) - 4.0, b),
        lambda a, b: (np.arange(9.0).reshape(3, 3) - 4.0) @ b,
    ),
}


@given(st.sampled_from(list(OPERATIONS)), st.integers(0, 2**32 - 1))
def test_operations_hold_what_numbers_inside_give(name: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    (A, a), (B, b) = boxes(random, 2.0), boxes(random, 2.0)
    of_intervals, of_numbers = OPERATIONS[name]
    result, value = of_intervals(A, B), of_numbers(a, b)
    assert np.all(result.low <= value)
    assert np.all(value <= result.high)


@given(st.sampled_from(list(OPERATIONS)), st.integers(0, 2**32 - 1))
def test_what_has_no_width_stays_narrow(name: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    (A, _), (B, _) = boxes(random, 0.0), boxes(random, 0.0)
    result = OPERATIONS[name][0](A, B)
    assert np.max(result.high - result.low) < NARROW
