"""Methods without search: their formulas, what they miss, and where they end up."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cdpr_drake.tensions.closed_form_kernel import (
    NOT_FOUND,
    alternating_projections,
    closed_form,
    improved_closed_form,
    kernel_line,
    pseudo_inverse,
    puncture,
    toward,
    within,
)
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    SINGULAR,
    nearest_tensions,
    workspace_shape,
)

FORMULA_TOLERANCE = 1e-12  # relative to the tensions; times the condition number over 1e2
BOUND_TOLERANCE = 1e-11  # [N]; tensions of at most some 1e2 N, moved along a line
PROJECTION_TOLERANCE = 1e-6  # [N]; Dykstra stops inside the bounds up to rounding, near the limit
ROUNDS = 20_000


@st.composite
def problems(draw, redundancies=(0, 1, 2, 3, 5)):
    n = draw(st.integers(1, 6))
    m = n + draw(st.sampled_from(redundancies))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    W = rng.normal(size=(n, m))
    assume(np.linalg.cond(W) < 1e3)
    lower = rng.uniform(0.0, 10.0, m)
    upper = lower + rng.uniform(5.0, 50.0, m)
    share = draw(st.sampled_from([0.0, 0.3, 0.8]))
    t = lower + (upper - lower) * (0.5 + rng.uniform(-1.0, 1.0, m) * share)
    return W, -W @ t, lower, upper


def run(kernel, W, w, lower, upper, *more):
    t, w = np.full(W.shape[1], np.nan), np.asarray(w, float)
    if not more:  # a method
        work = np.empty(workspace_shape(*W.shape))
        return kernel(work, W, w, lower, upper, np.zeros(len(t)), np.ones(len(w)), t), t
    return kernel(W, w, lower, upper, *more, t), t


def nearest(W, w, lower, upper, reference):
    return run(nearest_tensions, W, w, lower, upper, reference)


def allowed(W, t):
    return FORMULA_TOLERANCE * max(np.linalg.cond(W) / 1e2, 1.0) * max(np.max(np.abs(t)), 1.0)


@given(problems())
def test_the_pseudo_inverse_is_numpys(problem):
    W, w, lower, upper = problem
    code, t = run(pseudo_inverse, *problem)
    expected = -np.linalg.pinv(W) @ w
    np.testing.assert_allclose(t, expected, rtol=0.0, atol=allowed(W, expected))
    inside = np.all((t >= lower - BOUND_TOLERANCE) & (t <= upper + BOUND_TOLERANCE))
    assert code == (FEASIBLE if inside else NOT_FOUND)


@given(problems())
def test_the_closed_form_is_nearest_to_the_middle(problem):
    W, w, lower, upper = problem
    code, t = run(closed_form, *problem)
    middle = (lower + upper) / 2.0
    expected = middle - np.linalg.pinv(W) @ (w + W @ middle)
    np.testing.assert_allclose(t, expected, rtol=0.0, atol=allowed(W, expected))
    inside = np.all((t >= lower - BOUND_TOLERANCE) & (t <= upper + BOUND_TOLERANCE))
    assert code == (FEASIBLE if inside else NOT_FOUND)


@given(problems(), st.floats(-30.0, 90.0))
def test_toward_balances_the_wrench_next_to_any_tensions(problem, level):
    W, w, *_ = problem
    wanted = level + np.arange(W.shape[1], dtype=float)
    t = np.empty(W.shape[1])
    assert toward(W, w, wanted, t)
    expected = wanted - np.linalg.pinv(W) @ (w + W @ wanted)
    np.testing.assert_allclose(t, expected, rtol=0.0, atol=allowed(W, np.append(expected, wanted)))


@given(problems())
def test_the_improved_closed_form_never_misses_what_the_closed_form_finds(problem):
    W, w, lower, upper = problem
    plain, t = run(closed_form, *problem)
    code, improved = run(improved_closed_form, *problem)
    if plain == FEASIBLE:
        assert code == FEASIBLE
        np.testing.assert_allclose(improved, t, rtol=0.0, atol=allowed(W, t))
    elif code == FEASIBLE:
        assert np.all(within_rounding(improved, *problem))
        scale = np.linalg.norm(w) + np.linalg.norm(np.abs(W) @ improved)
        assert np.linalg.norm(W @ improved + w) <= FORMULA_TOLERANCE * scale
        assert np.any((improved == lower) | (improved == upper))  # a cable was put on its bound


def within_rounding(t, W, w, lower, upper):
    return (t >= lower - BOUND_TOLERANCE) & (t <= upper + BOUND_TOLERANCE)


def test_the_improved_closed_form_solves_much_that_the_closed_form_misses():
    """Share of feasible random problems that each solves, six degrees of freedom, eight cables."""
    rng = np.random.default_rng(0)
    lower, upper = np.full(8, 5.0), np.full(8, 60.0)
    solved, gained, count = 0, 0, 500
    for _ in range(count):
        W = rng.normal(size=(6, 8))
        w = -W @ rng.uniform(lower, upper)
        plain = run(closed_form, W, w, lower, upper)[0] == FEASIBLE
        improved = run(improved_closed_form, W, w, lower, upper)[0] == FEASIBLE
        assert improved or not plain
        solved += plain
        gained += improved - plain
    assert solved < 0.9 * count
    assert gained > 0.5 * (count - solved)


def test_the_improved_closed_form_by_hand():
    """Three cables along a line: the first would go below its bound and is put on it."""
    W = np.array([[1.0, 1.0, -1.0]])
    lower, upper = np.array([8.0, 0.0, 0.0]), np.array([10.0, 10.0, 10.0])
    # From the middle (9, 5, 5), 5 too much: t = (9, 5, 5) - 5/3 (1, 1, -1), below 8 in front.
    assert run(closed_form, W, [-4.0], lower, upper)[0] == NOT_FOUND
    code, t = run(improved_closed_form, W, [-4.0], lower, upper)
    assert code == FEASIBLE
    # Left: t_2 - t_3 = -4 next to (5, 5).
    np.testing.assert_allclose(t, [8.0, 3.0, 7.0], rtol=1e-14)


def test_the_improved_closed_form_gives_up_when_the_free_cables_do_not_span_the_wrench():
    W = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    lower, upper = np.array([0.0, 0.0, 0.0]), np.array([10.0, 10.0, 1.0])
    code, _ = run(improved_closed_form, W, [-4.0, -5.0], lower, upper)
    assert code == NOT_FOUND


@given(problems(redundancies=(1, 2, 3)))
def test_the_puncture_lies_between_closed_form_and_low_end_and_on_a_bound(problem):
    W, w, lower, upper = problem
    plain, start = run(closed_form, *problem)
    code, t = run(puncture, *problem)
    assert code == plain
    if code != FEASIBLE:
        return
    end = lower - np.linalg.pinv(W) @ (w + W @ lower)
    way = end - start
    length = np.linalg.norm(way)
    assume(length > 1e-6)
    share = (t - start) @ way / length**2
    assert -1e-9 <= share <= 1.0 + 1e-9
    np.testing.assert_allclose(t, start + share * way, rtol=0.0, atol=10 * allowed(W, start))
    assert np.all(within_rounding(t, *problem))
    on_bound = np.min(np.minimum(t - lower, upper - t)) <= BOUND_TOLERANCE
    assert on_bound or share == pytest.approx(1.0, abs=1e-9)


def test_the_puncture_reaches_the_low_end_where_no_bound_is_in_the_way():
    W = np.array([[1.0, -1.0]])
    lower, upper = np.array([2.0, 2.0]), np.array([10.0, 10.0])
    code, t = run(puncture, W, [0.0], lower, upper)
    assert code == FEASIBLE
    np.testing.assert_allclose(t, 2.0, rtol=1e-14)


@st.composite
def problems_on_a_bound(draw):
    """Whole numbers: tensions that cannot change, on their bounds up to rounding."""
    n = draw(st.integers(1, 3))
    m = n + draw(st.integers(1, 2))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    W = rng.integers(-2, 3, (n, m)).astype(float)
    assume(np.linalg.matrix_rank(W) == n)
    upper = np.full(m, 60.0)
    return W, -W @ rng.choice([0.0, 15.0, 30.0, 60.0], m), np.zeros(m), upper


@settings(max_examples=500)
@given(problems_on_a_bound())
def test_the_puncture_stays_within_bounds_also_where_it_starts_on_one(problem):
    code, t = run(puncture, *problem)
    assert code == run(closed_form, *problem)[0]
    if code == FEASIBLE:
        assert np.all(within_rounding(t, *problem))


@pytest.mark.parametrize(
    ("W", "t", "end"),
    [
        # The first two cables are given, the third takes no part in the balance.
        ([[-2.0, 1.0, 0.0], [-2.0, -1.0, 0.0]], [0.0, 60.0, 60.0], [0.0, 60.0, 0.0]),
        # The middle one is given, the others pull against each other.
        ([[1.0, 0.0, -1.0], [-2.0, -1.0, 2.0]], [15.0, 0.0, 60.0], [0.0, 0.0, 45.0]),
        # The first takes no part, the others are given.
        ([[0.0, 1.0, -2.0], [0.0, 2.0, -1.0]], [60.0, 0.0, 60.0], [0.0, 0.0, 60.0]),
    ],
)
def test_the_puncture_is_not_thrown_by_a_given_tension_on_its_bound_up_to_rounding(W, t, end):
    """Such a tension bars no way: its change is rounding, in whatever direction."""
    W, upper = np.array(W), np.full(3, 60.0)
    code, found = run(puncture, W, -W @ np.array(t), np.zeros(3), upper)
    assert code == FEASIBLE
    np.testing.assert_allclose(found, end, rtol=0.0, atol=BOUND_TOLERANCE)


@given(problems(redundancies=(1,)))
def test_the_kernel_line_is_the_middle_of_all_feasible_tensions(problem):
    W, w, lower, upper = problem
    code, t = run(kernel_line, *problem)
    h = np.linalg.svd(W)[2][-1]
    ends = np.sort(np.array([(lower - t) / h, (upper - t) / h]), axis=0)
    least, most = np.max(ends[0]), np.min(ends[1])
    size = np.max(np.abs(t)) + np.max(upper)
    rounding = FORMULA_TOLERANCE * size * np.linalg.cond(W) / np.min(np.abs(h))
    assert least + most == pytest.approx(0.0, abs=rounding)
    if abs(most - least) > rounding:
        assert (code == FEASIBLE) == (most > least)
    balance_scale = np.linalg.norm(w) + np.linalg.norm(np.abs(W) @ np.abs(t))
    assert np.linalg.norm(W @ t + w) <= FORMULA_TOLERANCE * balance_scale


@given(problems(redundancies=(1, 2, 3)))
def test_dykstra_converges_to_the_point_nearest_to_its_start(problem):
    W, w, lower, upper = problem
    middle = (lower + upper) / 2.0
    code, t = run(alternating_projections, W, w, lower, upper, middle, ROUNDS)
    proof, expected = nearest(W, w, lower, upper, middle)
    if code == FEASIBLE:
        assert proof == FEASIBLE
        np.testing.assert_allclose(t, expected, rtol=0.0, atol=PROJECTION_TOLERANCE)


def test_dykstra_gives_up_after_its_rounds():
    """The balanced tensions touch the bounds in one corner, at an angle of a hundredth.

    Each round comes nearer by the square of the angle's cosine, so e times nearer in 10,000.
    """
    W = np.array([[0.01, 1.0]])
    lower, upper = np.zeros(2), np.array([10.0, 4.0])
    w = -W @ upper
    middle = upper / 2.0
    early, near_corner = run(alternating_projections, W, w, lower, upper, middle, ROUNDS // 2)
    late, nearer = run(alternating_projections, W, w, lower, upper, middle, ROUNDS)
    assert early == late == NOT_FOUND
    assert nearest(W, w, lower, upper, middle)[0] == FEASIBLE
    ratio = np.linalg.norm(nearer - upper) / np.linalg.norm(near_corner - upper)
    assert ratio == pytest.approx(np.exp(-1.0), rel=1e-2)


def test_dykstra_never_calls_an_impossible_wrench_feasible():
    W = np.array([[1.0, -1.0]])
    lower, upper = np.zeros(2), np.full(2, 5.0)
    assert (
        run(alternating_projections, W, [-6.0], lower, upper, upper / 2.0, ROUNDS)[0] == NOT_FOUND
    )


@pytest.mark.parametrize(
    "kernel", [pseudo_inverse, closed_form, improved_closed_form, puncture, kernel_line]
)
def test_a_singular_wrench_matrix_has_its_own_code(kernel):
    W = np.ones((2, 3))
    assert run(kernel, W, np.ones(2), np.zeros(3), np.ones(3))[0] == SINGULAR


def test_dykstra_knows_a_singular_wrench_matrix():
    code = run(
        alternating_projections, np.ones((2, 3)), np.ones(2), np.zeros(3), np.ones(3), np.ones(3), 5
    )[0]
    assert code == SINGULAR


@pytest.mark.parametrize(
    "kernel", [pseudo_inverse, closed_form, improved_closed_form, puncture, kernel_line]
)
def test_nan_is_never_feasible(kernel):
    W = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -1.0]])
    assert run(kernel, W, [np.nan, -1.0], np.zeros(3), np.full(3, 10.0))[0] != FEASIBLE


def test_within_lets_rounding_pass_and_nothing_else():
    lower, upper = np.zeros(2), np.full(2, 60.0)
    assert within(np.array([0.0, 60.0]), lower, upper)
    assert within(np.array([-1e-14, 60.0 + 1e-14]), lower, upper)
    assert not within(np.array([-1e-9, 5.0]), lower, upper)
    assert not within(np.array([5.0, 60.0 + 1e-9]), lower, upper)
