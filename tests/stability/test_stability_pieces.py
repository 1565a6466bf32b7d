"""Pieces of the perturbations: that they cover all, hold what they say, and prove what is true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.stability.certified_kernel import ROUNDING, certified_margins, prove, rounding_error
from cdpr_drake.stability.criterion_at_pose_kernel import CaseArrays, evaluate, new_work, prepare
from cdpr_drake.stability.perturbation_bounds import BASELINE, PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.quadratic_bounds_kernel import fill_blocks, new_blocks
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.subdivision_kernel import (
    BOXES,
    best_cut,
    new_piece,
    place_piece,
    shrink_box,
    whole_box,
    whole_piece,
    worst_axes,
)
from cdpr_drake.stability.verdict import (
    VerdictOptions,
    judge_stability,
    packed_case,
    worst_perturbations,
)
from tests.stability.stability_cases import planar_case, random_poses, spatial_case

SLACK = 1e-9
"""Rounding of coordinates and forms of size 1."""

CASES = {
    "pbvs": spatial_case("pbvs"),
    "2.5d": spatial_case("2.5d"),
    "ibvs": spatial_case("ibvs"),
    "planar": planar_case(),
}

SCALES = {"pbvs": 3.0, "2.5d": 2.5, "ibvs": 3.5, "planar": 2.0}
"""Multiples of the baseline with which the whole proves some poses and pieces prove more."""

BOUNDS = {
    "large turns": PerturbationBounds(d_theta_bp=0.4, d_theta_pc=0.5, r_bp=0.02, r_pc=0.05),
    "large shifts": PerturbationBounds(r_bp=0.1, d_theta_bp=0.05, r_A=0.01, r_B=0.01),
    "common": BASELINE.varied(r_A=0.02, r_B=0.03, exits="common", anchors="common"),
    "corners": BASELINE.varied(r_A=0.01, r_B=0.01, exits="corners", anchors="corners"),
    "object": BASELINE.varied(r_s=0.1),
}


def boxes_of(
    arrays: CaseArrays, cuts: int, random: np.random.Generator
) -> tuple[Array, list[tuple[Array, Array]]]:
    """Radii, and boxes after random cuts as a certificate makes them."""
    ball, lo, hi = np.empty(BOXES), np.empty((BOXES, 3)), np.empty((BOXES, 3))
    whole_box(arrays, ball, lo, hi)
    boxes = [(lo, hi)]
    for _ in range(cuts):
        lo, hi = boxes.pop(random.integers(len(boxes)))
        slope, weight = random.normal(size=(BOXES, 3)), random.uniform(0.1, 1.0, BOXES)
        block, axis = best_cut(arrays, ball, lo, hi, slope, weight)
        middle = 0.5 * (lo[block, axis] + hi[block, axis])
        for side in (lo, hi):
            half = (lo.copy(), hi.copy())
            half[1 if side is lo else 0][block, axis] = middle
            if shrink_box(ball[block], half[0][block], half[1][block]):
                boxes.append(half)
    return ball, boxes


def turn(vector: Array) -> Array:
    return rotation_from_vector(vector).matrix()


def rodrigues(vector: Array) -> Array:
    """2 tan(theta / 2) u of a rotation vector theta u."""
    theta = np.linalg.norm(vector)
    return vector * (2.0 * np.tan(0.5 * theta) / theta if theta > 0.0 else 1.0)


def rotation_vector(R: Array) -> Array:
    """theta u of a rotation matrix by less than half a turn."""
    axis = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    s = np.linalg.norm(axis)
    return axis * (np.arctan2(s, 0.5 * (np.trace(R) - 1.0)) / s if s > 0.0 else 1.0)


def turn_between(a: Array, b: Array) -> Array:
    """Rotation vector that leads from exp(a) to exp(b), on the right."""
    return rotation_vector(turn(a).T @ turn(b))


def shift_of(case: StabilityCase, bounds: PerturbationBounds, R_WP: Array, d: Array) -> Array:
    """Shift of the platform, together with the common ones of the points."""
    shift = d[3:6].copy()
    if bounds.exits == "common":
        shift -= d[18:21]
    if bounds.anchors == "common":
        shift += R_WP @ turn(d[:3]) @ d[18 + 3 * case.m : 21 + 3 * case.m]
    return shift


@pytest.mark.parametrize("name", BOUNDS)
@pytest.mark.parametrize("scheme", CASES)
def test_pieces_cover_all_perturbations_and_bound_the_criterion(scheme: str, name: str) -> None:
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
            draw_perturbations(rows.poses[n], bounds, case.m, 15, planar=case.planar, inside=inside)
            for inside in (False, True)
        ])  # fmt: skip
        worst_axes(arrays, R_WP, draws[0], Q)
        ball, boxes = boxes_of(arrays, 25, random)
        for d in draws:
            shift = shift_of(case, bounds, R_WP, d)
            seen = [rodrigues(d[:3]), shift, rodrigues(d[6:9])]
            s = np.array([q.T @ x for q, x in zip(Q, seen, strict=True)])
            inside = [
                box for box in boxes if np.all(box[0] <= s + SLACK) and np.all(s <= box[1] + SLACK)
            ]
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
            for v in random.normal(size=(20, 6)):
                if case.planar:
                    v[[0, 1, 5]] = 0.0
                forms = np.einsum("i,bkij,j->bk", v, blocks.S, v)
                loss = blocks.radius[BOXES:] @ np.linalg.norm(forms[BOXES:], axis=1)
                a, b = (np.einsum("i,kij,j->k", v, x, v) for x in (blocks.left, blocks.right))
                loss += blocks.bound @ np.sqrt(np.maximum(a * b, 0.0))
                first = forms[:BOXES, :3]
                exact = v @ S_c @ v + np.sum(first * sigma)
                assert v @ w.S @ v >= exact - loss - SLACK * (v @ v)  # the remainder
                box = np.sum(first * piece.middle - np.abs(first) * piece.half, axis=1)
                disc = -piece.radius * np.linalg.norm(first, axis=1)
                lower = v @ S_c @ v + np.sum(np.maximum(box, disc)) - loss
                assert v @ w.S @ v >= lower - SLACK * (v @ v)
    assert bounded > 10


@pytest.mark.parametrize("scheme", CASES)
def test_cutting_proves_more_and_nothing_that_is_not_true(scheme: str) -> None:
    case = CASES[scheme]
    bounds = BASELINE.varied(exits="common", anchors="common").scaled(SCALES[scheme])
    poses = random_poses(24, case.planar)
    whole = judge_stability(case, bounds, poses, "certified", VerdictOptions(pieces=1))
    cut = judge_stability(case, bounds, poses, "certified", VerdictOptions(pieces=200))
    assert np.all(cut.stable >= whole.stable)
    assert np.sum(cut.stable) > np.sum(whole.stable)
    hard = VerdictOptions(draws=3000, searches=40, steps=60, seed=2)
    worst = judge_stability(case, bounds, poses, "searched", hard).margin
    assert np.all(cut.margin[cut.stable] <= worst[cut.stable])


def test_a_pose_just_beyond_its_bounds_is_never_certified() -> None:
    case, poses = spatial_case("pbvs"), random_poses(6)
    found = 0
    for pose in poses:
        low, high = 0.0, 8.0
        for _ in range(12):  # the bounds at which the search finds something
            share = 0.5 * (low + high)
            if judge_stability(case, BASELINE.scaled(share), pose, "searched").stable[0]:
                low = share
            else:
                high = share
        bounds = BASELINE.scaled(high)
        margin, worst = worst_perturbations(case, bounds, pose)
        assert not margin[0] > 0.0
        arrays, rows = packed_case(case, bounds, pose)
        proven = np.empty(1)
        for at in (worst, np.zeros_like(worst)):
            # As if the search had found nothing.
            certified_margins(0, 1, arrays, rows, np.full(1, np.inf), at, 10, 300, True, proven)
            assert not proven[0] > 0.0
        found += margin[0] > -0.05
    assert found > 0


def test_a_cable_without_length_proves_nothing() -> None:
    case = spatial_case("pbvs")
    A, B = case.cables.p_WA.copy(), case.cables.p_PB.copy()
    A[:, 0], B[:, 0] = [0.5, 0.5, 1.0], [0.25, 0.25, 0.0]
    case = replace(case, cables=replace(case.cables, p_WA=A, p_PB=B))
    pose = np.array([[1.0, 0.0, 0.0, 0.0, 0.25, 0.25, 0.75]])
    arrays, rows = packed_case(case, PerturbationBounds(r_bp=0.3), pose)
    w, piece, blocks = new_work(arrays), new_piece(case.m), new_blocks(case.m)
    assert prepare(arrays, rows, 0, w)
    whole_piece(arrays, piece)
    piece.d[5] = 0.25  # lifts anchor point 1 to its exit point
    assert prove(arrays, rows, 0, w, piece, blocks, np.eye(6) / 6.0, 3, True, ROUNDING) == (
        -np.inf,
        -np.inf,
    )
    proven = np.empty(1)
    found = piece.d[np.newaxis].copy()
    certified_margins(0, 1, arrays, rows, np.ones(1), found, 3, 20, True, proven)
    assert not proven[0] > 0.0


@pytest.mark.parametrize("scheme", CASES)
def test_certificates_by_pieces_do_not_depend_on_the_chunk(scheme: str) -> None:
    case = CASES[scheme]
    bounds, poses = BASELINE.scaled(0.5 * SCALES[scheme]), random_poses(9, case.planar)
    options = VerdictOptions(pieces=60)
    whole = judge_stability(case, bounds, poses, "certified", options)
    parts = [
        judge_stability(case, bounds, p, "certified", options).margin
        for p in (poses[5:], poses[:5])
    ]
    np.testing.assert_array_equal(whole.margin, np.concatenate([parts[1], parts[0]]))
    quick = VerdictOptions(pieces=60, margins=False)
    np.testing.assert_array_equal(
        whole.stable, judge_stability(case, bounds, poses, "certified", quick).stable
    )


@pytest.mark.parametrize("scheme", CASES)
def test_rounding_is_far_below_what_is_taken_off(scheme: str) -> None:
    case = CASES[scheme]
    arrays, rows = packed_case(case, BASELINE, random_poses(5, case.planar))
    w = new_work(arrays)
    for n in range(5):
        assert prepare(arrays, rows, n, w)
        error = rounding_error(arrays, w)
        assert 0.0 < error < 0.1 * ROUNDING
        # The left inverse against one of twice the length of numbers.
        J = w.J.astype(np.longdouble)
        if case.planar:
            continue
        residual = np.asarray(w.M @ J - np.eye(6), float)
        L, Li = (np.eye(6), np.eye(6)) if case.scheme == "ibvs" else (w.L, w.Li)
        assert np.linalg.norm(L @ residual @ Li) < error
