"""The gain of a tension correction: its bound by eigenvalues and by simulation, on both sides."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from scipy.integrate import solve_ivp

from cdpr_drake.errors import ControlGainError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.correction_laws import ConstantThreshold
from cdpr_drake.systems.controllers.tension_corrector import TensionCorrector
from cdpr_drake.systems.diagrams.tension_management import correction_loop
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from cdpr_drake.tensions.correction_gain import (
    SampledCorrection,
    correction_poles,
    linear_limit,
    tension_gain,
    tension_response,
)

ROUNDING = 1e-9
"""Of poles, which are eigenvalues of well scaled matrices; double ones are off by its root."""

BESIDE = 1e-3
"""How far beside a bound it is tried: poles are then off 1 by more than rounding."""


def radius(poles):
    """Largest modulus of those that are not at 1."""
    return np.max(np.abs(poles[np.abs(poles - 1.0) > 1e-6]), initial=0.0)


def held(robot, X_WP):
    """Stiffness of each cable, and what tensions all of them gain per length."""
    paths = cable_paths(X_WP, robot.cable_set())
    k = robot.cable_set().stiffness / paths.lengths
    S = robot.motion_type().basis(X_WP.rotation().matrix())
    J = paths.J @ S
    return k, tension_response(k, J, J.T @ np.diag(k) @ J)


@pytest.mark.parametrize("steps", range(6))
def test_the_linear_limit_is_where_the_eigenvalues_say(steps):
    k, rate = np.array([2e5, 3e5]), 25.0
    gains = linear_limit(steps) * rate / k
    inside = correction_poles(np.diag(k), (1.0 - BESIDE) * gains, rate, steps)
    outside = correction_poles(np.diag(k), (1.0 + BESIDE) * gains, rate, steps)
    assert np.max(np.abs(inside)) < 1.0 < np.max(np.abs(outside))


@pytest.mark.parametrize("name", ["acrobot_small", "acrobot_large", "caroca", "planar"])
@pytest.mark.parametrize("steps", [0, 1, 3])
def test_all_cables_together_through_the_projection(name, steps):
    """The platform gives way: the response is a projection, whose largest eigenvalue counts."""
    robot, rate = load_robot(name), 25.0
    k, M = held(robot, robot.home.transform())
    values = np.linalg.eigvalsh(M)
    spare = len(k) - robot.motion_type().freedom
    assert np.sum(values > ROUNDING * k.max()) == spare
    assert -ROUNDING * k.max() < values[0]
    assert values[-1] < (1.0 + ROUNDING) * k.max()
    limit = linear_limit(steps) * rate / values[-1]
    same = np.ones(len(k))
    assert radius(correction_poles(M, (1.0 - BESIDE) * limit * same, rate, steps)) < 1.0
    assert radius(correction_poles(M, (1.0 + BESIDE) * limit * same, rate, steps)) > 1.0
    # The formula is inside, nearly as far as it says without a delay.
    gains = tension_gain(k, rate, steps / rate, margin=1.0)
    scaled = np.sqrt(gains)[:, np.newaxis] * M * np.sqrt(gains)
    mu = np.max(np.linalg.eigvalsh(scaled)) / rate
    assert mu <= (1.0 + ROUNDING) * 2.0 / (2 * steps + 1) <= (1.0 + ROUNDING) * linear_limit(steps)
    assert mu > 0.9 * 2.0 / (2 * steps + 1)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), steps=st.integers(0, 4), below=st.floats(0.05, 0.99))
def test_below_the_bound_it_settles_whichever_cables_are_slack(seed, steps, below):
    """Random cables, random gains by cable: corrections die out, also as cables come and go."""
    random = np.random.default_rng(seed)
    m, n, T = 8, 6, 0.04
    k, J = random.uniform(1.0, 3.0, m), random.normal(size=(m, n))
    M = tension_response(k, J, J.T @ np.diag(k) @ J)
    gains = below * tension_gain(k, 1.0 / T, steps * T, margin=1.0)
    # Missing tensions, of either sign, within the range of M: others no winch can give.
    y = M @ random.normal(size=m)
    past = [np.zeros(m)] * (steps + 1)
    first = None
    for _ in range(20_000):
        past = [np.maximum(y, 0.0), *past[:steps]]
        change = -T * M @ (gains * past[-1])
        y = y + change
        size = float(np.linalg.norm(change))
        first = size if first is None and size > 0.0 else first
        if first is not None and size < 1e-3 * first:
            return
    assert first is None


def test_above_the_linear_limit_it_grows():
    robot, rate = load_robot("acrobot_small"), 25.0
    k, M = held(robot, robot.home.transform())
    for steps in (0, 1, 2):
        for share, grows in ((0.8, False), (1.2, True)):
            gain = share * linear_limit(steps) * rate / np.max(np.linalg.eigvalsh(M))
            y = M @ np.random.default_rng(0).normal(size=len(k)) / k.max()
            past, sizes = [np.zeros(len(k))] * (steps + 1), []
            for _ in range(400):
                past = [y + 1e3, *past[:steps]]  # all below their thresholds
                change = -M @ (gain * past[-1]) / rate
                y = y + change
                sizes.append(np.linalg.norm(change))
            assert (sizes[-1] > sizes[5]) == grows


def loop_of_robot(name, ratio=1.0):
    robot = load_robot(name)
    cables = CableSettings(stiffness_ratio=ratio).cable_set(robot)
    return robot, correction_loop(robot, cables, robot.home.transform())[0]


@pytest.mark.parametrize("delay", [0.0, 0.003, 0.01, 0.013, 0.027])
def test_a_step_of_the_sampled_loop_is_that_of_its_equations(delay):
    """Against a general integrator of the differential equations, event by event."""
    _, loop = loop_of_robot("acrobot_large", 0.01)
    m, n = loop.J.shape
    rate, random = 100.0, np.random.default_rng(1)
    T, gains, servo = 1.0 / rate, random.uniform(0.0, 0.01, m), 0.4
    k, kR = loop.cable_stiffness, loop.cable_stiffness * loop.retardation
    steps = int(np.ceil(delay * rate - 1e-9))

    def tensions(state, v):
        x, w, y = state[:n], state[n : 2 * n], state[2 * n :]
        return k * (loop.J @ x - y) + kR * (loop.J @ w - v)

    def rates(_, state, v):
        force = (
            -loop.J.T @ tensions(state, v) - (loop.stiffness - loop.J.T * k @ loop.J) @ state[:n]
        )
        return np.concatenate([state[n : 2 * n], np.linalg.solve(loop.mass, force), v])

    state, before = random.normal(size=2 * n + m) * 1e-4, np.zeros(m)
    way = [np.zeros(m)] * steps
    A = loop.step(gains, rate, delay, servo)
    z = np.concatenate([state, before, *way])
    for _ in range(6):
        z = A @ z
        seen = tensions(state, before) if steps == 0 else way[-1]
        v = gains * seen - servo * loop.J @ state[:n]
        flow = solve_ivp(
            rates, (0.0, T), state, args=(v,), rtol=1e-10, atol=1e-14, dense_output=True
        )
        if steps:
            way = [tensions(flow.sol(steps * T - delay), v), *way[:-1]]
        state, before = flow.y[:, -1], v
    scale = np.max(np.abs(state))
    np.testing.assert_allclose(z[: len(state)], state, atol=1e-6 * scale)  # of the integrator


def swing(robot, ratio, gains, rate, time):
    """Mean bend of tensions from sample to sample at the end, all cables below thresholds [N]."""
    builder = DiagramBuilder()
    how = CableRobotSettings(cables=CableSettings(model="kelvin_voigt", stiffness_ratio=ratio))
    block = builder.AddSystem(CompiledCableRobot(robot, how))
    block.integrate_by(StepRule(max_step=2e-4 if ratio == 1.0 else 2e-3))
    m = len(robot.cables)
    probe = block.CreateDefaultContext()
    block.set_at_equilibrium(probe, robot.home.transform())
    block.GetInputPort("cable_velocities").FixValue(probe, np.zeros(m))
    rest = block.GetOutputPort("tensions").Eval(probe)
    law = ConstantThreshold(rest + 1.0, gains)
    corrector = builder.AddSystem(TensionCorrector(law, m, rate))
    still = builder.AddSystem(ConstantVectorSource(np.zeros(m)))
    builder.Connect(still.get_output_port(), corrector.GetInputPort("commanded_velocities"))
    for out, into in (
        ("tensions", "tensions"),
        ("unstrained_lengths", "lengths"),
        ("X_WP", "X_WP"),
    ):
        builder.Connect(block.GetOutputPort(out), corrector.GetInputPort(into))
    builder.Connect(
        corrector.GetOutputPort("cable_velocities"), block.GetInputPort("cable_velocities")
    )
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    own = block.GetMyMutableContextFromRoot(context)
    block.set_at_equilibrium(own, robot.home.transform())
    rows = []
    for k in range(round(time * rate)):
        simulator.AdvanceTo(k / rate)
        rows.append(block.GetOutputPort("tensions").Eval(own).copy())
    changes = np.abs(np.diff(rows, 2, axis=0))
    return float(np.mean(changes[-len(changes) // 5 :]))


@pytest.mark.parametrize(
    ("ratio", "rate", "time"), [(1.0, 25.0, 1.5), (0.01, 25.0, 12.0), (0.01, 500.0, 0.5)]
)
def test_the_simulated_robot_on_both_sides_of_the_bound(ratio, rate, time):
    """Cables as stiff as their fibre, and a hundredth of it with modes as slow as the rate."""
    robot, loop = loop_of_robot("acrobot_large", ratio)
    gains = tension_gain(loop.cable_stiffness, rate, margin=1.0)
    low, high = 0.0, 2.0
    while high - low > 1e-2 * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if loop.growth(middle * gains, rate) > 1.0 else (middle, high)
    inside = swing(robot, ratio, 0.7 * low * gains, rate, time)
    outside = swing(robot, ratio, 2.0 * low * gains, rate, time)
    assert outside > 10.0 * inside


def test_a_stable_share_is_stable_and_never_more_than_all():
    for name, ratio, rate in (("acrobot_large", 0.01, 25.0), ("caroca", 1.0, 25.0)):
        _, loop = loop_of_robot(name, ratio)
        gains = tension_gain(loop.cable_stiffness, rate)
        share = loop.stable_share(gains, rate)
        assert share is not None
        assert share < 1.0
        assert loop.growth(share * gains, rate) <= 1.0 + ROUNDING
        assert loop.growth(2.0 * share * gains, rate) > 1.0  # modes as slow as the rate


def test_without_any_damping_no_gain_is_stable_late():
    """A mode of 45 rad/s, which feels corrections 0.055 s late, over a quarter of its period."""
    loop = SampledCorrection(
        0.1 * np.eye(1), np.array([[200.0]]), np.array([[1.0], [-1.0]]), np.full(2, 100.0),
        np.zeros(2), np.zeros((1, 1)),
    )  # fmt: skip
    assert loop.stable_share(tension_gain(loop.cable_stiffness, 100.0, 0.05), 100.0, 0.05) is None


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ((0.0, 25.0, 0.0, 1.5), "stiffness of a tension correction: found 0; accepted: above 0"),
        ((1e5, 0.0, 0.0, 1.5), "rate"),
        ((1e5, 25.0, -1.0, 1.5), "delay"),
        ((1e5, 25.0, 0.0, 0.9), "margin of a tension correction: found 0.9; accepted: at least 1"),
    ],
)
def test_what_is_refused(numbers, words):
    with pytest.raises(ControlGainError, match=words):
        tension_gain(*numbers[:3], margin=numbers[3])
