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

EA = np.array([1e5, 3e5])
TENSIONS = np.array([120.0, 900.0])
G = 8e-4

EXACT = 1e-9
"""Of closed forms against each other: rounding, and quadrature to as much."""

INTEGRATED = 1e-6
"""Of waves that were integrated in small steps."""


def test_a_stiffening_cable_is_the_integral_of_its_tangent_stiffness():
    for t, stiffness in zip(TENSIONS, EA, strict=True):
        strain = quad(lambda x, E=stiffness: 1.0 / tangent_stiffness(x, E, G), 0.0, t)[0]
        assert strain_of_tension(t, stiffness, G) == pytest.approx(strain, rel=EXACT)
        energy = quad(lambda e, E=stiffness: float(tension_of_strain(e, E, G)), 0.0, strain)[0]
        assert strain_energy(strain, stiffness, G) == pytest.approx(energy, rel=EXACT)
    strains = strain_of_tension(TENSIONS, EA, G)
    np.testing.assert_allclose(tension_of_strain(strains, EA, G), TENSIONS, rtol=EXACT)
    assert tension_of_strain(np.array([-1e-3]), EA[:1], G)[0] == 0.0


def test_off_gives_the_bits_of_the_elastic_law():
    lengths, off = np.array([2.3, 1.7]), CableBehaviour()
    np.testing.assert_array_equal(
        counted_lengths(lengths, TENSIONS, EA, off), unstrained_lengths(lengths, TENSIONS, EA)
    )
    np.testing.assert_array_equal(drum_tensions(TENSIONS, np.ones(2), 0.0, np.ones(2)), TENSIONS)
    cables = CableSet.make(np.zeros((3, 2)), np.ones((3, 2)), EA)
    same, l0 = tangent_cables(cables, lengths, TENSIONS, off)
    assert same is cables
    assert l0 is lengths
    np.testing.assert_array_equal(creep_step(np.zeros(2), np.ones(2), 0.1, EA, off), np.zeros(2))


def test_heat_makes_a_loose_cable_longer_and_a_held_one_pull_less():
    warm = CableBehaviour(expansion=1.2e-5, warmer=20.0)
    lengths = np.array([5.0, 5.0])
    counted = counted_lengths(lengths, np.zeros(2), EA, warm)
    np.testing.assert_allclose(lengths - counted, 5.0 * 2.4e-4 / (1.0 + 2.4e-4), rtol=1e-9)
    # Held between two walls, its tension falls by E S a dT, but for the second order.
    strain = lengths / (5.0 / (1.0 + 1e-3) * warm.longer()) - 1.0
    fall = 1e-3 * EA - tension_of_strain(strain, EA)
    np.testing.assert_allclose(fall, EA * 2.4e-4, rtol=2e-3)


def test_tangent_cables_have_tension_and_slope_of_the_law():
    behaviour = CableBehaviour(stiffening=G, expansion=1.2e-5, warmer=-15.0)
    cables = CableSet.make(np.zeros((3, 2)), np.ones((3, 2)), EA)
    lengths = np.array([2.3, 1.7])
    counted = counted_lengths(lengths, TENSIONS, EA, behaviour)
    linear, l0 = tangent_cables(cables, counted, TENSIONS, behaviour)

    def law(length):
        return tension_of_strain(length / (counted * behaviour.longer()) - 1.0, EA, G)

    np.testing.assert_allclose(linear.stiffness * (lengths / l0 - 1.0), TENSIONS, rtol=EXACT)
    np.testing.assert_allclose(law(lengths), TENSIONS, rtol=EXACT)
    h = 1e-6
    slope = (law(lengths + h) - law(lengths - h)) / (2.0 * h)
    np.testing.assert_allclose(linear.stiffness / l0, slope, rtol=1e-7)


