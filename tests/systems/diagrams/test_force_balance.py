"""A robot whose tensions balance forces alone: its centre of mass is held, its turn is not."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.control.force_balance import FORCE, WRENCH
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.predictive_tensions import PredictiveTensions
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

STIFFNESS, DAMPING = 100.0, 20.0
"""Critical damping: the error is e0 (1 + 10 t) exp(-10 t)."""

SAMPLED = 4e-4
"""A force that is held for a millisecond changes that curve by less, of 20 mm [m]."""

SAME = 1e-13
"""The same kernels in the same order, compiled together and apart, of numbers around one."""

END = 0.4
"""Simulated time; the platform turns for a while before cables can pull it no more [s]."""


def control(balance, **more):
    robot = load_robot("acrobot_large")
    home = robot.home.transform()
    settings = TensionControlSettings(
        trajectory=PoseTrajectory((home, home), (1.0,)),
        gains=TaskGains(STIFFNESS, DAMPING),
        limits=(0.1, 200.0),
        balance=balance,
        rule=StepRule(max_step=1e-3),
        **more,
    )
    return build_tension_control(robot, settings, log_rate=1000.0)


def run(balance, offset):
    built = control(balance)
    start = RigidTransform(built.trajectory.pose(0.0))
    start.set_translation(start.translation() + offset)
    loop = TensionLoop(built, 1000.0, start)
    loop.advance_to(END)
    return built, loop.read_log()


def centres(built, log):
    """Where the centre of mass is, shape (n, 3) [m]."""
    return np.array([pose_from_row(row) @ built.robot.center_of_mass() for row in log["X_WP"]])


def turns(log):
    return 2.0 * np.arccos(np.clip(np.abs(log["X_WP"][:, 0]), 0.0, 1.0))


def test_the_centre_of_mass_obeys_the_law_of_a_point_mass():
    offset = np.array([0.0, 0.0, -0.02])
    built, log = run(FORCE, offset)
    assert np.all(log["feasible"][1:] == 1.0)
    t = log["time"][:, np.newaxis]
    goal = built.trajectory.pose(0.0) @ built.robot.center_of_mass()
    expected = goal + offset * (1.0 + 10.0 * t) * np.exp(-10.0 * t)
    assert np.max(np.abs(centres(built, log) - expected)) < SAMPLED


def test_moments_are_held_by_the_wrench_and_not_by_the_force():
    offset = np.array([0.01, 0.0, -0.02])
    _, held = run(WRENCH, offset)
    _, free = run(FORCE, offset)
    assert np.max(turns(held)) < np.radians(0.1)
    assert np.max(turns(free)) > np.radians(5.0)


def test_the_loop_is_the_diagram():
    built = control(FORCE)
    loop = TensionLoop(built, 1000.0)
    loop.advance_to(END)
    simulator = Simulator(built.diagram, built.make_context())
    simulator.AdvanceTo(END)
    log = built.read_log(simulator.get_context())
    np.testing.assert_allclose(loop.read_log()["X_WP"], log["X_WP"], rtol=0.0, atol=SAME)


def test_prediction_refuses_forces_alone():
    robot = load_robot("acrobot_large")
    home = robot.home.transform()
    ahead = PredictiveTensions(PoseTrajectory((home, home), (1.0,)), 5)
    with pytest.raises(PlanningError, match="balance: found force; accepted by predictive: wrench"):
        control(FORCE, distributor=ahead)
