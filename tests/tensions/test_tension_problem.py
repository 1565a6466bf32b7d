"""Problems that make no sense are refused by name; verdicts are never better than the tensions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cdpr_drake.errors import CdprError, TensionProblemError
from cdpr_drake.tensions.closed_form_kernel import NOT_FOUND
from cdpr_drake.tensions.dispatch_kernel import check
from cdpr_drake.tensions.methods import METHODS, Distributor, distribute
from cdpr_drake.tensions.problem import (
    RESIDUAL_TOLERANCE,
    VERDICT_ROUNDING,
    TensionProblem,
    TensionSolution,
    TensionStatus,
    describe,
    refuse,
)
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, INFEASIBLE

MARGIN = 1e-9  # relative to the largest bound; nearer to the limit a verdict may go either way
ORACLE_MARGIN = 1e-6  # as above, where HiGHS, exact to 1e-7, must be trusted
STATUS = {
    FEASIBLE: TensionStatus.FEASIBLE,
    NOT_FOUND: TensionStatus.NOT_FOUND,
    INFEASIBLE: TensionStatus.INFEASIBLE,
}
SUMMING = 1e-10  # [N]; sums of a few products of some 100 N in another order

W = np.array([[1.0, 0.0, -1.0, 0.5], [0.0, 1.0, -1.0, -0.5]])
GOOD = {
    "W": W,
    "wrench": np.array([1.0, -3.0]),
    "lower": np.zeros(4),
    "upper": np.full(4, 9.0),
    "reference": np.full(4, 2.0),
}
NAN, INFINITY = np.nan, np.inf


def changed(**parts):
    return TensionProblem(**{**GOOD, **parts})


def test_a_good_problem_passes_and_is_converted():
    problem = changed(wrench=[1, -3], upper=(9, 9, 9, 9), W=np.asfortranarray(W), reference=None)
    assert problem.redundancy == 2
    assert problem.reference is None
    for value in (problem.W, problem.wrench, problem.lower, problem.upper):
        assert value.dtype == float
        assert value.flags.c_contiguous


REFUSALS = {
    "W is a vector": ({"W": np.ones(4)}, r"W: found shape \(4,\); accepted: \(n, m\)"),
    "W has three axes": ({"W": np.ones((2, 4, 1))}, r"W: found shape \(2, 4, 1\); accepted"),
    "short wrench": ({"wrench": [1.0]}, r"wrench: found shape \(1,\); accepted: \(2,\)"),
    "long wrench": ({"wrench": np.ones(6)}, r"wrench: found shape \(6,\); accepted: \(2,\)"),
    "short lower": ({"lower": [0.0]}, r"lower: found shape \(1,\); accepted: \(4,\)"),
    "flat upper": ({"upper": 60.0}, r"upper: found shape \(1,\); accepted: \(4,\)"),
    "tall upper": ({"upper": np.ones((4, 1))}, r"upper: found shape \(4, 1\); accepted: \(4,\)"),
    "long reference": ({"reference": np.ones(5)}, r"reference: found shape \(5,\); accepted"),
    "NaN in W": (
        {"W": np.where(W == 0.5, NAN, W)},
        r"W: found .*nan.*; accepted: finite numbers",
    ),
    "NaN in wrench": ({"wrench": [NAN, 0.0]}, r"wrench: found \[nan .*; accepted: finite"),
    "NaN in lower": ({"lower": [0.0, NAN, 0.0, 0.0]}, r"lower: found .*nan.*; accepted: finite"),
    "NaN in upper": ({"upper": [9, 9, 9, NAN]}, r"upper: found .*nan.*; accepted: finite"),
    "endless down": ({"upper": [9, 9, 9, -INFINITY]}, r"upper: found .*inf.*; accepted: finite"),
    "complex wrench": ({"wrench": [1.0, 2.0j]}, r"wrench: found complex numbers; accepted: real"),
    "NaN in reference": ({"reference": [NAN] * 4}, r"reference: found .*nan.*; accepted: finite"),
    "negative lower": ({"lower": [0, -1, 0, 0]}, r"lower: found \[ 0\. -1\. .*; accepted: >= 0"),
    "crossed bounds": (
        {"lower": [0, 5, 0, 0], "upper": [9, 4, 9, 9]},
        r"upper: found \[9\. 4\. .*below lower \[0\. 5\. .*accepted: lower <= upper",
    ),
    "fewer cables": (
        {"W": W.T, "wrench": np.ones(4), "lower": [0, 0], "upper": [9, 9], "reference": None},
        r"W: found 2 cables for 4 degrees of freedom; accepted: at least 4 cables",
    ),
    "rank 1": ({"W": np.ones((2, 4))}, r"W: found rank 1; accepted: 2, full rank"),
    "rank 0": ({"W": np.zeros((2, 4))}, r"W: found rank 0; accepted: 2, full rank"),
    "nearly rank 1": ({"W": np.ones((2, 4)) + 1e-13 * W}, r"W: found rank 1; accepted: 2"),
}


@pytest.mark.parametrize(("parts", "message"), REFUSALS.values(), ids=REFUSALS.keys())
def test_what_makes_no_sense_is_refused_by_name(parts, message):
    with pytest.raises(TensionProblemError, match=message) as caught:
        changed(**parts)
    assert isinstance(caught.value, CdprError)
    assert len(str(caught.value).splitlines()) == 1


def test_the_rank_of_a_flat_spatial_robot_is_named():
    """All cables in one plane leave three of six motions without force."""
    angles = np.arange(8) * np.pi / 4
    u = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    arms = 0.1 * np.stack([np.sin(3 * angles), np.cos(angles), 0.0 * angles])
    flat = np.vstack([np.cross(arms.T, u.T).T, u])
    with pytest.raises(TensionProblemError, match="found rank 3; accepted: 6"):
        TensionProblem(flat, np.zeros(6), np.zeros(8), np.full(8, 60.0))


def test_equal_bounds_are_accepted():
    assert changed(lower=np.full(4, 3.0), upper=np.full(4, 3.0)).redundancy == 2


def test_the_residual_is_relative_to_the_forces_at_work():
    problem = changed(wrench=[0.0, -100.0])
    t, one_more = np.array([0.0, 100.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0, 0.0])
    assert problem.residual(t) == pytest.approx(0.0, abs=1e-15)
    # Off by 1 N where 100 N pull each way.
    assert problem.residual(t + one_more) == pytest.approx(1.0 / 200.0, rel=0.01)


def balanced():
    """A problem and tensions strictly inside that balance it."""
    t = np.array([2.0, 3.0, 4.0, 5.0])
    return changed(wrench=-W @ t), t


def checked(problem, tensions, exists):
    """Tensions of which a method says that some exist, or that none do and these relax; checked."""
    t = np.array(tensions, float)
    active, slack = np.empty(len(t), int), np.empty(len(problem.wrench))
    given = problem.W, problem.wrench, problem.lower, problem.upper, t
    code, residual = check(FEASIBLE if exists else INFEASIBLE, True, *given)
    describe(*given, active, slack)
    return TensionSolution("some", STATUS[code], t, residual, active, slack)


def checked_by_numpy(problem, tensions):
    """What `checked` finds, written for reading."""
    rounding = VERDICT_ROUNDING * max(np.max(problem.upper), 1.0)
    low, high = problem.lower - rounding, problem.upper + rounding
    inside = np.all(tensions >= low) and np.all(tensions <= high)
    if inside:
        tensions = np.clip(tensions, problem.lower, problem.upper)
    active = np.where(tensions <= problem.lower + rounding, -1, 0)
    active = np.where(tensions >= problem.upper - rounding, 1, active)
    return inside, tensions, active, problem.W @ tensions + problem.wrench


@pytest.mark.parametrize("seed", range(40))
def test_the_verdict_is_what_numpy_finds(seed):
    rng = np.random.default_rng(seed)
    n, m = [(1, 1), (2, 3), (3, 4), (6, 8)][seed % 4]
    W, lower = rng.normal(size=(n, m)), np.full(m, 2.0)
    upper = lower + rng.uniform(0.0, 50.0, m)
    t = rng.uniform(lower, upper)
    t[0] = upper[0] + 50.0 * VERDICT_ROUNDING * rng.uniform(-2.0, 2.0)
    t[-1] = [lower[-1], np.nan, 1.9, t[-1]][seed // 4 % 4]
    problem = TensionProblem(W, -W @ np.nan_to_num(t), lower, upper)
    given = t.copy()
    solution = checked(problem, t, exists=True)
    np.testing.assert_array_equal(t, given)
    inside, expected, active, slack = checked_by_numpy(problem, t)
    residual = problem.residual(expected)
    feasible = inside and residual <= RESIDUAL_TOLERANCE
    assert solution.status == (TensionStatus.FEASIBLE if feasible else TensionStatus.NOT_FOUND)
    np.testing.assert_array_equal(solution.tensions, expected)
    np.testing.assert_array_equal(solution.active, active)
    np.testing.assert_allclose(solution.slack, slack, rtol=0.0, atol=SUMMING)
    np.testing.assert_allclose(solution.residual, residual, rtol=0.0, atol=1e-15)


def test_good_tensions_are_feasible_unless_it_is_proven_that_there_are_none():
    problem, t = balanced()
    for exists in (True, False):
        solution = checked(problem, t, exists)
        wanted = TensionStatus.FEASIBLE if exists else TensionStatus.INFEASIBLE
        assert solution.status == wanted
        np.testing.assert_array_equal(solution.tensions, t)
        np.testing.assert_array_equal(solution.active, 0)
        np.testing.assert_allclose(solution.slack, 0.0, atol=1e-14)


@pytest.mark.parametrize("error", [1e-6, 1e-7, -1e-6])
def test_tensions_off_balance_are_not_feasible(error):
    problem, t = balanced()
    t[0] += error
    wrong = checked(problem, t, exists=True)
    assert wrong.status == TensionStatus.NOT_FOUND
    assert wrong.residual > RESIDUAL_TOLERANCE
    np.testing.assert_allclose(wrong.slack, error * W[:, 0], rtol=1e-6)
    none = checked(problem, t, exists=False)
    assert none.status == TensionStatus.INFEASIBLE


@pytest.mark.parametrize("beyond", [1e-9, 1e-3, 2.0])
def test_tensions_out_of_bounds_are_not_feasible(beyond):
    problem, t = balanced()
    tight = changed(wrench=problem.wrench, upper=np.array([9.0, 9.0, 9.0, t[3] - beyond]))
    assert checked(tight, t, exists=True).status == TensionStatus.NOT_FOUND
    tight = changed(wrench=problem.wrench, lower=np.array([t[0] + beyond, 0.0, 0.0, 0.0]))
    assert checked(tight, t, exists=False).status == TensionStatus.INFEASIBLE


def test_tensions_on_their_bounds_are_named_and_put_there():
    problem, t = balanced()
    lower, upper = np.array([2.0, 0.0, 0.0, 0.0]), np.array([9.0, 9.0, 9.0, 5.0])
    tight = TensionProblem(W, problem.wrench, lower, upper)
    rounding = np.array([-1e-15, 0.0, 0.0, 1e-15])
    solution = checked(tight, t + rounding, exists=True)
    assert solution.status == TensionStatus.FEASIBLE
    np.testing.assert_array_equal(solution.active, [-1, 0, 0, 1])
    np.testing.assert_array_equal(solution.tensions, t)


def test_no_tension_at_all_is_feasible_without_a_wrench():
    """Rounding of the size of nothing is not off balance, measured against what cables can do."""
    problem = changed(wrench=np.zeros(2))
    t = np.array([1e-16, 0.0, 3e-16, 0.0])
    assert checked(problem, t, exists=True).status == TensionStatus.FEASIBLE
    assert checked(problem, np.zeros(4), exists=True).status == TensionStatus.FEASIBLE
    # A millinewton a cable is no rounding.
    assert checked(problem, t + 1e-3, exists=True).status == TensionStatus.NOT_FOUND


@pytest.mark.parametrize("method", METHODS)
def test_slack_cables_are_found_where_only_they_balance(method):
    """All cables pull one way and nothing pulls back, so every tension is zero."""
    one_way = np.array([[1.0, 2.0, 3.0], [0.3, 0.2, 0.7]])
    if not METHODS[method].takes(1):
        one_way = np.array([[1.0, 0.37, 3.0]])
    wrench, upper, reference = np.zeros(len(one_way)), np.full(3, 60.0), np.full(3, 7.7)
    problem = TensionProblem(one_way, wrench, np.zeros(3), upper, reference)
    solution = distribute(problem, method)
    if METHODS[method].exact:
        assert solution.status == TensionStatus.FEASIBLE
        np.testing.assert_allclose(solution.tensions, 0.0, atol=1e-9)
    else:
        assert solution.status != TensionStatus.INFEASIBLE


def test_a_refusal_holds_no_numbers():
    solution = refuse(changed(), "some")
    assert solution.method == "some"
    assert solution.status == TensionStatus.INFEASIBLE
    assert solution.tensions.shape == (4,)
    assert solution.slack.shape == (2,)
    assert np.all(np.isnan(solution.tensions))
    assert np.all(np.isnan(solution.slack))
    assert np.isnan(solution.residual)
    np.testing.assert_array_equal(solution.active, 0)


@st.composite
def problems(draw):
    """Of any size, degenerate ones among them, with and without tensions."""
    n = draw(st.integers(1, 6))
    m = n + draw(st.sampled_from([0, 1, 1, 2, 2, 2, 3, 5]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = draw(st.sampled_from(["normal", "whole", "twins", "levers"]))
    M = rng.integers(-2, 3, (n, m)).astype(float) if shape == "whole" else rng.normal(size=(n, m))
    if shape == "twins" and m > n:
        M[:, -1] = M[:, 0]
    if shape == "levers":
        M[0] *= 1e-2
    largest = draw(st.sampled_from([1.0, 60.0, 3000.0]))
    lower = np.full(m, largest * draw(st.sampled_from([0.0, 0.1, 0.3])))
    upper = np.full(m, largest)
    if draw(st.booleans()):
        fixed = rng.random(m) < 0.2
        upper[fixed] = lower[fixed]
    reach = draw(st.sampled_from([0.0, 0.2, 0.5]))
    t = lower + (upper - lower) * rng.uniform(-reach, 1.0 + reach, m)
    try:
        return TensionProblem(M, -M @ t, lower, upper, rng.uniform(0.0, largest, m))
    except TensionProblemError:  # whole numbers may be singular
        return TensionProblem(np.eye(n, m), -np.eye(n, m) @ t, lower, upper, lower)


def room(problem):
    """Largest common margin to the bounds, negative if infeasible, over the largest bound."""
    n, m = problem.W.shape
    one = np.ones((m, 1))
    largest = max(np.max(problem.upper), 1.0)
    result = linprog(
        np.append(np.zeros(m), -1.0),
        A_ub=np.block([[-np.eye(m), one], [np.eye(m), one]]),
        b_ub=np.concatenate([-problem.lower, problem.upper]) / largest,
        A_eq=np.hstack([problem.W, np.zeros((n, 1))]),
        b_eq=-problem.wrench / largest,
        bounds=[(None, None)] * (m + 1),
        method="highs",
    )
    assert result.success
    return -result.fun


def by_highs(problem):
    """Whether HiGHS finds tensions, on numbers of size one."""
    largest = max(np.max(problem.upper), 1.0)
    bounds = list(zip(problem.lower / largest, problem.upper / largest, strict=True))
    m = len(bounds)
    return linprog(
        np.zeros(m), A_eq=problem.W, b_eq=-problem.wrench / largest, bounds=bounds, method="highs"
    ).success


def same_answer(one, other):
    assert (one.method, one.status) == (other.method, other.status)
    np.testing.assert_allclose(one.tensions, other.tensions, rtol=0.0, atol=SUMMING)
    np.testing.assert_array_equal(one.active, other.active)
    np.testing.assert_allclose(one.slack, other.slack, rtol=0.0, atol=SUMMING)
    np.testing.assert_allclose(one.residual, other.residual, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("method", METHODS)
def test_a_distributor_answers_as_distribute(method):
    rng, seen = np.random.default_rng(0), set()
    m = 4 if method == "kernel" else 5
    ready = None
    for k in range(60):
        W = rng.normal(size=(3, m))
        wrench = -W @ rng.uniform(-5.0 if k % 3 else 5.0, 45.0, m)
        given = np.full(m, 2.0), np.full(m, 48.0), np.full(m, 20.0), np.array([0.3, 1.0, 1.0])
        problem = TensionProblem(W, wrench, *given)
        ready = ready or Distributor(problem, method)
        solution = ready(W, wrench)
        same_answer(solution, distribute(problem, method))
        seen.add(solution.status)
    assert len(seen) > 1


def test_a_distributor_takes_what_numpy_can_convert():
    W, wrench = np.array([[1, 0, 1], [0, 1, 1]]), np.array([-20, -30])
    ready = Distributor(TensionProblem(W, wrench, np.zeros(3), np.full(3, 50.0)))
    W_back = np.asfortranarray(W, float)
    W_back.flags.writeable = False
    same_answer(ready(W, wrench), ready(W_back, [-20.0, -30.0]))


@pytest.mark.parametrize(
    ("W", "wrench", "message"),
    [
        (np.eye(2), [1.0, 1.0], r"found shapes \(2, 2\), \(2,\); accepted: \(2, 3\), \(2,\)"),
        (np.ones((2, 3)), [1.0, 1.0, 1.0], "found shapes"),
        (np.full((2, 3), np.nan), [1.0, 1.0], "found NaN"),
        (np.eye(2, 3), [np.inf, 1.0], "found NaN, infinity"),
        (np.ones((2, 3)), [1.0, 1.0], "singular to rounding"),
    ],
)
def test_a_distributor_refuses_what_makes_no_sense(W, wrench, message):
    ready = Distributor(TensionProblem(np.eye(2, 3), np.zeros(2), np.zeros(3), np.ones(3)))
    with pytest.raises(TensionProblemError, match=message):
        ready(W, wrench)


def test_a_distributor_needs_what_its_method_needs():
    problem = TensionProblem(np.eye(2, 3), np.zeros(2), np.zeros(3), np.ones(3))
    with pytest.raises(TensionProblemError, match="found redundancy"):
        Distributor(problem, "barycenter")
    with pytest.raises(TensionProblemError, match="found no reference"):
        Distributor(problem, "reference_program")


@settings(max_examples=400)
@given(problems())
def test_no_method_is_wrong_about_feasibility(problem):
    margin = room(problem)
    for name, method in METHODS.items():
        if not method.takes(problem.redundancy):
            continue
        solution = distribute(problem, name)
        assert solution.method == name
        if solution.status == TensionStatus.FEASIBLE:
            assert np.all(solution.tensions >= problem.lower), name
            assert np.all(solution.tensions <= problem.upper), name
            assert problem.residual(solution.tensions) <= RESIDUAL_TOLERANCE, name
            off = np.linalg.norm(problem.W @ solution.tensions + problem.wrench)
            forces = np.linalg.norm(np.abs(problem.W) @ problem.upper)
            assert off <= 2.0 * RESIDUAL_TOLERANCE * (np.linalg.norm(problem.wrench) + forces)
            assert margin > -ORACLE_MARGIN, name
        elif solution.status == TensionStatus.NOT_FOUND:
            assert not method.exact or abs(margin) <= MARGIN, name
            assert margin > -ORACLE_MARGIN, name
            assert np.all(np.isfinite(solution.tensions)), name
        else:
            assert margin <= MARGIN, name
            assert margin > -ORACLE_MARGIN or not by_highs(problem), name
            if not method.relaxes:
                assert np.all(np.isnan(solution.tensions)), name
