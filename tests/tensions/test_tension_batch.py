"""Batches equal the single calls, whatever the number of threads; NaN where there is nothing."""

import numpy as np
import pytest
from numba import get_num_threads

from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import gravity_wrench, wrench_matrix
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.numerics.kernel_calls import SHARES
from cdpr_drake.tensions.batch import distribute_batch
from cdpr_drake.tensions.methods import METHODS, distribute, exact_tensions
from cdpr_drake.tensions.problem import RESIDUAL_TOLERANCE, TensionProblem, TensionStatus
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, INFEASIBLE, SINGULAR

SAME = 1e-10  # [N]; the same kernels, compiled into another loop, in which sums may be reordered
COUNT = 20 * SHARES + 7  # a last share that is not full
ROBOTS = {"acrobot_large": (0.0, 60.0), "caroca": (30.0, 3000.0)}


def weights(name, count=COUNT, seed=0, method=""):
    """Wrench matrices and weights at random poses, and the bounds, without the cables too many."""
    robot = load_robot(name)
    A, B = robot.exit_points(), robot.anchor_points()
    center = (robot.frame.lower + robot.frame.upper) / 2.0
    half = (robot.frame.upper - robot.frame.lower) / 2.0
    rng = np.random.default_rng(seed)
    W, w = np.empty((count, 6, 8)), np.empty((count, 6))
    for k in range(count):
        X_WP = pose_from_angles(
            center + half * rng.uniform(-0.9, 0.9, 3), rng.uniform(-0.4, 0.4, 3)
        )
        W[k] = wrench_matrix(X_WP, A, B)
        w[k] = gravity_wrench(X_WP, robot.platform.mass, robot.center_of_mass())
    lowest, highest = ROBOTS[name]
    cables = 7 if method == "kernel" else 8  # one or two to spare
    return W[:, :, :cables], w, np.full(cables, lowest), np.full(cables, highest)


SMALL = (np.array([[[1.0, 0.0, -1.0], [0.0, 1.0, -1.0]]]), -np.ones((1, 2)))
BOUNDS = (np.zeros(3), np.full(3, 9.0))


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("method", METHODS)
def test_a_batch_equals_the_single_calls(method, name):
    W, w, lower, upper = weights(name, method=method)
    reference = np.linspace(0.0, upper[0] / 4.0, len(upper))
    row_scale = np.array([0.2, 0.2, 0.2, 1.0, 1.0, 1.0])
    t, codes = distribute_batch(W, w, lower, upper, method, reference, row_scale=row_scale)
    seen = set()
    for k in range(COUNT):
        problem = TensionProblem(W[k], w[k], lower, upper, reference, row_scale)
        single = distribute(problem, method)
        seen.add(single.status)
        assert (codes[k] == FEASIBLE) == (single.status == TensionStatus.FEASIBLE)
        if codes[k] == FEASIBLE:
            assert np.all(t[k] >= lower - SAME)
            assert np.all(t[k] <= upper + SAME)
            np.testing.assert_allclose(t[k], single.tensions, rtol=0.0, atol=SAME * upper[0])
        if METHODS[method].exact:
            assert codes[k] != 0
            assert (codes[k] == INFEASIBLE) == (single.status == TensionStatus.INFEASIBLE)
        if codes[k] == INFEASIBLE:
            np.testing.assert_allclose(t[k], single.tensions, rtol=0.0, atol=SAME * upper[0])
    assert {TensionStatus.FEASIBLE, TensionStatus.INFEASIBLE} <= seen


@pytest.mark.parametrize("method", METHODS)
def test_two_threads_give_the_bytes_of_one(method):
    W, w, lower, upper = weights("acrobot_large", method=method)
    before = get_num_threads()
    one, codes = distribute_batch(W, w, lower, upper, method, upper / 9.0, threads=1)
    two, same = distribute_batch(W, w, lower, upper, method, upper / 9.0, threads=2)
    every, also = distribute_batch(W, w, lower, upper, method, upper / 9.0)
    assert one.tobytes() == two.tobytes() == every.tobytes()
    assert codes.tobytes() == same.tobytes() == also.tobytes()
    assert get_num_threads() == before


def test_no_tensions_are_nan():
    W, w, lower, upper = weights("acrobot_large")
    t, codes = distribute_batch(W, w, lower, upper)
    none = codes == INFEASIBLE
    assert 0 < np.sum(none) < COUNT
    assert np.all(np.isnan(t[none]))
    assert np.all(np.isfinite(t[~none]))


