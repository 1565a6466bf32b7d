"""Certificates and their pieces: first order, remainder, cover; nothing is below what is proven."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.proofs.bound_ascent_kernel import bound_blocks
from cdpr_drake.proofs.certified_kernel import (
    ROUNDING,
    certified_margins,
    prove,
    rounding_error,
)
from cdpr_drake.proofs.quadratic_bounds_kernel import BALL_SIZES, BALLS, fill_blocks, new_blocks
from cdpr_drake.proofs.subdivision_kernel import (
    BOXES,
    best_cut,
    new_piece,
    place_piece,
    shrink_box,
    whole_box,
    whole_piece,
    worst_axes,
)
from cdpr_drake.stability.criterion_at_pose_kernel import evaluate, new_work, prepare
from cdpr_drake.stability.criterion_gradient_kernel import gradient, steepest_into
from cdpr_drake.stability.perturbation_bounds import BASELINE, PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.searched_kernel import searched_margins
from cdpr_drake.stability.verdict import (
    VerdictOptions,
    judge_stability,
    packed_case,
    worst_perturbations,
)
from tests.stability.stability_cases import CASES, random_poses

DIFFERENCE = 1e-6
DIFFERENCE_TOLERANCE = 1e-5
"""Central differences of numbers up to about 10: rounding 1e-9, curvature below; where a least
squares pseudo-inverse is differenced twice, 1e-6."""
MEANINGFUL = 0.1
"""Share of its bound that the remainder of one of 45 perturbations reaches at least; a bound
ten times too large would prove little."""
SLACK = 1e-9  # rounding of coordinates and forms of size 1

FULL = [name for name in CASES if name != "slack"]
PIECES = ["pbvs", "2.5d", "ibvs", "planar"]


def mask(case):
    """Ones where a perturbation may be."""
    if not case.planar:
        return np.ones(18 + 6 * case.m)
    return np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0] * 3 + [1.0, 1.0, 0.0] * (2 * case.m))


def vectors(case, random, *shape):
    v = random.normal(size=(*shape, 6))
    if case.planar:
        v[..., [0, 1, 5]] = 0.0
    return v


def unit_vector(case):
    v = vectors(case, np.random.default_rng(5))
    return v / np.linalg.norm(v)


def forms_of(v, S):
    return np.einsum("i,...ij,j->...", v, S, v)


def products(v, blocks, at=slice(None)):
    """Norms of products that the remainder is made of."""
    squares = forms_of(v, blocks.left[at]) * forms_of(v, blocks.right[at])
    return np.sqrt(np.maximum(squares, 0.0))


# Order by order.


@pytest.mark.parametrize("perturbed", ["estimate", "truth"])
@pytest.mark.parametrize("name", FULL)
def test_gradient_is_that_of_differences(name, perturbed):
    case = replace(CASES[name], perturbed=perturbed)
    bounds = BASELINE.varied(r_s=0.02, d_theta_s=0.0 if case.planar else 0.02)
    arrays, rows = packed_case(case, bounds, random_poses(1, case.planar))
    w, v, kept = new_work(arrays), unit_vector(case), mask(case)
    assert prepare(arrays, rows, 0, w)
    d = draw_perturbations(rows.poses[0], bounds, case.m, 1, planar=case.planar)[0]

    def form(at):
        assert evaluate(arrays, rows, 0, w, at)
        return float(v @ w.S @ v)

    slope = [
        (form(d + DIFFERENCE * e) - form(d - DIFFERENCE * e)) / (2.0 * DIFFERENCE)
        for e in np.eye(len(d))
    ]
    form(d)
    found, goal = np.empty_like(d), np.empty_like(d)
    gradient(arrays, rows, 0, w, d, v, found)
    np.testing.assert_allclose(found * kept, np.array(slope) * kept, atol=DIFFERENCE_TOLERANCE)
    steepest_into(len(arrays.A), arrays.planar, arrays.radii, arrays.directions, found, goal)
    assert found @ goal < found @ (0.9 * d)  # within the bounds nothing is steeper
    np.testing.assert_array_equal(goal[kept == 0.0], 0.0)


@pytest.mark.parametrize("name", FULL)
def test_blocks_hold_the_first_order(name):
    case = CASES[name]
    arrays, rows = packed_case(
        case, BASELINE.varied(anchors="common"), random_poses(1, case.planar)
    )
    w, v, blocks, piece = new_work(arrays), unit_vector(case), new_blocks(case.m), new_piece(case.m)
    whole_piece(arrays, piece)
    d, g = np.zeros((2, 18 + 6 * case.m))
    assert prepare(arrays, rows, 0, w)
    assert evaluate(arrays, rows, 0, w, d)
    assert fill_blocks(arrays, w, piece, blocks)
    gradient(arrays, rows, 0, w, d, v, g)
    slopes = np.linalg.norm((g * mask(case))[:9].reshape(3, 3), axis=1)
    lengths = np.linalg.norm(forms_of(v, blocks.S[:3, :3]), axis=1)
    np.testing.assert_allclose(lengths, slopes, rtol=1e-9, atol=1e-12)  # axes differ, lengths not


def test_bound_of_forms_is_above_all_vectors_and_tight_for_one_product():
    random = np.random.default_rng(2)
    blocks = new_blocks(4)
    for block, size in enumerate(BALL_SIZES[:BALLS]):
        S = random.normal(size=(size, 6, 6))
        blocks.S[block, :size] = S + S.transpose(0, 2, 1)
    a, b = random.normal(size=(2, 10, 3, 6))
    blocks.left[:10], blocks.right[:10] = (x.transpose(0, 2, 1) @ x for x in (a, b))
    blocks.radius[:], blocks.bound[:10] = random.uniform(size=BALLS), random.uniform(size=10)
    blocks.half[:] = blocks.radius[: len(blocks.half), np.newaxis]
    v = random.normal(size=(5000, 6))
    v /= np.linalg.norm(v, axis=1)[:, np.newaxis]
    forms = np.einsum("ni,bkij,nj->nbk", v, blocks.S[:BALLS], v)
    value = np.linalg.norm(forms, axis=2) @ blocks.radius[:BALLS]
    lengths = (np.linalg.norm(np.einsum("kij,nj->nki", x, v), axis=2) for x in (a, b))
    value += np.prod(list(lengths), axis=0) @ blocks.bound[:10]
    worst = v[np.argmax(value)]
    D = 0.7 * np.outer(worst, worst) + 0.05 * np.eye(6)
    for rounds in (1, 10):
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
@pytest.mark.parametrize("name", ["pbvs", "ibvs", "planar"])
def test_no_perturbation_is_below_the_certificate(bounds, name):
    case = CASES[name]
    if name == "ibvs":
        bounds = bounds.varied(r_s=0.0)
    arrays, rows = packed_case(case, bounds, random_poses(12, case.planar))
    searched, bound = np.empty((2, 12))
    worst = np.zeros((12, 18 + 6 * case.m))
    searched_margins(0, 12, arrays, rows, 300, 0, True, False, 4, 4, 30, searched, worst)
    # Searches do not count here: the bound has to hold on its own.
    certified_margins(0, 12, arrays, rows, np.full(12, np.inf), worst, 10, 1, False, bound)
    proven = np.isfinite(bound)
    assert np.all(bound[proven] <= searched[proven])
    assert np.sum(bound > -1.0) > 6  # and says something


@pytest.mark.parametrize("scheme", ["exact", "ibvs", "planar"])
@pytest.mark.parametrize("name", LONE)
def test_remainder_covers_what_is_not_linear_and_little_more(scheme, name):
    case = CASES[scheme]
    bounds = LONE[name].varied(exits="independent", anchors="independent")
    if scheme == "ibvs":
        bounds = bounds.varied(r_s=0.0)
    arrays, rows = packed_case(case, bounds, random_poses(3, case.planar))
    random, m = np.random.default_rng(7), case.m
    w, blocks, piece = new_work(arrays), new_blocks(m), new_piece(m)
    whole_piece(arrays, piece)
    nothing, g = np.zeros((2, 18 + 6 * m))
    mine = np.r_[0:3, *(3 + 4 * i + np.arange(2) for i in range(m)), 3 + 4 * m, 4 + 4 * m]
    turns, largest, bound = bounds.d_theta_bp + bounds.d_theta_pc, 0.0, 0.0
    for n in range(3):
        assert prepare(arrays, rows, n, w)
        assert evaluate(arrays, rows, n, w, nothing)
        if not fill_blocks(arrays, w, piece, blocks):
            continue
        sizes = blocks.bound[mine]
        sizes[2] *= turns / (1.0 + turns)  # the rest of it is of first order
        for d in draw_perturbations(rows.poses[n], bounds, m, 15, planar=case.planar):
            v = vectors(case, random)
            evaluate(arrays, rows, n, w, nothing)
            gradient(arrays, rows, n, w, nothing, v, g)
            evaluate(arrays, rows, n, w, d)
            left_over = abs(v @ w.S @ v - v @ v - (g * mask(case)) @ d)
            bound = blocks.radius[3:] @ np.linalg.norm(forms_of(v, blocks.S[3:]), axis=1)
            bound += sizes @ products(v, blocks, mine)
            assert left_over <= bound + 1e-9 * (v @ v)
            largest = max(largest, left_over / max(bound, 1e-9))
    if name == "camera shift":  # it has none
        assert bound == 0.0
    else:
        assert largest > MEANINGFUL


# Pieces.

SCALES = {"pbvs": 3.0, "2.5d": 2.5, "ibvs": 3.5, "planar": 2.0}
"""Multiples of the baseline with which the whole proves some poses and pieces prove more."""

BOUNDS = {
    "large turns": PerturbationBounds(d_theta_bp=0.4, d_theta_pc=0.5, r_bp=0.02, r_pc=0.05),
    "large shifts": PerturbationBounds(r_bp=0.1, d_theta_bp=0.05, r_A=0.01, r_B=0.01),
    "common": BASELINE.varied(r_A=0.02, r_B=0.03, exits="common", anchors="common"),
    "corners": BASELINE.varied(r_A=0.01, r_B=0.01, exits="corners", anchors="corners"),
    "object": BASELINE.varied(r_s=0.1),
}


def boxes_of(arrays, cuts, random):
    """Radii, and boxes after random cuts as a certificate makes them."""
    ball, lo, hi = np.empty(BOXES), np.empty((BOXES, 3)), np.empty((BOXES, 3))
    whole_box(arrays, ball, lo, hi)
    boxes = [(lo, hi)]
    for _ in range(cuts):
        lo, hi = boxes.pop(random.integers(len(boxes)))
        slope, weight = random.normal(size=(BOXES, 3)), random.uniform(0.1, 1.0, BOXES)
        block, axis = best_cut(arrays, ball, lo, hi, slope, weight)
        middle = 0.5 * (lo[block, axis] + hi[block, axis])
        for side in (1, 0):
            half = (lo.copy(), hi.copy())
            half[side][block, axis] = middle
            if shrink_box(ball[block], half[0][block], half[1][block]):
                boxes.append(half)
    return ball, boxes


def turn(vector):
    return rotation_from_vector(vector).matrix()


def rodrigues(vector):
    """2 tan(theta / 2) u of a rotation vector theta u."""
    theta = np.linalg.norm(vector)
    return vector * (2.0 * np.tan(0.5 * theta) / theta if theta > 0.0 else 1.0)


def turn_between(a, b):
    """Rotation vector, of less than half a turn, from exp(a) to exp(b), on the right."""
    R = turn(a).T @ turn(b)
    axis = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    s = np.linalg.norm(axis)
    return axis * (np.arctan2(s, 0.5 * (np.trace(R) - 1.0)) / s if s > 0.0 else 1.0)


def shift_of(case, bounds, R_WP, d):
    """Shift of the platform, together with the common ones of the points."""
    shift = d[3:6].copy()
    if bounds.exits == "common":
        shift -= d[18:21]
    if bounds.anchors == "common":
        shift += R_WP @ turn(d[:3]) @ d[18 + 3 * case.m : 21 + 3 * case.m]
    return shift


@pytest.mark.parametrize("name", BOUNDS)
@pytest.mark.parametrize("scheme", PIECES)
def test_pieces_cover_all_perturbations_and_bound_the_criterion(scheme, name):
    case, bounds = CASES[scheme], BOUNDS[name]
    if scheme in ("2.5d", "ibvs"):
        bounds = bounds.varied(r_s=0.0)
    random = np.random.default_rng(8)
    arrays, rows = packed_case(case, bounds, random_poses(2, case.planar))
    w, blocks, piece = new_work(arrays), new_blocks(case.m), new_piece(case.m)
    Q, bounded = np.empty((BOXES, 3, 3)), 0
    for n in range(2):
        assert prepare(arrays, rows, n, w)
        R_WP = w.R.copy()
        draws = np.vstack([
            draw_perturbations(rows.poses[n], bounds, case.m, 12, planar=case.planar, inside=inside)
            for inside in (False, True)
        ])  # fmt: skip
        worst_axes(arrays, R_WP, draws[0], Q)
        ball, boxes = boxes_of(arrays, 25, random)
        for d in draws:
            shift = shift_of(case, bounds, R_WP, d)
            seen = [rodrigues(d[:3]), shift, rodrigues(d[6:9])]
            s = np.array([q.T @ x for q, x in zip(Q, seen, strict=True)])
            inside = [box for box in boxes if np.all((box[0] <= s + SLACK) & (s <= box[1] + SLACK))]
            assert inside  # somewhere
            place_piece(arrays, Q, ball, *inside[0], piece)
            c = piece.d
            away = [turn_between(c[:3], d[:3]), shift - c[3:6], turn_between(c[6:9], d[6:9])]
            sigma = np.array([np.linalg.solve(B, x) for B, x in zip(piece.axes, away, strict=True)])
            assert np.all(np.linalg.norm(sigma, axis=1) <= piece.radius + SLACK)
            assert np.all(np.linalg.norm(away, axis=1) <= piece.radius + SLACK)
            assert np.all(np.abs(sigma - piece.middle) <= piece.half + SLACK)
            assert evaluate(arrays, rows, n, w, c)
            S_c = w.S.copy()
            if not fill_blocks(arrays, w, piece, blocks):
                continue
            bounded += 1
            evaluate(arrays, rows, n, w, d)
            for v in vectors(case, random, 10):
                forms = forms_of(v, blocks.S)
                loss = blocks.radius[BOXES:] @ np.linalg.norm(forms[BOXES:], axis=1)
                loss += blocks.bound @ products(v, blocks)
                first, value = forms[:BOXES, :3], v @ S_c @ v - loss - SLACK * (v @ v)
                assert v @ w.S @ v >= value + np.sum(first * sigma)  # the remainder
                box = np.sum(first * piece.middle - np.abs(first) * piece.half, axis=1)
                disc = -piece.radius * np.linalg.norm(first, axis=1)
                assert v @ w.S @ v >= value + np.sum(np.maximum(box, disc))
    assert bounded > 10


@pytest.mark.parametrize("scheme", PIECES)
def test_cutting_proves_more_and_nothing_that_is_not_true(scheme):
    case = CASES[scheme]
    bounds = BASELINE.varied(exits="common", anchors="common").scaled(SCALES[scheme])
    poses = random_poses(24, case.planar)
    whole, cut = (
        judge_stability(case, bounds, poses, "certified", VerdictOptions(pieces=pieces))
        for pieces in (1, 200)
    )
    assert np.all(cut.stable >= whole.stable)
    assert np.sum(cut.stable) > np.sum(whole.stable)
    hard = VerdictOptions(draws=3000, searches=40, steps=60, seed=2)
    worst = judge_stability(case, bounds, poses[cut.stable], "searched", hard).margin
    assert np.all(cut.margin[cut.stable] <= worst)


def test_a_pose_just_beyond_its_bounds_is_never_certified():
    case, near = CASES["pbvs"], 0
    for pose in random_poses(4):
        low, high = 0.0, 8.0
        for _ in range(12):  # the bounds at which the search finds something
            share = 0.5 * (low + high)
            stable = judge_stability(case, BASELINE.scaled(share), pose, "searched").stable[0]
            low, high = (share, high) if stable else (low, share)
        bounds = BASELINE.scaled(high)
        margin, worst = worst_perturbations(case, bounds, pose)
        assert not margin[0] > 0.0
        arrays, rows = packed_case(case, bounds, pose)
        proven = np.empty(1)
        for at in (worst, np.zeros_like(worst)):
            # As if the search had found nothing.
            certified_margins(0, 1, arrays, rows, np.full(1, np.inf), at, 10, 300, True, proven)
            assert not proven[0] > 0.0
        near += margin[0] > -0.05
    assert near > 0


def test_a_cable_without_length_proves_nothing():
    case = CASES["pbvs"]
    A, B = case.cables.p_WA.copy(), case.cables.p_PB.copy()
    A[:, 0], B[:, 0] = [0.5, 0.5, 1.0], [0.25, 0.25, 0.0]
    case = replace(case, cables=replace(case.cables, p_WA=A, p_PB=B))
    pose = np.array([[1.0, 0.0, 0.0, 0.0, 0.25, 0.25, 0.75]])
    arrays, rows = packed_case(case, PerturbationBounds(r_bp=0.3), pose)
    w, piece, blocks = new_work(arrays), new_piece(case.m), new_blocks(case.m)
    assert prepare(arrays, rows, 0, w)
    whole_piece(arrays, piece)
    piece.d[5] = 0.25  # lifts anchor point 1 to its exit point
    nothing = prove(arrays, rows, 0, w, piece, blocks, np.eye(6) / 6.0, 3, True, ROUNDING)
    assert nothing == (-np.inf, -np.inf)
    proven = np.empty(1)
    certified_margins(0, 1, arrays, rows, np.ones(1), piece.d[None].copy(), 3, 20, True, proven)
    assert not proven[0] > 0.0


@pytest.mark.parametrize("scheme", PIECES)
def test_certificates_by_pieces_do_not_depend_on_the_chunk(scheme):
    case = CASES[scheme]
    bounds, poses = BASELINE.scaled(0.5 * SCALES[scheme]), random_poses(9, case.planar)

    def certified(poses, **more):
        options = VerdictOptions(pieces=60, **more)
        return judge_stability(case, bounds, poses, "certified", options)

    whole = certified(poses)
    parts = [certified(part).margin for part in (poses[:5], poses[5:])]
    np.testing.assert_array_equal(whole.margin, np.concatenate(parts))
    np.testing.assert_array_equal(whole.stable, certified(poses, margins=False).stable)


@pytest.mark.parametrize("scheme", PIECES)
def test_rounding_is_far_below_what_is_taken_off(scheme):
    case = CASES[scheme]
    arrays, rows = packed_case(case, BASELINE, random_poses(5, case.planar))
    w = new_work(arrays)
    for n in range(5):
        assert prepare(arrays, rows, n, w)
        error = rounding_error(arrays, w)
        assert 0.0 < error < 0.1 * ROUNDING
        if not case.planar:  # the left inverse against one of twice the length of numbers
            residual = np.asarray(w.M @ w.J.astype(np.longdouble) - np.eye(6), float)
            L, Li = (np.eye(6), np.eye(6)) if case.scheme == "ibvs" else (w.L, w.Li)
            assert np.linalg.norm(L @ residual @ Li) < error
