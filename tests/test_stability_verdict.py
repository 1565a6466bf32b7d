"""Verdicts on stability: against plain NumPy, chunk by chunk, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.errors import StabilityError
from cdpr_drake.models import load_robot
from cdpr_drake.perturbation_bounds import BASELINE, PLANAR_BASELINE
from cdpr_drake.perturbation_draws import draw_perturbations
from cdpr_drake.servo_target import FixedError, FixedObject, OppositeCorner
from cdpr_drake.stability_case import StabilityCase
from cdpr_drake.stability_criterion import stability_margin
from cdpr_drake.stability_verdict import VerdictOptions, judge
from tests.stability_reference import reference_pi

ROUNDING = 1e-9
"""Two ways to the same eigenvalue, through a pseudo-inverse of condition up to about 1e3."""


def spatial_case(scheme: str, **changes: object) -> StabilityCase:
    robot = load_robot("acrobot_large")
    target = FixedObject(
        RigidTransform([0.1, -0.05, -0.4]),
        RigidTransform(RollPitchYaw(0.2, np.pi - 0.3, 0.4), [0.02, -0.03, 0.5]),
    )
    case = StabilityCase(
        robot.exit_points(),
        robot.anchor_points(),
        scheme,
        X_PC=RigidTransform(RollPitchYaw(np.pi, 0.1, -0.2), [-0.06, 0.01, 0.02]),
        target=target,
        p_OK=np.array([[-0.1, 0.1, 0.1, -0.1], [0.1, 0.1, -0.1, -0.1], [0.0, 0.02, 0.0, 0.01]]),
    )
    return replace(case, **changes)


def planar_case() -> StabilityCase:
    robot = load_robot("planar")
    return StabilityCase(
        robot.exit_points(),
        robot.anchor_points(),
        planar=True,
        X_PC=RigidTransform(RollPitchYaw(np.pi, 0.0, 0.3), [0.02, 0.01, 0.1]),
        target=OppositeCorner(np.full(3, -0.55), np.full(3, 0.55)),
    )


def random_poses(count: int, planar: bool = False) -> np.ndarray:
    random = np.random.default_rng(1)
    poses = np.zeros((count, 7))
    poses[:, 0] = 1.0
    poses[:, 1:4] = random.uniform(-0.1, 0.1, (count, 3))
    if planar:
        poses[:, 1:3] = 0.0
    poses[:, 4:] = random.uniform([-0.3, -0.3, 0.1], [0.3, 0.3, 0.7], (count, 3))
    return poses


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
    found = judge(case, bounds, poses, options=options)
    m = len(case.p_WA.T)
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
    whole = judge(case, BASELINE, poses)
    parts = [judge(case, BASELINE, part).margin for part in (poses[6:], poses[:1], poses[1:6])]
    np.testing.assert_array_equal(whole.margin, np.concatenate([parts[1], parts[2], parts[0]]))
    single = judge(case, BASELINE, poses, options=VerdictOptions(threads=1))
    np.testing.assert_array_equal(whole.margin, single.margin)
    other = judge(case, BASELINE, poses, options=VerdictOptions(seed=1))
    assert not np.array_equal(whole.margin, other.margin)


def test_verdicts_without_margins_are_the_same() -> None:
    case, poses = spatial_case("pbvs"), random_poses(50)
    bounds = BASELINE.scaled(8.0)
    whole = judge(case, bounds, poses)
    quick = judge(case, bounds, poses, options=VerdictOptions(margins=False))
    np.testing.assert_array_equal(whole.stable, quick.stable)
    assert 0 < np.sum(whole.stable) < 50


def test_a_planar_robot_may_not_be_tilted() -> None:
    with pytest.raises(StabilityError, match="tilted"):
        judge(planar_case(), PLANAR_BASELINE, random_poses(2))


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
        (lambda: judge(spatial_case("pbvs"), BASELINE, np.zeros((2, 6))), r"shape \(2, 6\)"),
        (lambda: judge(spatial_case("pbvs"), BASELINE, np.zeros((2, 7))), "quaternion of zeros"),
        (
            lambda: judge(
                spatial_case("2.5d", target=FixedError()), BASELINE, random_poses(1)
            ),
            "needs p_CO",
        ),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(wrong: object, words: str) -> None:
    with pytest.raises(StabilityError, match=words):
        wrong()  # type: ignore[operator]
