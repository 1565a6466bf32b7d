"""What is infeasible by a hair, or by how much; tensions without upper limits; steps of control."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import linprog

from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.tensions.control_step_kernel import update_tensions
from cdpr_drake.tensions.methods import METHODS, distribute, distribute_batch
from cdpr_drake.tensions.problem import TensionProblem
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    NOT_FOUND,
    workspace_shape,
)
from cdpr_drake.tensions.shortfall import shortfall

LINEAR = 1e-6  # relative; HiGHS keeps constraints to 1e-7
TIGHT = 0.6  # [N] at most, where 0.5 N are the least: nothing balances


def barely_infeasible(seed, n, m, share, span=50.0):
    """A wrench beyond the farthest that cables give along a direction c, and c.

    `share` is by how much it is beyond, relative to that distance, `span` about the way of a
    tension between its bounds.
    """
    rng = np.random.default_rng([seed, n, m])
    W, c = rng.normal(size=(n, m)), rng.normal(size=n)
    lower = np.full(m, 2.0)
    upper = lower + span * rng.uniform(0.2, 1.2, m)
    farthest = np.where(c @ W > 0.0, upper, lower)
    w = -(W @ farthest + share * (c @ W @ farthest) * c / (c @ c))
    return TensionProblem(W, w, lower, upper), c


def proven(problem, c):
    """In exact arithmetic: the wrench to give is farther along c than all that cables give."""
    along = [Fraction(x) for x in c]
    bounds = zip(problem.lower, problem.upper, strict=True)
    most = Fraction(0)
    for column, (low, high) in zip(problem.W.T, bounds, strict=True):
        pull = sum(a * Fraction(x) for a, x in zip(along, column, strict=True))
        most += pull * Fraction(high if pull > 0 else low)
    return -sum(a * Fraction(x) for a, x in zip(along, problem.wrench, strict=True)) > most


@pytest.mark.parametrize(("share", "span"), [(1e-9, 50.0), (1e-11, 50.0), (1e-10, 1e-4)])
@pytest.mark.parametrize("method", ["slack_relaxed", "log_barrier", "quadratic_program"])
def test_what_is_infeasible_by_a_hair_is_infeasible(method, share, span):
    count = 0
    for seed in range(20):
        for n, m in ((1, 2), (3, 5), (6, 8)):
            problem, c = barely_infeasible(seed, n, m, share, span)
            if not proven(problem, c):  # rounding of the wrench is as large as the share
                continue
            count += 1
            assert distribute(problem, method).status == "infeasible"
            W, w = problem.W[np.newaxis], problem.wrench[np.newaxis]
            _, codes = distribute_batch(W, w, problem.lower, problem.upper, method)
            assert codes.tolist() == [INFEASIBLE]
    assert count > 20


def test_only_least_slack_gives_numbers_of_an_infeasible_problem():
    problem, _ = barely_infeasible(0, 3, 5, 0.1)
    W, w = problem.W[np.newaxis], problem.wrench[np.newaxis]
    for name, method in METHODS.items():
        if method.takes(2) and not method.needs_reference:
            solution = distribute(problem, name)
            t, codes = distribute_batch(W, w, problem.lower, problem.upper, name)
            assert (solution.status, codes[0]) == ("infeasible", INFEASIBLE), name
            assert np.all(np.isfinite(solution.tensions)) == (name == "slack_relaxed"), name
            assert np.all(np.isfinite(t)) == (name == "slack_relaxed"), name


def test_a_problem_keeps_its_own_numbers():
    arrays = {
        "W": np.array([[1.0, -1.0]]), "wrench": np.array([3.0]), "lower": np.array([1.0, 1.0]),
        "upper": np.array([9.0, 9.0]), "row_scale": np.array([1.0]),
    }  # fmt: skip
    problem = TensionProblem(**arrays)
    before = distribute(problem).tensions
    arrays["lower"][:], arrays["upper"][:], arrays["W"][:] = 20.0, 0.0, 5.0
    np.testing.assert_array_equal(distribute(problem).tensions, before)
    for name in (*arrays, "scale_of_rows"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(problem, name)[...] = 0.0


# Without upper limits.


@pytest.mark.parametrize(
    "method", ["quadratic_program", "linear_program", "infinity_norm", "slack_relaxed"]
)
@pytest.mark.parametrize("infinite", [[0], [0, 1, 2, 3, 4]])
def test_without_upper_limit_tensions_are_those_of_a_far_one(method, infinite):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        W, t = rng.normal(size=(3, 5)), rng.uniform(5.0, 50.0, 5)
        upper = np.full(5, 60.0)
        upper[infinite] = np.inf
        problem = TensionProblem(W, -W @ t, np.full(5, 1.0), upper)
        far = replace(problem, upper=np.where(np.isinf(upper), 600.0, upper))
        endless, bounded = distribute(problem, method), distribute(far, method)
        assert endless.status == bounded.status == "feasible"
        np.testing.assert_allclose(endless.tensions, bounded.tensions, rtol=1e-7)


@pytest.mark.parametrize(
    ("W", "w", "status"),
    [([[1.0, -1.0]], [-1e3], "feasible"), ([[1.0, 2.0]], [1.0], "infeasible")],
)
def test_without_upper_limit_two_cables_pull_against_any_push_or_none(W, w, status):
    assert distribute(TensionProblem(W, w, np.zeros(2), np.full(2, np.inf))).status == status


# The shortfall.


@pytest.mark.parametrize("seed", range(20))
def test_the_bounds_of_an_infeasible_problem_give_way_by_the_shortfall(seed):
    """Wider by that and a little, tensions are there; by a little less, there are none."""
    problem, _ = barely_infeasible(seed, 3, 5, 0.05)
    found = shortfall(problem)
    # `TensionProblem` takes no negative bounds: the same problem, from the lower bounds on.
    for factor, status in ((1.0 + LINEAR, "feasible"), (1.0 - 1e-3, "infeasible")):
        wider = factor * found.beyond
        wrench = problem.wrench + problem.W @ (problem.lower - wider)
        upper = problem.upper - problem.lower + 2.0 * wider
        assert distribute(TensionProblem(problem.W, wrench, np.zeros(5), upper)).status == status
    assert 0 < np.count_nonzero(found.limits) <= 4  # a vertex: as many as rows, and one


def test_the_missing_wrench_is_that_of_least_slack():
    problem = replace(barely_infeasible(3, 3, 5, 0.05)[0], row_scale=[0.2, 1.0, 1.0])
    found, relaxed = shortfall(problem), distribute(problem, "slack_relaxed")
    np.testing.assert_allclose(found.missing, relaxed.slack, atol=1e-9)
    assert found.size == pytest.approx(np.linalg.norm(relaxed.slack / [0.2, 1.0, 1.0]))
    words = found.words(["C1", "C2", "C3", "C4", "C5"], ["moment about z", "force along x", "f"])
    assert "bounds missed by" in words
    assert "wrench missed by" in words


@pytest.mark.parametrize(
    ("load", "low", "high", "beyond", "bound"),
    [(100.0, 0.0, 60.0, 40.0, "upper"), (20.0, 30.0, 60.0, 10.0, "lower")],
)
def test_one_cable_misses_a_weight_by_the_difference(load, low, high, beyond, bound):
    found = shortfall(TensionProblem([[1.0]], [-load], [low], [high]))
    assert found.beyond == pytest.approx(beyond)
    assert found.limits.tolist() == [1 if bound == "upper" else -1]
    assert found.missing == pytest.approx([-load + (high if bound == "upper" else low)])
    assert found.as_dict(["C1"])["cables"] == [{"cable": "C1", "bound": bound}]


# Steps of control.


@pytest.mark.parametrize("moments", [True, False])
@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
def test_a_step_holds_what_balances_and_says_what_highs_says(name, moments):
    """Else it holds what it held, or the tensions of a method that relaxes."""
    robot, rng = load_robot(name), np.random.default_rng(3)
    rows = [r for r in (PLANAR_ROWS if robot.is_planar() else range(6)) if moments or r > 2]
    cables, height = robot.cable_set().packed(), robot.plane_height or 0.0
    n, m = len(rows), len(cables)
    rest = [] if robot.is_planar() else [1.0, *rng.uniform(-0.1, 0.1, 3), 0.05, 0.1, 0.4]
    verdicts = []
    for upper in (5000.0, TIGHT) * 3:
        state = np.array([*rest, *rng.uniform(-0.2, 0.2, 6)])
        desired = np.array([*rng.normal(size=3) * 0.1, 0.0, 0.0, 200.0])
        bounds = np.vstack([np.full(m, 0.5), np.full(m, upper), np.zeros(m)])
        for method_name, method in METHODS.items():
            if not method.takes(m - n):
                continue
            t, held, feasible = np.empty(m), np.full(m, 7.0), np.full(1, np.nan)
            W, work = np.empty((n, m)), np.empty(workspace_shape(n, m))
            code = update_tensions(
                method.compiled(m - n), state, desired, cables, height, bounds, np.ones(n), work,
                W, t, held, feasible,
            )  # fmt: skip
            limits = list(zip(*bounds[:2], strict=True))
            holds = linprog(np.ones(m), A_eq=W, b_eq=desired[rows], bounds=limits).success
            batch, codes = distribute_batch(
                W[None], -desired[None, rows], *bounds[:2], method_name, np.zeros(m)
            )
            # Whether something missed is infeasible is found out by the batch only.
            assert code == codes[0] or (code == NOT_FOUND and codes[0] == INFEASIBLE)
            missed = codes[0] == NOT_FOUND and holds and not method.exact
            assert missed or codes[0] == (FEASIBLE if holds else INFEASIBLE), method_name
            assert feasible[0] == (code == FEASIBLE)
            if code == FEASIBLE:
                np.testing.assert_allclose(t, batch[0], rtol=1e-10)
                np.testing.assert_allclose(W @ t, desired[rows], atol=1e-9 * 200.0)
            if code == FEASIBLE or method.relaxes:
                np.testing.assert_array_equal(held, t)
            else:
                np.testing.assert_array_equal(held, 7.0)
        verdicts.append(holds)
    assert 0 < sum(verdicts) < 6
