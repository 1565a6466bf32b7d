"""The elastic catenary against Irvine's profile as printed, bars, parabolas and integrals."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from cdpr_drake.cables.catenary_kernel import free_part, sag_of, stored_energy, stretched_length
from cdpr_drake.cables.hanging_kernel import SENSITIVITIES, equations, sagging_cable, solve_catenary
from cdpr_drake.geometry.pulley_kernel import tangent

STIFFNESS = 1e6
ES, W = 2.9e6, 2.18
ROUNDING = 1e-11  # asinh and root of numbers up to 1e4, subtracted in the printed formulas
INTEGRATION = 1e-6  # a slack string turns far for little force: 1e-11 of the solver grows

few = settings(max_examples=40, deadline=None)


def irvine(s, H, V_A, ES, w):
    """Place of the material point s, as printed: Irvine (1.25), (1.26), from the near end."""
    V = V_A + w * s
    x = H * s / ES + H / w * (np.arcsinh(V / H) - np.arcsinh(V_A / H))
    z = s / ES * (V_A + w * s / 2) + (np.hypot(H, V) - np.hypot(H, V_A)) / w
    return x, z


@few
@given(st.floats(1.0, 1e4), st.floats(-200.0, 200.0), st.floats(0.5, 20.0), st.floats(0.01, 20.0))
def test_ends_compliance_length_and_energy(H, V_A, s, w):
    """Against Irvine's profile, central differences and integrals along the cable."""
    x, z, xx, xz, zz, T_A, T_B, V, S, phi = free_part(H, V_A, s, STIFFNESS, w)
    expected = irvine(s, H, V_A, STIFFNESS, w)
    np.testing.assert_allclose((x, z), expected, atol=ROUNDING * H / w)
    np.testing.assert_allclose((T_A, T_B), np.hypot(H, [V_A, V_A + w * s]))
    np.testing.assert_allclose(V, V_A + w * s / 2, atol=1e-12)
    step, scale = 1e-6 * np.hypot(H, V_A), s / STIFFNESS + s / max(H, 1.0)
    for (a, b), exact in (((step, 0.0), (xx, xz)), ((0.0, step), (xz, zz))):
        ends = [np.array(free_part(H + k * a, V_A + k * b, s, STIFFNESS, w)[:2]) for k in (1, -1)]
        np.testing.assert_allclose((ends[0] - ends[1]) / (2 * step), exact, atol=1e-4 * scale)
    assert xx * zz > xz * xz

    def tension(a):
        return np.hypot(H, V_A + w * a)

    stretch = quad(tension, 0.0, s, points=[np.clip(-V_A / w, 0.0, s)])[0] / STIFFNESS
    np.testing.assert_allclose(stretched_length(s, STIFFNESS, H, V, S, phi), s + stretch, rtol=1e-9)
    elastic = quad(lambda a: tension(a) ** 2, 0.0, s)[0] / (2 * STIFFNESS)
    height = quad(lambda a: free_part(H, V_A, a, STIFFNESS, w)[1], 1e-12, s)[0]
    energy = stored_energy(x, z, s, STIFFNESS, w, H, V, S, phi)
    np.testing.assert_allclose(energy, elastic + w * height, rtol=1e-6, atol=1e-6 * (1 + H * s))


@pytest.mark.parametrize(
    "ends",
    [
        (3.0, -2.0, 3.61),
        (3.0, -2.0, 3.6),
        (3.0, -2.0, 3.606),
        (12.0, 1.0, 13.0),
        (12.0, 1.0, 12.06),
    ],
)
def test_the_profile_is_irvines_and_that_of_a_chain_of_200_bars(ends):
    """Elastic bars, each with its weight in its middle; their error grows with (w s / H)^2."""
    x, z, s = ends
    H, V_A, good = solve_catenary(x, z, 0.0, 1.0, s, ES, W, 0.0, 0.0)
    assert good
    for part in np.linspace(0.05, 1.0, 20) * s:
        here = free_part(H, V_A, part, ES, W)[:2]
        np.testing.assert_allclose(here, irvine(part, H, V_A, ES, W), atol=1e-9)
    np.testing.assert_allclose(here, (x, z), atol=1e-12)
    if s == 13.0:  # too slack for so few bars
        return
    place, highest = np.zeros(2), 0.0
    chord = np.array([x, z]) / np.hypot(x, z)
    for k in range(200):
        force = np.array([H, V_A + W * s * (k + 0.5) / 200])
        tension = np.linalg.norm(force)
        place = place + force / tension * s / 200 * (1.0 + tension / ES)
        highest = max(highest, abs(place[0] * chord[1] - place[1] * chord[0]))
    assert np.linalg.norm(place - [x, z]) < 1e-6
    # The joint next to the lowest point is at most half a bar away from it.
    assert -1e-6 < sag_of(x, z, s, ES, W, H, V_A)[0] - highest < (s / 200) ** 2 * W / H


@few
@given(st.floats(0.3, 15.0), st.floats(-6.0, 6.0), st.floats(1e-9, 1.0), st.booleans())
def test_a_cable_is_found_from_slack_to_stretched(x, z, share, loose):
    chord = np.hypot(x, z)
    s = chord * (1.0 + share) if loose else chord * (1.0 - 0.01 * share)
    H, V_A, good = solve_catenary(x, z, 0.0, 1.0, s, STIFFNESS, 2.0, 0.0, 0.0)
    assert good
    assert H > 0.0
    np.testing.assert_allclose(free_part(H, V_A, s, STIFFNESS, 2.0)[:2], (x, z), atol=1e-11)
    # From the solution of a neighbour it is the same one.
    warm = solve_catenary(x, z, 0.0, 1.0, s, STIFFNESS, 2.0, 1.1 * H, V_A - 0.1)
    np.testing.assert_allclose(warm[:2], (H, V_A), rtol=1e-8, atol=1e-8)


