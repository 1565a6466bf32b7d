"""Steps of a whole robot: order, stability, estimate of the error, conservation, linearisation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.dynamics.advance_kernel import REPORTED, advance_robot, robot_energy
from cdpr_drake.dynamics.explicit_kernel import METHODS
from cdpr_drake.dynamics.robot_arrays import GRAVITY, MOTORS, TENSIONS, Drive
from cdpr_drake.dynamics.robot_kernel import (
    INTEGRATION_DIVERGED,
    INTEGRATION_OK,
    lay_out_cables,
    robot_rates,
)
from cdpr_drake.dynamics.semi_implicit_kernel import linearise
from cdpr_drake.models.robot_loader import load_robot
from tests.dynamics.robots import robot_arrays

ORDERS = {"runge_kutta2": 2.0, "runge_kutta3": 3.0, "semi_implicit": 2.0}
ORDER_TOLERANCE = 0.25
"""Of an order measured between steps that halve, where the next term of the error still shows."""

SLOPE = 2e-4
"""Differences of difference quotients and slopes, relative; the quotients' own error."""


def advanced(arrays, state, duration, step, method, **more):
    m = arrays.cables.shape[0]
    zeros = np.zeros(m)
    end, report = state.copy(), np.zeros(REPORTED)
    command, rate = more.get("command", zeros), more.get("rate", zeros)
    bad = advance_robot(
        arrays, METHODS[method], end, command, rate, zeros, duration, step,
        more.get("bound", np.inf), report,
    )  # fmt: skip
    return end, report, bad


def pushed(state, amount=0.02):
    """The platform set in motion, so that cables stretch."""
    moved = state.copy()
    n = 13 if len(state) >= 13 else 6
    moved[n - 3 : n] += amount
    if n == 13:
        moved[7:10] += amount * np.array([3.0, -2.0, 4.0])
    return moved


def reference(arrays, state, duration, command, rate=None):
    """By SciPy, with the same law for the derivative and its own integrator."""
    m, plain = arrays.cables.shape[0], lay_out_cables(arrays)
    rate = np.zeros(m) if rate is None else rate

    def derivative(t, y):
        out = np.zeros(len(y))
        robot_rates(arrays, y, command + rate * t, np.zeros(m), plain, out)
        return out

    found = solve_ivp(derivative, (0.0, duration), state, method="DOP853", rtol=1e-12, atol=1e-13)
    end = found.y[:, -1]
    if len(end) >= 13:
        end[:4] /= np.linalg.norm(end[:4])
    return end


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("name", "model", "drive"),
    [
        ("acrobot_small", "kelvin_voigt", None),
        ("planar", "kelvin_voigt", None),
        ("acrobot_small", "catenary", "motors"),
    ],
)
def test_order_of_convergence_while_cables_stay_taut(name, model, drive, method):
    if drive is not None:
        drive = Drive(kind=MOTORS, law=load_robot(name).winch_law(), mode="velocity")
    arrays, state, _ = robot_arrays(name, model=model, drive=drive, softer=1e4)
    m = arrays.cables.shape[0]
    command = 1e-3 * np.linspace(-1.0, 1.0, m)
    start, duration = pushed(state, 1e-3), 0.05
    if drive is not None:  # without dry friction, whose kinks have no order
        arrays.winch[:, 8:10] = 0.0
    end = reference(arrays, start, duration, command)
    steps = duration / np.array([50.0, 100.0, 200.0])
    errors = [
        np.max(np.abs(advanced(arrays, start, duration, h, method, command=command)[0] - end))
        for h in steps
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > ORDERS[method] - ORDER_TOLERANCE), (errors, orders)


def test_semi_implicit_step_stays_stable_where_the_explicit_one_does_not():
    arrays, state, _ = robot_arrays("acrobot_small")
    start = pushed(state)
    rest = robot_energy(arrays, state)
    _, _, bad = advanced(arrays, start, 2.0, 0.01, "runge_kutta3")
    assert bad == INTEGRATION_DIVERGED
    for step in (1e-3, 5e-3, 2e-2):
        end, _, bad = advanced(arrays, start, 2.0, step, "semi_implicit")
        assert bad == INTEGRATION_OK
        assert robot_energy(arrays, end) < rest + 1.0
        assert np.linalg.norm(end[7:13]) < 1e-2


