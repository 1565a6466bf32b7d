"""Winches with motors: closed forms, limits, poles, failures; the kernel against the arrays."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.winches.drum import Drum
from cdpr_drake.winches.failed_winches import (
    fail_winches,
    failed_law,
    held_brakes,
    pack_failing_winches,
)
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


VISCOUS = replace(PLAIN, friction=FrictionLaw(viscous=2e-4))
FRICTIONLESS = replace(LAW, friction=FrictionLaw())
ENDLESS = replace(LAW, rated_torque=np.inf)
OVER = 314.0 * 1.05 + 1e-9
KP, KI = LAW.gains()

CLOSED_FORMS = {
    # J dw/dt = rho t: Gazebo thesis (2.20) without friction and torque.
    "free drum": (PLAIN, TORQUE, (0, 0, 0, 12.0, 0), "acceleration", 0.004 * 12.0 / 3e-5, 0.0),
    # Servoing thesis 5.2.3: t_c = r_w tau / R_g.
    "held": (PLAIN, TORQUE, (0, 0, 0, 12.0, -0.04 / 10.0 * 12.0), "acceleration", 0.0, 1e-12),
    # tau = F_v w.
    "steady": (VISCOUS, TORQUE, (0, 0.03 / 2e-4, 0, 0, 0.03), "acceleration", 0.0, 1e-9),
    "rated torque": (
        LAW, TORQUE, (0, [0.0, 0.0, 10.0], 0, 0, [5.0, -5.0, 0.3]), "torque", [0.64, -0.64, 0.3],
        0.0,
    ),
    # Beyond the rated speed a motor brakes but does not drive.
    "rated speed": (
        LAW, TORQUE, (0, [OVER, OVER, -OVER, 313.0], 0, 0, [0.5, -0.5, -0.5, 0.5]), "torque",
        [0.0, -0.5, 0.0, 0.5], 1e-9,
    ),
    # Half of a small torque in the middle of the margin, nothing at its end.
    "small torques": (
        LAW, TORQUE, (0, [314.0 * 1.025, OVER, 314.0 * 0.99], 0, 0, [1e-3] * 3), "torque",
        [0.5e-3, 0.0, 1e-3], 1e-12,
    ),
    "no integral": (
        LAW, TORQUE, (0, [314.0 * 1.025, OVER, 314.0 * 0.99], 0, 0, [1e-3] * 3), "integral_rate",
        0.0, 0.0,
    ),
    # The speed reference ends at the rated speed, and with it the torque that the loop asks for.
    "speed reference": (ENDLESS, VELOCITY, (0, 314.0, 0, 0, [100.0, 3.0]), "torque", 0.0, 1e-9),
    # dz/dt = Ki (tau_limited - z) / Kp: the integral does not wind up while torque is limited.
    "limited": (LAW, VELOCITY, (0, 0, [0.0, 0.5, 0.64], 0, 100.0), "torque", 0.64, 0.0),
    "limited integral": (
        LAW, VELOCITY, (0, 0, [0.0, 0.5, 0.64], 0, 100.0), "integral_rate",
        KI / KP * (0.64 - np.array([0.0, 0.5, 0.64])), 1e-9,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CLOSED_FORMS.values(), ids=CLOSED_FORMS.keys())
def test_closed_form(case):
    law, mode, numbers, name, expected, tolerance = case
    found = getattr(motion(law, mode, *numbers), name)
    relative = 0.0 if tolerance else 1e-14
    np.testing.assert_allclose(found, expected, rtol=relative, atol=tolerance)


def test_layers_multiply_tension_by_the_radius_where_the_cable_leaves():
    q = np.array([-60.0, 0.0, 180.0])
    rho = LAW.drum.length_per_angle(q)
    assert rho[0] > rho[1] > rho[2]
    found = motion(FRICTIONLESS, TORQUE, q, 0.0, 0.0, 10.0, 0.0)
    np.testing.assert_allclose(found.acceleration, rho * 10.0 / LAW.inertia, rtol=1e-14)


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


def test_gains_and_defaults_of_a_winch():
    """s^2 + Kp / J s + Ki / J = (s + b / 2)^2; defaults are those of the robot files."""
    Kp, Ki = replace(LAW, velocity_bandwidth=50.0).gains()
    assert Kp == pytest.approx(LAW.inertia * 50.0, rel=1e-14)
    assert Ki == pytest.approx(LAW.inertia * 625.0, rel=1e-14)
    plain = WinchLaw(drum=LAW.drum, inertia=1.0, rated_speed=1.0)
    assert (plain.brake_torque, plain.rated_torque) == (0.0, np.inf)
    assert (plain.velocity_bandwidth, plain.position_bandwidth) == (200.0, 20.0)
    assert plain.friction == FrictionLaw()
    assert MODES == {"torque": TORQUE, "velocity": VELOCITY, "position": POSITION}


def test_whatever_holds_by_friction_or_brake_settles():
    """With a pole of its own, at the settling time of 1 ms."""
    plain = replace(FRICTIONLESS, brake_torque=0.0)
    assert len(plain.poles(TORQUE)) == 2
    braked, rough = replace(plain, brake_torque=0.1), replace(plain, friction=FRICTION)
    for law in (braked, rough, LAW):
        np.testing.assert_allclose(np.min(law.poles(TORQUE).real), -1000.0)


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


# Winches that fail stand still or let go.


SMALL, M = load_robot("acrobot_small").winch_law(), 4
LENGTHS, TENSIONS = np.ones(M), np.array([5.0, 8.0, 3.0, 6.0])
RATES = np.array([0.02, -0.05, 0.03, -0.01])
NONE, JAMMED, POWERLESS = np.zeros(M), np.array([0.0, 1, 0, 0]), np.array([0.0, 0, 1, 0])


def accelerations(mode, jammed, powerless):
    """Of the lengths, by the kernel."""
    whole = pack_failing_winches(SMALL, M)
    constants = np.empty_like(whole)
    brakes = fail_winches(whole, NONE, jammed, powerless, constants)
    state = np.concatenate([LENGTHS, RATES, np.full(M, -0.1)][: 2 if mode == "torque" else 3])
    out = np.empty_like(state)
    winch_rates(state, TENSIONS, -0.1 * LENGTHS, brakes, LENGTHS, MODES[mode], constants, out)
    return out[M : 2 * M]


@pytest.mark.parametrize("mode", MODES)
def test_the_kernel_does_what_the_law_says(mode):
    motion = winch_motion(
        failed_law(SMALL, JAMMED, POWERLESS), MODES[mode], (LENGTHS, RATES, np.full(M, -0.1)),
        TENSIONS, -0.1 * LENGTHS, held_brakes(NONE, JAMMED), home=LENGTHS,
    )  # fmt: skip
    found = accelerations(mode, JAMMED, POWERLESS)
    # Of what is jammed, rounding of what holds it.
    np.testing.assert_allclose(found, motion.length_acceleration, rtol=1e-9)
    assert motion.torque[2] == 0.0
    assert found[1] == pytest.approx(-RATES[1] / SMALL.friction.settling_time, rel=1e-6)


@pytest.mark.parametrize("mode", MODES)
def test_where_nothing_failed_bits_are_those_of_winches_that_cannot(mode):
    state = np.concatenate([LENGTHS, RATES, np.full(M, -0.1)][: 2 if mode == "torque" else 3])
    out = np.empty_like(state)
    winch_rates(state, TENSIONS, -0.1 * LENGTHS, NONE, LENGTHS, MODES[mode], pack_winch(SMALL), out)
    assert np.array_equal(accelerations(mode, NONE, NONE), out[M : 2 * M])