@few
@given(st.floats(0.5, 10.0), st.floats(-5.0, 5.0), st.floats(1.0, 2.0), st.floats(1e-3, 1e4))
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


@pytest.mark.parametrize("H", [100.0, 500.0, 3000.0])
def test_the_size_of_cogiro_by_the_parabola(H):
    """15 m x 11 m x 6 m, steel cable of 4 mm, 0.5 to 3 kN: sag and tension by handbook formulas.

    The parabola takes the weight as spread along the chord: an error of order (8/3)(sag/span)^2
    in the sag, and less in the tension.
    """
    x, z, w, ES = 9.0, -5.0, 0.63, 1.26e6
    chord = s = np.hypot(x, z)
    slope = z / x
    for _ in range(50):  # the unstrained length that takes this horizontal force
        V_A = H * slope - w * s / 2
        end = free_part(H, V_A, s, ES, w)
        s *= x / end[0]
        slope += (z - end[1]) / x
    sag = sag_of(*free_part(H, V_A, s, ES, w)[:2], s, ES, w, H, V_A)[0]
    span_sag = w * chord * x / (8.0 * H)  # below the chord, vertically
    error = sag / (span_sag * x / chord) - 1.0
    assert abs(error) < 8.0 / 3.0 * (span_sag / x) ** 2 + 2.0 * H / ES * chord / x
    parabola = np.hypot(H, H * abs(z) / x + w * chord / 2)
    np.testing.assert_allclose(np.hypot(H, V_A), parabola, rtol=10 * (span_sag / x) ** 2 + 1e-3)


def straight_length(rho, z, r, sigma):
    free, sine, cosine = tangent(rho, sigma * z, r)
    return free + r * (np.pi - np.arctan2(sine, cosine))


def test_cables_over_pulleys_are_found_near_the_groove_and_far_from_it():
    """The first one, with its forces by SciPy's least squares; Newton's steps alone gave it up."""
    random, hard = np.random.default_rng(0), (0.5, 0.5, 0.15, -1.0, -0.0996, ES, W)
    cases = [hard]
    for _ in range(1000):
        r = random.choice([0.03, 0.15])
        cases.append((
            2.0 * r + random.uniform(0.02, 2.0), random.uniform(-2.0, 2.0), r,
            random.choice([-1.0, 1.0]), -(10.0 ** random.uniform(-4.0, -0.6)),
            10.0 ** random.uniform(4.0, 7.0), 10.0 ** random.uniform(-1.0, 1.0),
        ))  # fmt: skip
    for case in cases:
        rho, z, r, sigma, strain, stiffness, w = case
        l0 = straight_length(rho, z, r, sigma) / (1.0 + strain)
        H, V_A, good = solve_catenary(rho, z, r, sigma, l0, stiffness, w, 0.0, 0.0)
        assert good, case
        miss = equations(H, V_A, rho, z, r, sigma, l0, stiffness, w)[:2]
        assert np.hypot(*miss) < 1e-9, case  # m
        if case == hard:
            np.testing.assert_allclose((H, V_A), (0.262158, -0.497468), atol=1e-6)


spans, heights, radii = st.floats(0.5, 10.0), st.floats(-5.0, 5.0), st.floats(0.01, 0.15)
signs = st.sampled_from([1.0, -1.0])
strains = st.one_of(st.floats(-0.1, -1e-5), st.floats(1e-5, 3e-3))


@settings(max_examples=25, deadline=None)
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
        rate = (1.0 + T / ES) / r  # height: sigma r sin(pi - turned)
        return [rate, -W * sigma * r * np.cos(np.pi - turned) * rate, 1.0 + T / ES]

    def left(_, state):
        return state[0] - (np.pi - alpha)

    def free(_, state):
        T = np.hypot(state[2], state[3])
        return [*(state[2:4] / T * (1.0 + T / ES)), 0.0, W, 1.0 + T / ES]

    left.terminal = True
    options = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-12}
    wheel = solve_ivp(on_wheel, (0.0, l0), [0.0, t_A, 0.0], events=left, **options)
    _, T, way = wheel.y[:, -1]
    u = np.array([np.sin(alpha), -sigma * np.cos(alpha)])
    place = np.array([r * (1.0 + np.cos(alpha)), sigma * r * np.sin(alpha)])
    end = solve_ivp(free, (wheel.t[-1], l0), [*place, *(T * u), way], **options).y[:, -1]
    np.testing.assert_allclose(end[:2], (rho, z), atol=INTEGRATION)
    np.testing.assert_allclose(end[2:4], (H, V_B), atol=INTEGRATION * (1.0 + t_B))
    np.testing.assert_allclose(np.hypot(*end[2:4]), t_B, rtol=INTEGRATION)
    np.testing.assert_allclose(end[4], length, atol=INTEGRATION)


@few
@given(spans, heights, radii, signs)
def test_a_heavy_pull_leaves_the_pulley_where_a_straight_cable_does(rho, z, r, sigma):
    assume(rho > 2.5 * r)
    _, sine, cosine = tangent(rho, sigma * z, r)
    l0 = straight_length(rho, z, r, sigma) / 1.001
    H, V_A, _ = solve_catenary(rho, z, r, sigma, l0, ES, 1e-9, 0.0, 0.0)
    T = np.hypot(H, V_A)
    np.testing.assert_allclose((H / T, -sigma * V_A / T), (sine, cosine), atol=1e-9)
    np.testing.assert_allclose(T, ES * 1e-3, rtol=1e-9)
