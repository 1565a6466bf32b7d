"""Verdicts on problems that are infeasible by a hair, and by how much infeasible ones miss."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tensions.batch import distribute_batch
from cdpr_drake.tensions.methods import METHODS, distribute
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
from cdpr_drake.tensions.shortfall import shortfall

LINEAR = 1e-6  # relative; HiGHS keeps constraints to 1e-7
ENDLESS = 1e-9  # relative; rounding of bounds that are ten thousand times the tensions


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
    exact = [[Fraction(x) for x in row] for row in problem.W]
    along = [Fraction(x) for x in c]
    pulls = [
        sum(a * row[i] for a, row in zip(along, exact, strict=True)) for i in range(len(exact[0]))
    ]
    most = sum(
        p * Fraction(high if p > 0 else low)
        for p, low, high in zip(pulls, problem.lower, problem.upper, strict=True)
    )
    return -sum(a * Fraction(x) for a, x in zip(along, problem.wrench, strict=True)) > most


@pytest.mark.parametrize(("share", "span"), [(1e-9, 50.0), (1e-11, 50.0), (1e-10, 1e-4)])
@pytest.mark.parametrize("method", ["slack_relaxed", "log_barrier", "quadratic_program"])
def test_what_is_infeasible_by_a_hair_is_infeasible(method, share, span):
    for seed in range(20):
        for n, m in ((1, 2), (3, 5), (6, 8)):
            problem, c = barely_infeasible(seed, n, m, share, span)
            if not proven(problem, c):  # rounding of the wrench is as large as the share
                continue
            assert distribute(problem, method).status == TensionStatus.INFEASIBLE
            _, codes = distribute_batch(
                problem.W[np.newaxis], problem.wrench[np.newaxis], problem.lower, problem.upper,
                method,
            )  # fmt: skip
            assert codes.tolist() == [-1]


def test_beside_infeasible_only_least_slack_gives_numbers():
    problem, _ = barely_infeasible(0, 3, 5, 0.1)
    for name, method in METHODS.items():
        if method.takes(problem.redundancy) and not method.needs_reference:
            solution = distribute(problem, name)
            if solution.status == TensionStatus.INFEASIBLE:
                assert np.all(np.isfinite(solution.tensions)) == (name == "slack_relaxed"), name


def test_a_problem_keeps_its_own_numbers():
    given = {
        "W": np.array([[1.0, -1.0]]), "wrench": np.array([3.0]), "lower": np.array([1.0, 1.0]),
        "upper": np.array([9.0, 9.0]), "row_scale": np.array([1.0]),
    }  # fmt: skip
    problem = TensionProblem(**given)
    before = distribute(problem).tensions
    given["lower"][:], given["upper"][:], given["W"][:] = 20.0, 0.0, 5.0
    np.testing.assert_array_equal(distribute(problem).tensions, before)
    for name in (*given, "scale_of_rows", "nothing_wanted"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(problem, name)[...] = 0.0


@pytest.mark.parametrize("wrench", [[1.0 + 1.0j], np.array([2.0 + 1e-300j]), ["one"]])
def test_a_number_that_is_not_real_is_refused(wrench):
    with pytest.raises(TensionProblemError, match="wrench: found"):
        TensionProblem([[1.0, -1.0]], wrench, [0.0, 0.0], [9.0, 9.0])


def test_a_complex_number_without_imaginary_part_is_a_real_one():
    problem = TensionProblem([[1.0, -1.0]], [3.0 + 0.0j], [0.0, 0.0], [9.0, 9.0])
    np.testing.assert_array_equal(problem.wrench, [3.0])


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
        assert endless.status == bounded.status == TensionStatus.FEASIBLE
        np.testing.assert_allclose(endless.tensions, bounded.tensions, rtol=1e-7)


def test_without_upper_limit_a_wrench_that_no_cable_pulls_against_is_infeasible():
    """Two cables along x, to both sides: no force along y, and one against a push along x."""
    for W, w, status in (
        ([[1.0, -1.0]], [-1e3], TensionStatus.FEASIBLE),
        ([[1.0, 2.0]], [1.0], TensionStatus.INFEASIBLE),
    ):
        problem = TensionProblem(W, w, np.zeros(2), np.full(2, np.inf))
        assert distribute(problem).status == status


@pytest.mark.parametrize("method", ["barycenter", "median", "log_barrier", "optimally_safe"])
def test_what_aims_between_the_bounds_needs_upper_ones(method):
    problem = TensionProblem(np.eye(2, 4) - 0.5, np.ones(2), np.zeros(4), np.full(4, np.inf))
    with pytest.raises(TensionProblemError, match=f"{method}: found an infinite upper tension"):
        distribute(problem, method)


def test_the_bounds_of_an_infeasible_problem_give_way_by_the_shortfall():
    """Wider by that and a little, tensions are there; by a little less, there are none."""
    for seed in range(20):
        problem, _ = barely_infeasible(seed, 3, 5, 0.05)
        found = shortfall(problem)
        # `TensionProblem` takes no negative bounds: the same problem, from the lower bounds on.
        for factor, status in (
            (1.0 + LINEAR, TensionStatus.FEASIBLE), (1.0 - 1e-3, TensionStatus.INFEASIBLE),
        ):  # fmt: skip
            wider = factor * found.beyond
            shifted = TensionProblem(
                problem.W, problem.wrench + problem.W @ (problem.lower - wider), np.zeros(5),
                problem.upper - problem.lower + 2.0 * wider,
            )  # fmt: skip
            assert distribute(shifted).status == status
        assert 0 < np.count_nonzero(found.limits) <= 4  # a vertex: as many as rows, and one


def test_the_missing_wrench_is_that_of_least_slack():
    problem, _ = barely_infeasible(3, 3, 5, 0.05)
    problem = replace(problem, row_scale=[0.2, 1.0, 1.0])
    found, relaxed = shortfall(problem), distribute(problem, "slack_relaxed")
    np.testing.assert_allclose(found.missing, relaxed.slack, atol=1e-9)
    assert found.size == pytest.approx(np.linalg.norm(relaxed.slack / [0.2, 1.0, 1.0]))
    words = found.words(["C1", "C2", "C3", "C4", "C5"], ["moment about z", "force along x", "f"])
    assert "bounds missed by" in words
    assert "wrench missed by" in words


def test_a_single_cable_that_is_too_weak_misses_by_the_difference():
    """A weight of 100 N on a cable of at most 60 N, and one of 20 N on a cable of at least 30 N."""
    for load, low, high, beyond, side in (
        (100.0, 0.0, 60.0, 40.0, 1), (20.0, 30.0, 60.0, 10.0, -1),
    ):  # fmt: skip
        found = shortfall(TensionProblem([[1.0]], [-load], [low], [high]))
        assert found.beyond == pytest.approx(beyond)
        assert found.limits.tolist() == [side]
        assert found.missing == pytest.approx([-load + (high if side > 0 else low)])
        assert found.as_dict(["C1"])["cables"] == [
            {"cable": "C1", "bound": "upper" if side > 0 else "lower"}
        ]
