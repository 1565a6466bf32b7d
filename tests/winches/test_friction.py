"""Friction: the Stribeck curve, rest under static friction, stopping as the exact law does."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.winches.friction import FrictionLaw, held_friction

LAW = FrictionLaw(coulomb=0.02, static=0.03, viscous=1e-4, stribeck_speed=5.0, settling_time=1e-3)
INERTIA = 3e-5


def acceleration(net_motor, w, law=LAW):
    """dw/dt under a torque, without friction, of `net_motor`."""
    net = net_motor - law.viscous * w
    held = held_friction(law.dry(w), net, w, INERTIA, law.settling_time)
    return (net - held) / INERTIA


def runge_kutta(torque, w, step, count, law=LAW):
    """Speeds of a motor by Drake's three-stage method; torque is a function of time."""
    speeds = [w]
    for k in range(count):
        t = k * step
        k1 = acceleration(torque(t), w, law)
        k2 = acceleration(torque(t + step / 2), w + step / 2 * k1, law)
        k3 = acceleration(torque(t + step), w + step * (2 * k2 - k1), law)
        w = w + step / 6 * (k1 + 4 * k2 + k3)
        speeds.append(w)
    return np.array(speeds)


def test_the_stribeck_curve_is_that_of_the_thesis():
    """Least friction where the slopes are equal, exp(-w / w_s) = F_v w_s / (F_s - F_c)."""
    w = np.array([0.5, 5.0, 40.0])
    expected = 0.02 + 0.01 * np.exp(-w / 5.0) + 1e-4 * w
    np.testing.assert_allclose(LAW.sliding(w), expected, rtol=1e-14)
    np.testing.assert_allclose(LAW.sliding(-w), -expected, rtol=1e-14)
    assert LAW.dry(np.array(0.0)) == LAW.static
    assert LAW.sliding(np.array(0.0)) == 0.0  # what holds at rest is a reaction
    w = np.linspace(0.0, 60.0, 60001)[1:]
    least = w[np.argmin(LAW.sliding(w))]
    assert least == pytest.approx(-5.0 * np.log(1e-4 * 5.0 / 0.01), abs=2e-3)


@given(st.lists(st.floats(-0.03, 0.03), min_size=1, max_size=40), st.floats(1e-5, 2e-3))
def test_no_torque_within_static_friction_ever_moves_a_motor_at_rest(torques, step):
    """Exactly: not by the last bit, whatever the torque does and the step is."""
    torques = np.array(torques)
    speeds = runge_kutta(
        lambda t: torques[int(t / step) % len(torques)], 0.0, step, 2 * len(torques)
    )
    np.testing.assert_array_equal(speeds, 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_beyond_static_friction_moves_it(sign):
    """At first with the torque beyond static friction over the inertia."""
    beyond = 1e-4
    assert acceleration(sign * (0.03 + beyond), 0.0) == pytest.approx(sign * beyond / INERTIA)
    assert acceleration(sign * (0.03 - 1e-12), 0.0) == 0.0


@given(w=st.floats(0.05, 200.0), net=st.floats(-0.3, 0.3))
def test_a_turning_motor_has_the_friction_of_the_curve(w, net):
    """But where it would stop, or turn round, within the settling time."""
    exact = (net - LAW.sliding(w)) / INERTIA
    if w + exact * LAW.settling_time >= 0.0:
        assert acceleration(net, w) == pytest.approx(exact, rel=1e-9, abs=1e-9)


@given(w=st.floats(-200.0, 200.0), net=st.floats(-0.03, 0.03))
def test_friction_brakes_whatever_it_can_hold(w, net):
    """Kinetic energy falls wherever the torque is below dry friction at that speed."""
    if abs(net) <= float(LAW.dry(np.array(w))) and abs(w) > 1e-12:
        assert acceleration(net, w) * w < 0.0


@pytest.mark.parametrize("step", [1e-4, 5e-4, 1e-3, 2e-3])
@pytest.mark.parametrize("net", [0.0, 0.015, -0.015])
def test_a_motor_comes_to_rest_where_the_exact_law_stops_it(step, net):
    """Without chatter, and at most T^2 (g - |n|) / (2 J) and a step's error farther."""
    speeds = runge_kutta(lambda t: net, 10.0, step, round(0.2 / step))
    travelled = step * (np.sum(speeds) - 0.5 * (speeds[0] + speeds[-1]))
    assert abs(speeds[-1]) < 1e-12
    fine = np.linspace(0.0, 10.0, 20001)
    braking = LAW.dry(fine) + LAW.viscous * fine - net
    stopping = np.trapezoid(fine * INERTIA / braking, fine)
    bound = LAW.settling_time**2 * (LAW.static + abs(net)) / (2.0 * INERTIA)
    one_step = step**2 * (LAW.static + abs(net)) / INERTIA
    assert abs(travelled - stopping) < bound + one_step
    # Chatter would make the speed grow again after every change of sign.
    assert np.all(np.diff(np.abs(speeds)) <= 0.0)


def test_work_of_friction_is_the_loss_of_energy():
    """1/2 J w^2 at the start is the integral of friction times speed until rest."""
    step = 1e-4
    speeds = runge_kutta(lambda t: 0.0, 30.0, step, 4000, replace(LAW, settling_time=2e-4))
    power = LAW.sliding(speeds) * speeds
    assert np.trapezoid(power, dx=step) == pytest.approx(0.5 * INERTIA * 30.0**2, rel=1e-3)


def test_friction_is_none_by_default():
    none = FrictionLaw()
    assert (none.coulomb, none.static, none.viscous) == (0.0, 0.0, 0.0)
    assert (none.stribeck_speed, none.settling_time) == (1.0, 1e-3)
    held = held_friction(np.zeros(2), np.array([0.3, -2.0]), np.array([5.0, -1.0]), INERTIA, 1e-3)
    np.testing.assert_array_equal(held, 0.0)