@pytest.mark.parametrize("method", METHODS)
def test_a_singular_wrench_matrix_spoils_only_its_own_row(method):
    W, w, lower, upper = weights("acrobot_large", 5, method=method)
    expected, good = distribute_batch(W, w, lower, upper, method, upper / 9.0)
    W[2, 3] = W[2, 4]
    t, codes = distribute_batch(W, w, lower, upper, method, upper / 9.0)
    assert codes[2] == SINGULAR
    assert np.all(np.isnan(t[2]))
    others = [0, 1, 3, 4]
    np.testing.assert_array_equal(t[others], expected[others])
    np.testing.assert_array_equal(codes[others], good[others])


def with_a_slack_cable(r, count=200):
    """Tensions of which the last is zero and cannot be another, and may not be either."""
    rng = np.random.default_rng(0)
    W, w = np.zeros((count, 3, r + 3)), np.empty((count, 3))
    lower, upper = np.zeros(r + 3), np.append(np.full(r + 2, 60.0), 0.0)
    for k in range(count):
        W[k, :2, :-1] = rng.normal(size=(2, r + 2))
        W[k, 2, -1] = 1.0
        W[k] = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ W[k]
        w[k] = -W[k] @ (upper * rng.uniform(0.3, 0.7, r + 3))
    return W, w, lower, upper


@pytest.mark.parametrize("method", METHODS)
def test_fixed_tensions_get_the_verdict_of_the_single_call(method):
    """Their bounds are met up to the rounding of the others' tensions, not of their own."""
    W, w, lower, upper = with_a_slack_cable(1 if method == "kernel" else 2)
    _, codes = distribute_batch(W, w, lower, upper, method, upper / 9.0)
    for k in range(len(W)):
        single = distribute(TensionProblem(W[k], w[k], lower, upper, upper / 9.0), method)
        assert (codes[k] == FEASIBLE) == (single.status == TensionStatus.FEASIBLE)
    assert np.any(codes == FEASIBLE)


def test_a_reference_is_approached():
    W, w, lower, upper = weights("acrobot_large", 40)
    reference = np.linspace(0.0, 14.0, 8)
    t, codes = distribute_batch(W, w, lower, upper, "reference_program", reference)
    assert np.any(codes == FEASIBLE)
    for k in np.flatnonzero(codes == FEASIBLE):
        expected = exact_tensions(TensionProblem(W[k], w[k], lower, upper), reference)
        np.testing.assert_allclose(t[k], expected, rtol=0.0, atol=SAME * upper[0])


@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 2), (2, 3), (3, 5), (6, 11)])
def test_robots_of_any_size(n, m):
    rng = np.random.default_rng(m)
    W = rng.normal(size=(30, n, m))
    lower, upper = np.full(m, 2.0), np.full(m, 60.0)
    w = np.array([-M @ rng.uniform(-5.0, 67.0, m) for M in W])
    t, codes = distribute_batch(W, w, lower, upper)
    for k in range(30):
        expected = exact_tensions(TensionProblem(W[k], w[k], lower, upper))
        assert (codes[k] == FEASIBLE) == (expected is not None)
        if expected is not None:
            np.testing.assert_allclose(t[k], expected, rtol=0.0, atol=SAME * upper[0])


def test_an_empty_batch():
    t, codes = distribute_batch(np.empty((0, 6, 8)), np.empty((0, 6)), np.zeros(8), np.ones(8))
    assert t.shape == (0, 8)
    assert codes.shape == (0,)


def test_arrays_of_another_layout_are_taken():
    W, w, lower, upper = weights("acrobot_large", 20)
    expected, _ = distribute_batch(W, w, lower, upper)
    t, _ = distribute_batch(np.asfortranarray(W), np.asfortranarray(w), list(lower), list(upper))
    np.testing.assert_array_equal(t, expected)


