"""A robot's motion without a diagram: begun again, and continued from what was kept."""

import numpy as np
import pytest

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.loops.loop_state import arrays_of, restore_arrays
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings


@pytest.fixture(params=["elastic", "catenary"])
def make_motion(request):
    def make():
        settings = CableRobotSettings()
        settings.cables.model = request.param
        return RobotMotion(load_robot("acrobot_small"), settings, StepRule(max_step=1e-3))

    return make


def begun(motion):
    motion.begin(motion.resting(motion.robot.home.transform()))
    motion.command(np.full(8, 0.02))


def test_a_run_that_begins_again_follows_its_own_command(make_motion):
    motion, reached = make_motion(), []
    rest = motion.resting(motion.robot.home.transform())
    for speed in (0.02, -0.02, 0.02):
        motion.begin(rest)
        motion.command(np.full(8, speed))
        motion.advance(0.01)
        reached.append(motion.pose().translation())
    assert np.linalg.norm(reached[1] - reached[0]) > 1e-5
    assert np.array_equal(reached[2], reached[0])


def test_what_is_kept_continues_to_the_last_bit(make_motion):
    """With cables that sag, whose search begins where it ended last."""
    motion, other = make_motion(), make_motion()
    begun(motion)
    motion.advance(0.05)
    begun(other)
    restore_arrays(other.kept(), arrays_of(motion.kept()))
    other.forget()
    for one in (motion, other):
        one.advance(0.25)
    assert motion.report.tobytes() == other.report.tobytes()
    assert motion.pose().GetAsMatrix4().tobytes() == other.pose().GetAsMatrix4().tobytes()
