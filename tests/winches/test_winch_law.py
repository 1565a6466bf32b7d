"""Winches with motors, as functions: closed forms, limits, poles; the kernel against the arrays."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff

from cdpr_drake.winches.drum import Drum
from cdpr_drake.winches.friction import FrictionLaw
from cdpr_drake.winches.motor import MODES, POSITION, TORQUE, VELOCITY, WinchLaw, winch_motion
from cdpr_drake.winches.motor_kernel import WINCH_CONSTANTS, pack_winch, winch_rates, winch_torques

FRICTION = FrictionLaw(coulomb=0.02, static=0.03, viscous=1e-4, stribeck_speed=5.0)
LAW = WinchLaw(
    drum=Drum(radius=0.041, gear_ratio=10.0, layer_turns=6.0, layer_height=0.002, wound=1.3),
    inertia=3e-5,
    rated_speed=314.0,
    rated_torque=0.64,
    friction=FRICTION,
    brake_torque=0.9,
)
PLAIN = replace(
    LAW, drum=Drum(radius=0.04, gear_ratio=10.0), friction=FrictionLaw(), rated_torque=np.inf
)
HOME = np.array([1.0, 1.2, 0.9])
SAME = 1e-9
"""Kernel against arrays, of accelerations up to 1e5 rad/s^2, relative."""


def state_at(law, q, w, z):
    """Lengths, rates and integrals at angles and speeds of motors."""
    home = np.resize(HOME, len(q))
    return home + law.drum.paid_out(q), law.drum.length_per_angle(q) * w, z


def motion(law, mode, q, w, z, tensions, command, brakes=0.0):
    one = [np.atleast_1d(np.asarray(x, float)) for x in (q, w, z, tensions, command)]
    m = max(len(x) for x in one)
    q, w, z, tensions, command = (np.broadcast_to(x, m).astype(float) for x in one)
    brakes = np.full(m, brakes)
    state = state_at(law, q, w, z)
    return winch_motion(law, mode, state, tensions, command, brakes, home=np.resize(HOME, m))


def test_lengths_accelerate_as_the_turning_drum_says():
    """d2l/dt2 along l(q0 + w t + a t^2 / 2), by central differences, on a climbing spiral."""
    drum = Drum(radius=0.04, gear_ratio=10.0, layer_turns=1.0, layer_height=0.003, wound=1.3)
    law = replace(LAW, drum=drum)
    q, w = np.array([5.0, -30.0]), np.array([80.0, -200.0])
    found = motion(law, TORQUE, q, w, 0.0, 10.0, 0.1)
    np.testing.assert_allclose(found.speed, w, rtol=1e-12)
    h = 1e-3

    def length(t):
        return drum.paid_out(q + w * t + 0.5 * found.acceleration * t**2)

    expected = (length(h) - 2.0 * length(0.0) + length(-h)) / h**2
    np.testing.assert_allclose(found.length_acceleration, expected, rtol=1e-5)


def test_a_free_drum_accelerates_with_its_inertia():
    """J dw/dt = rho t: Gazebo thesis (2.20) without friction and torque."""
    found = motion(PLAIN, TORQUE, 0.0, 0.0, 0.0, 12.0, 0.0)
    np.testing.assert_allclose(found.acceleration, 0.004 * 12.0 / 3e-5, rtol=1e-14)


def test_a_torque_of_radius_times_tension_holds_the_cable():
    """Servoing thesis 5.2.3: t_c = r_w tau / R_g."""
    found = motion(PLAIN, TORQUE, 0.0, 0.0, 0.0, 12.0, -0.04 / 10.0 * 12.0)
    np.testing.assert_allclose(found.acceleration, 0.0, atol=1e-12)


def test_layers_multiply_tension_by_the_radius_where_the_cable_leaves():
    law = replace(LAW, friction=FrictionLaw())
    q = np.array([-60.0, 0.0, 180.0])
    found = motion(law, TORQUE, q, 0.0, 0.0, 10.0, 0.0)
    rho = law.drum.length_per_angle(q)
    assert rho[0] > rho[1] > rho[2]
    np.testing.assert_allclose(found.acceleration, rho * 10.0 / law.inertia, rtol=1e-14)


def test_viscous_friction_alone_gives_a_steady_speed():
    """tau = F_v w."""
    law = replace(PLAIN, friction=FrictionLaw(viscous=2e-4))
    found = motion(law, TORQUE, 0.0, 0.03 / 2e-4, 0.0, 0.0, 0.03)
    np.testing.assert_allclose(found.acceleration, 0.0, atol=1e-9)


def test_torque_ends_at_the_rated_torque():
    found = motion(LAW, TORQUE, 0.0, [0.0, 0.0, 10.0], 0.0, 0.0, [5.0, -5.0, 0.3])
    np.testing.assert_array_equal(found.torque, [0.64, -0.64, 0.3])


def test_beyond_the_rated_speed_a_motor_brakes_but_does_not_drive():
    over = 314.0 * 1.05 + 1e-9
    found = motion(LAW, TORQUE, 0.0, [over, over, -over, 313.0], 0.0, 0.0, [0.5, -0.5, -0.5, 0.5])
    np.testing.assert_allclose(found.torque, [0.0, -0.5, 0.0, 0.5], atol=1e-9)


def test_small_torques_do_not_drive_beyond_the_rated_speed_either():
    """Half of a small torque in the middle of the margin, nothing at its end."""
    speeds = 314.0 * np.array([1.025, 1.05 + 1e-9, 0.99])
    found = motion(LAW, TORQUE, 0.0, speeds, 0.0, 0.0, [1e-3, 1e-3, 1e-3])
    np.testing.assert_allclose(found.torque, [0.5e-3, 0.0, 1e-3], atol=1e-12)
    np.testing.assert_array_equal(found.integral_rate, 0.0)


def test_the_speed_reference_ends_at_the_rated_speed():
    """And with it the torque that the loop asks for."""
    law = replace(LAW, rated_torque=np.inf)
    found = motion(law, VELOCITY, 0.0, 314.0, 0.0, 0.0, [100.0, 3.0])
    np.testing.assert_allclose(found.torque, 0.0, atol=1e-9)


def test_the_integral_does_not_wind_up_while_the_torque_is_limited():
    """It follows the limit: dz/dt = Ki (tau_limited - z) / Kp, from dz/dt by definition."""
    Kp, Ki = LAW.gains()
    found = motion(LAW, VELOCITY, 0.0, 0.0, [0.0, 0.5, 0.64], 0.0, 100.0)
    np.testing.assert_allclose(found.torque, 0.64)
    rate = Ki / Kp * (0.64 - np.array([0.0, 0.5, 0.64]))
    np.testing.assert_allclose(found.integral_rate, rate, atol=1e-9)


def test_a_brake_holds_what_it_can():
    limit = LAW.brake_torque + FRICTION.static
    pull = limit / LAW.drum.length_per_angle(np.zeros(1))[0]
    for share, moves in ((0.999, False), (1.001, True)):
        found = motion(LAW, TORQUE, 0.0, 0.0, 0.0, share * pull, 0.0, brakes=1.0)
        assert (found.acceleration[0] != 0.0) == moves
        assert motion(LAW, TORQUE, 0.0, 0.0, 0.0, share * pull, 0.0).acceleration[0] > 0.0


@pytest.mark.parametrize("mode", MODES.values())
def test_poles_are_those_of_the_derivatives(mode):
    """Derivatives of the motion at rest, without dry friction."""
    law = replace(PLAIN, friction=FrictionLaw(viscous=3e-4), brake_torque=0.0)
    x = InitializeAutoDiff(np.array([HOME[0], 0.0, 0.0]))[:, 0]
    command = HOME[:1] if mode == POSITION else np.zeros(1)
    zero = np.zeros(1)
    found = winch_motion(law, mode, (x[:1], x[1:2], x[2:]), zero, command, zero, home=HOME[:1])
    A = ExtractGradient(np.array([x[1], found.length_acceleration[0], found.integral_rate[0]]))
    if mode == TORQUE:
        A = A[:2, :2]
    wanted = np.sort_complex(np.linalg.eigvals(A))
    np.testing.assert_allclose(np.sort_complex(law.poles(mode)), wanted, atol=1e-4)


def test_the_speed_loop_is_critically_damped():
    poles = replace(LAW, friction=FrictionLaw(static=0.1, settling_time=2e-3)).poles(VELOCITY)
    np.testing.assert_allclose(np.sort(poles.real), [-500.0, -100.0, -100.0, 0.0], atol=1e-3)
    # A double pole splits by the root of the rounding; with any other Ki it would by tens.
    np.testing.assert_allclose(poles.imag, 0.0, atol=1e-3)


def test_gains_of_the_speed_loop():
    """s^2 + Kp / J s + Ki / J = (s + b / 2)^2."""
    Kp, Ki = replace(LAW, velocity_bandwidth=50.0).gains()
    assert Kp == pytest.approx(LAW.inertia * 50.0, rel=1e-14)
    assert Ki == pytest.approx(LAW.inertia * 625.0, rel=1e-14)


def test_defaults_of_a_winch_are_those_of_the_robot_files():
    plain = WinchLaw(drum=LAW.drum, inertia=1.0, rated_speed=1.0)
    assert (plain.brake_torque, plain.rated_torque) == (0.0, np.inf)
    assert (plain.velocity_bandwidth, plain.position_bandwidth) == (200.0, 20.0)
    assert plain.friction == FrictionLaw()


def test_whatever_holds_by_friction_or_brake_settles():
    """With a pole of its own, at the settling time of 1 ms."""
    frictionless = replace(LAW, friction=FrictionLaw(), brake_torque=0.0)
    assert len(frictionless.poles(TORQUE)) == 2
    for law in (
        replace(frictionless, brake_torque=0.1),
        replace(frictionless, friction=FrictionLaw(static=0.1)),
        LAW,
    ):
        np.testing.assert_allclose(np.min(law.poles(TORQUE).real), -1000.0)


def test_modes_have_names():
    assert MODES == {"torque": TORQUE, "velocity": VELOCITY, "position": POSITION}


@st.composite
def winches(draw):
    turns = draw(st.sampled_from([1.0, 3.0, np.inf]))
    drum = Drum(0.04, 10.0, turns, draw(st.sampled_from([0.0, 0.002])), 1.0)
    friction = draw(st.sampled_from([FRICTION, FrictionLaw()]))
    torque = draw(st.sampled_from([0.3, np.inf]))
    return replace(LAW, drum=drum, friction=friction, rated_torque=torque)


NUMBERS = st.floats(-1.0, 1.0)


@given(
    law=winches(),
    mode=st.sampled_from(list(MODES.values())),
    x=st.lists(NUMBERS, min_size=12, max_size=12),
    brakes=st.lists(st.sampled_from([0.0, 1.0]), min_size=3, max_size=3),
)
def test_the_kernel_is_the_array_path(law, mode, x, brakes):
    x = np.array(x)
    parts = state_at(law, 200.0 * x[:3], 400.0 * x[3:6], x[6:9])
    tensions, command = 50.0 * np.abs(x[9:]), HOME + x[[9, 5, 2]]
    brakes = np.array(brakes)
    found = winch_motion(law, mode, parts, tensions, command, brakes, home=HOME)
    state = np.concatenate(parts[:2] if mode == TORQUE else parts)
    constants = pack_winch(law)
    assert constants.shape == (1, WINCH_CONSTANTS)
    rates, pairs = np.empty_like(state), np.empty((2, 3))
    winch_rates(state, tensions, command, brakes, HOME, mode, constants, rates)
    np.testing.assert_array_equal(rates[:3], parts[1])
    np.testing.assert_allclose(rates[3:6], found.length_acceleration, rtol=SAME, atol=1e-9)
    if mode != TORQUE:
        np.testing.assert_allclose(rates[6:], found.integral_rate, rtol=SAME, atol=1e-6)
    winch_torques(state, tensions, command, brakes, HOME, mode, constants, pairs)
    np.testing.assert_allclose(pairs, [found.torque, found.friction], rtol=SAME, atol=1e-9)


@given(mode=st.sampled_from(list(MODES.values())), x=st.lists(NUMBERS, min_size=4, max_size=4))
def test_values_do_not_depend_on_the_scalar(mode, x):
    numbers = np.array([HOME[0] + 0.4 * x[0], x[1], x[2]])
    tension, command, zero = np.array([40.0 * abs(x[3])]), np.array([0.7]), np.zeros(1)

    def found(numbers):
        parts = (numbers[:1], numbers[1:2], numbers[2:])
        return winch_motion(LAW, mode, parts, tension, command, zero, home=HOME[:1])

    dual = found(InitializeAutoDiff(numbers)[:, 0])
    np.testing.assert_array_equal(
        ExtractValue(dual.length_acceleration).ravel(), found(numbers).length_acceleration
    )
