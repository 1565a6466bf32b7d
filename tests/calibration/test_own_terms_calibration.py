"""Own costs and constraints of a calibration, against Gauss-Newton and scipy."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.parameters import model_difference
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.errors import CalibrationError
from tests.calibration.bench import poses, start_readings, true_model, wrong_model

EXITS = [f"C{i}.exit_point.{x}" for i in range(1, 9) for x in "xyz"]
SHARE = 0.05  # of standard deviations, by which two solvers may differ
COST = 1e-6  # of the cost, likewise


def made(priors=(), seed=0, count=4, wrong=0.002):
    """Exit points of a robot that a tracker sees at some poses."""
    random, true = np.random.default_rng(seed), true_model()
    at = poses(count, random)
    zero = start_readings(true, at[0])
    tracked = simulated_poses(at, 1e-3, 1e-4, random)
    program = CalibrationProgram(wrong_model(true, wrong, 0.0, random), tracked, ["exit_points"])
    program.AddLengths(simulated_lengths(true, at, zero, 1e-4, random), 1e-4, zero)
    program.AddTrackedPoses(tracked, 1e-3, 1e-4)
    program.AddPrior(["exit_points"], 0.005)
    for patterns, std in priors:
        program.AddPrior(patterns, std)
    return program


@cache
def plain():
    return made().Solve(outliers=False)


def by_scipy(extra, constraints=()):
    """Half the squared residuals and an own cost, over all steps at once, by another solver."""
    program = made()
    problem, start = program.least_squares(), program.at()
    count, columns = 24, problem.columns(start)
    scale = problem.station_scale(start)

    def cost(x):
        step = np.zeros(start.layout.size)
        step[program.free] = 0.01 * x[:count]
        steps = np.zeros((start.stations.count, start.stations.width))
        steps[:, columns] = x[count:].reshape(-1, len(columns)) * scale
        at = start.moved(step, steps)
        r = problem.evaluate(at)[0]
        off, _ = problem.prior.evaluate(at, problem.free)
        return 0.5 * float(np.sum(r**2) + off @ off) + extra(0.01 * x[:count])

    size = count + start.stations.count * len(columns)
    x = np.zeros(size)
    x[:count] = plain().values / 0.01
    found = minimize(cost, x, method="SLSQP", constraints=list(constraints),
                     options={"ftol": 1e-14, "maxiter": 150})  # fmt: skip
    return 0.01 * found.x[:count], found.fun


def test_with_nothing_added_gauss_newton_answers():
    one, other = plain(), made()
    other.prog()  # making it is no term
    again = other.Solve(outliers=False)
    assert again.program is None
    assert again.values.tobytes() == one.values.tobytes()


def test_a_quadratic_preference_is_a_prior():
    """0.5 (v / s)^2 says as much as a prior of s about the believed model, which Gauss-Newton has
    in its equations."""
    s = 3e-4
    prior = made([(["C3.exit_point.*"], s)]).Solve(outliers=False)
    program = made()
    program.AddPrior(["C3.exit_point.*"], 1e3)  # instead of the 5 mm that all have
    program.AddQuadraticCost(0.0, 0.5 / s**2, of="C3.exit_point.*", name="as built")
    found = program.Solve(outliers=False)
    np.testing.assert_allclose(found.values, prior.values, atol=SHARE * np.min(prior.std))
    assert np.max(np.abs(found.values - plain().values) / plain().std) > 0.5
    report = found.program
    assert report.solver == "Clarabel"
    own = 0.5 * np.sum((found.values[6:9] / s) ** 2)
    assert report.own_costs["as built"] == pytest.approx(own, rel=1e-6)
    assert report.cost + own == pytest.approx(0.5 * prior.chi_square, rel=1e-5)
    assert "own terms are not in them" in report.lost[0]
    difference = model_difference(found.model, program.model)[program.free]
    np.testing.assert_allclose(difference, found.values, atol=1e-12)


def test_a_linear_bound_is_what_scipy_finds():
    """Two exit points differ from the plan by the same way along z, and one is not lower."""
    A = np.zeros((2, 24))
    A[0, 2], A[0, 5], A[1, 8] = 1.0, -1.0, 1.0
    least = plain().values[8] + 2.0 * plain().std[8]
    low, high = np.array([0.0, least]), np.array([0.0, np.inf])
    program = made()
    program.AddLinearConstraint(A, low, high, name="frame")
    found = program.Solve(outliers=False)
    wide = np.pad(0.01 * A, ((0, 0), (0, 24)))  # variables are in typical sizes, then poses
    rules = [LinearConstraint(wide[k], low[k], high[k]) for k in range(2)]
    other, cost = by_scipy(lambda v: 0.0, rules)
    assert found.values[2] == pytest.approx(found.values[5], abs=1e-8)
    assert found.values[8] == pytest.approx(least, abs=1e-8)
    assert found.program.cost == pytest.approx(cost, rel=1e-4)
    np.testing.assert_allclose(found.values, other, atol=SHARE * np.min(plain().std))


def test_a_nonlinear_cost_is_what_scipy_finds():
    """Exit points that stand apart by what a tape says, whose errors have long tails."""
    program = made()

    def tape(v):
        ways = np.linalg.norm(v.reshape(8, 3), axis=1) / 1e-3
        return 20.0 * float(np.sum(np.log1p(ways**2)))

    program.AddCost(tape, name="tape")
    found = program.Solve(outliers=False)
    other, cost = by_scipy(tape)
    whole = found.program.cost + found.program.own_costs["tape"]
    assert whole == pytest.approx(cost, rel=1e-4)
    np.testing.assert_allclose(found.values, other, atol=0.2 * np.min(plain().std))
    assert np.max(np.abs(found.values - plain().values) / plain().std) > 0.5


def test_outliers_are_dropped_with_own_terms_too():
    program = made(count=8)
    program.terms[0].readings[3, 2] += 0.02
    program.AddLinearConstraint(np.ones(3), 0.0, 0.0, of="C1.*", name="sum")
    found = program.Solve()
    assert [one.pose for one in found.outliers] == [3]
    assert np.sum(found.values[:3]) == pytest.approx(0.0, abs=1e-8)
    assert "loss for outliers is not in the program" in found.program.lost[1]
    clean = made(count=8)
    clean.terms[0].readings[3, 2] = np.nan
    clean.AddLinearConstraint(np.ones(3), 0.0, 0.0, of="C1.*")
    other = clean.Solve()
    np.testing.assert_allclose(found.values, other.values, atol=SHARE * np.min(other.std))


def test_poses_have_variables_too():
    """A pose that is known by other means is kept where it was put; SNOPT solves the whole."""
    program = made(count=3)
    program.prog().AddBoundingBoxConstraint(0.0, 0.0, program.pose(1))
    found = program.Solve(outliers=False)
    np.testing.assert_allclose(found.stations.p[1], program.stations.p[1], atol=1e-9)
    assert len(program.parameters("C2.*")) == 3


def test_own_terms_that_no_robot_keeps_are_said():
    program = made()
    program.AddLinearConstraint(np.ones(3), 0.5, 1.0, of="C1.*", name="far")
    program.AddLinearConstraint(np.ones(3), -1.0, -0.5, of="C1.*", name="near")
    with pytest.raises(CalibrationError, match="a robot that the measurements fit: found none"):
        program.Solve(outliers=False)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p.AddQuadraticCost(0.0, of="C9.*"), "found 'C9.*'"),
        (lambda p: p.AddQuadraticCost(0.0, of="camera"), "not unknown; accepted: C1.exit_point.x"),
        (lambda p: (p.prog(), p.AddPrior(["exit_points"], 1.0)), "AddPrior: found a program that"),
        (lambda p: p.pose(9), "pose: found 9; accepted: 0 to 3"),
        (lambda p: p.AddLinearConstraint(np.ones(2), 0, 1, of="C1.*"), r"A: found shape \(1, 2\)"),
    ],
)
def test_bad_input_is_one_line(change, words):
    with pytest.raises(CalibrationError, match=words) as refused:
        change(made())
    assert "\n" not in str(refused.value)