def test_lifting_over_lowering_is_the_square_of_the_capstan():
    wraps = np.array([2.0, 2.6])
    up = drum_tensions(TENSIONS, wraps, 0.03, np.ones(2))
    down = drum_tensions(TENSIONS, wraps, 0.03, -np.ones(2))
    np.testing.assert_allclose(up / down, np.exp(2.0 * 0.03 * wraps), rtol=EXACT)
    # As a chain of small pieces, each of which adds mu t dtheta.
    step = 1e-5
    t = TENSIONS[0] * (1.0 + 0.03 * step) ** round(wraps[0] / step)
    assert up[0] == pytest.approx(t, rel=INTEGRATED)
    np.testing.assert_array_equal(drum_tensions(TENSIONS, wraps, 0.03, np.zeros(2)), TENSIONS)


CREEPS = CableBehaviour(creep_stiffness=0.3, creep_time=4.0)


def test_a_loop_takes_the_energy_that_the_dashpot_loses():
    amplitude, w, E = 2e-3, 0.7, 1e5
    n = 40_000
    time = np.linspace(0.0, 8.0 * 2.0 * np.pi / w, n + 1)
    strain = amplitude * np.sin(w * time)
    h, s = time[1] - time[0], np.zeros(n + 1)
    for k in range(n):
        rate = np.array([(strain[k + 1] - strain[k]) / h])
        s[k + 1] = creep_step(s[k : k + 1], rate, h, np.array([E]), CREEPS)[0]
    last = slice(n - n // 8, None)
    tension = E * strain + s
    area = cumulative_trapezoid(tension[last], strain[last])[-1]
    # The dashpot of viscosity E1 S tau takes s^2 / (E1 S tau).
    lost = cumulative_trapezoid(s[last] ** 2, time[last])[-1] / (0.3 * E * 4.0)
    told = loop_energy(amplitude, w, E, CREEPS)
    # Eight waves leave exp(-18) of the beginning, 3e-8 of the loss; straight pieces of 5000 a wave
    # leave 4e-7 of the area, a quarter of it with pieces half as long.
    assert area == pytest.approx(told, rel=INTEGRATED)
    assert lost == pytest.approx(told, rel=INTEGRATED)
    assert loop_energy(amplitude, w, E, CableBehaviour()) == 0.0


def test_steps_of_creep_are_exact_at_a_constant_rate():
    rate, E = 3e-4, 1e5
    one = creep_step(np.array([50.0]), np.array([rate]), 2.0, np.array([E]), CREEPS)
    solved = solve_ivp(
        lambda _, s: 0.3 * E * rate - s / 4.0, (0.0, 2.0), [50.0], rtol=1e-10, atol=1e-10
    )
    assert one[0] == pytest.approx(solved.y[0, -1], rel=INTEGRATED)
    half = creep_step(np.array([50.0]), np.array([rate]), 1.0, np.array([E]), CREEPS)
    twice = creep_step(half, np.array([rate]), 1.0, np.array([E]), CREEPS)
    np.testing.assert_allclose(twice, one, rtol=EXACT)
    with pytest.raises(CableModelError, match="creep_time: found 0"):
        creep_step(half, half, 1.0, half, CableBehaviour(creep_time=0.0))


def test_creep_under_a_constant_tension_is_the_solution_of_the_law():
    t, E = 100.0, 1e5
    time = np.array([0.0, 1.0, 5.0, 60.0])
    q = 0.3 / 1.3
    # t = E e + s is constant: E de/dt = -ds/dt = -E1 de/dt + s / tau.
    solved = solve_ivp(
        lambda _, e: (t - E * e) / 4.0 / (1.3 * E), (0.0, 60.0), [t / (1.3 * E)],
        t_eval=time, rtol=1e-11, atol=1e-16,
    )  # fmt: skip
    np.testing.assert_allclose(creep_strain(t, time, E, CREEPS), solved.y[0], rtol=INTEGRATED)
    assert creep_strain(t, np.zeros(1), E, CREEPS)[0] == pytest.approx(t / E * (1.0 - q))
