"""Straight cables eight at once: the bits of one after the other."""

import numpy as np
import pytest

from cdpr_drake.cables.straight_kernel import floating_force
from cdpr_drake.cables.straight_lanes_kernel import floating_lanes_force, put_columns

STATES = 200
"""Random states of each number of cables; with any of them about half the cables are slack."""


def forces(state, l0, l0_dot, cables):
    """One after the other, and eight at once."""
    columns = np.full((8, max(len(l0), 6)), np.nan)
    put_columns(cables, columns)
    each, together = np.zeros(6), np.zeros(6)
    floating_force(state, l0, l0_dot, cables, 0, each)
    floating_lanes_force(state, l0, l0_dot, columns, together)
    return each, together


def robot(rng, m):
    cables = rng.normal(size=(m, 17))
    cables[:, 6], cables[:, 7] = 1e5 * rng.random(m), rng.choice([0.0, 1e-3, 0.3])
    return rng.normal(size=13), rng.uniform(0.3, 4.0, m), rng.normal(size=m), cables


@pytest.mark.parametrize("m", [1, 3, 7, 8, 9, 12, 16, 17])
def test_the_force_has_the_same_bits(m):
    rng = np.random.default_rng(m)
    pulled = 0
    for _ in range(STATES):
        each, together = forces(*robot(rng, m))
        assert each.tobytes() == together.tobytes()
        pulled += each.any()
    assert pulled > STATES / 4


@pytest.mark.parametrize("where", ["length", "rate", "retardation", "exit point"])
def test_what_is_not_a_number_is_none_in_both(where):
    rng = np.random.default_rng(0)
    for _ in range(STATES):
        state, l0, l0_dot, cables = robot(rng, 8)
        place = {"length": l0, "rate": l0_dot, "retardation": cables[:, 7]}.get(where, cables[:, 0])
        place[rng.integers(8)] = np.nan if where != "exit point" else np.inf
        each, together = forces(state, l0, l0_dot, cables)
        np.testing.assert_array_equal(each, together)
