"""One perturbation means the same to the criterion, the scenario and the kinematic loop."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.studies.closed_loops.kinematic_servo import REACHED, STEP, kinematic_path
from cdpr_drake.analyses.studies.framework.servo_models import (
    Perturbation,
    perturbed_scenario,
    perturbed_servo,
)
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import BASELINE, vector_size
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

ROUNDING = 1e-9
SETTINGS = [
    "robot=acrobot_large",
    "camera.kind=projected",
    "target.pose.position=[0, 0, 0]",
    "desired.position=[0, 0, 0.3]",
]
START = pose_from_angles(np.array([0.2, 0.1, 0.6]), np.radians([5.0, -5.0, 20.0]))
NONE = Perturbation.from_vector(np.zeros(vector_size(8)))


def servo_of(perturbation, *settings):
    return perturbed_servo(load_scenario("acrobot_pbvs", [*SETTINGS, *settings]), perturbation)


def drawn(seed):
    return draw_perturbations(pose_row(START), BASELINE, 8, 1, seed)[0]


@pytest.mark.parametrize("scheme", ["pbvs", "pbvs-line", "2.5d", "ibvs"])
@pytest.mark.parametrize("seed", range(3))
def test_the_margin_is_that_of_the_kernel(scheme, seed):
    """The plain NumPy criterion of the perturbed servo, and the kernel's with the same draw."""
    bounds = BASELINE.scaled(4.0)  # so that margins are well below those of the exact model
    d = draw_perturbations(pose_row(START), bounds, 8, 1, seed)[0]
    servo = servo_of(Perturbation.from_vector(d), f"controller.scheme={scheme}")
    robot = load_robot("acrobot_large")
    case = StabilityCase(
        robot.cable_set().without_pulleys(),
        scheme,
        X_PC=servo.X_PC,
        target=FixedObject(servo.X_WO, servo.scenario.desired.transform()),
        p_OK=servo.target.points,
        lever="object",
    )
    options = VerdictOptions(draws=1, seed=seed)
    found = judge_stability(case, bounds, pose_row(START)[None], "sampled", options).margin[0]
    assert found < 0.95
    assert servo.margin(START) == pytest.approx(found, abs=1e-7)


def test_the_scenario_makes_the_controller_believe_the_perturbation():
    d = drawn(5)
    perturbation = Perturbation.from_vector(d)
    servo = servo_of(perturbation)
    made = perturbed_scenario(servo.scenario, START, perturbation)
    believed = believed_robot(made, load_robot("acrobot_large"))
    truth, estimate = servo.models(START)
    assert believed.X_WP0.IsNearlyEqualTo(estimate.X_WP, ROUNDING)
    assert believed.X_PC.IsNearlyEqualTo(estimate.X_PC, ROUNDING)
    np.testing.assert_allclose(believed.cables.p_WA, estimate.cables.p_WA, atol=ROUNDING)
    np.testing.assert_allclose(believed.cables.p_PB, estimate.cables.p_PB, atol=ROUNDING)
    assert made.initial_pose.transform().IsNearlyEqualTo(truth.X_WP, ROUNDING)
    # All errors have full size.
    np.testing.assert_allclose(np.linalg.norm(perturbation.exits, axis=0), BASELINE.r_A)
    np.testing.assert_allclose(np.linalg.norm(perturbation.anchors, axis=0), BASELINE.r_B)
    assert np.linalg.norm(perturbation.shift) == pytest.approx(BASELINE.r_bp)
    assert np.linalg.norm(perturbation.camera_shift) == pytest.approx(BASELINE.r_pc)
    # The base scenario is not touched.
    assert servo.scenario.perturbations.exit_point_shifts is None


def test_without_perturbation_the_error_falls_exponentially():
    servo = servo_of(NONE)
    path = kinematic_path(servo, START)
    assert path.outcome == Outcome.CONVERGED
    assert len(path.errors) == pytest.approx(-np.log(REACHED) / STEP, rel=0.02)
    assert servo.margin(START) == pytest.approx(1.0, abs=1e-6)
    times = STEP * np.arange(len(path.errors))
    np.testing.assert_allclose(path.errors, path.errors[0] * np.exp(-times), rtol=0.15)


@pytest.mark.parametrize("scheme", ["pbvs", "pbvs-line", "2.5d"])
@pytest.mark.parametrize("seed", range(2))
def test_the_error_falls_wherever_the_criterion_holds(scheme, seed):
    servo = servo_of(Perturbation.from_vector(drawn(seed)), f"controller.scheme={scheme}")
    path = kinematic_path(servo, START)
    holds = np.array([servo.margin(X) > 0.0 for X in path.poses[::20]])
    assert np.all(holds)
    assert path.outcome == Outcome.CONVERGED
    assert np.max(np.diff(path.errors)) <= 0.0


def test_a_camera_mounted_the_wrong_way_round_does_not_converge():
    """What the criterion refuses, and rightly so."""
    turned = Perturbation(
        RotationMatrix(),
        np.zeros(3),
        RotationMatrix.MakeZRotation(np.pi * 0.9),
        np.zeros(3),
        np.zeros((3, 8)),
        np.zeros((3, 8)),
    )
    servo = servo_of(turned)
    assert servo.margin(START) < 0.0
    path = kinematic_path(servo, START)
    assert path.outcome in (Outcome.TARGET_LOST, Outcome.DIVERGED)


def test_no_perturbation_believes_the_truth():
    X = RigidTransform(RotationMatrix.MakeZRotation(0.3), [1.0, 2.0, 3.0])
    assert NONE.platform(X).IsNearlyEqualTo(X, ROUNDING)
    assert NONE.camera(X).IsNearlyEqualTo(X, ROUNDING)
