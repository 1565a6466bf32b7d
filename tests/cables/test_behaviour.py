"""Stiffening, heat, sheaves and creep against closed forms, integrals and each other."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, quad, solve_ivp

from cdpr_drake.cables.cable_behaviour import (
    CableBehaviour,
    counted_lengths,
    creep_step,
    creep_strain,
    drum_tensions,
    loop_energy,
    strain_energy,
    strain_of_tension,
    tangent_cables,
    tangent_stiffness,
    tension_of_strain,
)
from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_set import CableSet

EA, TENSIONS, LENGTHS = np.array([1e5, 3e5]), np.array([120.0, 900.0]), np.array([2.3, 1.7])
CABLES = CableSet.make(np.zeros((3, 2)), np.ones((3, 2)), EA)
G = 8e-4
EXACT = 1e-9  # of closed forms against each other, and of quadrature
INTEGRATED = 1e-6  # of waves that were integrated in small steps


@pytest.mark.parametrize(("t", "E"), [(120.0, 1e5), (900.0, 3e5)])
def test_a_stiffening_cable_is_the_integral_of_its_tangent_stiffness(t, E):
    strain = quad(lambda x: 1.0 / tangent_stiffness(x, E, G), 0.0, t)[0]
    assert strain_of_tension(t, E, G) == pytest.approx(strain, rel=EXACT)
    energy = quad(lambda e: float(tension_of_strain(e, E, G)), 0.0, strain)[0]
    assert strain_energy(strain, E, G) == pytest.approx(energy, rel=EXACT)
    tension = tension_of_strain(np.array([strain_of_tension(t, E, G), -1e-3]), E, G)
    np.testing.assert_allclose(tension, [t, 0.0], rtol=EXACT)


def test_off_gives_the_bits_of_the_elastic_law():
    off = CableBehaviour()
    counted = counted_lengths(LENGTHS, TENSIONS, EA, off)
    np.testing.assert_array_equal(counted, unstrained_lengths(LENGTHS, TENSIONS, EA))
    np.testing.assert_array_equal(drum_tensions(TENSIONS, np.ones(2), 0.0, np.ones(2)), TENSIONS)
    same, l0 = tangent_cables(CABLES, LENGTHS, TENSIONS, off)
    assert same is CABLES
    assert l0 is LENGTHS
    np.testing.assert_array_equal(creep_step(np.zeros(2), np.ones(2), 0.1, EA, off), np.zeros(2))


def test_heat_makes_a_loose_cable_longer_and_a_held_one_pull_less():
    warm, lengths = CableBehaviour(expansion=1.2e-5, warmer=20.0), np.array([5.0, 5.0])
    counted = counted_lengths(lengths, np.zeros(2), EA, warm)
    np.testing.assert_allclose(lengths - counted, 5.0 * 2.4e-4 / (1.0 + 2.4e-4), rtol=1e-9)
    # Held between two walls, its tension falls by E S a dT, but for the second order.
    strain = lengths / (5.0 / (1.0 + 1e-3) * warm.longer()) - 1.0
    fall = 1e-3 * EA - tension_of_strain(strain, EA)
    np.testing.assert_allclose(fall, EA * 2.4e-4, rtol=2e-3)


def test_tangent_cables_have_tension_and_slope_of_the_law():
    behaviour, h = CableBehaviour(stiffening=G, expansion=1.2e-5, warmer=-15.0), 1e-6
    counted = counted_lengths(LENGTHS, TENSIONS, EA, behaviour)
    linear, l0 = tangent_cables(CABLES, counted, TENSIONS, behaviour)

    def law(length):
        return tension_of_strain(length / (counted * behaviour.longer()) - 1.0, EA, G)

    np.testing.assert_allclose(linear.stiffness * (LENGTHS / l0 - 1.0), TENSIONS, rtol=EXACT)
    np.testing.assert_allclose(law(LENGTHS), TENSIONS, rtol=EXACT)
    slope = (law(LENGTHS + h) - law(LENGTHS - h)) / (2.0 * h)
    np.testing.assert_allclose(linear.stiffness / l0, slope, rtol=1e-7)


def test_lifting_over_lowering_is_the_square_of_the_capstan():
    wraps, step = np.array([2.0, 2.6]), 1e-5
    up, down, still = (drum_tensions(TENSIONS, wraps, 0.03, way * np.ones(2)) for way in (1, -1, 0))
    np.testing.assert_allclose(up / down, np.exp(2.0 * 0.03 * wraps), rtol=EXACT)
    np.testing.assert_array_equal(still, TENSIONS)
    # As a chain of small pieces, each of which adds mu t dtheta.
    chain = TENSIONS[0] * (1.0 + 0.03 * step) ** round(wraps[0] / step)
    assert up[0] == pytest.approx(chain, rel=INTEGRATED)


CREEPS = CableBehaviour(creep_stiffness=0.3, creep_time=4.0)
E = 1e5


def creep(stress, rate, duration):
    return creep_step(np.array([stress]), np.array([rate]), duration, np.array([E]), CREEPS)[0]


def test_a_loop_takes_the_energy_that_the_dashpot_loses():
    """Eight waves leave exp(-18) of the beginning, 3e-8 of the loss; straight pieces of 5000 a wave
    leave 4e-7 of the area, a quarter of it with pieces half as long.
    """
    amplitude, w, n = 2e-3, 0.7, 40_000
    time, h = np.linspace(0.0, 8.0 * 2.0 * np.pi / w, n + 1, retstep=True)
    strain, s = amplitude * np.sin(w * time), np.zeros(n + 1)
    for k, rate in enumerate(np.diff(strain) / h):
        s[k + 1] = creep(s[k], rate, h)
    last = slice(n - n // 8, None)
    area = cumulative_trapezoid((E * strain + s)[last], strain[last])[-1]
    # The dashpot of viscosity E1 S tau takes s^2 / (E1 S tau).
    lost = cumulative_trapezoid(s[last] ** 2, time[last])[-1] / (0.3 * E * 4.0)
    energy = loop_energy(amplitude, w, E, CREEPS)
    assert area == pytest.approx(energy, rel=INTEGRATED)
    assert lost == pytest.approx(energy, rel=INTEGRATED)
    assert loop_energy(amplitude, w, E, CableBehaviour()) == 0.0


def test_steps_of_creep_are_exact_at_a_constant_rate():
    rate, end = 3e-4, creep(50.0, 3e-4, 2.0)
    solved = solve_ivp(
        lambda _, s: 0.3 * E * rate - s / 4.0, (0.0, 2.0), [50.0], rtol=1e-10, atol=1e-10
    )
    assert end == pytest.approx(solved.y[0, -1], rel=INTEGRATED)
    assert creep(creep(50.0, rate, 1.0), rate, 1.0) == pytest.approx(end, rel=EXACT)
    with pytest.raises(CableModelError, match="creep_time: found 0"):
        creep_step(EA, EA, 1.0, EA, CableBehaviour(creep_time=0.0))


def test_creep_under_a_constant_tension_is_the_solution_of_the_law():
    """t = E e + s is constant: E de/dt = -ds/dt = -E1 de/dt + s / tau."""
    t, time = 100.0, np.array([0.0, 1.0, 5.0, 60.0])
    solved = solve_ivp(
        lambda _, e: (t - E * e) / 4.0 / (1.3 * E), (0.0, 60.0), [t / (1.3 * E)],
        t_eval=time, rtol=1e-11, atol=1e-16,
    )  # fmt: skip
    np.testing.assert_allclose(creep_strain(t, time, E, CREEPS), solved.y[0], rtol=INTEGRATED)
    start = creep_strain(t, np.zeros(1), E, CREEPS)[0]
    assert start == pytest.approx(t / E * (1.0 - 0.3 / 1.3))