REFUSALS = {
    "unknown method": ({"method": "magic"}, "method: found magic; accepted: .*quadratic_program"),
    "one matrix": ({"W": SMALL[0][0]}, r"W, wrenches: found shapes \(2, 3\), \(1, 2\); accepted"),
    "one wrench": ({"wrenches": [0.0, 1.0]}, r"W, wrenches: found shapes .*\(2,\); accepted"),
    "too many wrenches": ({"wrenches": np.ones((2, 2))}, r"found shapes \(1, 2, 3\), \(2, 2\)"),
    "short lower": ({"lower": [0.0]}, r"lower: found shape \(1,\); accepted: \(3,\)"),
    "flat upper": ({"upper": 9.0}, r"upper: found shape \(\); accepted: \(3,\)"),
    "long reference": (
        {"method": "reference_program", "reference": np.ones(4)},
        r"reference: found shape \(4,\); accepted",
    ),
    "barycenter": (
        {"method": "barycenter"},
        r"barycenter: found redundancy m - n = 1; accepted: 2",
    ),
    "kernel": (
        {"method": "kernel", "W": np.eye(3)[np.newaxis], "wrenches": np.ones((1, 3))},
        r"kernel: found redundancy m - n = 0; accepted: 1",
    ),
    "weighted vertices": (
        {"method": "weighted_vertices", "W": np.ones((1, 1, 4)), "wrenches": np.ones((1, 1))},
        r"weighted_vertices: found redundancy m - n = 3; accepted: 0 or 1 or 2",
    ),
    "too few cables": (
        {"W": np.ones((1, 3, 2)), "wrenches": np.ones((1, 3))},
        "W: found 2 cables for 3 degrees of freedom; accepted: at least 3 cables",
    ),
    "no reference": (
        {"method": "reference_program"},
        "reference_program: found no reference; accepted",
    ),
    "short row scale": (
        {"row_scale": np.ones(3)},
        r"row_scale: found shape \(3,\); accepted: \(2,",
    ),
    "no row scale": ({"row_scale": [0.0, 1.0]}, "row_scale: found one not above 0; accepted"),
    "no threads": ({"threads": 0}, "threads: found 0; accepted"),
    "crossed bounds": ({"lower": [0, 10, 0]}, "lower.*found"),
    "negative bounds": ({"lower": [0, -1, 0]}, "lower.*found"),
    "NaN in W": ({"W": np.where(SMALL[0] == 1.0, np.nan, SMALL[0])}, "W: found .*; accepted"),
    "NaN in a wrench": ({"wrenches": [[np.nan, 0.0]]}, "wrenches: found .*; accepted: finite"),
    "NaN in a bound": ({"upper": [9.0, np.nan, 9.0]}, "upper: found .*; accepted: finite"),
}


@pytest.mark.parametrize(("parts", "message"), REFUSALS.values(), ids=REFUSALS.keys())
def test_what_makes_no_sense_is_refused_by_name(parts, message):
    good = {"W": SMALL[0], "wrenches": SMALL[1], "lower": BOUNDS[0], "upper": BOUNDS[1]}
    with pytest.raises(TensionProblemError, match=message):
        distribute_batch(**{**good, **parts})


def hard_problems(r, top, count=300, seed=0):
    """Random wrenches that need tensions on their bounds, near them or beyond, by nearly parallel
    cables; the bounds reach far beyond what is needed where top is large."""
    rng = np.random.default_rng(seed)
    m = 6 + r
    W = rng.normal(size=(count, 6, m))
    W[:, :3] *= 10.0 ** rng.uniform(-3.0, 0.0, (count, 1, 1))
    W[:, :, -1] = W[:, :, 0] + 10.0 ** rng.uniform(-4.0, 0.0, (count, 1)) * W[:, :, -1]
    t = rng.choice([1.0, 50.0, 100.0, 1.0001, 99.999, 1.5, 0.5], size=(count, m))
    return W, -np.einsum("knm,km->kn", W, t), np.full(m, 1.0), np.full(m, top)


CODES = {
    TensionStatus.FEASIBLE: FEASIBLE,
    TensionStatus.NOT_FOUND: 0,
    TensionStatus.INFEASIBLE: INFEASIBLE,
}


@pytest.mark.parametrize("top", [1e2, 1e6])
@pytest.mark.parametrize("method", METHODS)
def test_hard_problems_get_the_verdict_of_the_single_call(method, top):
    """What a method believes is feasible must balance to the limit that single calls have.

    With bounds of 1e6 N alternating projections stop within the rounding of these, which is off
    balance by more than the limit.
    """
    W, w, lower, upper = hard_problems(1 if method == "kernel" else 2, top)
    t, codes = distribute_batch(W, w, lower, upper, method, lower + 30.0)
    found = [TensionProblem(W[k], w[k], lower, upper, lower + 30.0) for k in range(len(W))]
    singles = [distribute(problem, method) for problem in found]
    np.testing.assert_array_equal(codes, [CODES[single.status] for single in singles])
    for k in np.flatnonzero(codes == FEASIBLE):
        assert found[k].residual(t[k]) <= RESIDUAL_TOLERANCE
        assert np.all((lower <= t[k]) & (t[k] <= upper))
    assert {FEASIBLE, INFEASIBLE} <= set(codes)
