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
SLOPE = 2e-4  # difference quotients and slopes, relative; the quotients' own error
ZEROS = np.zeros(8)


def motors(mode):
    return Drive(kind=MOTORS, law=load_robot("acrobot_small").winch_law(), mode=mode)


def advanced(arrays, state, duration, step, method, command=None, rate=None, bound=np.inf):
    zeros, end, report = np.zeros(len(arrays.cables)), state.copy(), np.zeros(REPORTED)
    command, rate = (zeros if part is None else part for part in (command, rate))
    bad = advance_robot(
        arrays, METHODS[method], end, command, rate, zeros, duration, step, bound, report
    )
    return end, report, bad


def pushed(state, amount=0.02):
    """The platform set in motion, so that cables stretch."""
    moved, n = state.copy(), 13 if len(state) >= 13 else 6
    moved[n - 3 : n] += amount
    if n == 13:
        moved[7:10] += amount * np.array([3.0, -2.0, 4.0])
    return moved


def reference(arrays, state, duration, command, rate=0.0):
    """By SciPy, with the same law for the derivative and its own integrator."""
    zeros, plain = np.zeros(len(arrays.cables)), lay_out_cables(arrays)

    def derivative(t, y):
        out = np.zeros(len(y))
        robot_rates(arrays, y, command + rate * t, zeros, plain, out)
        return out

    solved = solve_ivp(derivative, (0.0, duration), state, method="DOP853", rtol=1e-12, atol=1e-13)
    end = solved.y[:, -1]
    if len(end) >= 13:
        end[:4] /= np.linalg.norm(end[:4])
    return end


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("name", "model"),
    [("acrobot_small", "kelvin_voigt"), ("planar", "kelvin_voigt"), ("acrobot_small", "catenary")],
)
def test_order_of_convergence_while_cables_stay_taut(name, model, method):
    """On ideal winches, or motors where cables sag, without dry friction, which has no order."""
    drive = motors("velocity") if model == "catenary" else None
    arrays, state, _ = robot_arrays(name, model=model, drive=drive, softer=1e4)
    if drive is not None:
        arrays.winch[:, 8:10] = 0.0
    command = 1e-3 * np.linspace(-1.0, 1.0, len(arrays.cables))
    start = pushed(state, 1e-3)
    end = reference(arrays, start, 0.05, command)
    ends = [advanced(arrays, start, 0.05, 0.05 / n, method, command)[0] for n in (50, 100, 200)]
    errors = np.max(np.abs(np.array(ends) - end), axis=1)
    orders = np.log2(errors[:-1] / errors[1:])
    # The next term of the error still shows.
    assert np.all(orders > ORDERS[method] - 0.25), (errors, orders)


def test_semi_implicit_step_stays_stable_where_the_explicit_one_does_not():
    arrays, state, _ = robot_arrays("acrobot_small")
    start, rest = pushed(state), robot_energy(arrays, state)
    assert advanced(arrays, start, 2.0, 0.01, "runge_kutta3")[2] == INTEGRATION_DIVERGED
    for step in (1e-3, 5e-3, 2e-2):
        end, _, bad = advanced(arrays, start, 2.0, step, "semi_implicit")
        assert bad == INTEGRATION_OK
        assert robot_energy(arrays, end) < rest + 1.0
        assert np.linalg.norm(end[7:13]) < 1e-2


