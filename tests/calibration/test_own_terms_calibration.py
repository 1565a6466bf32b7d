"""Own costs and constraints of a calibration, against Gauss-Newton and slopes of the cost."""

from functools import cache

import numpy as np
import pytest

from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.parameters import model_difference
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.errors import CalibrationError
from tests.calibration.bench import poses, start_readings, true_model, wrong_model

EXITS = [f"C{i}.exit_point.{x}" for i in range(1, 9) for x in "xyz"]
SHARE = 0.05  # of standard deviations, by which two solvers may differ
KEPT = 1e-7  # [m]; solvers stop at constraints kept to 1e-6 of a centimetre
FLAT = 0.05  # change of half of chi-square by a standard deviation: an end within 0.05 of one
DIFFERENCE = 1e-2  # of a standard deviation


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


def slope(found, extra=lambda v: 0.0):
    """Slopes of half the squared residuals and an own cost where something was found, by
    differences of the cost alone, over parameters and poses; times standard deviations, so that a
    step of one of them would change the cost by about so much."""
    program = made()
    problem = program.least_squares()
    end = program.at(found.stations)
    end = type(end)(found.model, found.stations, end.layout)
    columns = problem.freedom.columns(end.stations.width)
    free = np.flatnonzero(program.free)

    def cost(step, steps):
        at = end.moved(step, steps)
        r = problem.evaluate(at)[0]
        off, _ = problem.prior.evaluate(at, problem.free)
        v = model_difference(at.model, program.model)[free]
        return 0.5 * float(np.sum(r**2) + off @ off) + extra(v)

    none, still = np.zeros(end.layout.size), np.zeros((found.stations.count, end.stations.width))
    by_parameters, by_poses = [], []
    for k, std in zip(free, found.std, strict=True):
        step = none.copy()
        step[k] = DIFFERENCE * std
        by_parameters.append((cost(step, still) - cost(-step, still)) / (2.0 * DIFFERENCE))
    for k in range(found.stations.count):
        for c in columns:
            steps = still.copy()
            steps[k, c] = DIFFERENCE * found.pose_std[k, 0 if c < 3 else 1]
            by_poses.append((cost(none, steps) - cost(none, -steps)) / (2.0 * DIFFERENCE))
    return np.array(by_parameters), np.array(by_poses)


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
    assert report.solver == "SNOPT"
    own = 0.5 * np.sum((found.values[6:9] / s) ** 2)
    assert report.own_costs["as built"] == pytest.approx(own, rel=1e-6)
    assert report.cost + own == pytest.approx(0.5 * prior.chi_square, rel=1e-5)
    assert "own terms are not in them" in report.lost[0]
    difference = model_difference(found.model, program.model)[program.free]
    np.testing.assert_allclose(difference, found.values, atol=1e-12)


def test_a_linear_bound_ends_where_no_slope_is_left():
    """Two exit points differ from the plan by the same way along z, and one is not lower."""
    A = np.zeros((2, 24))
    A[0, 2], A[0, 5], A[1, 8] = 1.0, -1.0, 1.0
    least = plain().values[8] + 2.0 * plain().std[8]
    low, high = np.array([0.0, least]), np.array([0.0, np.inf])
    program = made()
    program.AddLinearConstraint(A, low, high, name="frame")
    found = program.Solve(outliers=False)
    assert found.values[2] == pytest.approx(found.values[5], abs=KEPT)
    assert found.values[8] == pytest.approx(least, abs=KEPT)
    # Karush, Kuhn and Tucker: what is left of the slope is what the rows of A push against.
    by_parameters, by_poses = slope(found)
    rows = (A * found.std).T
    push, *_ = np.linalg.lstsq(rows, by_parameters, rcond=None)
    assert np.max(np.abs(by_parameters - rows @ push)) < FLAT
    assert np.max(np.abs(by_poses)) < FLAT
    assert push[1] > 1.0  # the bound is from below, and costs something
    assert found.program.own_constraints == ("frame",)


def test_a_nonlinear_cost_ends_where_no_slope_is_left():
    """Exit points that stand apart by what a tape says, whose errors have long tails."""
    program = made()

    def tape(v):
        ways = np.linalg.norm(v.reshape(8, 3), axis=1) / 1e-3
        return 20.0 * float(np.sum(np.log1p(ways**2)))

    program.AddCost(tape, name="tape")
    found = program.Solve(outliers=False)
    by_parameters, by_poses = slope(found, tape)
    assert np.max(np.abs(by_parameters)) < FLAT
    assert np.max(np.abs(by_poses)) < FLAT
    assert found.program.own_costs["tape"] == pytest.approx(tape(found.values), rel=1e-9)
    assert np.max(np.abs(found.values - plain().values) / plain().std) > 0.5


def test_outliers_are_dropped_with_own_terms_too():
    program = made(count=8)
    program.terms[0].readings[3, 2] += 0.02
    program.AddLinearConstraint(np.ones(3), 0.0, 0.0, of="C1.*", name="sum")
    found = program.Solve()
    assert [one.pose for one in found.outliers] == [3]
    assert np.sum(found.values[:3]) == pytest.approx(0.0, abs=KEPT)
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


def test_a_bound_holds_beside_own_terms():
    """An own cost that is almost none: the bounded search without it is the oracle."""
    most, found = 4e-4, []
    for own in (False, True):
        program = made()
        program.AddBound(["C3.exit_point.*"], most)
        if own:
            program.AddQuadraticCost(0.0, 1e-6, of="C3.exit_point.*", name="almost nothing")
        found.append(program.Solve(outliers=False))
    bounded, both = found
    assert bounded.at_bounds
    assert set(both.at_bounds) == set(bounded.at_bounds)
    where = [k for k, name in enumerate(both.names) if name not in bounded.at_bounds]
    values = dict(zip(bounded.names, bounded.values, strict=True))
    np.testing.assert_allclose(
        both.values[where], [values[both.names[k]] for k in where], atol=SHARE * np.min(bounded.std)
    )
    for name, value in bounded.at_bounds.items():
        assert both.at_bounds[name] == pytest.approx(value, rel=1e-4)
