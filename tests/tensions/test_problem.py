"""The verdict on tensions, and what all methods promise about feasibility."""

import numpy as np
import pytest
from hypothesis import given, settings

from cdpr_drake.tensions.control_step_kernel import check
from cdpr_drake.tensions.methods import METHODS, distribute
from cdpr_drake.tensions.problem import (
    RESIDUAL_TOLERANCE,
    VERDICT_ROUNDING,
    TensionProblem,
    TensionStatus,
    describe,
    refuse,
)
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, INFEASIBLE, NOT_FOUND, SINGULAR
from tests.tensions.tension_cases import largest_margin, numbers, problems

MARGIN = 1e-9  # relative to the largest bound; nearer to the limit a verdict may go either way
ORACLE = 1e-6  # as above, for HiGHS, which is exact to 1e-7

W = np.array([[1.0, 0.0, -1.0, 0.5], [0.0, 1.0, -1.0, -0.5]])
BALANCED = np.array([2.0, 3.0, 4.0, 5.0])


def problem(**parts):
    arrays = {"W": W, "wrench": -W @ BALANCED, "lower": np.zeros(4), "upper": np.full(4, 9.0)}
    return TensionProblem(**{**arrays, **parts})


def verdict(problem, t, code=FEASIBLE, relaxes=True):
    """Code, residual and tensions of `check`."""
    t = np.array(t, float)
    return *check(code, relaxes, *numbers(problem), t), t


@pytest.mark.parametrize("seed", range(12))
def test_verdict_is_that_of_numpy(seed):
    rng = np.random.default_rng(seed)
    n, m = [(1, 1), (2, 3), (6, 8)][seed % 3]
    W, lower = rng.normal(size=(n, m)), np.full(m, 2.0)
    upper = lower + rng.uniform(0.0, 50.0, m)
    t = rng.uniform(lower, upper)
    t[0] = upper[0] + 50.0 * VERDICT_ROUNDING * rng.uniform(-2.0, 2.0)
    t[-1] = [lower[-1], np.nan, 1.9, t[-1]][seed // 3]
    case = TensionProblem(W, -W @ np.nan_to_num(t), lower, upper)
    rounding = VERDICT_ROUNDING * max(np.max(upper), 1.0)
    inside = np.all((t >= lower - rounding) & (t <= upper + rounding))
    expected = np.clip(t, lower, upper) if inside else t
    active = np.where(expected <= lower + rounding, -1, 0)
    active[expected >= upper - rounding] = 1
    code, residual, after = verdict(case, t)
    written, slack = np.empty(m, int), np.empty(n)
    describe(*numbers(case), after, written, slack)
    feasible = inside and case.residual(expected) <= RESIDUAL_TOLERANCE
    assert code == (FEASIBLE if feasible else NOT_FOUND)
    np.testing.assert_array_equal(after, expected)
    np.testing.assert_array_equal(written, active)
    np.testing.assert_allclose(slack, W @ expected + case.wrench, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(residual, case.residual(expected), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("error", [1e-7, -1e-6])
def test_tensions_off_balance_or_out_of_bounds_are_never_feasible(error):
    wrong = BALANCED + np.array([error, 0.0, 0.0, 0.0])
    tight = problem(upper=[9.0, 9.0, 9.0, 5.0 - abs(error)])
    high = problem(lower=[2.0 + abs(error), 0.0, 0.0, 0.0])
    for case, t in ((problem(), wrong), (tight, BALANCED), (high, BALANCED)):
        assert verdict(case, t)[0] == NOT_FOUND
        assert verdict(case, t, INFEASIBLE)[0] == INFEASIBLE
    assert verdict(problem(), BALANCED)[0] == FEASIBLE
    assert verdict(problem(), BALANCED, INFEASIBLE)[0] == INFEASIBLE  # a proof
    for code in (INFEASIBLE, SINGULAR):
        assert verdict(problem(), BALANCED, code, relaxes=False)[0] == code


def test_residual_is_relative_to_the_forces():
    case = problem(wrench=[0.0, -100.0])
    t = np.array([0.0, 101.0, 0.0, 0.0])  # off by 1 N where 100 N pull each way
    assert case.residual(t) == pytest.approx(1.0 / 201.0, rel=1e-12)
    # Without forces the capacity of the cables is the measure: rounding is feasible, 1 mN is not.
    zero = problem(wrench=np.zeros(2))
    assert verdict(zero, [1e-16, 0.0, 3e-16, 0.0])[0] == FEASIBLE
    assert verdict(zero, np.full(4, 1e-3))[0] == NOT_FOUND


def test_solution_in_words():
    solution = distribute(problem(lower=BALANCED, upper=[2.0, 9.0, 9.0, 9.0]))
    assert solution.as_dict()["tensions_n"] == solution.tensions.tolist()
    assert solution.as_dict()["status"] == "feasible"
    title, rows = solution.summary()
    assert title == "Tensions by quadratic_program: feasible"
    assert rows[0] == ("tensions [N]", "2.00*, 3.00*, 4.00*, 5.00*")
    none = refuse(problem(), "some")
    assert (none.method, none.status) == ("some", TensionStatus.INFEASIBLE)
    for array, size in ((none.tensions, 4), (none.slack, 2), (none.residual, None)):
        assert np.all(np.isnan(array))
        assert np.shape(array) == (() if size is None else (size,))
    np.testing.assert_array_equal(none.active, np.zeros(4))
    assert none.as_dict()["tensions_n"] is none.as_dict()["residual"] is None


@settings(max_examples=200)
@given(problems())
def test_no_method_is_wrong_about_feasibility(problem):
    largest = max(np.max(problem.upper), 1.0)
    margin = largest_margin(problem) / largest
    for name, method in METHODS.items():
        if not method.takes(problem.redundancy):
            continue
        solution = distribute(problem, name)
        t = solution.tensions
        if solution.status == TensionStatus.FEASIBLE:
            assert np.all((t >= problem.lower) & (t <= problem.upper)), name
            assert problem.residual(t) <= RESIDUAL_TOLERANCE, name
            assert margin > -ORACLE, name
        elif solution.status == TensionStatus.NOT_FOUND:
            assert not method.exact or abs(margin) <= MARGIN, name
            assert margin > -ORACLE, name
            assert np.all(np.isfinite(t)), name
        else:
            assert margin <= MARGIN, name
            assert np.all(np.isfinite(t) if method.answers else np.isnan(t)), name
