"""What runs over seeds have in common is made once, and only where no seed changes it."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import servo_model
from cdpr_drake.systems.loops.basis import loop_basis
from cdpr_drake.systems.loops.loop_choice import check_loop
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.robots.compiled_step import StepRule

PROJECTED = "camera.kind=projected"


def scenario_with(*options):
    return check_loop(load_scenario("acrobot_pbvs", [PROJECTED, *options]))


def test_seeds_that_change_no_belief_share_the_model():
    scenario = scenario_with()
    basis = loop_basis(scenario)
    other = replace(scenario, seed=7)
    assert loop_basis(other) is basis
    assert servo_model(other, basis.robot, basis.model) is basis.model


@pytest.mark.parametrize(
    "wrong", ["perturbations.exit_points=0.01", "perturbations.camera_pose_shift.distance=0.01"]
)
def test_a_seed_that_changes_what_is_believed_gets_a_model_of_its_own(wrong):
    scenario = replace(scenario_with(wrong), seed=7)
    basis = loop_basis(scenario)
    found = servo_model(scenario, basis.robot, basis.model)
    alone = servo_model(scenario, basis.robot)
    assert found is not basis.model
    np.testing.assert_array_equal(found.believed.cables.p_WA, alone.believed.cables.p_WA)
    np.testing.assert_array_equal(
        found.believed.X_PC.GetAsMatrix4(), alone.believed.X_PC.GetAsMatrix4()
    )


def test_a_motion_like_another_moves_as_it_and_leaves_it_alone():
    scenario = scenario_with()
    basis = loop_basis(scenario)
    rule = StepRule(max_step=1e-3)
    alone = RobotMotion(basis.robot, scenario, rule)
    like = RobotMotion(basis.robot, scenario, rule, alone)
    pulled = np.linspace(-0.02, 0.02, len(basis.robot.cables))
    alone.begin(basis.resting)
    before = alone.pose().GetAsMatrix4()
    for motion in (like, alone):
        motion.begin(basis.resting)
        motion.command(pulled)
        motion.advance(0.05)
        if motion is like:
            np.testing.assert_array_equal(alone.pose().GetAsMatrix4(), before)
    np.testing.assert_array_equal(like.pose().GetAsMatrix4(), alone.pose().GetAsMatrix4())
    np.testing.assert_array_equal(like.cables(), alone.cables())
