"""The worst perturbation: within bounds, and as bad as the search says."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.framework.servo_models import Perturbation, perturbed_servo
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.stability.criterion_at_pose_kernel import evaluate, new_work, prepare
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import BASELINE, POSE_BLOCKS, PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import (
    VerdictOptions,
    judge_stability,
    packed_case,
    worst_perturbations,
)
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.workspaces.pose_grid import grid_by_count
from tests.stability.stability_cases import planar_case, random_poses, spatial_case

ROUNDING = 1e-9
SAME = 1e-7
"""Two implementations of the criterion agree within this [-]."""


@pytest.fixture(scope="module")
def found():
    scenario = load_scenario(
        "acrobot_pbvs",
        ["robot=acrobot_large", "target.pose.position=[0,0,0]", "desired.position=[0,0,0.3]"],
    )
    nothing = Perturbation.from_vector(np.zeros(3 * (POSE_BLOCKS + 16)))
    servo = perturbed_servo(scenario, nothing)
    case = StabilityCase(
        servo.robot.cable_set().without_pulleys(),
        X_PC=servo.X_PC,
        target=FixedObject(servo.X_WO, scenario.desired.transform()),
        lever="object",
    )
    poses = grid_by_count([-0.3, -0.3, 0.3], [0.3, 0.3, 0.9], [2, 2, 2]).pose_rows()
    options = VerdictOptions(seed=4)
    margin, worst = worst_perturbations(case, BASELINE, poses, options)
    return scenario, case, poses, options, margin, worst


def test_it_is_as_bad_as_the_searched_verdict_says(found):
    scenario, case, poses, options, margin, worst = found
    np.testing.assert_array_equal(
        margin, judge_stability(case, BASELINE, poses, "searched", options).margin
    )
    for pose, value, d in zip(poses, margin, worst, strict=True):
        servo = perturbed_servo(scenario, Perturbation.from_vector(d))
        assert servo.margin(pose_from_row(pose)) == pytest.approx(value, abs=SAME)


def test_it_is_worse_than_random_ones(found):
    _, case, poses, options, margin, _ = found
    assert np.all(margin < judge_stability(case, BASELINE, poses, "sampled", options).margin)


def test_it_stays_within_the_bounds(found):
    *_, worst = found
    blocks = np.linalg.norm(worst.reshape(len(worst), -1, 3), axis=2)
    radii = BASELINE.radii()
    limits = np.concatenate([radii[:POSE_BLOCKS], np.repeat(radii[POSE_BLOCKS:], 8)])
    assert np.all(blocks <= limits * (1.0 + ROUNDING) + 1e-15)


@pytest.mark.parametrize(
    ("case", "bounds"),
    [
        (planar_case(), PerturbationBounds(d_theta_bp=0.3)),  # two draws are all there is
        (planar_case(), BASELINE.scaled(2.0)),
        (spatial_case("pbvs"), PerturbationBounds(d_theta_bp=0.5)),
        (spatial_case("2.5d"), PerturbationBounds()),
    ],
)
def test_every_perturbation_has_the_margin_that_stands_beside_it(case, bounds):
    poses = random_poses(40, case.planar)
    options = VerdictOptions(draws=20, searches=2, steps=3)
    margin, worst = worst_perturbations(case, bounds, poses, options)
    arrays, rows = packed_case(case, bounds, poses)
    w = new_work(arrays)
    for n in range(len(poses)):
        assert prepare(arrays, rows, n, w)
        assert evaluate(arrays, rows, n, w, worst[n])
        found = min(np.linalg.eigvalsh(w.S)[0], 1.0)
        assert found == pytest.approx(margin[n], abs=ROUNDING)
