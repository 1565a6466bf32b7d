"""Robots of a batch that get other parameters, or a blow, while they move."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.batches.batch_member import BatchMember
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.robots.settings import CableRobotSettings

COUNT = 3
ROUNDING = 1e-9
"""Of poses at which a search for rest ends [m]."""


def heavier(robot, share=1.3):
    return replace(robot, platform=replace(robot.platform, mass=share * robot.platform.mass))


def moved(batch, steps=5):
    for k in range(steps):
        batch.step(0.02 * np.sin(np.arange(batch.commands_per_robot) + k), 0.01)
    return batch.states


def test_an_exchanged_robot_moves_as_if_it_had_been_in_the_batch_from_the_start():
    robot = load_robot("acrobot_small")
    other = heavier(robot)
    exchanged = BatchRobots(robot, COUNT, threads=1)
    moved(exchanged)
    exchanged.exchange(1, other)
    exchanged.reset()
    made = BatchRobots(robot, COUNT, parameters=[robot, other, robot], threads=1)
    assert moved(exchanged).tobytes() == moved(made).tobytes()
    assert exchanged.tensions.tobytes() == made.tensions.tobytes()
    assert exchanged.robots[1] is other


def test_a_load_that_is_taken_up_pulls_the_platform_down():
    """Newton: with the tensions of before, the weight that was added is all that accelerates."""
    robot = load_robot("acrobot_small")
    batch = BatchRobots(robot, COUNT, by_tensions=True, threads=1)
    held = batch.tensions
    batch.exchange(2, heavier(robot, 2.0))
    batch.step(held, 1e-3)
    assert batch.twists[:2, 5] == pytest.approx(0.0, abs=1e-6)
    assert batch.twists[2, 5] == pytest.approx(-0.5 * 9.81 * 1e-3, rel=1e-3)


@pytest.mark.parametrize("name", ["acrobot_small", "planar", "hangprinter_4", "gt_graffiti"])
def test_a_blow_is_what_is_read(name):
    batch = BatchRobots(load_robot(name), COUNT, threads=1)
    basis = batch.robot.motion_type().basis(batch.robot.home.transform().rotation().matrix())
    twist = basis @ np.linspace(0.01, 0.02, basis.shape[1])
    batch.set_twists([0, 2], twist)
    assert batch.twists[[0, 2]] == pytest.approx(np.tile(twist, (2, 1)))
    assert not batch.twists[1].any()


def test_robots_of_another_structure_are_refused():
    batch = BatchRobots(load_robot("acrobot_small"), 2, threads=1)
    with pytest.raises(CdprError, match="accepted: robots of one structure"):
        batch.exchange(0, load_robot("planar"))
    with pytest.raises(CdprError, match="robots: found"):
        batch.exchange(2, load_robot("acrobot_small"))


def test_what_was_made_of_a_robot_serves_several_rows_at_several_places():
    """Its rest is sought once for each place, and is that of a robot made anew."""
    robot = load_robot("acrobot_small")
    other = heavier(robot)
    member = BatchMember.of(other, CableRobotSettings(), False)
    batch = BatchRobots(robot, COUNT, threads=1)
    for row in (0, 2):
        batch.exchange(row, member)
    made = BatchRobots(robot, COUNT, parameters=[other, robot, heavier(robot)], threads=1)
    home = robot.home.transform()
    places = [
        home,
        home,
        RigidTransform(home.rotation(), home.translation() + np.array([0.0, 0.0, 0.05])),
    ]
    for X in (places, places[::-1], None):
        assert batch.reset(None, X).tobytes() == made.reset(None, X).tobytes()
        there = [pose_row(one) for one in X or [home] * COUNT]
        np.testing.assert_allclose(batch.poses, there, atol=ROUNDING)
        assert moved(batch).tobytes() == moved(made).tobytes()
    assert batch.robots[0] is batch.robots[2] is other
