"""Laws that correct tensions, and their largest stable gains."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from scipy.integrate import solve_ivp

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform, tension_problem
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.static_tensions import find_static_tensions
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
from cdpr_drake.tensions.methods import distribute, feasible_polygon, solution_space
from cdpr_drake.tensions.slack_correction import (
    TensionFollower,
    adaptive_gains,
    length_correction,
    length_thresholds,
    null_part,
    polygon_correction,
    polygon_target,
    tension_correction,
)
from tests.tensions.tension_cases import seeds

ROUNDING = 1e-12  # relative, of a few operations
BALANCE = 1e-9  # [N]
BESIDE = 1e-3  # relative distance to a bound on both sides
STRAIN = 1e-3  # by so much cables do not give in proportion to their length
X_WP = pose_from_angles([0.1, -0.15, 0.4], [0.05, 0.0, 0.1])

tensions = arrays(float, 8, elements=st.floats(-50.0, 500.0))
lengths = arrays(float, 8, elements=st.floats(0.1, 20.0))


# Slack.


@pytest.mark.parametrize(
    ("velocities", "expected"),
    [
        (  # (5.1)
            tension_correction(
                np.array([0.0, 0.25, 1.0, 7.0]), np.array([1.0, 1, 1, 8]), np.full(4, 0.04)
            ),
            [-0.04, -0.03, 0.0, -0.04],
        ),
        (adaptive_gains(np.array([2.0, 1.0]), np.array([1.5, 1.2]), 3.0), [1.5, 0.0]),  # (5.3)
        (  # (5.5)
            length_correction(
                np.array([5.0, 0.0, 0.1, 9.0]), np.array([2.0, 2.12, 2.005, 3.0]),
                np.array([1.0, 2.0, 2.0, 2.0]), allowance=0.01, slowness=2.0, period=0.04,
            ),
            [0.0, -0.11 / 0.08, 0.0, 0.0],
        ),
        *(
            (
                length_thresholds(
                    np.array([0.5, 1.0, 2.0, 3.0, 4.0]), 1.0, 3.0, lowest=np.full(5, 1.0),
                    highest=np.full(5, 9.0), shape=shape,
                ),
                [9.0, 9.0, middle, 1.0, 1.0],
            )
            for shape, middle in (("linear", 5.0), ("exponential", 3.0))
        ),
    ],
)  # fmt: skip
def test_numbers_by_hand(velocities, expected):
    np.testing.assert_allclose(velocities, expected, rtol=ROUNDING, atol=1e-14)


@given(tensions, lengths, lengths, st.floats(0.0, 0.1), st.floats(1.0, 20.0))
def test_the_two_least_tensions_are_corrected_and_never_beyond(now, length, expected, low, slow):
    velocities = length_correction(now, length, expected, allowance=low, slowness=slow, period=0.04)
    corrected = np.flatnonzero(velocities)
    assert np.all(velocities <= 0.0)
    assert len(corrected) <= 2
    assert np.all(now[corrected] <= np.sort(now)[1])
    after = length + velocities * 0.04
    assert np.all(after[corrected] >= (expected + low)[corrected] - 1e-9)


def test_followers_reach_desired_tensions_of_springs():
    desired, period = np.array([5.0, 40.0]), 0.002
    for follower in (
        TensionFollower(0.01), TensionFollower(0.01, 0.02), TensionFollower(0.01, 0.02, 1e-5)
    ):  # fmt: skip
        now, last, integral = np.zeros(2), None, np.zeros(2)
        for _ in range(4000):
            missing = desired - now
            velocity, integral = follower.step(missing, last, integral, period)
            now, last = now - 500.0 * period * velocity, missing
        np.testing.assert_allclose(now, desired, rtol=1e-3)


def test_an_integral_does_not_wind_up_at_the_limit():
    follower, integral = TensionFollower(0.001, 1.0, fastest=0.01), np.zeros(1)
    for _ in range(1000):
        velocity, integral = follower.step(np.array([20.0]), None, integral, 0.01)
        assert velocity[0] == -0.01
    assert integral[0] < 20.0 * 0.01 * 1.5  # of a thousand steps' 200 N s
    assert follower.step(np.array([-20.0]), None, integral, 0.01)[0][0] > 0.0


# The polygon.


@pytest.fixture(scope="module")
def problem():
    robot = load_robot("acrobot_large")
    cables = robot.cable_set(pulleys=False)
    return tension_problem(robot, X_WP, limits=(1.0, 60.0), cables=cables)


@pytest.fixture(scope="module")
def middle(problem):
    return distribute(problem, "barycenter").tensions


def target(problem, middle, tensions, margin=1.0):
    limits = {"lower": problem.lower, "upper": problem.upper}
    return polygon_target(tensions, middle, problem.W, **limits, margin=margin)


@given(seeds, st.sampled_from([15.0, 90.0]))
def test_missing_tensions_change_no_wrench_and_lead_inside(problem, middle, seed, highest):
    now = np.random.default_rng(seed).uniform(0.0, highest, 8)
    missing, least = target(problem, middle, now)
    np.testing.assert_allclose(problem.W @ missing, 0.0, atol=BALANCE)
    np.testing.assert_allclose(least, np.minimum(problem.lower + 1.0, middle))
    most = np.maximum(problem.upper - 1.0, middle)
    on_plane = middle + null_part(problem.W, now - middle)
    margins = [np.min(np.minimum(t - least, most - t)) for t in (on_plane, on_plane + missing)]
    assert margins[1] >= -BALANCE
    if margins[0] < -BALANCE:  # no farther than to the margin
        assert margins[1] == pytest.approx(0.0, abs=BALANCE)
    else:
        np.testing.assert_array_equal(missing, 0.0)


def test_corners_come_back_continuously_and_the_middle_stays(problem, middle):
    base, N = solution_space(problem)
    for corner in feasible_polygon(problem).T:
        now = base + N @ corner
        missing, _ = target(problem, middle, now)
        share = np.linalg.norm(missing) / np.linalg.norm(middle - now)
        np.testing.assert_allclose(missing, share * (middle - now), atol=BALANCE)
        assert 0.0 < share < 1.0
    # A margin that nothing keeps makes the middle itself the target.
    missing, least = target(problem, middle, now, margin=25.0)
    np.testing.assert_allclose(missing, middle - now, atol=BALANCE)
    np.testing.assert_allclose(least, middle)
    ways = middle + np.linspace(0.0, 1.2, 200)[:, None] * (now - middle)
    sizes = [np.linalg.norm(target(problem, middle, t)[0]) for t in ways]
    assert sizes[0] == 0.0
    assert np.max(np.diff(sizes)) < 3.0 * np.linalg.norm(ways[1] - ways[0])


def test_the_platform_stays_where_elastic_cables_hold_it(problem, middle):
    robot = load_robot("acrobot_large")
    cables, platform = robot.cable_set().without_pulleys(), rigid_platform(robot)
    l0 = find_static_tensions(
        cables, "elastic", X_WP, problem.wrench, (1.0, 60.0)
    ).unstrained_lengths
    rest = equilibrium_near(cables, "elastic", platform, l0, X_WP)
    base, N = solution_space(problem)
    now = base + N @ feasible_polygon(problem)[:, 0]
    missing, least = target(problem, middle, now)
    gains = np.full(8, 0.04)
    distances = []
    for velocities in (
        polygon_correction(now, missing, least, problem.W, l0, gains),
        tension_correction(now, least, gains),
    ):
        step = 1e-6 * velocities / np.max(np.abs(velocities))
        moved = equilibrium_near(cables, "elastic", platform, l0 + step, rest.X_WP)
        change = moved.tensions - rest.tensions
        distances.append(np.linalg.norm(moved.X_WP.translation() - rest.X_WP.translation()))
        if len(distances) == 1:  # the tensions that were missing change, and nothing else
            np.testing.assert_allclose(
                change / np.max(np.abs(change)), missing / np.max(np.abs(missing)), atol=STRAIN
            )
    assert distances[0] < STRAIN * distances[1]


def test_slack_cables_are_wound_up_and_taut_ones_do_the_rest(problem, middle):
    gains, now = np.full(8, 0.04), middle.copy()
    now[[0, 1]] = 0.0
    missing, least = target(problem, middle, now)
    velocities = polygon_correction(now, missing, least, problem.W, np.ones(8), gains)
    np.testing.assert_allclose(velocities[:2], -0.04 * least[:2])
    np.testing.assert_array_equal(velocities[2:], 0.0)  # six taut ones would move the platform
    now[1] = middle[1]
    missing, least = target(problem, middle, now)
    velocities = polygon_correction(now, missing, least, problem.W, np.ones(8), gains)
    assert velocities[0] == pytest.approx(-0.04 * least[0])
    np.testing.assert_array_equal(velocities[1:], 0.0)  # the taut ones are well inside
    base, N = solution_space(problem)
    now = base + N @ feasible_polygon(problem)[:, 0]
    now[np.argmin(now)] = 0.0  # seven taut ones have one way to change tensions
    missing, least = target(problem, middle, now)
    velocities = polygon_correction(now, missing, least, problem.W, np.ones(8), gains)
    taut = now > 0.0
    assert np.max(np.abs(velocities[taut])) > 1e-3
    np.testing.assert_allclose(problem.W[:, taut] @ velocities[taut], 0.0, atol=BALANCE)


# Stable gains.


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
@pytest.mark.parametrize("steps", [0, 1, 3])
def test_limits_are_where_the_eigenvalues_are_one(name, steps):
    """Cables alone, and together on a platform that gives way: the response is a projection."""
    robot, rate = load_robot(name), 25.0
    paths = cable_paths(robot.home.transform(), robot.cable_set())
    k = robot.cable_set().stiffness / paths.lengths
    J = paths.J @ robot.motion_type().basis(robot.home.transform().rotation().matrix())
    M = tension_response(k, J, J.T @ np.diag(k) @ J)
    values = np.linalg.eigvalsh(M)
    assert np.sum(values > 1e-9 * k.max()) == len(k) - robot.motion_type().freedom
    assert np.all((values > -1e-9 * k.max()) & (values < (1.0 + 1e-9) * k.max()))
    for response, gains in (
        (np.diag(k), linear_limit(steps) * rate / k),
        (M, np.full(len(k), linear_limit(steps) * rate / values[-1])),
    ):
        radii = []
        for share in (1.0 - BESIDE, 1.0 + BESIDE):
            poles = correction_poles(response, share * gains, rate, steps)
            radii.append(np.max(np.abs(poles[np.abs(poles - 1.0) > 1e-6])))
        assert radii[0] < 1.0 < radii[1]
    # The formula is inside of the linear limit, and tight without a delay.
    gains = tension_gain(k, rate, steps / rate, margin=1.0)
    scaled = np.sqrt(gains)[:, np.newaxis] * M * np.sqrt(gains)
    mu, limit = np.max(np.linalg.eigvalsh(scaled)) / rate, 2.0 / (2 * steps + 1)
    assert 0.9 * limit < mu <= (1.0 + 1e-9) * limit <= (1.0 + 1e-9) * linear_limit(steps)
    np.testing.assert_allclose(tension_gain(k, rate, steps / rate), gains / 1.5)


@settings(max_examples=20)
@given(seeds, st.integers(0, 4), st.floats(0.05, 0.95))
def test_below_the_bound_it_settles_whichever_cables_are_slack(seed, steps, below):
    random = np.random.default_rng(seed)
    T, k, J = 0.04, random.uniform(1.0, 3.0, 8), random.normal(size=(8, 6))
    M = tension_response(k, J, J.T @ np.diag(k) @ J)
    gains = below * tension_gain(k, 1.0 / T, steps * T, margin=1.0)
    y, past, first = M @ random.normal(size=8), [np.zeros(8)] * (steps + 1), 0.0
    for _ in range(20_000):
        past = [np.maximum(y, 0.0), *past[:steps]]
        change = -T * M @ (gains * past[-1])
        y, size = y + change, float(np.linalg.norm(change))
        first = first or size
        if first > 0.0 and size < 1e-3 * first:
            return
    assert first == 0.0


def loop_of_robot(name, ratio=1.0):
    robot = load_robot(name)
    cables = CableSettings(stiffness_ratio=ratio).cable_set(robot)
    return correction_loop(robot, cables, robot.home.transform())[0]


@pytest.mark.parametrize("delay", [0.0, 0.003, 0.01, 0.027])
def test_a_step_of_the_sampled_loop_is_that_of_its_equations(delay):
    """By a general integrator, event by event."""
    loop, rate, random = loop_of_robot("acrobot_large", 0.01), 100.0, np.random.default_rng(1)
    (m, n), T, servo = loop.J.shape, 1.0 / rate, 0.4
    gains, steps = random.uniform(0.0, 0.01, m), int(np.ceil(delay * rate - 1e-9))
    k, kR = loop.cable_stiffness, loop.cable_stiffness * loop.retardation

    def tensions(state, v):
        x, w, y = state[:n], state[n : 2 * n], state[2 * n :]
        return k * (loop.J @ x - y) + kR * (loop.J @ w - v)

    def rates(_, state, v):
        geometric = (loop.stiffness - loop.J.T * k @ loop.J) @ state[:n]
        force = -loop.J.T @ tensions(state, v) - geometric
        return np.concatenate([state[n : 2 * n], np.linalg.solve(loop.mass, force), v])

    state, before = random.normal(size=2 * n + m) * 1e-4, np.zeros(m)
    way = [np.zeros(m)] * steps
    z, A = np.concatenate([state, before, *way]), loop.step(gains, rate, delay, servo)
    for _ in range(4):
        z = A @ z
        v = gains * (way[-1] if steps else tensions(state, before)) - servo * loop.J @ state[:n]
        flow = solve_ivp(
            rates, (0.0, T), state, args=(v,), rtol=1e-10, atol=1e-14, dense_output=True
        )
        if steps:
            way = [tensions(flow.sol(steps * T - delay), v), *way[:-1]]
        state, before = flow.y[:, -1], v
    np.testing.assert_allclose(z[: len(state)], state, atol=1e-6 * np.max(np.abs(state)))


@pytest.mark.parametrize(("ratio", "rate", "time"), [(1.0, 25.0, 1.5), (0.01, 500.0, 0.5)])
def test_a_simulated_robot_swings_beyond_the_bound_only(ratio, rate, time):
    """All cables are below their thresholds; as stiff as their fibre, or a hundredth of it."""
    loop, robot = loop_of_robot("acrobot_large", ratio), load_robot("acrobot_large")
    gains = tension_gain(loop.cable_stiffness, rate, margin=1.0)
    low, high = 0.0, 2.0
    while high - low > 1e-2 * high:
        share = 0.5 * (low + high)
        low, high = (low, share) if loop.growth(share * gains, rate) > 1.0 else (share, high)
    bends = [swing(robot, ratio, share * low * gains, rate, time) for share in (0.7, 2.0)]
    assert bends[1] > 10.0 * bends[0]


def swing(robot, ratio, gains, rate, time):
    """Mean bend of tensions from sample to sample at the end [N]."""
    builder, still = DiagramBuilder(), np.zeros(8)
    cables = CableSettings(model="kelvin_voigt", stiffness_ratio=ratio)
    block = builder.AddSystem(CompiledCableRobot(robot, CableRobotSettings(cables=cables)))
    block.integrate_by(StepRule(max_step=2e-4 if ratio == 1.0 else 2e-3))
    probe = block.CreateDefaultContext()
    block.set_at_equilibrium(probe, robot.home.transform())
    block.GetInputPort("cable_velocities").FixValue(probe, still)
    law = ConstantThreshold(block.GetOutputPort("tensions").Eval(probe) + 1.0, gains)
    corrector = builder.AddSystem(TensionCorrector(law, 8, rate))
    source = builder.AddSystem(ConstantVectorSource(still))
    builder.Connect(source.get_output_port(), corrector.GetInputPort("commanded_velocities"))
    for out, into in zip(
        ("tensions", "unstrained_lengths", "X_WP"), ("tensions", "lengths", "X_WP"), strict=True
    ):
        builder.Connect(block.GetOutputPort(out), corrector.GetInputPort(into))
    velocities = corrector.GetOutputPort("cable_velocities")
    builder.Connect(velocities, block.GetInputPort("cable_velocities"))
    simulator = Simulator(builder.Build())
    context = block.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    block.set_at_equilibrium(context, robot.home.transform())
    rows = []
    for k in range(round(time * rate)):
        simulator.AdvanceTo(k / rate)
        rows.append(block.GetOutputPort("tensions").Eval(context).copy())
    bends = np.abs(np.diff(rows, 2, axis=0))
    return np.mean(bends[-len(bends) // 5 :])


def test_stable_shares():
    """Modes as slow as the rate need gains below the formula; undamped and late none is stable."""
    for name, ratio in (("acrobot_large", 0.01), ("caroca", 1.0)):
        loop = loop_of_robot(name, ratio)
        gains = tension_gain(loop.cable_stiffness, 25.0)
        share = loop.stable_share(gains, 25.0)
        assert 0.0 < share < 1.0
        assert loop.growth(share * gains, 25.0) <= 1.0 + 1e-9
        assert loop.growth(2.0 * share * gains, 25.0) > 1.0
    loop = SampledCorrection(
        0.1 * np.eye(1), np.array([[200.0]]), np.array([[1.0], [-1.0]]), np.full(2, 100.0),
        np.zeros(2), np.zeros((1, 1)),
    )  # fmt: skip
    assert loop.stable_share(tension_gain(loop.cable_stiffness, 100.0, 0.05), 100.0, 0.05) is None
