"""The proof behind certificates: its first order, its remainder, and bounds of forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.arrays import Array
from cdpr_drake.stability.bound_ascent_kernel import bound_blocks
from cdpr_drake.stability.certified_kernel import certified_margins
from cdpr_drake.stability.criterion_at_pose_kernel import evaluate, new_work, prepare
from cdpr_drake.stability.criterion_gradient_kernel import gradient, steepest_into
from cdpr_drake.stability.perturbation_bounds import BASELINE, PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.quadratic_bounds_kernel import BALL_SIZES, BALLS, fill_blocks, new_blocks
from cdpr_drake.stability.searched_kernel import searched_margins
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.subdivision_kernel import new_piece, whole_piece
from cdpr_drake.stability.verdict import packed_case
from tests.stability.stability_cases import planar_case, random_poses, spatial_case

DIFFERENCE = 1e-6
DIFFERENCE_TOLERANCE = 1e-5
"""Central differences of numbers up to about 10: rounding 1e-9, curvature below; where a least
squares pseudo-inverse is differenced twice, 1e-6."""

MEANINGFUL = 0.1
"""Share of its bound that the remainder of one of 45 perturbations reaches at least; a bound
ten times too large would prove little."""

CASES = {
    "pbvs": spatial_case("pbvs"),
    "exact": spatial_case("pbvs", lever="object"),
    "line": spatial_case("pbvs-line"),
    "2.5d": spatial_case("2.5d"),
    "ibvs": spatial_case("ibvs"),
    "planar": planar_case(),
}


def mask(case: StabilityCase) -> Array:
    """Ones where a perturbation may be."""
    if not case.planar:
        return np.ones(18 + 6 * case.m)
    return np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0] * 3 + [1.0, 1.0, 0.0] * (2 * case.m))


def vector(case: StabilityCase) -> Array:
    v = np.random.default_rng(5).normal(size=6)
    if case.planar:
        v[[0, 1, 5]] = 0.0
    return v / np.linalg.norm(v)


@pytest.mark.parametrize("perturbed", ["estimate", "truth"])
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_gradient_is_that_of_differences(case: StabilityCase, perturbed: str) -> None:
    case = replace(case, perturbed=perturbed)
    bounds = BASELINE.varied(r_s=0.02, d_theta_s=0.0 if case.planar else 0.02)
    arrays, rows = packed_case(case, bounds, random_poses(1, case.planar))
    w, v = new_work(arrays), vector(case)
    assert prepare(arrays, rows, 0, w)
    d = draw_perturbations(rows.poses[0], bounds, case.m, 1, planar=case.planar)[0]

    def form(at: Array) -> float:
        assert evaluate(arrays, rows, 0, w, at)
        return float(v @ w.S @ v)

    slope = [
        (form(d + DIFFERENCE * e) - form(d - DIFFERENCE * e)) / (2.0 * DIFFERENCE)
        for e in np.eye(len(d))
    ]
    form(d)
    found = np.empty_like(d)
    gradient(arrays, rows, 0, w, d, v, found)
    kept = mask(case)
    np.testing.assert_allclose(found * kept, np.array(slope) * kept, atol=DIFFERENCE_TOLERANCE)
    goal, other = np.empty_like(d), d * 0.9
    m = arrays.A.shape[0]
    steepest_into(m, arrays.planar, arrays.radii, arrays.directions, found, goal)
    assert found @ goal < found @ other  # within the bounds nothing is steeper
    np.testing.assert_array_equal(goal[kept == 0.0], 0.0)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_blocks_hold_the_first_order(case: StabilityCase) -> None:
    bounds = BASELINE.varied(anchors="common")
    arrays, rows = packed_case(case, bounds, random_poses(1, case.planar))
    w, v, blocks, piece = new_work(arrays), vector(case), new_blocks(case.m), new_piece(case.m)
    whole_piece(arrays, piece)
    size = 18 + 6 * case.m
    d, g = np.zeros(size), np.empty(size)
    assert prepare(arrays, rows, 0, w)
    assert evaluate(arrays, rows, 0, w, d)
    assert fill_blocks(arrays, w, piece, blocks)
    gradient(arrays, rows, 0, w, d, v, g)
    g *= mask(case)
    expected = [g[0:3], g[3:6], g[6:9]]
    for block, slope in enumerate(expected):  # the axes differ, the lengths do not
        found = np.array([v @ S @ v for S in blocks.S[block, :3]])
        assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(slope), rel=1e-9, abs=1e-12)


def test_bound_of_forms_is_above_all_vectors_and_tight_for_one_product() -> None:
    random = np.random.default_rng(2)
    blocks = new_blocks(4)
    for block in range(BALLS):
        S = random.normal(size=(BALL_SIZES[block], 6, 6))
        blocks.S[block, : BALL_SIZES[block]] = S + S.transpose(0, 2, 1)
    a, b = random.normal(size=(2, 10, 3, 6))
    blocks.left[:10], blocks.right[:10] = (x.transpose(0, 2, 1) @ x for x in (a, b))
    blocks.radius[:], blocks.bound[:10] = random.uniform(size=BALLS), random.uniform(size=10)
    blocks.half[:] = blocks.radius[: len(blocks.half), np.newaxis]
    v = random.normal(size=(20_000, 6))
    v /= np.linalg.norm(v, axis=1)[:, np.newaxis]
    value = np.zeros(len(v))
    for block in range(BALLS):
        forms = np.einsum("ni,kij,nj->nk", v, blocks.S[block], v)
        value += blocks.radius[block] * np.linalg.norm(forms, axis=1)
    for k in range(10):
        value += (
            blocks.bound[k]
            * np.linalg.norm(v @ a[k].T, axis=1)
            * np.linalg.norm(v @ b[k].T, axis=1)
        )
    for rounds in (1, 10):
        worst = v[np.argmax(value)]
        D = 0.7 * np.outer(worst, worst) + 0.05 * np.eye(6)
        bound = bound_blocks(blocks, np.zeros((6, 6)), D, rounds, -np.inf, np.inf)
        assert np.max(value) < bound < 2.0 * np.max(value)
    blocks.radius[:], blocks.bound[:] = 0.0, 0.0
    blocks.bound[0] = 1.0
    blocks.left[0], blocks.right[0] = np.diag([1.0, 0, 0, 0, 0, 0]), np.diag([0, 1.0, 0, 0, 0, 0])
    # |v_0 v_1| is at most 1/2, and the bound finds it but for what keeps it finite.
    bound = bound_blocks(blocks, np.zeros((6, 6)), np.eye(6) / 6.0, 30, -np.inf, np.inf)
    assert bound == pytest.approx(0.5, 0.01)


LONE = {
    "turn": PerturbationBounds(d_theta_bp=0.4),
    "shift": PerturbationBounds(r_bp=0.12),
    "camera turn": PerturbationBounds(d_theta_pc=0.7),
    "camera shift": PerturbationBounds(r_pc=0.3),
    "both turns": PerturbationBounds(d_theta_bp=0.25, d_theta_pc=0.3),
    "turn and shift": PerturbationBounds(d_theta_bp=0.2, d_theta_pc=0.2, r_bp=0.05, r_pc=0.1),
    "exits": PerturbationBounds(r_A=0.03),
    "anchors": PerturbationBounds(r_B=0.02),
    "corners": PerturbationBounds(r_A=0.015, r_B=0.01, exits="corners", anchors="corners"),
    "common": PerturbationBounds(r_A=0.04, r_B=0.03, exits="common", anchors="common"),
    "object": PerturbationBounds(r_s=0.2, d_theta_pc=0.2, d_theta_bp=0.2),
    "all": BASELINE.scaled(1.5),
}


@pytest.mark.parametrize("bounds", LONE.values(), ids=LONE)
@pytest.mark.parametrize("scheme", ["pbvs", "ibvs", "planar"])
def test_no_perturbation_is_below_the_certificate(bounds: PerturbationBounds, scheme: str) -> None:
    case = planar_case() if scheme == "planar" else spatial_case(scheme)
    if scheme == "ibvs":
        bounds = bounds.varied(r_s=0.0)
    poses = random_poses(12, case.planar)
    arrays, rows = packed_case(case, bounds, poses)
    searched, bound = np.empty(12), np.empty(12)
    found_at = np.zeros((12, 18 + 6 * case.m))
    searched_margins(0, 12, arrays, rows, 300, 0, True, False, 4, 4, 30, searched, found_at)
    # Searches do not count here: the bound has to hold on its own.
    certified_margins(0, 12, arrays, rows, np.full(12, np.inf), found_at, 10, 1, False, bound)
    proven = np.isfinite(bound)
    assert np.all(bound[proven] <= searched[proven])
    assert np.sum(bound > -1.0) > 6  # and says something


@pytest.mark.parametrize("scheme", ["exact", "ibvs", "planar"])
@pytest.mark.parametrize("name", LONE)
def test_remainder_covers_what_is_not_linear_and_little_more(scheme: str, name: str) -> None:
    case = CASES[scheme]
    bounds = LONE[name].varied(exits="independent", anchors="independent")
    if case.scheme in ("2.5d", "ibvs"):
        bounds = bounds.varied(r_s=0.0)
    arrays, rows = packed_case(case, bounds, random_poses(3, case.planar))
    random = np.random.default_rng(7)
    w, blocks, piece = new_work(arrays), new_blocks(case.m), new_piece(case.m)
    whole_piece(arrays, piece)
    size = 18 + 6 * case.m
    g, kept, largest = np.empty(size), mask(case), 0.0
    for n in range(3):
        assert prepare(arrays, rows, n, w)
        assert evaluate(arrays, rows, n, w, np.zeros(size))
        if not fill_blocks(arrays, w, piece, blocks):
            continue
        end = 3 + 4 * case.m
        mine = np.r_[0:3, *(3 + 4 * i + np.arange(2) for i in range(case.m)), end, end + 1]
        size_of = blocks.bound[mine]
        turns = bounds.d_theta_bp + bounds.d_theta_pc
        size_of[2] *= turns / (1.0 + turns)  # the rest of it is of first order
        draws = draw_perturbations(rows.poses[n], bounds, case.m, 15, planar=case.planar)
        for d in draws:
            v = random.normal(size=6)
            if case.planar:
                v[[0, 1, 5]] = 0.0
            evaluate(arrays, rows, n, w, np.zeros(size))
            gradient(arrays, rows, n, w, np.zeros(size), v, g)
            evaluate(arrays, rows, n, w, d)
            left_over = abs(v @ w.S @ v - v @ v - (g * kept) @ d)
            forms = np.einsum("i,bkij,j->bk", v, blocks.S[3:], v)
            bound = blocks.radius[3:] @ np.linalg.norm(forms, axis=1)
            a, b = (np.einsum("i,kij,j->k", v, x[mine], v) for x in (blocks.left, blocks.right))
            bound += size_of @ np.sqrt(np.maximum(a * b, 0.0))
            assert left_over <= bound + 1e-9 * (v @ v)
            largest = max(largest, left_over / max(bound, 1e-9))
    if name == "camera shift":  # it has none
        assert np.all(bound == 0.0)
    else:
        assert largest > MEANINGFUL
