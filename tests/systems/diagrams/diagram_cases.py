"""What the tests of diagrams share: runs, robots with a doubled cable, dynamic control."""

import copy

import yaml

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.models.robots import content_of

PROJECTED = "camera.kind=projected"

ENGINE = "integration.engine=compiled"

LOOP = (ENGINE, "integration.loop=compiled")
"""The loop of kernels, whose runs are those of the diagram (tests of `loops`)."""

KNOWN_TAG = (
    "estimator.known_tag={tag_id: 7, size: 0.06, pose: {position: [0.12, -0.02, 0]}, period: 0.1}"
)

PLATFORM_TAG = (
    "platform_tag: {tag_id: 5, size: 0.12, "
    "pose: {position: [0, -0.1, 0.06], angles_deg: [55, 0, 0]}}"
)


def servo_run(name, *changes):
    return ServoRun(load_scenario(name, [PROJECTED, *changes])).simulate()


def doubled(name="acrobot_small"):
    """A robot whose first cable is two, 2 mm from each other, on one winch."""
    content = content_of(name)
    twin = copy.deepcopy(content["cables"][0])
    twin["name"] = "twin"
    for key in ("exit_point", "anchor_point"):
        twin[key] = [twin[key][0] + 0.002, *twin[key][1:]]
    for cable in (content["cables"][0], twin):
        cable["winch"] = "both"
    content["cables"].append(twin)
    content["slack_readings"] = None
    return content


def written(folder, content):
    path = folder / "robot.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return f"robot={path}"


def dynamic_control(name="acrobot_large", *, trajectory=None, log_rate=None, **more):
    """Dynamic control, critically damped at 10 rad/s, which stays at home if not told a way."""
    robot = load_robot(name)
    home = robot.home.transform()
    trajectory = trajectory or PoseTrajectory((home, home), (1.0,))
    settings = TensionControlSettings(trajectory=trajectory, gains=TaskGains(100.0, 20.0), **more)
    return build_tension_control(robot, settings, log_rate=log_rate)
