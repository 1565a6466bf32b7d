"""Verdicts on stability: against plain NumPy, chunk by chunk, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.poses import pose_rows
from cdpr_drake.stability.criterion import stability_margin
from cdpr_drake.stability.desired_view import FixedError
from cdpr_drake.stability.perturbation_bounds import BASELINE, DIRECTIONS, PLANAR_BASELINE
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VERDICTS, VerdictOptions, judge_stability
from tests.stability.stability_cases import planar_case, random_poses, spatial_case
from tests.stability.stability_reference import reference_pi

ROUNDING = 1e-9
"""Two ways to the same eigenvalue, through a pseudo-inverse of condition up to about 1e3."""


@pytest.mark.parametrize("perturbed", ["estimate", "truth"])
@pytest.mark.parametrize(
    "case",
    [
        spatial_case("pbvs"),
        spatial_case("pbvs", lever="object"),
        spatial_case("pbvs-line"),
        spatial_case("2.5d"),
        spatial_case("ibvs"),
        spatial_case("ibvs", p_OK=None),
        spatial_case("pbvs", taut=np.arange(8) != 3),
        planar_case(),
    ],
    ids=["pbvs", "pbvs exact", "line", "2.5d", "ibvs", "ibvs blind", "slack", "planar"],
)
@pytest.mark.parametrize("s", [0.0, 0.05])
def test_sampled_margin_is_that_of_plain_numpy(
    case: StabilityCase, perturbed: str, s: float
) -> None:
    case = replace(case, perturbed=perturbed)
    if case.scheme == "ibvs" and case.p_OK is None:
        s = 0.0
    bounds = BASELINE.varied(r_s=s, d_theta_s=0.0 if case.planar else s, exits="corners")
    poses = random_poses(3, case.planar)
    options = VerdictOptions(draws=20, seed=3)
    found = judge_stability(case, bounds, poses, options=options)
    m = case.cables.count
    for pose, margin in zip(poses, found.margin, strict=True):
        if case.planar:
            pose[6] = 0.0
        draws = draw_perturbations(pose, bounds, case.m, 20, 3, case.planar)
        if case.planar:
            pose[6] = 0.3  # the plane of the robot
        points = np.zeros((20, 2, m, 3))
        points[:, :, case.taut_cables()] = draws[:, 18:].reshape(20, 2, case.m, 3)
        full = np.hstack([draws[:, :18], points.reshape(20, -1)])
        expected = min(stability_margin(reference_pi(case, pose, d)) for d in full)
        assert margin == pytest.approx(min(expected, 1.0), abs=ROUNDING)


def test_a_perfect_model_is_the_identity() -> None:
    for case in (spatial_case("pbvs"), spatial_case("2.5d"), spatial_case("ibvs")):
        Pi = reference_pi(case, random_poses(1)[0], np.zeros(66))
        np.testing.assert_allclose(Pi, np.eye(6), atol=ROUNDING)


def test_verdicts_do_not_depend_on_the_chunk() -> None:
    case, poses = spatial_case("pbvs"), random_poses(9)
    whole = judge_stability(case, BASELINE, poses)
    parts = [
        judge_stability(case, BASELINE, part).margin for part in (poses[6:], poses[:1], poses[1:6])
    ]
    np.testing.assert_array_equal(whole.margin, np.concatenate([parts[1], parts[2], parts[0]]))
    single = judge_stability(case, BASELINE, poses, options=VerdictOptions(threads=1))
    np.testing.assert_array_equal(whole.margin, single.margin)
    other = judge_stability(case, BASELINE, poses, options=VerdictOptions(seed=1))
    assert not np.array_equal(whole.margin, other.margin)


def test_verdicts_without_margins_are_the_same() -> None:
    case, poses = spatial_case("pbvs"), random_poses(50)
    bounds = BASELINE.scaled(8.0)
    whole = judge_stability(case, bounds, poses)
    quick = judge_stability(case, bounds, poses, options=VerdictOptions(margins=False))
    np.testing.assert_array_equal(whole.stable, quick.stable)
    assert 0 < np.sum(whole.stable) < 50


def test_fifty_draws_are_looked_at_unless_said_otherwise() -> None:
    case, poses = spatial_case("pbvs"), random_poses(300)
    margins = {
        draws: judge_stability(case, BASELINE, poses, options=VerdictOptions(draws=draws)).margin
        for draws in (49, 50, 51)
    }
    assert np.any(margins[50] < margins[49])  # else fewer would do here
    assert np.any(margins[51] < margins[50])
    np.testing.assert_array_equal(judge_stability(case, BASELINE, poses).margin, margins[50])


@pytest.mark.parametrize("scheme", ["pbvs", "pbvs-line"])
@pytest.mark.parametrize("verdict", VERDICTS)
def test_a_planar_robot_sees_nothing_out_of_its_plane(verdict: str, scheme: str) -> None:
    """Neither a height nor a tilt of the desired view; a way in the plane counts under PBVS."""
    turn, error = np.array([0.3, -0.2, 0.5]), np.array([0.1, -0.15, 0.4])
    flat, poses = np.array([1.0, 1.0, 0.0]), random_poses(4, planar=True)

    def margins(turn: np.ndarray, error: np.ndarray) -> np.ndarray:
        case = replace(planar_case(), scheme=scheme, target=FixedError(turn, error))
        return judge_stability(case, PLANAR_BASELINE.scaled(0.2), poses, verdict).margin

    whole = margins(turn, error)
    assert np.all(np.isfinite(whole))
    np.testing.assert_array_equal(whole, margins(turn * (1.0 - flat), error * flat))
    for axis in np.eye(3)[:2]:
        moved = margins(turn, error + 0.1 * axis) != whole
        assert np.all(moved) if scheme == "pbvs" else not np.any(moved)


def test_a_planar_robot_may_not_be_tilted() -> None:
    with pytest.raises(StabilityError, match="tilted"):
        judge_stability(planar_case(), PLANAR_BASELINE, random_poses(2))


ORDER_CASES = {
    "pbvs": spatial_case("pbvs"),
    "line": spatial_case("pbvs-line"),
    "2.5d": spatial_case("2.5d"),
    "ibvs": spatial_case("ibvs"),
    "slack": spatial_case("pbvs", taut=np.arange(8) != 3),
    "planar": planar_case(),
}


@pytest.mark.parametrize("case", ORDER_CASES.values(), ids=ORDER_CASES)
@pytest.mark.parametrize("directions", DIRECTIONS)
def test_certified_implies_searched_implies_sampled(case: StabilityCase, directions: str) -> None:
    poses = random_poses(40, case.planar)
    bounds = BASELINE.varied(exits=directions, anchors=directions)
    for share in (0.25, 1.0, 2.0):
        chunks = [
            judge_stability(case, bounds.scaled(share), poses, verdict) for verdict in VERDICTS
        ]
        sampled, searched, certified = (chunk.margin for chunk in chunks)
        assert np.all(certified <= searched)
        assert np.all(searched <= sampled)
        quick = judge_stability(
            case, bounds.scaled(share), poses, "certified", VerdictOptions(margins=False)
        )
        assert not np.any(quick.stable & ~chunks[1].stable)


def test_the_search_beats_many_random_draws() -> None:
    case, poses = spatial_case("pbvs"), random_poses(20)
    many = judge_stability(case, BASELINE, poses, options=VerdictOptions(draws=20_000)).margin
    searched = judge_stability(case, BASELINE, poses, "searched").margin
    assert np.all(searched < many)


def test_a_quarter_of_the_baseline_is_mostly_certified() -> None:
    case, poses = spatial_case("pbvs"), random_poses(200)
    bounds = BASELINE.scaled(0.25)
    searched = judge_stability(
        case, bounds, poses, "searched", VerdictOptions(margins=False)
    ).stable
    certified = judge_stability(
        case, bounds, poses, "certified", VerdictOptions(margins=False)
    ).stable
    assert np.sum(certified) >= 0.9 * np.sum(searched) > 0


def test_poses_may_be_transforms() -> None:
    case, poses = spatial_case("pbvs"), random_poses(4)
    transforms = [
        RigidTransform(Quaternion(pose[:4] / np.linalg.norm(pose[:4])), pose[4:]) for pose in poses
    ]
    np.testing.assert_allclose(
        np.abs(np.sum(pose_rows(transforms)[:, :4] * poses[:, :4], axis=1)),
        np.linalg.norm(poses[:, :4], axis=1),
    )
    np.testing.assert_array_equal(pose_rows(transforms)[:, 4:], poses[:, 4:])
    assert judge_stability(case, BASELINE, pose_rows(transforms)).stable.all()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: BASELINE.varied(r_A=-0.1), "r_A: found -0.1; accepted: a number >= 0"),
        (lambda: BASELINE.varied(d_theta_bp=4.0), "d_theta_bp: found 4; accepted"),
        (lambda: BASELINE.varied(r_X=1.0), "found r_X; accepted"),
        (lambda: BASELINE.varied(exits="all"), "exits: found all; accepted"),
        (lambda: replace(planar_case(), scheme="2.5d"), "2.5d for a planar robot"),
        (lambda: replace(planar_case(), scheme="ibvs"), "ibvs for a planar robot"),
        (lambda: spatial_case("pbvs", taut=np.arange(8) < 5), "found 5 taut; accepted: at least 6"),
        (lambda: spatial_case("dance"), "scheme: found dance"),
        (lambda: VerdictOptions(draws=0), "draws: found 0"),
        (
            lambda: judge_stability(spatial_case("pbvs"), BASELINE, random_poses(1), "sure"),
            "verdict: found",
        ),
        (
            lambda: judge_stability(
                spatial_case("pbvs", perturbed="truth"), BASELINE, random_poses(1), "certified"
            ),
            "perturbed: found truth for a certificate",
        ),
        (
            lambda: judge_stability(
                spatial_case("2.5d"), BASELINE.varied(r_s=0.1), random_poses(1), "certified"
            ),
            "r_s: found 0.1 for a certificate of 2.5d",
        ),
        (
            lambda: judge_stability(spatial_case("pbvs"), BASELINE, np.zeros((2, 6))),
            r"shape \(2, 6\)",
        ),
        (
            lambda: judge_stability(spatial_case("pbvs"), BASELINE, np.zeros((2, 7))),
            "quaternion of zeros",
        ),
        (
            lambda: judge_stability(
                spatial_case("2.5d", target=FixedError()), BASELINE, random_poses(1)
            ),
            "needs p_CO",
        ),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(wrong: object, words: str) -> None:
    with pytest.raises(StabilityError, match=words):
        wrong()  # type: ignore[operator]
