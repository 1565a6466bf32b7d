"""Sagging cables over pulleys: the equations of a string on a wheel, checked on the solution."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from cdpr_drake.cables.catenary_kernel import free_part
from cdpr_drake.cables.hanging_kernel import SENSITIVITIES, sagging_cable, solve_catenary
from cdpr_drake.geometry.pulley_kernel import tangent

ES, W = 2.9e6, 2.18
INTEGRATION = 1e-6  # a slack string turns far for little force: 1e-11 of the solver grows

spans = st.floats(0.5, 10.0)
heights = st.floats(-5.0, 5.0)
radii = st.floats(0.01, 0.15)
signs = st.sampled_from([1.0, -1.0])
strains = st.one_of(st.floats(-0.1, -1e-5), st.floats(1e-5, 3e-3))


def straight_length(rho, z, r, sigma):
    free, sine, cosine = tangent(rho, sigma * z, r)
    return free + r * (np.pi - np.arctan2(sine, cosine))


@settings(max_examples=40, deadline=None)
@given(spans, heights, radii, signs, strains)
def test_string_on_the_wheel_and_off_it(rho, z, r, sigma, strain):
    """Integrates frictionless statics along the string from A, and ends at B with the force.

    Per unstrained length a: on the wheel dT/da = w dz/da, free d(T u)/da = (0, w); the string
    moves by (1 + T / ES) u.
    """
    assume(rho > 2.5 * r)
    l0 = straight_length(rho, z, r, sigma) / (1.0 + strain)
    H, V_A, good = solve_catenary(rho, z, r, sigma, l0, ES, W, 0.0, 0.0)
    assert good
    out = np.empty((SENSITIVITIES, 3))
    H, V_B, t_B, t_A, length, _ = sagging_cable(rho, z, r, sigma, l0, ES, W, H, V_A, out)
    alpha = np.arctan2(H, -sigma * V_A)

    def on_wheel(_, state):
        turned, T, _ = state
        rate = (1.0 + T / ES) / r
        # Height sigma r sin(pi - turned).
        return [rate, -W * sigma * r * np.cos(np.pi - turned) * rate, 1.0 + T / ES]

    def left(_, state):
        return state[0] - (np.pi - alpha)

    left.terminal = True
    options = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-12}
    wheel = solve_ivp(on_wheel, (0.0, l0), [0.0, t_A, 0.0], events=left, **options)
    _, T, way = wheel.y[:, -1]
    u = np.array([np.sin(alpha), -sigma * np.cos(alpha)])
    place = np.array([r * (1.0 + np.cos(alpha)), sigma * r * np.sin(alpha)])

    def free(_, state):
        T = np.hypot(state[2], state[3])
        return [*(state[2:4] / T * (1.0 + T / ES)), 0.0, W, 1.0 + T / ES]

    ended = solve_ivp(free, (wheel.t[-1], l0), [*place, *(T * u), way], **options).y[:, -1]
    np.testing.assert_allclose(ended[:2], (rho, z), atol=INTEGRATION)
    np.testing.assert_allclose(ended[2:4], (H, V_B), atol=INTEGRATION * (1.0 + t_B))
    np.testing.assert_allclose(np.hypot(*ended[2:4]), t_B, rtol=INTEGRATION)
    np.testing.assert_allclose(ended[4], length, atol=INTEGRATION)


@given(spans, heights, radii, signs)
def test_a_heavy_pull_leaves_the_pulley_where_a_straight_cable_does(rho, z, r, sigma):
    assume(rho > 2.5 * r)
    _, sine, cosine = tangent(rho, sigma * z, r)
    l0 = straight_length(rho, z, r, sigma) / 1.001
    H, V_A, _ = solve_catenary(rho, z, r, sigma, l0, ES, 1e-9, 0.0, 0.0)
    T = np.hypot(H, V_A)
    np.testing.assert_allclose((H / T, -sigma * V_A / T), (sine, cosine), atol=1e-9)
    np.testing.assert_allclose(T, ES * 1e-3, rtol=1e-9)


@given(spans, heights, st.floats(1.0, 2.0), st.floats(1e-3, 1e4))
def test_hanging_loops_of_any_weight_are_found(x, z, looseness, weight):
    s = looseness * np.hypot(x, z) + 1e-6
    H, V_A, good = solve_catenary(x, z, 0.0, 1.0, s, 1e8, weight, 0.0, 0.0)
    assert good
    np.testing.assert_allclose(free_part(H, V_A, s, 1e8, weight)[:2], (x, z), atol=1e-10)


def test_a_vertical_cable_hangs_by_its_weight():
    """Slack by a metre, straight down: both strands carry themselves."""
    H, V_A, good = solve_catenary(1e-9, -2.0, 0.0, 1.0, 3.0, 1e9, W, 0.0, 0.0)
    assert good
    np.testing.assert_allclose((V_A, V_A + W * 3.0), (-W * 2.5, W * 0.5), atol=1e-6)
    assert 0.0 < H < 1e-6


def test_what_cannot_be_solved_says_so():
    assert not solve_catenary(0.05, 0.0, 0.1, 1.0, 1.0, ES, W, 0.0, 0.0)[2]
