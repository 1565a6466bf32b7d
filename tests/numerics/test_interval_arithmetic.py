"""Interval arithmetic: what numbers inside give is inside."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.numerics.interval_arithmetic import (
    Interval,
    cardinal_sine,
    left_inverse,
    product,
    rotation,
)

FLOATS = st.floats(-5.0, 5.0)

ROUNDING = 1e-15
"""What the numbers that are compared with were rounded by, relative to their size of about one."""

NARROW = 1e-12
"""A matrix without width of condition below 100: so wide its enclosed inverse may be."""


@st.composite
def inside(draw: st.DrawFn) -> tuple[Interval, np.ndarray]:
    ends = sorted([draw(FLOATS), draw(FLOATS)])
    share = draw(st.floats(0.0, 1.0))
    x = min(max(ends[0] + share * (ends[1] - ends[0]), ends[0]), ends[1])
    return Interval(np.array(ends[0]), np.array(ends[1])), np.array(x)


def holds(found: Interval, value: np.ndarray, slack: float = 0.0) -> bool:
    return bool(np.all((found.low <= value + slack) & (value - slack <= found.high)))


@settings(max_examples=60)
@given(inside(), inside())
def test_operations_hold_what_numbers_inside_give(
    first: tuple[Interval, np.ndarray], second: tuple[Interval, np.ndarray]
) -> None:
    (X, x), (Y, y) = first, second
    assert holds(X + Y, x + y)
    assert holds(X - Y, x - y)
    assert holds(X * Y, x * y)
    assert holds(X.square(), x * x)
    assert X.square().low >= 0.0
    assert holds(X.square().root(), np.abs(x), ROUNDING * 5.0)
    if abs(x) > 1e-3:
        assert holds(X.reciprocal(), 1.0 / x)
    assert holds(X.widened(0.1), x + 0.1)
    assert X.magnitude() >= abs(x)


def test_one_over_what_holds_zero_is_everything() -> None:
    found = Interval(np.array(-1.0), np.array(2.0)).reciprocal()
    assert found.low == -np.inf
    assert found.high == np.inf


@settings(max_examples=40)
@given(st.floats(0.0, np.pi), st.floats(0.0, np.pi))
def test_cardinal_sines_are_held(a: float, b: float) -> None:
    low, high = min(a, b), max(a, b)
    found = cardinal_sine(Interval(np.array(low), np.array(high)))
    for x in (low, high, 0.5 * (low + high)):
        assert holds(found, np.sinc(x / np.pi), ROUNDING)


@settings(max_examples=40)
@given(
    st.lists(st.floats(-0.6, 0.6), min_size=3, max_size=3),
    st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=3),
    st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
)
def test_rotations_of_a_box_are_held(
    middle: list[float], half: list[float], where: list[float]
) -> None:
    reach = np.abs(half)
    box = Interval(np.array(middle) - reach, np.array(middle) + reach)
    v = np.clip(np.array(middle) + reach * where, box.low, box.high)
    found = rotation(box, float(np.linalg.norm(np.abs(middle) + reach)))
    assert holds(found, rotation_from_vector(v).matrix(), ROUNDING)


def test_a_rotation_without_width_is_narrow() -> None:
    v = np.array([0.3, -0.2, 0.5])
    found = rotation(Interval.of(v), 1.0)
    assert np.max(found.high - found.low) < 1e-13


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_a_left_inverse_is_held_and_narrow(seed: int) -> None:
    random = np.random.default_rng(seed)
    J = np.vstack([np.eye(4), random.uniform(-1.0, 1.0, (3, 4))])
    found = left_inverse(Interval.of(J[:, :, None]))
    exact = np.linalg.pinv(J)[:, :, None]
    assert holds(found, exact, 1e-14)
    assert np.max(found.high - found.low) < NARROW


def test_a_left_inverse_of_what_has_not_full_rank_is_no_finite_bound() -> None:
    J = np.ones((4, 2, 1))
    found = left_inverse(Interval.of(J))
    assert not np.any(np.isfinite(found.low) & np.isfinite(found.high))


def test_products_of_matrices_hold_those_of_numbers() -> None:
    random = np.random.default_rng(3)
    A, B = random.normal(size=(3, 4, 5)), random.normal(size=(4, 2, 5))
    found = product(Interval.of(A), Interval.of(B))
    assert found.low == pytest.approx(np.einsum("ikn,kjn->ijn", A, B), abs=1e-14)
    assert np.all(found.low <= found.high)
