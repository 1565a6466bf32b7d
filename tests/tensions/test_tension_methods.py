"""The methods: published tensions, refusals, small robots, who misses what."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from scipy.optimize import brentq

from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tensions.barrier_kernel import BARRIER
from cdpr_drake.tensions.methods import METHODS, distribute, exact_tensions, feasible_polygon
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
from tests.tensions.tension_cases import acrobot, random_problem

EVEN = brentq(lambda a: a**3 - BARRIER / a + BARRIER / (1.0 - a), 0.01, 0.5, xtol=1e-14)
"""Where of its range a tension is by `log_barrier` if all are equal and none is needed."""

PRINTED_ROUNDING = 0.005  # [N]; the thesis prints two decimals
HOMING_TOLERANCE = 0.02 + PRINTED_ROUNDING  # [N]; the thesis' pose is that of the real platform
BALANCE = 1e-9  # relative to the forces; what a solution promises
ROUNDING = 1e-12  # relative; two ways to compute the same tensions
SMOOTH = 1e-9  # relative; a method that lets balance go by as much


PUBLISHED = {
    # Servoing thesis, section 1.3.4: position of the platform, tensions, how near.
    "off the middle": (
        (0.35, -0.27, 0.45),
        (2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31),
        PRINTED_ROUNDING,
    ),
    "homing": (
        (0.0, 0.0, 0.15),
        (5.22, 5.46, 5.16, 5.41, 5.13, 5.39, 5.22, 5.46),
        HOMING_TOLERANCE,
    ),
}

FREE = [name for name, method in METHODS.items() if method.takes(0)]
BOUND_TO_SOME = {n: m.redundancies for n, m in METHODS.items() if m.redundancies is not None}


@pytest.mark.parametrize(("position", "tensions", "near"), PUBLISHED.values(), ids=PUBLISHED.keys())
def test_the_published_tensions(position, tensions, near):
    solution = distribute(acrobot(RigidTransform(position)), "barycenter")
    assert solution.status == TensionStatus.FEASIBLE
    np.testing.assert_allclose(solution.tensions, tensions, rtol=0.0, atol=near)


def test_the_names_are_those_of_the_field():
    assert set(METHODS) == {
        "pseudo_inverse",
        "closed_form",
        "improved_closed_form",
        "kernel",
        "linear_program",
        "infinity_norm",
        "quadratic_program",
        "reference_program",
        "barycenter",
        "polygon_1_norm",
        "polygon_2_norm",
        "puncture",
        "dykstra",
        "weighted_vertices",
        "optimally_safe",
        "slack_relaxed",
        "median",
        "log_barrier",
    }
    assert all(method.title for method in METHODS.values())


def test_an_unknown_method_is_refused():
    with pytest.raises(TensionProblemError, match=r"method: found magic; accepted: .*barycenter"):
        distribute(acrobot(RigidTransform([0.0, 0.0, 0.3])), "magic")


@pytest.mark.parametrize("r", [0, 1, 2, 3])
@pytest.mark.parametrize("method", BOUND_TO_SOME)
def test_another_redundancy_is_refused(method, r):
    problem = random_problem(np.random.default_rng(r), 3, r)
    needed = BOUND_TO_SOME[method]
    if r in needed:
        assert distribute(problem, method).status == TensionStatus.FEASIBLE
        return
    message = rf"{method}: found redundancy m - n = {r}; accepted: {' or '.join(map(str, needed))}"
    with pytest.raises(TensionProblemError, match=message):
        distribute(problem, method)


@pytest.mark.parametrize("r", [0, 2])
def test_a_missing_reference_is_refused(r):
    problem = random_problem(np.random.default_rng(0), 2, r)
    bare = TensionProblem(problem.W, problem.wrench, problem.lower, problem.upper)
    with pytest.raises(TensionProblemError, match="reference_program: found no reference"):
        distribute(bare, "reference_program")


@pytest.mark.parametrize("r", [0, 1, 3])
def test_there_is_a_polygon_only_for_two_cables_to_spare(r):
    problem = random_problem(np.random.default_rng(0), 3, r)
    with pytest.raises(TensionProblemError, match=f"feasible polygon: found redundancy {r}"):
        feasible_polygon(problem)


@pytest.mark.parametrize("method", FREE)
@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_no_cable_to_spare_is_solved_directly(method, n):
    problem = random_problem(np.random.default_rng(n), n, 0)
    solution = distribute(problem, method)
    assert solution.status == TensionStatus.FEASIBLE
    expected = np.linalg.solve(problem.W, -problem.wrench)
    rounding = SMOOTH if method == "log_barrier" else ROUNDING
    allowed = rounding * np.linalg.cond(problem.W) * np.linalg.norm(expected)
    np.testing.assert_allclose(solution.tensions, expected, rtol=0.0, atol=allowed)


@pytest.mark.parametrize("method", FREE)
def test_no_cable_to_spare_and_no_tensions(method):
    problem = TensionProblem(np.eye(2), np.array([1.0, -3.0]), np.zeros(2), np.full(2, 5.0), [1, 1])
    solution = distribute(problem, method)
    assert solution.status == TensionStatus.INFEASIBLE
    if METHODS[method].answers:
        np.testing.assert_allclose(solution.tensions, [0.0, 3.0], atol=ROUNDING)
        np.testing.assert_allclose(solution.slack, [1.0, 0.0], atol=ROUNDING)
    else:
        assert np.all(np.isnan(solution.tensions))


@pytest.mark.parametrize("method", METHODS)
def test_who_is_exact_misses_none_and_who_is_not_misses_some(method):
    """Of problems that some tensions solve, many of them hardly: by tensions near their bounds."""
    rng, missed = np.random.default_rng(5), 0
    r = 2 if METHODS[method].takes(2) else 1
    for _ in range(300):
        problem = random_problem(rng, 6, r)
        t = np.where(rng.uniform(size=6 + r) < 0.5, rng.choice([0.5, 59.5], 6 + r), 30.0)
        problem = TensionProblem(
            problem.W, -problem.W @ t, problem.lower, problem.upper, problem.reference
        )
        missed += distribute(problem, method).status == TensionStatus.NOT_FOUND
    assert METHODS[method].exact == (missed == 0)


def test_the_default_is_the_quadratic_program():
    problem = acrobot(RigidTransform([0.1, 0.0, 0.3]))
    assert distribute(problem).method == "quadratic_program"
    np.testing.assert_array_equal(distribute(problem).tensions, exact_tensions(problem))


# Small robots: the closed solutions are known.


@pytest.mark.parametrize("m", [4, 5])
@pytest.mark.parametrize("method", METHODS)
def test_planar_platforms(method, m):
    """A square in the plane, held from the corners and, with five cables, from one more side."""
    A = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (0.0, 1.2)])[:m].T
    B = 0.2 * np.array([(1.0, -1.0), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (0.0, 1.0)])[:m].T
    along = B - A
    u = along / np.linalg.norm(along, axis=0)
    W = -np.vstack([B[0] * u[1] - B[1] * u[0], u])
    problem = TensionProblem(
        W, np.array([0.1, 2.0, -1.0]), np.full(m, 1.0), np.full(m, 30.0), np.full(m, 10.0)
    )
    if not METHODS[method].takes(m - 3):
        return
    solution = distribute(problem, method)
    if METHODS[method].exact:
        assert solution.status == TensionStatus.FEASIBLE
    if solution.status == TensionStatus.FEASIBLE:
        assert np.all((solution.tensions >= 1.0) & (solution.tensions <= 30.0))
        assert solution.residual <= BALANCE


@pytest.mark.parametrize("method", FREE)
def test_a_point_mass_on_two_cables(method):
    """At 45 degrees each cable holds the weight over the square root of two."""
    W = np.array([[1.0, -1.0], [1.0, 1.0]]) / np.sqrt(2.0)
    problem = TensionProblem(W, [0.0, -10.0], np.zeros(2), np.full(2, 9.0), np.ones(2))
    solution = distribute(problem, method)
    assert solution.status == TensionStatus.FEASIBLE
    near = SMOOTH if method == "log_barrier" else ROUNDING
    np.testing.assert_allclose(solution.tensions, 10.0 / np.sqrt(2.0), rtol=near)


@pytest.mark.parametrize("method", METHODS)
def test_a_point_in_space_between_four_cables(method):
    """Cables to the corners of a tetrahedron, no weight: all tensions are equal by symmetry."""
    if not METHODS[method].takes(1):
        return
    W = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]).T / np.sqrt(3.0)
    problem = TensionProblem(W, np.zeros(3), np.full(4, 2.0), np.full(4, 8.0), np.full(4, 3.0))
    solution = distribute(problem, method)
    level = {"reference_program": 3.0, "kernel": 5.0, "closed_form": 5.0, "dykstra": 5.0}
    level |= {"weighted_vertices": 5.0, "optimally_safe": 5.0, "improved_closed_form": 5.0}
    level |= {"median": 5.0, "log_barrier": 2.0 + 6.0 * EVEN}
    if method == "pseudo_inverse":  # zero, below the bounds
        assert solution.status == TensionStatus.NOT_FOUND
    else:
        assert solution.status == TensionStatus.FEASIBLE
        near = SMOOTH if method == "log_barrier" else ROUNDING
        np.testing.assert_allclose(solution.tensions, level.get(method, 2.0), rtol=near)


# Who misses what.


def test_pseudo_inverse_and_closed_form_go_out_of_bounds_where_others_do_not():
    problem = acrobot(RigidTransform(PUBLISHED["off the middle"][0]), lower=2.0)
    for method in ("pseudo_inverse", "closed_form"):
        solution = distribute(problem, method)
        assert solution.status == TensionStatus.NOT_FOUND
        assert solution.residual <= BALANCE  # balanced, but out of bounds
        assert np.min(solution.tensions) < 2.0
    for method in ("improved_closed_form", "quadratic_program", "barycenter", "dykstra"):
        assert distribute(problem, method).status == TensionStatus.FEASIBLE


def test_a_pose_outside_the_frame_has_no_tensions():
    problem = acrobot(RigidTransform([2.0, 0.0, 0.3]), reference=np.ones(8))
    assert feasible_polygon(problem).shape == (2, 0)
    for method in METHODS:
        if METHODS[method].takes(2):
            solution = distribute(problem, method)
            assert solution.status == TensionStatus.INFEASIBLE
            if not METHODS[method].relaxes:
                assert np.all(np.isnan(solution.tensions))