def test_semi_implicit_comes_to_the_same_rest_as_the_explicit_one():
    arrays, state, _ = robot_arrays("acrobot_small", damping=(50.0, 1.0))
    explicit, _, _ = advanced(arrays, pushed(state), 3.0, 2e-4, "runge_kutta3")
    implicit, _, _ = advanced(arrays, pushed(state), 3.0, 5e-3, "semi_implicit")
    np.testing.assert_allclose(implicit[:7], explicit[:7], atol=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_estimated_error_bounds_the_true_one_of_a_step_and_is_kept(method):
    arrays, state, _ = robot_arrays("acrobot_small", softer=1e3)
    start, h = pushed(state), 2e-3
    end, report, _ = advanced(arrays, start, h, h, method)
    distance = np.linalg.norm((end - reference(arrays, start, h, ZEROS))[4:7])
    assert report[2] == 1.0
    assert 0.0 < distance <= report[0]
    bound = report[0] / 100.0
    _, careful, _ = advanced(arrays, start, 0.1, h, method, bound=bound)
    assert np.all(careful[:2] <= bound)
    assert careful[2] > 0.1 / h
    assert careful[3] > 0.0


def test_ramps_of_commanded_lengths_are_followed_between_events():
    arrays, state, _ = robot_arrays("acrobot_small", softer=1e3, drive=motors("position"))
    command, rate = state[13:21].copy(), np.full(8, 5e-3)
    exact = reference(arrays, state, 0.1, command, rate)[13:21]
    end, _, _ = advanced(arrays, state, 0.1, 1e-4, "runge_kutta3", command, rate)
    held, _, _ = advanced(arrays, state, 0.1, 1e-4, "runge_kutta3", command)
    assert np.max(np.abs(end[13:21] - exact)) < 1e-8
    assert np.max(np.abs(held[13:21] - exact)) > 1e-5


def test_a_free_body_keeps_its_energy():
    arrays, state, _ = robot_arrays("caroca", drive=Drive(kind=TENSIONS))
    arrays.body[GRAVITY : GRAVITY + 3] = 0.0
    state[7:13] = [0.8, -0.5, 1.2, 0.1, 0.2, -0.1]
    before = robot_energy(arrays, state)
    end, _, _ = advanced(arrays, state, 5.0, 1e-3, "runge_kutta3")
    assert abs(robot_energy(arrays, end) - before) < 1e-8 * before


@pytest.mark.parametrize("step", [4e-5, 2e-5])
def test_energy_at_real_stiffness_with_cables_that_go_slack_and_catch(step):
    """Undamped cables of 350 kN and a platform let go 5 mm above its rest: five seconds of impacts.

    Each impact costs the explicit step an error of either sign; what the sum may reach falls with
    the step.
    """
    arrays, state, _ = robot_arrays("acrobot_small", model="elastic")
    end, lowest = state.copy(), robot_energy(arrays, state)
    end[6] += 5e-3
    energy, slack, motions = robot_energy(arrays, end), False, np.zeros((2, 8))
    for _ in range(50):
        end, _, bad = advanced(arrays, end, 0.1, step, "runge_kutta3")
        assert bad == INTEGRATION_OK
        cable_motions(end[:13], arrays.cables, 0.0, motions)
        slack |= np.any(motions[0] < end[13:])
        change = robot_energy(arrays, end) - energy
        assert abs(change) < 0.05 * (energy - lowest), change
    assert slack


@pytest.mark.parametrize("kind", ["ideal", "motors"])
def test_linearisation_has_the_slopes_of_the_derivative(kind):
    """About a pose with taut cables; weight and turning of the arms are left out, and small."""
    drive = motors("velocity") if kind == "motors" else None
    arrays, state, _ = robot_arrays("acrobot_small", drive=drive, pulleys=True)
    state[13:21] *= 1.0 - 1e-4
    rows = list(range(7, 13))
    columns = [(4 + k, 3 + k) for k in range(3)]  # translations, the plainest to perturb
    velocities = [(7 + k, k) for k in range(6)]
    if kind == "motors":
        state[21:29] = 0.3  # sliding
        rows += range(21, 29)
        columns += [(13 + i, 6 + i) for i in range(8)]
        velocities += [(21 + i, 6 + i) for i in range(8)]
    plain = lay_out_cables(arrays)

    def rates(index=0, change=0.0):
        moved, out = state.copy(), np.zeros(len(state))
        moved[index] += change
        robot_rates(arrays, moved, ZEROS, ZEROS, plain, out)
        return out

    at_rest = rates()
    arrays.work[0][:] = state
    linearise(arrays, at_rest, ZEROS, ZEROS, 0.0)
    M, K, D = (matrix.copy() for matrix in arrays.matrices[:3])
    for step, pairs, matrix in ((1e-7, columns, -K), (1e-4, velocities, -D)):
        for index, column in pairs:
            slope = M @ (rates(index, step) - rates(index, -step))[rows] / (2.0 * step)
            atol = SLOPE * np.max(np.abs(matrix))
            np.testing.assert_allclose(slope, matrix[:, column], atol=atol)


def test_what_is_lost_leaves_the_state_before_it():
    arrays, state, _ = robot_arrays("acrobot_small")
    state[10:13] = 1e9
    end, _, bad = advanced(arrays, state, 1.0, 1e-3, "runge_kutta3")
    assert bad == INTEGRATION_DIVERGED
    assert np.all(np.isfinite(end))
