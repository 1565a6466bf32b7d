"""Robots in MJCF are at rest at home as long as nothing is commanded, wherever they can be."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.models.robot_exchange import export_robot
from cdpr_drake.models.robot_exports import export_omissions
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import load_robot, robot_names
from tests.models.formats.unusual_robots import UNUSUAL
from tests.motion.small_robots import MOTIONS, small_robot

mujoco = pytest.importorskip("mujoco")

AT_REST = 1e-6
"""Accelerations at rest [m/s^2, rad/s^2]; found: at most 6e-9, by rounding of tensions."""

ROBOTS = [*robot_names(), *UNUSUAL, *(name for name in MOTIONS if name != "beam")]


def robot_of(name):
    if name in UNUSUAL:
        return UNUSUAL[name]()
    return small_robot(name) if name in MOTIONS else load_robot(name)


def at_home(robot):
    """MuJoCo's model and data, nothing commanded."""
    (text,) = export_robot(robot, "mjcf").values()
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("name", ROBOTS)
def test_it_is_at_rest_at_home_and_motors_add_nothing(name):
    robot = robot_of(name)
    _, data = at_home(robot)
    assert np.all(data.actuator_force == 0.0)
    cables = robot.cable_set().without_pulleys()
    why = ""
    try:
        hold_robot(robot, robot.home.transform(), cables, "elastic")
    except InfeasibleTensionError as problem:
        why = f"is no pose of rest, since {problem}"
    assert export_omissions(robot, "mjcf").get("home", "") == why
    assert (np.max(np.abs(data.qacc)) < AT_REST) == (why == "")


@pytest.mark.parametrize("name", ["cogiro", "caroca_gazebo", "everything", "flat"])
def test_motors_pull_up_to_the_largest_tension_and_never_push(name):
    robot = robot_of(name)
    model, data = at_home(robot)
    for command, force in ((1e9, 0.0), (-1e9, -robot.tension_bounds.upper)):
        data.ctrl[:] = command
        mujoco.mj_forward(model, data)
        np.testing.assert_array_equal(data.actuator_force, force)


def test_all_robots_of_the_package_that_statics_hold_are_here():
    held = [
        name for name in robot_names() if "home" not in export_omissions(load_robot(name), "mjcf")
    ]
    assert len(held) >= 21
