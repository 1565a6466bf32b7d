"""A frame that was assumed bounds default grids and refuses no pose."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake import models
from cdpr_drake.analyses.statics.robot_at_rest import static_at_lengths, static_at_pose
from cdpr_drake.errors import RobotFileError, TensionProblemError
from cdpr_drake.models.robot_loader import parse_robot
from cdpr_drake.models.robot_statics import check_pose

HUNG = """\
name: hung
title: A box that hangs on four vertical ropes
motion: 3R3T
platform: {{mass: 1.0, size: [1.0, 1.0, 1.0], box_center: [0, 0, 0], center_of_mass: [0, 0, 0]}}
cable: {{youngs_modulus: 1.0e11, diameter: 0.004, linear_density: 0.01, retardation_time: 3.0e-4}}
pulley: {{radius: 0.0}}
winch: {{drum_radius: 0.05, gear_ratio: 1.0, motor_speed_rpm: 190.0}}
tension_bounds: {{lower: 0.0, upper: 50.0}}
frame: {{lower: [-1, -1, 2], upper: [1, 1, 5], assumed: {assumed}}}
home: {{position: [0, 0, {home}]}}
cables:
  - {{name: a, exit_point: [0.5, 0.5, 5], anchor_point: [0.5, 0.5, 0.5]}}
  - {{name: b, exit_point: [0.5, -0.5, 5], anchor_point: [0.5, -0.5, 0.5]}}
  - {{name: c, exit_point: [-0.5, 0.5, 5], anchor_point: [-0.5, 0.5, 0.5]}}
  - {{name: d, exit_point: [-0.5, -0.5, 5], anchor_point: [-0.5, -0.5, 0.5]}}
"""

QUARTER = 9.81 / 4.0
"""Tension of each rope [N]: a quarter of the weight of 1 kg."""

STRETCH = 1e-4
"""Share by which elastic ropes change the frequency of a pendulum of rigid ones."""

BELOW = RigidTransform([0.0, 0.0, 1.5])
"""A pose under the assumed frame, on ropes of 3 m."""


def hung(*, assumed=True, home=2.0):
    text = HUNG.format(assumed=str(assumed).lower(), home=home)
    return parse_robot(text, "hung.yaml")


@pytest.mark.parametrize(("height", "length"), [(2.0, 2.5), (1.5, 3.0), (-4.0, 8.5)])
def test_a_box_hangs_where_its_ropes_let_it(height, length):
    found = static_at_pose(hung(), RigidTransform([0.0, 0.0, height]), "elastic", True)
    assert found.tensions == pytest.approx([QUARTER] * 4)
    pendulum = np.sqrt(9.81 / length) / (2.0 * np.pi)
    assert np.min(found.frequencies) == pytest.approx(pendulum, rel=STRETCH)


def test_a_given_frame_still_refuses():
    with pytest.raises(TensionProblemError, match="outside the frame of hung"):
        check_pose(hung(assumed=False), BELOW)
    check_pose(hung(), BELOW)


def test_home_may_lie_outside_an_assumed_frame():
    assert hung(home=1.0).home.position[2] == 1.0
    with pytest.raises(RobotFileError, match="within the frame"):
        hung(assumed=False, home=1.0)


def test_tensions_and_lengths_answer_below_it():
    robot = hung()
    assert cdpr.solve_tensions(robot, BELOW).tensions == pytest.approx([QUARTER] * 4, abs=1e-6)
    held = static_at_pose(robot, BELOW, "elastic", True)
    again = static_at_lengths(robot, held.l0, "elastic", True)
    assert again.X_WP.translation() == pytest.approx(BELOW.translation(), abs=1e-6)


def test_every_shipped_frame_that_no_source_gives_is_assumed():
    drawn = [
        name
        for name in models.robot_names()
        if "| frame | drawn round the exit points |"
        in (models.robot_file(name).parent / "README.md").read_text(encoding="utf-8")
    ]
    assert len(drawn) > 10
    for name in [*drawn, "maslow_4", "hangprinter_4", "irma4u"]:
        robot = models.load_robot(name)
        assert robot.frame.assumed, name
        check_pose(robot, RigidTransform(robot.home.transform()))
