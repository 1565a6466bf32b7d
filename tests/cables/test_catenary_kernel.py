"""The elastic catenary against Irvine's profile as printed, chains of bars and the parabola."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from cdpr_drake.cables.catenary_kernel import free_part, sag_of, stored_energy, stretched_length
from cdpr_drake.cables.hanging_kernel import equations, solve_catenary
from cdpr_drake.geometry.pulley_kernel import tangent

ROUNDING = 1e-11  # asinh and root of numbers up to 1e4, subtracted in the printed formulas
CHAIN = 1e-6
"""Distance of the ends of a chain of 200 bars from those of the cable [m]; 2e-7 m at a sag of 2 per
cent, and it grows with the square of w s / H: a chain bends in 200 steps."""

STEP = 1e-6

forces = st.floats(1.0, 1e4)
verticals = st.floats(-200.0, 200.0)
lengths = st.floats(0.5, 20.0)
weights = st.floats(0.01, 20.0)
STIFFNESS = 1e6


def irvine(s, H, V_A, total, ES, w):
    """Place of the material point s, as printed: Irvine (1.25), (1.26), from the near end."""
    V = V_A + w * s
    x = H * s / ES + H / w * (np.arcsinh(V / H) - np.arcsinh(V_A / H))
    z = s / ES * (V_A + w * s / 2) + (np.hypot(H, V) - np.hypot(H, V_A)) / w
    return x, z


@given(forces, verticals, lengths, weights)
def test_end_is_where_irvines_profile_ends(H, V_A, s, w):
    x, z, _, _, _, T_A, T_B, V, _, _ = free_part(H, V_A, s, STIFFNESS, w)
    np.testing.assert_allclose((x, z), irvine(s, H, V_A, s, STIFFNESS, w), atol=ROUNDING * H / w)
    np.testing.assert_allclose(T_A, np.hypot(H, V_A))
    np.testing.assert_allclose(T_B, np.hypot(H, V_A + w * s))
    np.testing.assert_allclose(V, V_A + w * s / 2, atol=1e-12)


@pytest.mark.parametrize("ends", [(3.0, -2.0, 3.61), (3.0, -2.0, 3.6), (12.0, 1.0, 13.0)])
def test_the_whole_profile_is_irvines(ends):
    """Points along a solved cable, through its end."""
    x, z, s = ends
    H, V_A, good = solve_catenary(x, z, 0.0, 1.0, s, 2.9e6, 2.18, 0.0, 0.0)
    assert good
    for part in np.linspace(0.05, 1.0, 20) * s:
        here = free_part(H, V_A, part, 2.9e6, 2.18)[:2]
        np.testing.assert_allclose(here, irvine(part, H, V_A, s, 2.9e6, 2.18), atol=1e-9)
    np.testing.assert_allclose(here, (x, z), atol=1e-12)


@pytest.mark.parametrize("ends", [(3.0, -2.0, 3.61), (3.0, -2.0, 3.606), (12.0, 1.0, 12.06)])
def test_a_chain_of_200_bars_hangs_the_same(ends):
    """Elastic bars, each carrying its weight in its middle, under the force that was solved for."""
    x, z, s = ends
    ES, w, bars = 2.9e6, 2.18, 200
    H, V_A, _ = solve_catenary(x, z, 0.0, 1.0, s, ES, w, 0.0, 0.0)
    place, highest = np.zeros(2), 0.0
    chord = np.array([x, z]) / np.hypot(x, z)
    for k in range(bars):
        force = np.array([H, V_A + w * s * (k + 0.5) / bars])
        tension = np.linalg.norm(force)
        place = place + force / tension * s / bars * (1.0 + tension / ES)
        highest = max(highest, abs(place[0] * chord[1] - place[1] * chord[0]))
    assert np.linalg.norm(place - [x, z]) < CHAIN
    sag = sag_of(x, z, s, ES, w, H, V_A)[0]
    # The joint next to the lowest point is at most half a bar away from it.
    assert -CHAIN < sag - highest < (s / bars) ** 2 * w / H


@given(forces, verticals, lengths, weights)
def test_compliance_is_the_derivative_of_the_end(H, V_A, s, w):
    _, _, xx, xz, zz, *_ = free_part(H, V_A, s, STIFFNESS, w)
    step = STEP * np.hypot(H, V_A)
    for (a, b), exact in (((step, 0.0), (xx, xz)), ((0.0, step), (xz, zz))):
        ahead, behind = (
            np.array(free_part(H + k * a, V_A + k * b, s, STIFFNESS, w)[:2]) for k in (1, -1)
        )
        slope = (ahead - behind) / (2 * step)
        scale = s / STIFFNESS + s / max(H, 1.0)
        np.testing.assert_allclose(slope, exact, atol=1e-4 * scale)
    assert xx * zz > xz * xz


@given(forces, verticals, lengths, weights)
def test_length_and_energy_are_the_integrals(H, V_A, s, w):
    x, z, _, _, _, _, _, V, S, phi = free_part(H, V_A, s, STIFFNESS, w)

    def tension(a):
        return np.hypot(H, V_A + w * a)

    stretch = quad(tension, 0.0, s, points=[np.clip(-V_A / w, 0.0, s)])[0] / STIFFNESS
    np.testing.assert_allclose(stretched_length(s, STIFFNESS, H, V, S, phi), s + stretch, rtol=1e-9)
    elastic = quad(lambda a: tension(a) ** 2, 0.0, s)[0] / (2 * STIFFNESS)
    height = quad(lambda a: free_part(H, V_A, a, STIFFNESS, w)[1], 1e-12, s)[0]
    energy = stored_energy(x, z, s, STIFFNESS, w, H, V, S, phi)
    np.testing.assert_allclose(energy, elastic + w * height, rtol=1e-6, atol=1e-6 * (1 + H * s))


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


def test_the_size_of_cogiro_by_the_parabola():
    """15 m x 11 m x 6 m, steel cable of 4 mm, 0.5 to 3 kN: sag and tension by handbook formulas.

    The parabola takes the weight as spread along the chord: an error of order (8/3)(sag/span)^2
    in the sag, and less in the tension.
    """
    x, z, w, ES = 9.0, -5.0, 0.63, 1.26e6
    chord = np.hypot(x, z)
    for H in (100.0, 500.0, 3000.0):
        # The unstrained length that takes this horizontal force, by the solved cable itself.
        slope, V_A = z / x, 0.0
        s = chord
        for _ in range(50):
            V_A = H * slope - w * s / 2
            found = free_part(H, V_A, s, ES, w)
            s *= x / found[0]
            slope += (z - found[1]) / x
        sag = sag_of(*free_part(H, V_A, s, ES, w)[:2], s, ES, w, H, V_A)[0]
        span_sag = w * chord * x / (8.0 * H)  # below the chord, vertically
        error = sag / (span_sag * x / chord) - 1.0
        assert abs(error) < 8.0 / 3.0 * (span_sag / x) ** 2 + 2.0 * H / ES * chord / x
        parabola = np.hypot(H, H * abs(z) / x + w * chord / 2)
        np.testing.assert_allclose(np.hypot(H, V_A), parabola, rtol=10 * (span_sag / x) ** 2 + 1e-3)


SOLVED = 1e-9  # [m] of the end of a cable that was found


def test_cables_over_pulleys_are_found_near_the_groove_and_far_from_it():
    """The first one, with its forces by SciPy's least squares; Newton's steps alone gave it up."""
    random = np.random.default_rng(0)
    cases = [(0.5, 0.5, 0.15, -1.0, -0.0996, 2.9e6, 2.18)]
    for _ in range(2000):
        r = random.choice([0.03, 0.15])
        cases.append((
            2.0 * r + random.uniform(0.02, 2.0), random.uniform(-2.0, 2.0), r,
            random.choice([-1.0, 1.0]), -(10.0 ** random.uniform(-4.0, -0.6)),
            10.0 ** random.uniform(4.0, 7.0), 10.0 ** random.uniform(-1.0, 1.0),
        ))  # fmt: skip
    for rho, z, r, sigma, strain, ES, w in cases:
        free, sine, cosine = tangent(rho, sigma * z, r)
        l0 = (free + r * (np.pi - np.arctan2(sine, cosine))) / (1.0 + strain)
        H, V_A, good = solve_catenary(rho, z, r, sigma, l0, ES, w, 0.0, 0.0)
        assert good, (rho, z, r, sigma, strain, ES, w)
        assert np.hypot(*equations(H, V_A, rho, z, r, sigma, l0, ES, w)[:2]) < SOLVED
        if strain == -0.0996:
            np.testing.assert_allclose((H, V_A), (0.262158, -0.497468), atol=1e-6)
