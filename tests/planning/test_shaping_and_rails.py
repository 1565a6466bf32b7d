"""Shapers against an oscillator in closed form; exit points on rails against brute force."""

from functools import cache

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff

from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.input_shaping import SHAPERS, make_shaper, shaped_share
from cdpr_drake.planning.reconfiguration import Rails, RailTask, ReconfigurationProgram
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.static_feasibility import wrench_matrices
from tests.planning.planning_cases import pose, slopes

# Shapers.

W = 7.0  # [rad/s]


def vibration(shaper, frequency, damping):
    """Amplitude after the last impulse over that after a single one: by superposition."""
    decay = complex(-damping * frequency, frequency * np.sqrt(1.0 - damping**2))
    return abs(np.sum(shaper.amplitudes * np.exp(decay * (shaper.times[-1] - shaper.times))))


@pytest.mark.parametrize("kind", SHAPERS)
@pytest.mark.parametrize("damping", [0.0, 0.08])
def test_what_is_left_is_what_the_formula_says(kind, damping):
    shaper = make_shaper(kind, W, damping)
    assert np.sum(shaper.amplitudes) == pytest.approx(1.0)
    assert np.all(shaper.amplitudes > 0.0)
    for frequency in (0.8 * W, W, 1.15 * W):
        expected = vibration(shaper, frequency, damping)
        np.testing.assert_allclose(shaper.left(frequency, damping), expected, atol=1e-12)


def test_each_does_what_its_name_says():
    zv, zvd, ei = (make_shaper(kind, W) for kind in SHAPERS)
    assert zv.left(W) < 1e-12
    assert zvd.left(W) < 1e-12
    assert ei.left(W) == pytest.approx(0.05)
    h = 1e-4
    assert abs(zv.left(W + h) - zv.left(W - h)) < 1e-9  # even, with a kink
    assert zv.left(W + h) / h > 0.1
    assert zvd.left(W + h) / h < 1e-3
    # EI stays below its share over a wider range than ZVD.
    around = np.linspace(0.7 * W, 1.3 * W, 601)
    wide = [np.sum([s.left(w) <= 0.05 + 1e-12 for w in around]) for s in (zv, zvd, ei)]
    assert wide[0] < wide[1] < wide[2]
    assert make_shaper("ZV", W, 0.1).left(W, 0.1) < 1e-12
    assert make_shaper("ZVD", W, 0.1).left(W, 0.1) < 1e-12


@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_two_in_turn_take_both_away(damping):
    both = make_shaper("ZV", W, damping).then(make_shaper("ZVD", 2.3 * W, damping))
    assert both.left(W, damping) < 1e-12
    assert both.left(2.3 * W, damping) < 1e-12
    assert both.amplitudes.sum() == pytest.approx(1.0)
    half = np.pi / (W * np.sqrt(1.0 - damping**2))
    assert both.duration == pytest.approx(half * (1.0 + 2.0 / 2.3))


def test_a_shaped_law_of_time_goes_from_0_to_1():
    shaper = make_shaper("ZVD", W)
    times = np.linspace(0.0, 0.5 + shaper.duration, 4001)
    s, rate, growth = shaped_share(shaper, 0.5, times)
    assert s[0] == 0.0
    assert s[-1] == pytest.approx(1.0)
    assert np.all(np.diff(s) >= 0.0)
    np.testing.assert_allclose(np.gradient(s, times)[1:-1], rate[1:-1], atol=2e-4)
    np.testing.assert_allclose(np.gradient(rate, times)[1:-1], growth[1:-1], atol=3e-2)


# Exit points on rails.

SLOPE = 1e-6  # of entries of W, relative to the largest
CONVERGED = 1e-5  # of half the range: tolerances of the solver


@cache
def rail_task():
    """The planar robot; exit points of its first and of its third cable slide along y."""
    robot = load_robot("planar")
    bases = robot.exit_points()
    directions = np.zeros((2, *bases.shape))
    directions[0, 1, 0] = directions[1, 1, 2] = 1.0
    low = np.where(bases[1, [0, 2]] > 0, -0.4, -0.1)
    rails = Rails(directions, low, low + 0.5, np.zeros(2), bases)
    height = robot.plane_height
    poses = [pose(0.15, 0.1, height, 0.0, 0.0, 5.0), pose(-0.1, -0.15, height)]
    box = SpatialSet(box=np.array([0.0, 0.0, 0.0, 2.0, 2.0, 0.0]))
    return RailTask(static_case(robot, (1.0, 60.0)), rails, poses, box)


def test_wrench_matrices_are_those_of_the_moved_robot_and_slopes_their_derivatives():
    task, c = rail_task(), np.array([0.05, -0.02])
    W, rates = task.matrices(c)
    robot = load_robot("planar")
    for k, cable in enumerate(robot.cables):
        cable.exit_point = task.rails.exit_points(c)[:, k]
    p = np.array([X.translation() for X in task.poses])
    R = np.array([X.rotation().matrix() for X in task.poses])
    expected = wrench_matrices(p, R, robot.cable_set().without_pulleys())
    np.testing.assert_allclose(W, expected[:, list(task.case.rows)], atol=1e-12)
    numeric = slopes(lambda z: task.matrices(z)[0].ravel(), c, 1e-4)
    by_rail = np.moveaxis(rates, 1, -1).reshape(-1, 2)
    np.testing.assert_allclose(by_rail, numeric, atol=SLOPE)


def test_gradients_of_the_program_are_exact():
    evaluator = ReconfigurationProgram(rail_task()).balances()[3].evaluator()
    x = np.random.default_rng(1).uniform(0.1, 0.9, 2 + 4)
    exact = ExtractGradient(np.array(evaluator.Eval(InitializeAutoDiff(x).ravel())))
    numeric = slopes(evaluator.Eval, x, 1e-4)
    np.testing.assert_allclose(exact, numeric, atol=SLOPE * np.max(np.abs(exact)))


@pytest.mark.parametrize("goal", ["margin", "tension"])
def test_it_finds_what_brute_force_finds(goal):
    task = rail_task()
    program = ReconfigurationProgram(task)
    if goal == "margin":
        program.AddLargestMargin()
    else:
        program.AddLeastLargestTension()
    solution = program.Solve(3)
    assert solution.success

    def value(c):
        least = float(np.min(task.margins(c)))
        if goal == "margin":
            return least
        return -np.inf if least < 0.0 else -float(np.max(task.largest_tensions(c)))

    at = value(solution.coordinates - 1e-9 * np.sign(solution.coordinates))
    scale, sign = (1.0, 1.0) if goal == "margin" else (60.0, -1.0)
    assert at == pytest.approx(sign * solution.value, abs=CONVERGED * scale)
    rails = zip(task.rails.lower, task.rails.upper, strict=True)
    first, second = (np.linspace(a, b, 5) for a, b in rails)
    best = max(value(np.array([a, b])) for a in first for b in second)
    assert at >= best - CONVERGED * scale  # no point of the grid is better
    assert at > value(task.rails.at) + 1e-3 * scale  # and it is better than it was
