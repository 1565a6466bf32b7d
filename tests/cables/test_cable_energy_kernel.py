"""The energy of one cable: its slope is the pull, and it grows by the work of the winch."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drake.cables.dispatch_kernel import cable_energy, cable_response
from cdpr_drake.cables.response_kernel import DERIVATIVES
from cdpr_drake.geometry.pulley_kernel import (
    CABLE_SET_COLUMNS,
    LINEAR_WEIGHT,
    PULLEY_RADIUS,
    SWIVEL_AXIS,
)

STEP = 1e-5
SLOPE = 1e-6
"""Central differences of energies, relative to the largest pull."""

FEW = settings(max_examples=30, deadline=None)


def cable(radius, weight, axis=1.0):
    """A row as `CableSet.packed` has it, without a pulley at the platform."""
    row = np.zeros(CABLE_SET_COLUMNS)
    row[:3], row[6] = (0.3, -0.2, 3.0), 1e4
    row[PULLEY_RADIUS], row[LINEAR_WEIGHT], row[SWIVEL_AXIS + 2] = radius, weight, axis
    return row


def energy_and_pull(sags, row, p, l0):
    X = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, *p)
    solved, D = np.zeros(2), np.zeros((DERIVATIVES, 4))
    response = cable_response(sags, X, row, l0, solved, np.empty((6, 3)), D)
    assert response[-1]
    return cable_energy(sags, X, row, l0, solved), np.array(response[:3])


@FEW
@given(
    st.booleans(),
    st.sampled_from([(0.0, 1.0), (0.075, 1.0), (0.1, -1.0)]),
    st.floats(0.5, 2.5),
    st.floats(-3.0, 3.0),
    st.floats(-2.0, 2.0),
    st.one_of(st.floats(-0.02, -1e-3), st.floats(1e-3, 0.3)),
)
def test_slope_is_the_pull(sags, pulley, x, y, z, extra):
    row = cable(pulley[0], 2.0 if sags else 0.0, pulley[1])
    p = np.array([0.3 + x, y, 3.0 + z])
    l0 = (1.0 + extra) * np.linalg.norm(p - row[:3]) + np.pi * pulley[0] * (extra > 0.0)
    _, pull = energy_and_pull(sags, row, p, l0)
    slopes = [
        (
            energy_and_pull(sags, row, p + STEP * d, l0)[0]
            - energy_and_pull(sags, row, p - STEP * d, l0)[0]
        )
        / (2.0 * STEP)
        for d in np.eye(3)
    ]
    np.testing.assert_allclose(slopes, pull, atol=SLOPE * max(1.0, np.linalg.norm(pull)))


def test_a_slack_straight_cable_has_none():
    assert energy_and_pull(False, cable(0.0, 2.0), [0.3, -0.2, 2.0], 1.5)[0] == 0.0


def test_a_vertical_cable_in_closed_form():
    """Stretch of its own weight, hung free but for its end's height."""
    l0, w, ES, depth = 2.0, 2.0, 1e4, 2.01
    s = (np.arange(20000) + 0.5) / 20000 * l0
    T_A = ES * (depth / l0 - 1.0) + 0.5 * w * l0
    tension = T_A - w * s
    height = -(s + (T_A * s - 0.5 * w * s**2) / ES)
    expected = np.mean(tension**2 / (2.0 * ES) + w * height) * l0
    found, pull = energy_and_pull(True, cable(0.0, w), [0.3, -0.2, 3.0 - depth], l0)
    assert found == pytest.approx(expected, rel=1e-6)
    assert pull[2] == pytest.approx(-(T_A - w * l0), rel=1e-6)