def test_semi_implicit_comes_to_the_same_rest_as_the_explicit_one():
    arrays, state, _ = robot_arrays("acrobot_small", damping=(50.0, 1.0))
    ends = [
        advanced(arrays, pushed(state), 3.0, step, method)[0]
        for step, method in ((2e-4, "runge_kutta3"), (5e-3, "semi_implicit"))
    ]
    np.testing.assert_allclose(ends[0][:7], ends[1][:7], atol=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_estimated_error_bounds_the_true_one_of_a_step_and_is_kept(method):
    arrays, state, _ = robot_arrays("acrobot_small", softer=1e3)
    start, h = pushed(state), 2e-3
    end, report, _ = advanced(arrays, start, h, h, method)
    exact = reference(arrays, start, h, np.zeros(8))
    distance = np.linalg.norm(end[4:7] - exact[4:7])
    assert report[2] == 1.0
    assert 0.0 < distance <= report[0]
    bound = report[0] / 100.0
    _, careful, _ = advanced(arrays, start, 0.1, h, method, bound=bound)
    assert careful[0] <= bound
    assert careful[1] <= bound
    assert careful[2] > 0.1 / h
    assert careful[3] > 0.0


def test_ramps_of_commanded_lengths_are_followed_between_events():
    law = load_robot("acrobot_small").winch_law()
    drive = Drive(kind=MOTORS, law=law, mode="position")
    arrays, state, _ = robot_arrays("acrobot_small", softer=1e3, drive=drive)
    m = 8
    command, rate = state[13 : 13 + m].copy(), np.full(m, 5e-3)
    end, _, _ = advanced(arrays, state, 0.1, 1e-4, "runge_kutta3", command=command, rate=rate)
    exact = reference(arrays, state, 0.1, command, rate)
    held, _, _ = advanced(arrays, state, 0.1, 1e-4, "runge_kutta3", command=command)
    assert np.max(np.abs(end[13:21] - exact[13:21])) < 1e-8
    assert np.max(np.abs(held[13:21] - exact[13:21])) > 1e-5


def test_a_free_body_keeps_energy_and_angular_momentum():
    arrays, state, _ = robot_arrays("caroca", drive=Drive(kind=TENSIONS))
    arrays.body[GRAVITY : GRAVITY + 3] = 0.0
    state[7:13] = [0.8, -0.5, 1.2, 0.1, 0.2, -0.1]
    end, _, _ = advanced(arrays, state, 5.0, 1e-3, "runge_kutta3")
    before, after = robot_energy(arrays, state), robot_energy(arrays, end)
    assert abs(after - before) < 1e-8 * before


@pytest.mark.parametrize("step", [4e-5, 2e-5])
def test_energy_at_real_stiffness_with_cables_that_go_slack_and_catch(step):
    """Undamped cables of 350 kN and a platform let go 5 mm above its rest: five seconds of impacts.

    Each impact costs the explicit step an error of either sign; what the sum may reach falls with
    the step.
    """
    arrays, state, _ = robot_arrays("acrobot_small", model="elastic")
    start = state.copy()
    start[6] += 5e-3
    energy, lowest = robot_energy(arrays, start), robot_energy(arrays, state)
    slack, motions = False, np.zeros((2, 8))
    for _ in range(50):
        end, _, bad = advanced(arrays, start, 0.1, step, "runge_kutta3")
        assert bad == INTEGRATION_OK
        start = end
        cable_motions(end[:13], arrays.cables, 0.0, motions)
        slack |= np.any(motions[0] < end[13:])
        change = robot_energy(arrays, end) - energy
        assert abs(change) < 0.05 * (energy - lowest), change
    assert slack


@pytest.mark.parametrize("kind", ["ideal", "motors"])
def test_linearisation_has_the_slopes_of_the_derivative(kind):
    """About a pose with taut cables; weight and turning of the arms are left out, and small."""
    drive = None
    if kind == "motors":
        law = load_robot("acrobot_small").winch_law()
        drive = Drive(kind=MOTORS, law=law, mode="velocity")
    arrays, state, _ = robot_arrays("acrobot_small", drive=drive, pulleys=True)
    m, zeros, plain = 8, np.zeros(8), lay_out_cables(arrays)
    state[13 : 13 + m] *= 1.0 - 1e-4
    if kind == "motors":
        state[21:29] = 0.3  # sliding
    rates = np.zeros(len(state))
    robot_rates(arrays, state, zeros, zeros, plain, rates)
    arrays.work[0][:] = state
    linearise(arrays, rates, zeros, zeros, 0.0)
    M, K, D = (matrix.copy() for matrix in arrays.matrices[:3])
    rows = [*range(7, 13), *(range(21, 29) if kind == "motors" else ())]

    def slope(index, change):
        moved, out = state.copy(), np.zeros(len(state))
        moved[index] += change
        robot_rates(arrays, moved, zeros, zeros, plain, out)
        moved[index] -= 2.0 * change
        other = np.zeros(len(state))
        robot_rates(arrays, moved, zeros, zeros, plain, other)
        return M @ (out - other)[rows] / (2.0 * change)

    def close(found, expected, scale):
        np.testing.assert_allclose(found, expected, atol=SLOPE * scale)

    columns = [(4 + k, 3 + k) for k in range(3)]  # translations, the plainest to perturb
    velocities = [(7 + k, k) for k in range(6)]
    if kind == "motors":
        columns += [(13 + i, 6 + i) for i in range(m)]
        velocities += [(21 + i, 6 + i) for i in range(m)]
    for index, column in columns:
        close(-slope(index, 1e-7), K[:, column], np.max(np.abs(K)))
    for index, column in velocities:
        close(-slope(index, 1e-4), D[:, column], np.max(np.abs(D)))


def test_what_is_lost_leaves_the_state_before_it():
    arrays, state, _ = robot_arrays("acrobot_small")
    state[10:13] = 1e9
    end, _, bad = advanced(arrays, state, 1.0, 1e-3, "runge_kutta3")
    assert bad == INTEGRATION_DIVERGED
    assert np.all(np.isfinite(end))
