"""Which cables a message names, and which limits count as reached."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.planning.robot_path_task import RESERVE, LimitSettings, path_task
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.failures import not_held
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import ACTIVE, MotionSamples
from cdpr_drake.trajectories.pose_path import POINT_SIZE

OUTSIDE = pose_from_angles(np.array([-0.2, -0.42, 0.3]), np.zeros(3))
"""Where the nearest tensions are above the limits in one cable and below them in another."""


@pytest.mark.parametrize("torque", [np.inf, 0.3, 0.15])
def test_cables_that_miss_most_are_named(torque):
    """C1 pulls too much and C3 too little, by as much: also where torques keep their limit."""
    task = path_task(load_robot("planar"), LimitSettings(tensions=(1.0, 60.0), reserve=RESERVE))
    task = replace(task, limits=replace(task.limits, torque=torque))
    point = np.concatenate([pose_row(OUTSIDE), np.zeros(POINT_SIZE - 7)])
    nearest = not_held(task, point).split("the nearest they come: ")[1].split("; accepted")[0]
    assert tuple(cable.split()[0] for cable in nearest.split(", ")) == ("C1", "C3")


def test_a_limit_is_reached_within_a_share_of_its_range():
    """Tensions by half their range of 100 N, all else by the limit; just inside, just outside."""
    limits = MotionLimits(lower=10.0, upper=210.0, cable_speed=4.0, cable_acceleration=5.0,
                          torque=2.0, speed=3.0)  # fmt: skip
    near = np.array([1.0 - 0.9 * ACTIVE, 1.0 - 1.1 * ACTIVE, 0.0])
    tensions = 10.0 + 100.0 * np.array([[0.9 * ACTIVE, 1.1 * ACTIVE, 2.0 - 0.9 * ACTIVE]])
    uses = np.array([[0.0, 0.0, 0.0, 1.0 - 0.9 * ACTIVE]])
    zero = np.zeros(1)
    samples = MotionSamples(
        zero, zero, zero, uses, tensions, -4.0 * near[np.newaxis], 5.0 * near[np.newaxis],
        -2.0 * near[np.newaxis], limits,
    )  # fmt: skip
    active = samples.active()
    assert active["tension, lower"].tolist() == [[True, False, False]]
    assert active["tension, upper"].tolist() == [[False, False, True]]
    for name in ("torque", "cable speed", "cable acceleration"):
        assert active[name].tolist() == [[True, False, False]], name
    assert active["speed of Po"].tolist() == [[True]]
    assert not replace(samples, uses=uses - 0.2 * ACTIVE).active()["speed of Po"].any()
